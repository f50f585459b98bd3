// SPDX-License-Identifier: GPL-3.0-or-later
// The soft shadow of a model on the ground it stands on. Private to picture.
#pragma once

#include <optional>

#include "fibrolite/image.h"
#include "fibrolite/mesh.h"
#include "picture_view.h"

namespace fibrolite {

/// What stands near the ground takes its light from above: a footprint, weighted by height and blurred.
class GroundShadow {
 public:
  /// Of what the cut leaves.
  GroundShadow(const Mesh& mesh, const std::optional<CutPlane>& cut, Vec3d up);
  /// How much light the ground seen at these sample coordinates lacks, 0 to 1.
  [[nodiscard]] double at(const View& view, double x, double y) const;

 private:
  Frame ground_;  ///< Origin at a corner of the grid, z up.
  double cell_mm_ = 0;
  FloatImage dark_;
};

}  // namespace fibrolite
