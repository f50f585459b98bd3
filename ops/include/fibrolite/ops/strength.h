// SPDX-License-Identifier: GPL-3.0-or-later
// What the printed solid carries, and where it breaks first.
#pragma once

#include <cstdint>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/recipe.h"
#include "fibrolite/ops/report.h"

namespace fibrolite {

struct StrengthParams {
  /// Samples along the edge of a cell: 1, 2 or 4; 0: the finest with at most `most_cells` cells.
  int coarsen = 0;
  std::int64_t most_cells = 4000000;
  double residual = 1e-6;  ///< Relative, of each solve.
};
/// Linear elasticity on the voxels of the finished solid (voxel_fem.h), one solve per load case. Stress within one cell
/// of a support or of a loaded face is not counted: that is the clamp's. A force on what is seen from somewhere acts on
/// the cell faces that look there. @throws Error BadRecipe: an empty selection, named by case and key; Unsupported;
/// SolverFailed; Cancelled. Cost: see benchmarks/README.md.
/// The load cases are those of the verification, load_cases(recipe.verify). A pressure acts on the skin, not on the
/// walls of the interior.
[[nodiscard]] std::vector<StrengthReport> strength(const Hybrid& hybrid, const Recipe& recipe,
                                                   const StrengthParams& params = {}, const Context& context = {});

}  // namespace fibrolite
