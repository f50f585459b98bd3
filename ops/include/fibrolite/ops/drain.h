// SPDX-License-Identifier: GPL-3.0-or-later
// Drain holes: every enclosed void gets a way out for resin or powder.
#pragma once

#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct DrainParams {
  double hole_mm = 2;   ///< Diameter; 2 voxels or more.
  Vec3d up{0, 0, 1};    ///< Of any length above zero.
  double reach_mm = 4;  ///< Walls thicker than this are not drilled through but from the lowest point straight down.
};
/// A hole from one enclosed void to another, or to the outside.
struct Drain {
  Vec3d place_mm{};      ///< Of its mouth: on the outer surface, or on the other void's.
  Vec3d direction{};     ///< Out of the void, unit length.
  double length_mm = 0;  ///< Through material.
  bool outward = true;   ///< Its mouth is on the outside of the model.
  Capsule shape{};       ///< What is to be taken away.
};
/// One hole per enclosed void, which is the least there can be: voids with a thin wall between them drain into each
/// other, and each group of such voids gets one hole to the outside. That is hidden: the place with the least sum of
/// height (0 the solid's lowest point, 1 its highest), unevenness of the outer surface round the mouth (in radii),
/// material beside the hole's ends in a void, half of how far it turns up, and a quarter of its length over the reach.
/// Cost: O(samples near the surface * reach / voxel); the same answer on any number of threads.
/// @throws Error BadRecipe: a range above; Cancelled.
[[nodiscard]] std::vector<Drain> drains(const Solid& solid, const DrainParams& params = {},
                                        const Context& context = {});

[[nodiscard]] std::vector<Capsule> shapes(const std::vector<Drain>& drains);

}  // namespace fibrolite
