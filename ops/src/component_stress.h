// SPDX-License-Identifier: GPL-3.0-or-later
// Mean stress of a component in its own axes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "elasticity.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// Means over a volume, MPa.
struct MeanStress {
  double volume_mm3 = 0;
  double axial = 0;  ///< Mean |normal stress along t(x)|.
  double transverse[2] = {
      0, 0};  ///< Mean |normal stress| across: in the direction with the largest mean, and at right angles.
  double von_mises = 0;
  /// axial / transverse[0]; bounded, so that it can be written down.
  [[nodiscard]] double dominance() const;
};

/// What else a component's stresses say, over its volume.
struct ComponentSummary {
  double p99_von_mises = 0;         ///< MPa; 99 % of the volume is at or below it.
  double strain_energy_nmm = 0;     ///< From the mean stress of each tetrahedron.
  std::array<double, 3> principal;  ///< Of the mean stress, MPa, largest magnitude first.
  Vec3d direction{};                ///< Of the first of them; its largest component is positive.
};
[[nodiscard]] ComponentSummary summary(const TetMesh& mesh, const std::vector<fem::Stress>& stress,
                                       const std::vector<std::uint32_t>& tets, const Material& material);

/// In the axis field. Directions across are turned along with t(x), so "the same direction" has a meaning along a bent
/// limb; all of them are tried, so the answer does not depend on how the model lies.
[[nodiscard]] MeanStress mean_in_axis(const TetMesh& mesh, const std::vector<fem::Stress>& stress,
                                      const std::vector<std::uint32_t>& tets, const Axis& axis);
/// In world axes, as in the paper: `axial` is the one of x, y, z with the largest mean.
[[nodiscard]] MeanStress mean_in_world(const TetMesh& mesh, const std::vector<fem::Stress>& stress,
                                       const std::vector<std::uint32_t>& tets);

}  // namespace fibrolite
