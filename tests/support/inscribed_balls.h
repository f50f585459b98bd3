// SPDX-License-Identifier: GPL-3.0-or-later
// Thickness by the largest inscribed ball, from nothing but which voxels are set.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/vec.h"

namespace fibrolite::testing {

/// A brick of voxels, x fastest; voxel (i, j, k) about low + voxel_mm * (i, j, k).
struct Voxels {
  Vec3d low{};
  double voxel_mm = 1;
  int nx = 0, ny = 0, nz = 0;
  std::vector<std::uint8_t> set;

  Voxels(const Box3d& box, double voxel_mm);
  [[nodiscard]] std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(nx) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] Vec3d place(int i, int j, int k) const { return low + voxel_mm * Vec3d{1.0 * i, 1.0 * j, 1.0 * k}; }
  /// Calls visit(place, set) for each voxel, rows in parallel.
  void fill(const std::function<void(const std::vector<Vec3d>& row, std::uint8_t* set)>& row);
};

/// Squared distance of each voxel's centre to the nearest one that is set (or not), in voxels; exact (Felzenszwalb and
/// Huttenlocher 2012). What lies beyond the brick is not set.
[[nodiscard]] std::vector<float> distance2(const Voxels& voxels, bool to_set);

struct ThinPlaces {
  std::int64_t voxels = 0;  ///< Set, in no ball of the diameter, and no corner.
  double farthest_mm = 0;   ///< Of them: off the nearest such ball.
  Vec3d where{};            ///< That one.
};
/// Set voxels that no ball of `diameter_mm`, made of set voxels alone, holds. A ball counts if its diameter in voxels
/// is no more than 1.5 too small, which every wall of that thickness has room for, however it lies; one thinner by 2.5
/// voxels or more has none. A convex edge of 90 degrees or more lies off its balls by at most (sqrt(2) - 1) radii: so
/// much, and 1.5 voxels, is a corner and not thin. A wedge sharper than that, or a thin wall that reaches out farther,
/// counts.
[[nodiscard]] ThinPlaces thin_places(const Voxels& voxels, double diameter_mm,
                                     const std::function<bool(Vec3d)>& counts = {});

}  // namespace fibrolite::testing
