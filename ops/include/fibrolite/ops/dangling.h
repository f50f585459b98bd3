// SPDX-License-Identifier: GPL-3.0-or-later
// Ends of sticks that carry nothing because they end in the void.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/context.h"
#include "fibrolite/piece_sweep.h"
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
/// end; nor are looked at sticks with both nodes elsewhere, or with no material in their middle. What lies along sticks
/// is told by the nearest samples, a voxel apart. `body`: its band as deep as the shell. Sorted by place. Lengths in
/// mm. Cost: O(sticks in the box). The same answer on any number of threads.
[[nodiscard]] std::vector<LooseEnd> loose_ends(const Sticks& sticks, const Solid& body, double shell_mm,
                                               const Solid& solid, const Context& context = {});

/// Shows the finished solid around boxes, mm: calls visit once for each, with a solid that holds what lies in that box.
using Surroundings = std::function<void(const std::vector<Box3d>& boxes,
                                        const std::function<void(std::size_t number, const Solid& solid)>& visit)>;
/// Of a solid that is whole.
[[nodiscard]] Surroundings surroundings(const Solid& solid);

/// The same on a solid that comes slab by slab and is never whole in memory. Of each stick with a node in the lumen
/// some 100 bytes are kept.
class StickSweep {
 public:
  StickSweep(const Sticks& sticks, double shell_mm, double voxel_mm);
  /// The next slab: its blocks with low <= sample[axis] < high, rising, each next to the one before.
  void add(const Solid& body, const Solid& solid, const SampleRange& range, const Context& context = {});
  /// After the last slab; once. `flips`: what cleaning changes in the solid; `around`: the solid with it changed.
  [[nodiscard]] std::vector<LooseEnd> finish(const Flips& flips, const Surroundings& around);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace fibrolite
