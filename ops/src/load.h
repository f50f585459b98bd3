// SPDX-License-Identifier: GPL-3.0-or-later
// The load of the component verification: a force from above, spread over the surface that is seen first.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "fibrolite/frame.h"
#include "fibrolite/ops/loads.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// The places where a load from above acts, one per pixel of a horizontal raster; each carries the same share of the
/// force, so the force is spread by projected area.
struct Footprint {
  Frame frame;  ///< z is up; pixel (x, y) lies at (x + 1/2, y + 1/2) * pixel_mm.
  double pixel_mm = 1;
  int width = 0, height = 0;
  struct Point {
    int pixel = 0;      ///< y * width + x
    double height = 0;  ///< Along up from the frame's origin, mm.
  };
  std::vector<Point> points;  ///< Ascending by pixel.
  std::int64_t faces = 0;     ///< Triangles that they lie on.
  [[nodiscard]] Vec3d at(const Point& point) const;
};
/// What is seen first from above, as far as `wanted` takes it. Cost: O(faces + pixels), about 400 pixels along the
/// longer side.
[[nodiscard]] Footprint seen_from_above(const TetMesh& body, Vec3d up, const std::function<bool(Vec3d)>& wanted);

/// The share of the whole force on each node of `mesh` (of the body or of one component of it), from the points that
/// `mine` accepts. Each goes to the upward face above or below it that is nearest in height; farther than
/// `tolerance_mm` is not met. Shares sum to (points met) / (all points): 1 for the body itself.
[[nodiscard]] std::vector<double> nodal_shares(const TetMesh& mesh, const Footprint& footprint, double tolerance_mm,
                                               const std::function<bool(Vec3d)>& mine);

/// The level unit direction that the slanted load comes from, for a unit vector `up`: see load_directions().
[[nodiscard]] Vec3d slanted_from(Vec3d up, double azimuth_deg);
/// Unit directions of the two load cases: straight down, and 45 degrees from it, coming from `azimuth_deg` about `up`.
/// Azimuth 0 is the next world axis after the one nearest to `up` (x for z, y for x, z for y), made level.
[[nodiscard]] std::vector<Vec3d> load_directions(Vec3d up, double azimuth_deg);
/// The unit vector of a direction, for a unit vector `up`.
[[nodiscard]] Vec3d resolved(const Direction& direction, Vec3d up, double azimuth_deg);

}  // namespace fibrolite
