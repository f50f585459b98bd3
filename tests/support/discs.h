// SPDX-License-Identifier: GPL-3.0-or-later
// How thick walls and how wide voids are, by discs on samples: knows nothing of how a shape was made.
#pragma once

#include <cstdint>

#include "fibrolite/frame.h"
#include "fibrolite/image.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// Whether discs of this diameter inside the marked samples cover all of those `rim` away from the frame, but for
/// `slack`.
[[nodiscard]] bool holds_discs(const Image<std::uint8_t>& marked, double diameter, int rim, double slack);

/// Walls and voids of a shape in the xy plane of a frame, about its origin, samples `step_mm` apart.
class Discs {
 public:
  Discs(const Shape& shape, const Frame& section, double width_mm, double height_mm, double step_mm);
  /// The samples on either side of an edge are up to one apart from it.
  [[nodiscard]] bool walls_hold(double mm, double rim_mm) const {
    return holds_discs(wall_, mm / step_mm_, static_cast<int>(rim_mm / step_mm_), 1.5);
  }
  [[nodiscard]] bool gaps_hold(double mm, double rim_mm) const {
    return holds_discs(gap_, mm / step_mm_, static_cast<int>(rim_mm / step_mm_), 1.5);
  }

 private:
  Image<std::uint8_t> wall_, gap_;
  double step_mm_;
};

}  // namespace fibrolite
