// SPDX-License-Identifier: GPL-3.0-or-later
// Micrographs whose fibres are known.
#pragma once

#include <cstdint>

#include "fibrolite/image.h"

namespace fibrolite {

/// Regular hexagons, `pitch` pixels between the middles of neighbours, membranes of `wall` between them; grey levels 60
/// and 180, edges blended over a pixel. Whole hexagons only, membrane around them: columns * rows fibres.
[[nodiscard]] GrayImage honeycomb(int columns, int rows, double pitch, double wall);

/// A photograph of uneven cells as large as side x side: one per square of `pitch`, its middle anywhere in the middle
/// half of the square; membranes of 4 pixels. Light falls from one side to less than half, and to half toward the
/// corners; noise of `noise` grey levels. `truth`: how many cells are whole or show more than a tenth of the mean.
[[nodiscard]] GrayImage photograph(std::uint64_t seed, double pitch, int side, double noise = 8, int* truth = nullptr);

/// Grey `mean` with normal noise of `sd`, white, or blurred by `grain` pixels.
[[nodiscard]] GrayImage pure_noise(std::uint64_t seed, int side, double mean, double sd, int grain = 0);

}  // namespace fibrolite
