// SPDX-License-Identifier: GPL-3.0-or-later
// The printed solid a slab at a time, for solids that do not fit into memory.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/prepare.h"
#include "fibrolite/ops/recipe.h"
#include "fibrolite/ops/report.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// How a solid is cut into slabs.
struct SlabPlan {
  int axis = 2;                ///< Of the world, across which they lie.
  std::vector<int> borders{};  ///< Samples along it, multiples of 8, rising: slab i from borders[i] to borders[i + 1].
  int margin_vox = 8;          ///< How far beyond its slab each is known; a multiple of 8.
  double memory_bytes = 0;     ///< What the run will need at most; more than allowed if 8 samples are too many.
  double usual_bytes = 0;      ///< What such runs took, measured: most slabs are not the largest.
  double allowed_bytes = 0;    ///< As asked of plan_slabs().
};
struct SlabNeeds {
  int axis = 2;
  double margin_mm = 0;  ///< How far beyond a slab the solid will be looked at.
  bool surface = false;  ///< Will its surface be made, a few layers of blocks at a time (SurfaceLayers)?
};
/// To cut layers of this height across `up`.
[[nodiscard]] SlabNeeds needs_of_layers(Up up, double layer_mm, double voxel_mm);
/// Slabs as thick as the memory allows, by how much surface and lumen there is across the axis.
/// Cost: O(triangles).
[[nodiscard]] SlabPlan plan_slabs(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill,
                                  const SlabNeeds& needs, double allowed_bytes);

/// Made by hybridize(). Two passes: the first, before it is made, finds loose pieces, specks and micro-voids with no
/// more than a slab in memory; the second is the caller's, who asks for each slab. The solid is the one that
/// hybridize() makes whole, sample for sample, however it is cut.
class SolidStream {
 public:
  struct Impl;
  explicit SolidStream(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

  [[nodiscard]] const SlabPlan& plan() const;
  [[nodiscard]] Grid grid() const;
  [[nodiscard]] std::size_t slabs() const { return plan().borders.size() - 1; }
  /// The slab that a place along the plan's axis lies in, mm; the first or last beyond them.
  [[nodiscard]] std::size_t slab_at(double mm) const;
  struct Slab {
    SampleRange range;
    std::size_t number = 0;
    Solid body, solid;  ///< With the margin.
  };
  /// Any slab; measured the first time, for which they must come in rising or in falling order. Cost: body and solid of
  /// the slab are made anew each time.
  [[nodiscard]] Slab slab(std::size_t number, const Context& context = {});
  /// As Hybrid::printed, good up to three voxels less than the margin beyond the slab.
  [[nodiscard]] Shape printed(const Slab& slab, const Context& context = {}) const;
  /// What was measured, as hybridize() reports it of a whole solid. Slabs that nobody asked for are made first.
  void finish(Report& report, const Context& context = {});

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace fibrolite
