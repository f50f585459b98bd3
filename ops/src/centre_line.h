// SPDX-License-Identifier: GPL-3.0-or-later
// The line through the centroids of a limb's level sets.
#pragma once

#include <cstdint>
#include <vector>

#include "voxel_body.h"

namespace fibrolite {

struct CentreLine {
  std::vector<Vec3d>
      points;            ///< Evenly spaced, past both ends by a quarter of the width; a ring's last point is its first.
  double length_mm = 0;  ///< Within the limb.
  double width_mm = 0;   ///< Larger principal diameter of the sections, 90th percentile.
};

/// `order`: the limb's samples from its start to its end, `way_mm` apart. Tips (ends that are no cut) are straightened:
/// level sets say little there.
[[nodiscard]] CentreLine centre_line(const VoxelBody& body, const std::vector<std::int32_t>& order, double way_mm,
                                     bool ring, bool first_is_cut, bool second_is_cut);

}  // namespace fibrolite
