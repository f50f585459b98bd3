// SPDX-License-Identifier: Apache-2.0
// Which vertices of a mesh are the same point, and which triangles have no
// area.
#pragma once

#include <cstdint>
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

/// Is the area exactly zero? The differences of float coordinates are exact in
/// double (unless the coordinates of one axis differ by more than 2^29 in
/// magnitude), and their products are compared together with their rounding
/// errors, so nothing is rounded.
bool zero_area(Vec3f a, Vec3f b, Vec3f c);

}  // namespace fibrolite
