// SPDX-License-Identifier: GPL-3.0-or-later
// How a section grows and shrinks along a limb. Private to the fibre infill.
#pragma once

#include <vector>

#include "fibrolite/ops/infill/mfs.h"
#include "infill/sweep.h"

namespace fibrolite {

/// A limb in one of its normal planes: 0 if that plane does not show the whole of it (cut off from its neighbour
/// there).
struct LimbSection {
  double size_mm = 0;   ///< Radius of a disc of the same area.
  double reach_mm = 0;  ///< Farthest point from the centre line.
};
struct TaperLimits {
  double least = 1, most = 1;  ///< Of the scale.
  double steepest = 0.25;      ///< Fibres run at most this slope (a tangent) to the centre line.
};
/// The scale follows the limb's size, 1 at the median, even over a limb's radius, held where no section is whole.
/// `sections`: equally spaced along the line, first and last at its ends.
[[nodiscard]] Taper taper_along(const Sweep& sweep, const std::vector<LimbSection>& sections,
                                const TaperLimits& limits);

}  // namespace fibrolite
