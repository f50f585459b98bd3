// SPDX-License-Identifier: GPL-3.0-or-later
// A centre line whose normal planes do not cross inside the limb. Private to the fibre infill.
#pragma once

#include "fibrolite/ops/partition.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// The largest curvature of the line times how far the limb reaches to the inner side of the bend there; planes cross
/// inside the limb from 1 on. `inside`: negative in the limb.
[[nodiscard]] double sharpest_bend(const Axis& axis, const Shape& inside);

/// The axis itself if that is below 0.8; else its line made even over a length just wide enough. Ends stay.
/// Cost: O(points of the line) per try.
[[nodiscard]] Axis straightened(const Axis& axis, const Shape& inside);

}  // namespace fibrolite
