// SPDX-License-Identifier: GPL-3.0-or-later
// Pillars for whoever has scanned the solid already.
#pragma once

#include <vector>

#include "fibrolite/ops/pillars.h"
#include "print_scan.h"

namespace fibrolite {

/// As pillars(), under `steep`: what overhangs() or print_scan() found on this solid.
[[nodiscard]] std::vector<Pillar> pillars_under(std::vector<Spot> steep, const Solid& solid, const PillarParams& params,
                                                const Context& context);

}  // namespace fibrolite
