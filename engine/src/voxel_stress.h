// SPDX-License-Identifier: Apache-2.0
// Stress in the cells of a voxel model.
#pragma once

#include <array>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/stress.h"
#include "fibrolite/voxel_fem.h"
#include "voxel_element.h"
#include "voxel_model.h"

namespace fibrolite {

/// xx yy zz xy yz zx, MPa.
using CellStress = StressTensor;
/// At the centre of a cell whose lowest corner has this place in the block's table of nodes.
[[nodiscard]] CellStress cell_stress(const VoxelModel& model, const VoxelElement& element, double young_mpa,
                                     double poisson, const std::vector<double>& u, const std::uint32_t* table, int low);

struct StressSummary {
  PlaceStress whole;
  std::vector<PlaceStress> places;
};
/// Over cells of at least half the fraction of the fullest cell whose centre is not in problem.unmeasured. Cost:
/// O(cells log cells), parallel; the same bits on any number of threads. @throws Error Cancelled.
[[nodiscard]] StressSummary measure_stress(const VoxelModel& model, const VoxelElement& element,
                                           const VoxelFemProblem& problem, const std::vector<double>& u,
                                           const Context& context);

}  // namespace fibrolite
