// SPDX-License-Identifier: Apache-2.0
// A right-handed orthonormal frame: an origin (mm) and three unit axes.
#pragma once

#include "fibrolite/vec.h"

namespace fibrolite {

struct Frame {
  Vec3d origin{};
  Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  [[nodiscard]] constexpr Vec3d to_local(Vec3d p) const {
    const Vec3d d = p - origin;
    return {dot(d, x), dot(d, y), dot(d, z)};
  }
  [[nodiscard]] constexpr Vec3d to_world(Vec3d p) const { return origin + p.x * x + p.y * y + p.z * z; }
};

/// The world as this frame sees it: its to_local() is the other's to_world().
[[nodiscard]] constexpr Frame inverse(const Frame& frame) {
  return {frame.to_local({}),
          {frame.x.x, frame.y.x, frame.z.x},
          {frame.x.y, frame.y.y, frame.z.y},
          {frame.x.z, frame.y.z, frame.z.z}};
}

/// A frame whose z axis is `z` (any length but zero). The choice of x is deterministic: it is built from the
/// world axis least aligned with z.
[[nodiscard]] inline Frame frame_along(Vec3d origin, Vec3d z) {
  const Vec3d w = normalized(z);
  const double ax = std::abs(w.x), ay = std::abs(w.y), az = std::abs(w.z);
  const Vec3d helper = (ax <= ay && ax <= az) ? Vec3d{1, 0, 0} : (ay <= az) ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  const Vec3d u = normalized(cross(helper, w));
  return {origin, u, cross(w, u), w};
}

}  // namespace fibrolite
