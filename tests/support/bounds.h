// SPDX-License-Identifier: GPL-3.0-or-later
// Shape::bound() against values.
#pragma once

#include <gtest/gtest.h>

#include "fibrolite/random.h"
#include "fibrolite/shape.h"

namespace fibrolite::testing {

/// In `boxes` random boxes up to 3.2 mm wide, at 50 points of each, within 20 mm of the origin.
inline void expect_bounds_hold(const Shape& shape, Random random, int boxes) {
  for (int i = 0; i < boxes; ++i) {
    const Vec3d low{20 * random.uniform(), 20 * random.uniform(), 20 * random.uniform()};
    const double size = 0.2 + 3 * random.uniform();
    const Interval bound = shape.bound({low, low + Vec3d{size, size, size}});
    for (int k = 0; k < 50; ++k) {
      const float v = shape(low + size * Vec3d{random.uniform(), random.uniform(), random.uniform()});
      ASSERT_GE(v, bound.lo);
      ASSERT_LE(v, bound.hi);
    }
  }
}

}  // namespace fibrolite::testing
