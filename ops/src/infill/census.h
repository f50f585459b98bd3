// SPDX-License-Identifier: GPL-3.0-or-later
// What a section of fibres holds. Private to the fibre infill.
#pragma once

#include "fibrolite/image.h"
#include "fibrolite/ops/fill.h"

namespace fibrolite {

/// Of a signed distance to the membranes, negative inside them; `lumen`, if given, is negative where it counts. Voids
/// below `least_area` count as porosity, but as no fibres. In the unit of `pixel`.
[[nodiscard]] FibreCensus census(const FloatImage& membranes, double pixel, double least_area,
                                 const FloatImage* lumen = nullptr);

/// Membranes that end in a void.
[[nodiscard]] int count_free_edges(const FloatImage& membranes, const FloatImage& lumen, double wall_mm,
                                   double pixel_mm);

}  // namespace fibrolite
