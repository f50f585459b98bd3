// SPDX-License-Identifier: GPL-3.0-or-later
// Pillars under steep faces inside: what would need supports while it prints gets supports that stay.
#pragma once

#include <optional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/printable.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct PillarParams {
  PrintParams print{};
  Vec3d up{0, 0, 1};          ///< Of any length above zero.
  double node_mm = 0.8;       ///< Overhangs no wider than this stay: they print as bridges.
  double shaft_mm = 0.8;      ///< Least diameter; 2 voxels or more.
  double cell_mm = 2;         ///< One pillar bears what lies within this of its axis, or half as much again; above 0.
  Shape lattice = nothing();  ///< Overhangs that are this shape's own surface stay.
};
/// A head that widens upwards, by print.overhang_deg at most, until it bears all of its share of the overhang; and a
/// shaft from there down to the next material, leaning by no more, unless the head itself reaches some.
struct Pillar {
  Frustum head{};
  std::optional<Capsule> shaft{};
};
/// Overhangs as printable() finds them, cut by a lattice of triangles across `up` and into storeys; a pillar under each
/// piece. Heads touch, so that no overhang is left between them but what is narrow. Shafts are a 25th of their length
/// thick, and no less than shaft_mm. The shape may leave the body: clip it. Cost: a scan, and a pillar per cell.
/// @throws Error BadRecipe: a range above; Cancelled.
[[nodiscard]] std::vector<Pillar> pillars(const Solid& solid, const Shape& lumen, const PillarParams& params,
                                          const Context& context = {});

[[nodiscard]] Shape shape(const std::vector<Pillar>& pillars);

}  // namespace fibrolite
