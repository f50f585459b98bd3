// SPDX-License-Identifier: GPL-3.0-or-later
// Ends of sticks that carry nothing because they end in the void.
#pragma once

#include <functional>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// The sticks of a part.
struct Sticks {
  std::function<void(const Box3d& box, const std::function<void(const Capsule&)>& visit)> visit;  ///< As Fill::sticks.
  double ball_mm = 0;                                                                             ///< As in Fill.
  Box3d box;
  Shape region;  ///< The part's distance.
};
/// What hangs free of a stick.
struct LooseEnd {
  Vec3d held_mm, end_mm;  ///< From where something holds it, or its node's ball, to its end.
  double radius_mm = 0;   ///< Of the stick.
  double knob_mm = 0;     ///< Radius of the ball at its end; 0: cut off there.
};
/// Stick ends in the void, on the finished solid. An end is looked at where its stick leaves the part inside the lumen
/// and where a node holds one stick alone; it hangs free if there is no material beside the stick there, and the stick
/// does not run on to its other node. A stub that hardly leaves its node's ball (by less than the stick's radius) is no
/// end; nor are looked at sticks with both nodes elsewhere, or with no material in their middle. `body`: its distance.
/// Lengths in mm. Cost: O(sticks in the box). The same answer on any number of threads.
[[nodiscard]] std::vector<LooseEnd> loose_ends(const Sticks& sticks, const Shape& body, double shell_mm,
                                               const Solid& solid, const Context& context = {});
/// The same on the solid as a function, looked at in steps of a voxel; for solids that are never whole.
[[nodiscard]] std::vector<LooseEnd> loose_ends(const Sticks& sticks, const Shape& body, double shell_mm,
                                               const Shape& solid, double voxel_mm, const Context& context = {});

}  // namespace fibrolite
