// SPDX-License-Identifier: Apache-2.0
// A solid: a closed narrow-band signed distance grid (mm, negative inside). Immutable; copies are cheap.
#pragma once

#include <cstdint>
#include <memory>

#include "fibrolite/box.h"
#include "fibrolite/grid.h"
#include "fibrolite/shape.h"

namespace fibrolite {

class Solid {
 public:
  struct Impl;
  Solid();  ///< The empty solid on a default grid.
  explicit Solid(std::shared_ptr<const Impl> impl);

  [[nodiscard]] Grid grid() const;
  [[nodiscard]] bool empty() const;
  /// World box of all samples inside (value < 0), mm. Cost: O(leaves).
  [[nodiscard]] Box3d bounds_mm() const;
  [[nodiscard]] std::int64_t active_voxels() const;
  [[nodiscard]] std::int64_t memory_bytes() const;
  /// Volume of { distance < 0 }, mm3. Each sample counts with the share of its voxel below zero, from the distance and
  /// its Laplacian there. Error about 1 % for sticks three voxels thick, falling with the square of the thickness.
  /// Cost: O(active voxels), parallel, the first time; the same bits on any number of threads.
  [[nodiscard]] double volume_mm3() const;
  /// The same of a block's 8 x 8 x 8 samples, from `block` on, a multiple of 8; in voxels. Blocks add up to the whole's
  /// volume without an error, if the solid holds the samples next to each too. Cost: O(1).
  [[nodiscard]] double filled_vox(Vec3i block) const;
  [[nodiscard]] std::int64_t active_voxels(const SampleRange& range) const;
  /// Trilinear distance at a world point, mm; +-(band) outside the band. Cost: O(1).
  [[nodiscard]] float distance(Vec3d p) const;
  /// At sample (i, j, k), mm; +-(band) outside the band. Cost: O(1).
  [[nodiscard]] float at(Vec3i sample) const;

  [[nodiscard]] const Impl& impl() const { return *impl_; }
  [[nodiscard]] std::shared_ptr<const Impl> share() const { return impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// The same with no value inside deeper than the band: a level set as others know it (Grid::inside_vox).
/// Cost: O(leaves), and a copy if something else holds the grid; none if no value was told deeper.
[[nodiscard]] Solid narrowed(Solid solid);

/// The solid's distance as a shape. A block on the solid's own lattice is copied, any other point is interpolated.
[[nodiscard]] Shape distance_to(const Solid& solid);

}  // namespace fibrolite
