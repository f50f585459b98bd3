// SPDX-License-Identifier: GPL-3.0-or-later
// No stick ends in the void: what hangs free is tied on, or removed.
#pragma once

#include <functional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/dangling.h"
#include "fibrolite/ops/tie.h"

namespace fibrolite {

/// A loose end is tied to the nearest material in sight if that is no farther than what hangs free is long, so if it
/// takes less material than was there for nothing; else what hangs free is removed, node and all, and with it what then
/// hangs free behind it. At most eight rounds. `whole`: what tied.solid was made from, before its changes. `keep_out`
/// of the params is where no tie may lie. Cost: as loose_ends(); a realize and a tie() per round that finds something.
[[nodiscard]] Tied trim(Tied tied, const Shape& whole, const Solid& body, const std::vector<Sticks>& sticks,
                        double shell_mm, const TieParams& params, const Context& context = {});

/// The same on a solid that is never whole.
struct Trimmed {
  std::function<std::vector<LooseEnd>()> loose_ends;  ///< Of the solid as it is now.
  Surroundings around;                                ///< As it is now.
  std::function<void()> remake;                       ///< Makes it anew, in one piece, after tied.changes grew.
};
void trim(Tied& tied, const Trimmed& solid, double voxel_mm, const TieParams& params);

}  // namespace fibrolite
