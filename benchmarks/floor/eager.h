// SPDX-License-Identifier: GPL-3.0-or-later
// The route of whole grids: what a user of OpenVDB's tools writes for a body with a lattice and a shell.
#pragma once

#include <vector>

#include <openvdb/openvdb.h>

namespace fibrolite::bench {

struct Eager {
  double wall_s = 0, cpu_s = 0, offset_s = 0;
  double volume_mm3 = 0;
  std::size_t triangles = 0;
};
/// The preset peer-tcs: model to level set; the shell as the model less a copy that LevelSetFilter has shrunk; the
/// crystal as a grid of its own (ours, the cheapest to be had); csgIntersection, csgUnion; volumeToMesh.
[[nodiscard]] Eager eager_csg(const std::vector<openvdb::Vec3s>& points, const std::vector<openvdb::Vec3I>& triangles,
                              double voxel_mm);

}  // namespace fibrolite::bench
