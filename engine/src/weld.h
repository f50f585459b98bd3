// SPDX-License-Identifier: Apache-2.0
// Which vertices of a mesh are the same point, and which triangles have no
// area.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fibrolite/mesh.h"

namespace fibrolite {

/// Vertices with equal coordinates (-0 equals 0) get one number; numbers follow
/// the first appearance in mesh.vertices.
struct Weld {
  std::vector<std::uint32_t> id;  ///< One per mesh vertex, below `count`.
  std::uint32_t count = 0;
};
/// Cost: O(n), parallel, about 12 bytes per vertex at its peak.
Weld weld(const std::vector<Vec3f>& vertices);
/// For each the first that has its coordinates. Cost: as weld().
std::vector<std::uint32_t> first_equal(std::span<const Vec3f> vertices);

}  // namespace fibrolite
