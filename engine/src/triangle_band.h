// SPDX-License-Identifier: Apache-2.0
// The engine behind to_solid: exact distances to a triangle mesh in a band around it, block by block.
#pragma once

#include <openvdb/openvdb.h>

#include <memory>

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
/// Finds the band whole, or box by box. Holds references: mesh, topology and winding must outlive it.
class TriangleBand {
 public:
  /// Cost: O(triangles + cells).
  TriangleBand(const Mesh& mesh, const SurfaceTopology& topology, const WindingTree& winding, const BandParams& params);
  ~TriangleBand();
  TriangleBand(const TriangleBand&) = delete;
  TriangleBand& operator=(const TriangleBand&) = delete;

  [[nodiscard]] Band whole(const Context& context);
  /// Finds out what whole() would decide by winding number, holding a row of cells at a time; gives the band's totals,
  /// no tree. Cost: as whole(); again for every round in which new contradictions show.
  [[nodiscard]] Band survey(const Context& context);
  /// The samples in `box` (whole blocks of 8), bit for bit as in whole(). After a survey() if not by winding.
  /// Thread-safe.
  [[nodiscard]] openvdb::FloatTree::Ptr within(const openvdb::CoordBBox& box, const Context& context) const;
  /// Holds every sample that is inside or in the band; whole blocks of 8.
  [[nodiscard]] openvdb::CoordBBox samples() const;

 private:
  class Builder;
  std::unique_ptr<Builder> builder_;
};

}  // namespace fibrolite
