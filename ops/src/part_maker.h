// SPDX-License-Identifier: GPL-3.0-or-later
// The only maker of parts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fibrolite/ops/part.h"

namespace fibrolite {

class PartMaker {
 public:
  struct Fields {
    int id = 0;
    Kind kind = Kind::Bulk;
    std::vector<int> candidates{0};
    std::optional<PartInfill> chosen{};
    Shape region;
    Box3d bounds_mm;
    Axis axis;
    double diameter_mm = 0;
    double volume_mm3 = 0;
    Vec3d centroid_mm{};
    PartStress stress;
    std::string reason;
  };
  static Part make(Fields fields);
};

/// Geometry of the samples of the proxy that `labels` gives to one part.
struct PartGeometry {
  Box3d bounds_mm;  ///< Holds the part at every voxel size: two proxy voxels wider than its surface.
  Vec3d centroid_mm{};
  Axis axis;  ///< Straight, along the longest principal axis, as long as the part.
};
/// One per part. Cost: O(samples inside + triangles), at most about half a million samples, parallel.
[[nodiscard]] std::vector<PartGeometry> part_geometry(const Proxy& proxy, const Labels& labels);

}  // namespace fibrolite
