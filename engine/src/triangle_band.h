// SPDX-License-Identifier: Apache-2.0
// The engine behind to_solid: exact distances to a triangle mesh in a band around it, block by block.
#pragma once

#include <openvdb/openvdb.h>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/winding.h"
#include "surface_topology.h"

namespace fibrolite {

struct BandParams {
  double voxel_mm = 0;
  float outside_vox = 0, inside_vox = 0;  ///< Where the band ends on either side.
  /// false: side by pseudonormal near the surface, by winding number in cells where that leads to contradictions; the
  /// mesh must be closed, and the distances count every wall, so the result is of use only if `overlap` stays false.
  /// true: side by winding number everywhere, for any mesh; where the number passes 1/2 away from all triangles the
  /// values rise away from there, but are no distances.
  bool by_winding = false;
};
struct Band {
  openvdb::FloatTree::Ptr tree;  ///< Background +outside, inner tiles and clamped values -inside, mm.
  /// Samples inside and near the surface whose side was told by winding number, and those of them with a number below
  /// 3/4: around a body with holes few, under an open sheet almost all.
  std::int64_t inside_samples = 0, doubtful_samples = 0;
  std::int64_t cells_by_winding = 0;  ///< Cells of 64^3 samples with contradictions, decided by winding number.
  bool overlap = false;  ///< The mesh overlaps itself by more than a voxel (seen where the winding number was asked).
};
[[nodiscard]] Band triangle_band(const Mesh& mesh, const SurfaceTopology& topology, const WindingTree& winding,
                                 const BandParams& params, const Context& context);

}  // namespace fibrolite
