// SPDX-License-Identifier: GPL-3.0-or-later
// The borders of cells as smooth lines, and the exact distance to them. Private to the fibre infill.
#pragma once

#include <vector>

#include "fibrolite/image.h"
#include "fibrolite/vec.h"
#include "infill/cells.h"

namespace fibrolite {

struct Segment2d {
  Vec2d a, b;
};
/// The borders between the cells of a full partition, in pixel coordinates (pixel centres at whole numbers). The
/// staircase of pixel edges is smoothed as a network, junctions too, which stays closed: no cell can leak. Cost:
/// O(pixels + border * rounds).
[[nodiscard]] std::vector<Segment2d> smooth_borders(const LabelImage& label, int rounds);

/// image(i, j) = distance from corner + pixel_mm * (i, j) to the nearest segment, but at most `reach_mm`: exact up to
/// there and 1-Lipschitz. Cost: O(segments * (reach / pixel)^2), parallel.
[[nodiscard]] FloatImage distance_to_segments(const std::vector<Segment2d>& segments, Vec2d corner_mm, double pixel_mm,
                                              int width, int height, double reach_mm);

}  // namespace fibrolite
