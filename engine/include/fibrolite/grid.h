// SPDX-License-Identifier: Apache-2.0
// How a solid is sampled.
#pragma once

#include "fibrolite/vec.h"

namespace fibrolite {

/// Sample (i, j, k) lies at voxel_mm * (i, j, k) in world mm: every Grid of one voxel size shares one lattice.
struct Grid {
  double voxel_mm = 0.25;  ///< Voxel edge, mm; > 0.
  float band_vox = 3;      ///< Half width of the narrow band, voxels; 2 or more.
  /// How deep values are told inside, voxels; less than the band: as deep as that. What lies between the two is no
  /// active voxel.
  float inside_vox = 0;
  friend constexpr bool operator==(const Grid&, const Grid&) = default;
};

/// Samples (i, j, k) with min <= (i, j, k) < max on each axis.
struct SampleBox {
  Vec3i min{}, max{};
  friend constexpr bool operator==(const SampleBox&, const SampleBox&) = default;
};

/// Whole blocks of 8 along one axis: the samples low <= (i, j, k)[axis] < high, both multiples of 8.
struct SampleRange {
  int axis = 2, low = 0, high = 0;
  [[nodiscard]] constexpr bool holds(Vec3i sample) const {
    const int at = axis == 0 ? sample.x : axis == 1 ? sample.y : sample.z;
    return at >= low && at < high;
  }
};

}  // namespace fibrolite
