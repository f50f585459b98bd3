// SPDX-License-Identifier: GPL-3.0-or-later
// Tetrahedral crystal structure (paper Sec. 5.2).
#pragma once

#include <functional>

#include "fibrolite/ops/fill.h"
#include "fibrolite/ops/part.h"

namespace fibrolite {

/// Tetrahedral crystal (diamond cubic): balls at the nodes, sticks along the bonds.
struct TcsParams {
  double cell_mm = 6.0;    ///< Edge of the cubic cell; 4 * stick_mm or more.
  double stick_mm = 0.8;   ///< Stick diameter; 2 voxels or more.
  double ball_mm = 1.6;    ///< Ball diameter; stick_mm or more.
  Vec3d shift_mm{};        ///< Lattice origin, world axes.
  bool stretch_z = false;  ///< Cell taller by sqrt(2) along world z: sticks at 45 degrees, printable without support.
};
/// The crystal, unclipped, world frame. @throws Error BadRecipe (a range above). Cost: O(1) per point. Source: paper
/// Sec. 5.2; the sizes are ours.
[[nodiscard]] Fill generate(const Part& part, const TcsParams& params);
/// The distance alone, for tests and benchmarks.
[[nodiscard]] Shape crystal(const TcsParams& params);
/// Each stick that may reach into the box, once, from node to node; others near the box too. Cost: O(cells in the box).
void each_stick(const TcsParams& params, const Box3d& box, const std::function<void(const Capsule&)>& visit);

}  // namespace fibrolite
