// SPDX-License-Identifier: GPL-3.0-or-later
// What a solid will come to, from points of it.
#pragma once

#include "fibrolite/ops/recipe.h"

namespace fibrolite {

/// Of a structure, at a voxel.
struct Survey {
  double active = 0;       ///< Samples in the band of the solid.
  double crossings = 0;    ///< Edges of the lattice that the surface crosses; two triangles each.
  double blocks = 0;       ///< Of 8 x 8 x 8 samples, that hold some of its band.
  double body_blocks = 0;  ///< The same of the body, told as deep as the shell.
};
/// Distances at a few thousand points, spread evenly over the model: within some 5 %, more where a structure that is
/// known once the parts are is stood for by crystal (`parts_share` of its faces: of a hybrid and of fibres).
/// Cost: a tree of the model, and a tenth of a second.
[[nodiscard]] Survey survey(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill,
                            double parts_share);

}  // namespace fibrolite
