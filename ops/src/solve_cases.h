// SPDX-License-Identifier: GPL-3.0-or-later
// Several load cases with supports of their own on one mesh.
#pragma once

#include <vector>

#include "elasticity.h"
#include "fibrolite/context.h"
#include "fibrolite/frame.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// What acts on a mesh and where it is held, both in the mesh's coordinates but for the axes of `fixed` and the values
/// of load.fixed_mm: those are components along the axes of `frame`. Its origin means nothing.
struct HeldCase {
  Frame frame{};
  std::vector<fem::Fixed> fixed;
  fem::LoadCase load;
};

/// The solutions, in the mesh's coordinates. Cases that hold the same components in the same frame share one
/// factorisation. @throws Error as fem::solve().
[[nodiscard]] std::vector<fem::Solution> solve_cases(const TetMesh& mesh, const Material& material,
                                                     const std::vector<HeldCase>& cases, const Context& context);

}  // namespace fibrolite
