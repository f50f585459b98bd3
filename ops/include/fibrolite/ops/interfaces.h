// SPDX-License-Identifier: GPL-3.0-or-later
// Where two parts meet.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/part.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// One connected section of the body in a cut between two parts, plane or bent; or the mantle of a core (sleeve.h).
struct Interface {
  int a = 0, b = 0;      ///< Part ids; the frame's z axis points from a into b. If one is a column, it is a.
  Frame frame;           ///< Origin at the section's centroid; its z axis is the normal of a plane section.
  Bend bend{};           ///< Of the section's surface over the frame's xy plane.
  double radius_mm = 0;  ///< Of the disc that covers the section, seen along z.
  double area_mm2 = 0;   ///< Of the body's section, along its surface.
  /// Above 0: a cylinder of radius_mm about the frame's z axis, from its origin so far along it; a is inside.
  double length_mm = 0;
  /// Of a section that other pairs of parts share: it reaches as far as these say that a lies beside b.
  std::optional<Labels> within{};

  [[nodiscard]] BentPlane surface() const { return {frame, bend}; }
  /// Whether a point of the section's surface, seen `step_mm` to either side, lies between a and b.
  [[nodiscard]] bool parts_here(const Labels& labels, Vec2d local, double step_mm) const;
};
/// The sections of the body in the surface of one cut, where it parts cut.a from cut.b; sampled at `pixel_mm` (coarser
/// for a disc wider than 3000 pixels). Sections below 16 pixels or 3 % of the cut's largest are left out.
[[nodiscard]] std::vector<Interface> sections_of(const Cut& cut, const Labels& labels, const Shape& body,
                                                 double pixel_mm);

/// What an interface has to carry, N: the integral over its section of `traction` (MPa at a point, on the plane with a
/// normal), sampled at about a thousand points of it.
[[nodiscard]] double demand_n(const Interface& section, const Labels& labels, const Shape& body,
                              const std::function<double(Vec3d point_mm, Vec3d normal)>& traction_mpa);

/// `body` must not depend on the voxel (distance to the mesh). Sampled at `pixel_mm`. Sorted by (a, b, centroid).
[[nodiscard]] std::vector<Interface> interfaces(const Parts& parts, const Shape& body, double pixel_mm,
                                                const Context& context = {});

}  // namespace fibrolite
