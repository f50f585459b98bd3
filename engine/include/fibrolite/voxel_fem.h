// SPDX-License-Identifier: Apache-2.0
// Linear elasticity of a finished solid on its own voxels: small strains, isotropic, static.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Nodes where `where` is negative are held along the given axes.
struct VoxelSupport {
  Shape where;
  std::array<bool, 3> axes{true, true, true};
  std::function<Vec3d(Vec3d)> displacement_mm;  ///< Prescribed there; empty: 0. Pure.
};

/// A total force spread evenly over the surface of the cells: over exposed cell faces whose centre is where `where` is
/// negative, by the area of material they expose.
struct VoxelForce {
  Shape where;
  Vec3d total_n;
  /// Unless zero: only faces that look this way, each by its area projected along it. Unit.
  Vec3d facing{};
};

/// A pressure on the surface of the cells, against its normal: on exposed cell faces whose centre is where `where` is
/// negative. The steps of a slanted surface add up to its own projections.
struct VoxelPressure {
  Shape where;
  double mpa = 0;  ///< Negative: suction.
};

struct VoxelFemProblem {
  Solid solid;
  double young_mpa = 2000;  ///< > 0.
  double poisson = 0.35;    ///< 0 <= poisson < 0.5.
  int coarsen = 1;          ///< Samples along the edge of a cell: 1, 2 or 4.
  std::vector<VoxelSupport> supports;
  std::vector<VoxelForce> forces;
  std::vector<VoxelPressure> pressures;
  std::function<Vec3d(Vec3d)> body_force_n_mm3;  ///< Per mm3 of material at a point, e.g. its weight; empty: 0. Pure.
  double residual = 1e-6;                        ///< Asked for; in [1e-12, 0.1].
  int max_iterations = 500;                      ///< > 0.
  Shape unmeasured;  ///< Cells whose centre is in here give no stress: clamps, load patches.
  /// Which place each point belongs to, to have the stress of each; empty: no places. Pure.
  std::function<void(std::span<const Vec3d> points, std::span<std::uint16_t> place)> place_of;
};

/// Stress of the measured cells of one place.
struct PlaceStress {
  std::uint16_t place = 0;
  std::int64_t cells = 0;
  double volume_mm3 = 0;                                                        ///< Of their material.
  double max_von_mises_mpa = 0, p99_von_mises_mpa = 0, peak_von_mises_mpa = 0;  ///< As of the whole, below.
  Vec3d weakest_mm{};                                                           ///< Of the peak.
};

/// What a solid does under its loads. Displacement is trilinear between the nodes of cells. Stress is that of the
/// material (not thinned by a cell's fraction) at the cell's centre, where it is most accurate, and only of cells that
/// are at least half material: the steps of the staircase would give peaks of their own.
class VoxelFemResult {
 public:
  struct Impl;
  explicit VoxelFemResult(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

  std::int64_t cells = 0, nodes = 0;
  double volume_mm3 = 0;  ///< Sum of the cells' material.
  int iterations = 0;
  double residual = 0;         ///< |f - K u| / |f| over the free components, in double precision.
  double compliance_n_mm = 0;  ///< Load times displacement: twice the work the loads do.
  double max_displacement_mm = 0;
  Vec3d load_n{}, reaction_n{};     ///< Sums; in equilibrium they cancel.
  double pressed_n = 0;             ///< Sum of the magnitudes of what the pressures press with.
  double max_von_mises_mpa = 0;     ///< Of any measured cell. Grows without limit at re-entrant edges as voxels shrink.
  double p99_von_mises_mpa = 0;     ///< 99 % of the measured material is at or below this.
  double peak_von_mises_mpa = 0;    ///< Largest after averaging stress over the cells around each node, then each cell.
  Vec3d weakest_mm{};               ///< Centre of the cell of that peak.
  std::vector<PlaceStress> places;  ///< Of all measured cells, by place, rising.

  /// Displacement at a point of a cell with material, mm; none elsewhere. Cost: O(log blocks).
  [[nodiscard]] std::optional<Vec3d> displacement_mm(Vec3d p) const;
  /// Von Mises stress at the centre of the cell around a point, MPa; none where there is no material. Cost: as above.
  [[nodiscard]] std::optional<double> von_mises_mpa(Vec3d p) const;

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Conjugate gradients in double precision with a multigrid of smoothed aggregates in single precision; the stiffness
/// is never stored. Cells are cubes with the fraction of material their distance tells, and so stiff: exact in tension,
/// but material smeared over a cell makes members bend less, a round stick of d voxels by about 1.3 / d^2.
/// Cost: a lattice of a million solid voxels, sticks 3 voxels thick: about 20 iterations, a minute of processor time
/// and 1 GB, growing with the material, not with its box. The same bits on any number of threads. Sources: Vanek,
/// Mandel, Brezina 1996 (smoothed aggregation); Taylor, Beresford, Wilson 1976 (the cell).
/// @throws Error BadRecipe: a number out of range, a support or a load that meets no material; SolverFailed: a piece
/// can move freely, or the residual is not reached; TooLarge; Cancelled.
[[nodiscard]] VoxelFemResult solve(const VoxelFemProblem& problem, const Context& context = {});

}  // namespace fibrolite
