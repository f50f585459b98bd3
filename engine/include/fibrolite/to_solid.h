// SPDX-License-Identifier: Apache-2.0
// Mesh -> Solid: exact distance in a band, with a sign that survives holes and self-intersections.
#pragma once

#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct ToSolidParams {
  Grid grid{};
  /// The band reaches at least this deep inside the surface, mm (the shell needs its thickness), and grid.band_vox
  /// outside.
  double inside_band_mm = 0;
};
struct ToSolidResult {
  Solid solid;                       ///< Interior background is -(max(inside_band_mm, 0) + band); exterior +band.
  std::vector<std::string> repairs;  ///< What had to be decided by winding number, in words; empty for a clean mesh.
};
/// @throws Error BadInput: the mesh encloses no volume (an open sheet, all triangles in one plane, thinner than the
/// voxel); BadRecipe: voxel or band out of range; TooLarge: more than 2^31 voxels along an axis. Cost: O(triangles +
/// band voxels), parallel; the same bits on any number of threads.
[[nodiscard]] ToSolidResult to_solid(const Mesh& mesh, const ToSolidParams& params, const Context& context = {});

}  // namespace fibrolite
