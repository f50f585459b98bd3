// SPDX-License-Identifier: GPL-3.0-or-later
// Columns that hold up the crystal (paper Sec. 6.2). Private to the joints.
#pragma once

#include <vector>

#include "fibrolite/frame.h"
#include "fibrolite/ops/joint.h"
#include "fibrolite/random.h"

namespace fibrolite {

struct SupportColumns {
  std::vector<Capsule> columns;
  int dropped = 0;
};
/// A side of the joint in the layer's face there, on the layer's own raster.
struct Face {
  FloatImage fill_mm, lumen_mm;
};
[[nodiscard]] Face face_of(const Layer& layer, const BentPlane& surface, const Shape& fill, const Shape& lumen,
                           double layer_mm);
/// Where the fill stands on the layer, inside the lumen.
[[nodiscard]] double contact_area_mm2(const Layer& layer, const BentPlane& surface, const Face& face);
/// Columns from `layer` along the surface's normals into `crystal`: its material within half of reach_mm is projected
/// on the layer, feet are drawn as Poisson disks from where both are solid, each column ends where the crystal is
/// stick_mm / 4 deep. A column that leaves the `lumen` (the body without its shell) first, or finds nothing within
/// reach, is dropped.
[[nodiscard]] SupportColumns support_columns(const Layer& layer, const BentPlane& surface, const Shape& crystal,
                                             const Face& face, double stick_mm, const Shape& lumen,
                                             const JointParams& params, Random random, const Context& context);

}  // namespace fibrolite
