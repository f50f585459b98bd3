// SPDX-License-Identifier: GPL-3.0-or-later
// A border that is no plane: a paraboloid over the xy plane of a frame.
#pragma once

#include "fibrolite/frame.h"
#include "fibrolite/vec.h"

namespace fibrolite {

/// How high a bent plane lies over the xy plane of its frame, mm: slope.x x + slope.y y + xx x^2 + xy x y + yy y^2.
struct Bend {
  Vec2d slope{};
  double xx = 0, xy = 0, yy = 0;  ///< 1/mm; half the curvatures where the slope is none.

  [[nodiscard]] constexpr bool flat() const { return slope.x == 0 && slope.y == 0 && xx == 0 && xy == 0 && yy == 0; }
  [[nodiscard]] constexpr double height(Vec2d p) const {
    return slope.x * p.x + slope.y * p.y + xx * p.x * p.x + xy * p.x * p.y + yy * p.y * p.y;
  }
  [[nodiscard]] constexpr Vec2d slope_at(Vec2d p) const {
    return {slope.x + 2 * xx * p.x + xy * p.y, slope.y + xy * p.x + 2 * yy * p.y};
  }
  /// Its area over that of the plane below.
  [[nodiscard]] double stretch(Vec2d p) const;
  /// The largest of either sign anywhere, 1/mm.
  [[nodiscard]] double curvature() const;
  /// Not less than any slope within a disc about the origin.
  [[nodiscard]] double steepest(double radius_mm) const;
  /// The same surface seen from the other side: by a frame whose y and z axes are turned round.
  [[nodiscard]] constexpr Bend turned() const { return {{-slope.x, slope.y}, -xx, xy, -yy}; }
  /// The same surface by a frame with the same axes whose origin is the surface's own point at `p`.
  [[nodiscard]] constexpr Bend about(Vec2d p) const { return {slope_at(p), xx, xy, yy}; }

  friend constexpr bool operator==(const Bend&, const Bend&) = default;
};

/// The points z = bend.height({x, y}) of a frame, mm; its normals point to where z is larger. A flat one is the frame's
/// xy plane, to the last bit. Source: ours.
struct BentPlane {
  Frame frame;
  Bend bend{};

  /// The surface's own point at local (x, y), moved so far along the normal there; world.
  [[nodiscard]] Vec3d at(Vec2d local, double above_mm = 0) const;
  [[nodiscard]] Vec3d normal(Vec2d local) const;  ///< World, unit.
  /// Local x and y, and how high above the surface along the frame's z axis.
  [[nodiscard]] Vec3d flattened(Vec3d world) const;
  /// The nearest point of the surface and how far above it (below: negative) a point lies. Exact within the radius of
  /// curvature, an upper bound of the distance beyond. Cost: a few projections on tangent planes.
  struct Foot {
    Vec2d local{};
    double above_mm = 0;
  };
  [[nodiscard]] Foot foot(Vec3d world) const;
};

}  // namespace fibrolite
