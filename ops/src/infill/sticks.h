// SPDX-License-Identifier: GPL-3.0-or-later
// Exact distance to balls and sticks. Private to the crystal.
#pragma once

#include <functional>

#include "fibrolite/ops/infill/tcs.h"

namespace fibrolite {

struct Radii {
  double stick_mm, ball_mm;
};
/// Lattice axes; `shift_mm`: where the origin is.
[[nodiscard]] Shape sticks_and_balls(const CellEdges& cell, const Radii& radii, Vec3d shift_mm);
/// Radii multiplied by a field of factors, in lattice axes too.
[[nodiscard]] Shape sticks_and_balls(const CellEdges& cell, const Radii& radii, Vec3d shift_mm, const Shape& thickness);

/// Every bond that starts at a node A in the box, in quarters of the cell; `low` even.
void each_diamond_bond(Vec3i low, Vec3i high, const std::function<void(Vec3i node, Vec3i along)>& visit);

}  // namespace fibrolite
