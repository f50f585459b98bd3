// SPDX-License-Identifier: Apache-2.0
// An axis-aligned box, mm. A default box is empty and grows by include().
#pragma once

#include <algorithm>
#include <limits>

#include "fibrolite/vec.h"

namespace fibrolite {

struct Box3d {
  Vec3d min{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
            std::numeric_limits<double>::infinity()};
  Vec3d max{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity()};

  [[nodiscard]] constexpr bool empty() const { return min.x > max.x || min.y > max.y || min.z > max.z; }
  [[nodiscard]] constexpr Vec3d size() const { return empty() ? Vec3d{} : max - min; }
  [[nodiscard]] constexpr Vec3d center() const { return 0.5 * (min + max); }
  [[nodiscard]] double longest_side() const { return std::max({size().x, size().y, size().z}); }
  void include(Vec3d p) {
    min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
  }
  /// 0 to 7: bits 0, 1, 2 choose the larger x, y, z.
  [[nodiscard]] constexpr Vec3d corner(unsigned i) const {
    return {(i & 1U) != 0 ? max.x : min.x, (i & 2U) != 0 ? max.y : min.y, (i & 4U) != 0 ? max.z : min.z};
  }
  /// The box with every face moved outward by `mm` (inward if negative).
  [[nodiscard]] constexpr Box3d grown(double mm) const { return {min - Vec3d{mm, mm, mm}, max + Vec3d{mm, mm, mm}}; }
  [[nodiscard]] constexpr bool contains(Vec3d p) const {
    return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y && p.z >= min.z && p.z <= max.z;
  }
};

}  // namespace fibrolite
