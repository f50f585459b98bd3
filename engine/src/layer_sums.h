// SPDX-License-Identifier: Apache-2.0
// What a layer's triangles add up to.
#pragma once

#include <cstdint>
#include <span>

#include "fibrolite/box.h"
#include "fibrolite/mesh_layers.h"

namespace fibrolite {

struct LayerSums {
  double volume_mm3 = 0;        ///< Signed, with a point.
  std::int64_t degenerate = 0;  ///< Triangles without area (zero_area()).
  std::int64_t collapsed = 0;   ///< Of those, with two equal corners.
};
/// Cost: O(n), parallel; eight triangles at a time. The same bits on any number of threads.
[[nodiscard]] LayerSums sums_of(const MeshLayer& layer, Vec3d from);

/// Around vertices. Cost: O(n), parallel.
[[nodiscard]] Box3d box_of(std::span<const Vec3f> vertices);

}  // namespace fibrolite
