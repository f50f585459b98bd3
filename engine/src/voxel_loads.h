// SPDX-License-Identifier: Apache-2.0
// Supports and loads of the voxel solver, on its nodes.
#pragma once

#include <cstdint>
#include <vector>

#include "fibrolite/voxel_fem.h"
#include "voxel_model.h"

namespace fibrolite {

struct VoxelSupports {
  std::vector<std::uint32_t> fixed;  ///< Entries of a node vector, rising.
  std::vector<double> value_mm;      ///< Of each; where supports overlap, the last says.
};
/// @throws Error BadRecipe: a support meets no material.
[[nodiscard]] VoxelSupports voxel_supports(const VoxelModel& model, const std::vector<VoxelSupport>& supports);

/// @throws Error SolverFailed: a piece that the supports let move, with a point of it.
void check_held(const VoxelModel& model, const VoxelPieces& pieces, const std::vector<std::uint32_t>& fixed);

struct VoxelForces {
  std::vector<double> node_n;  ///< Three per node.
  double pressed_n = 0;        ///< Sum of the magnitudes of what pressures press with.
};
/// @throws Error BadRecipe: no surface under a load.
[[nodiscard]] VoxelForces voxel_forces(const VoxelModel& model, const VoxelFemProblem& problem);

}  // namespace fibrolite
