// SPDX-License-Identifier: GPL-3.0-or-later
// Whole runs of the method at a coarse voxel.
#pragma once

#include "fibrolite/ops/hybridize.h"

namespace fibrolite::testing {

/// The default recipe with members thick enough for a voxel of 0.5 mm.
inline Recipe sturdy() {
  Recipe recipe;
  recipe.tcs.stick_mm = recipe.mfs.wall_mm = 1.0;
  recipe.joint.column_mm = recipe.joint.min_wall_mm = 1.0;
  recipe.mfs.fibre_mm = 3;
  return recipe;
}

struct Outcome {
  Hybrid hybrid;
  Report report;
};
inline Outcome hybridized(const Mesh& mesh, const HybridizeParams& params) {
  Outcome out;
  out.hybrid = hybridize(prepare({mesh, 1.0, {}}, {}), params, out.report);
  return out;
}

}  // namespace fibrolite::testing
