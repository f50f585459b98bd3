// SPDX-License-Identifier: GPL-3.0-or-later
// What the user decides in place of partition and verification.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// What fills a part.
enum class PartInfill { Mfs, Tcs, Solid, Gyroid, Shell };  ///< Shell: nothing inside.
[[nodiscard]] const char* name(PartInfill infill);

/// Flat-ended, between the centres of its end faces.
struct Cylinder {
  Vec3d from_mm{}, to_mm{};
  double diameter_mm = 0;  ///< > 0
};
using KeptRegion = std::variant<Box3d, Cylinder>;

/// Lengths in mm, world frame, after `--size` and `--unit`.
struct Overrides {
  struct PartChoice {
    int id = 0;  ///< Of a candidate, as `fibrolite partition` numbers them.
    PartInfill infill = PartInfill::Solid;
  };
  struct Plane {
    Vec3d point_mm{}, normal{};  ///< In the body or within a voxel of the proxy of it; any length above zero.
    /// Other than 0: bent like a bowl (a paraboloid), with this radius of curvature at the point; it opens to where the
    /// normal points, below 0 to the other side. Not less than the section's own radius.
    double radius_mm = 0;
  };
  std::vector<PartChoice> parts;  ///< Each at most once.
  /// If there are any, the body is parted here and nowhere else: at the connected section through each point.
  std::vector<Plane> cuts;
  std::vector<KeptRegion> solid;  ///< Stays filled, as around a screw hole.
};
/// @throws Error BadRecipe, naming the entry: an empty box, a cylinder without length or diameter, a normal of no
/// length, a radius that is no number, a part named twice.
void check_overrides(const Overrides& overrides);
/// @throws Error BadRecipe, naming the entry: a region that stays filled lies beside the model's box.
void check_overrides(const Overrides& overrides, const Box3d& model);
/// The regions that stay filled, as one shape; nothing() if there are none.
[[nodiscard]] Shape kept_solid(const Overrides& overrides);

}  // namespace fibrolite
