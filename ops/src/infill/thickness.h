// SPDX-License-Identifier: GPL-3.0-or-later
// Walls no thinner and voids no narrower than can be printed, from true distances. Private to the fibre infill.
#pragma once

#include <vector>

#include "fibrolite/image.h"
#include "infill/network.h"

namespace fibrolite {

struct Thickness {
  double wall_mm, gap_mm;
  double least_scale = 1;  ///< Both hold, too, when the section is shrunk by this and its walls are not; up to 1.
};

/// A raster with a pixel at corner_mm.
struct Raster {
  Vec2d corner_mm;
  double pixel_mm;
  int width, height;
};

/// Signed distance to walls along `lines` (mm, negative inside): every wall is wall_mm thick or more, and every void is
/// a union of discs of gap_mm; what is narrower becomes wall. Voids shrink, never grow: where a neck is filled so
/// thinly that the filling itself would be no wall, it gets a wall of its own. True in walls and up to gap_mm / 2 off
/// them, at most the distance elsewhere; at most far_mm. Cost: O(pixels + length of walls * (far / pixel)^2), parallel.
[[nodiscard]] FloatImage walls_along(std::vector<Segment2d> lines, const Raster& raster, const Thickness& thickness,
                                     double far_mm);

}  // namespace fibrolite
