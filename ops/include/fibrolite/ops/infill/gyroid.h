// SPDX-License-Identifier: GPL-3.0-or-later
// Gyroid walls: what most slicers offer, to be compared with.
#pragma once

#include <optional>

#include "fibrolite/ops/fill.h"
#include "fibrolite/ops/part.h"

namespace fibrolite {

/// The sheet of the gyroid: one membrane, equally thick everywhere, with the two channels on either side open.
struct GyroidParams {
  double cell_mm = 12.0;  ///< Period along x, y and z; 4 * wall_mm or more.
  double wall_mm = 0.8;   ///< Thickness; 2 voxels or more.
  /// Share of a cell that is material. If given, walls are made as thick as that takes.
  std::optional<double> density{};
};
/// The walls, unclipped, world frame, the lattice's origin at (0, 0, 0).
/// @throws Error BadRecipe (a range above). Cost: O(1) per point. Source: Schoen 1970; von Schnering and Nesper 1991
/// (nodal approximation sin X cos Y + sin Y cos Z + sin Z cos X), as a table of true distances.
[[nodiscard]] Fill generate(const Part& part, const GyroidParams& params);
/// The distance alone, for tests and benchmarks.
[[nodiscard]] Shape gyroid(const GyroidParams& params);

/// Share of the endless walls that is material, by area and curvature; within 0.6 % up to a tenth of a cell of wall.
/// Cost: milliseconds.
[[nodiscard]] double density(const GyroidParams& params);
/// The same walls with their thickness instead of a density (which is then none). @throws Error BadRecipe: no thickness
/// gives that density. Cost: milliseconds, if there is a density.
[[nodiscard]] GyroidParams sized(const GyroidParams& params);

}  // namespace fibrolite
