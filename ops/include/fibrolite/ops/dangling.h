// SPDX-License-Identifier: GPL-3.0-or-later
// Ends of sticks that carry nothing because they end in the void.
#pragma once

#include <cstdint>

#include "fibrolite/context.h"
#include "fibrolite/ops/fill.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Stick ends in the void, on the finished solid. An end is looked at where its stick leaves the part inside the lumen
/// and where a node holds one stick alone; it hangs free if there is no material around it but the stick itself. A stub
/// that hardly leaves its node's ball (by less than the stick's radius) is no end; nor are looked at sticks with both
/// nodes elsewhere. `fill.sticks` must be set; `region` the part's
/// distance, `body` the body's. Lengths in mm. Cost: O(sticks in the box). The same answer on any number of threads.
[[nodiscard]] std::int64_t dangling_sticks(const Fill& fill, const Box3d& box, const Shape& region, const Shape& body,
                                           double shell_mm, const Solid& solid, const Context& context = {});

}  // namespace fibrolite
