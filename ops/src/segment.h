// SPDX-License-Identifier: GPL-3.0-or-later
// The surface in regions of thin and thick faces.
#pragma once

#include <vector>

#include "face_graph.h"

namespace fibrolite {

/// A closed line along which a thin region meets a thick one.
struct BorderLoop {
  Vec3d centre{};
  Vec3d direction{};     ///< Unit, along the limb, from the thin region into the thick one.
  double radius_mm = 0;  ///< Mean distance of its points from the centre.
};
struct SurfaceRegion {
  bool thin = false;
  double area_mm2 = 0;
  std::vector<BorderLoop> loops;  ///< Of thin regions only.
};
struct Segmentation {
  std::vector<int> region;  ///< Per face.
  std::vector<SurfaceRegion> regions;
};

/// Faces with nsdf below `threshold` are thin; jagged borders are smoothed and regions below `min_area` (share of the
/// surface) given to what surrounds them. Regions are numbered by their first face.
[[nodiscard]] Segmentation segment(const Mesh& surface, const FaceGraph& graph, const std::vector<double>& normalized,
                                   double threshold, double min_area);

}  // namespace fibrolite
