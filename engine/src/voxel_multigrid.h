// SPDX-License-Identifier: Apache-2.0
// The preconditioner of the voxel solver: one multigrid cycle.
#pragma once

#include <memory>
#include <vector>

#include "block_multigrid.h"
#include "fibrolite/chebyshev.h"
#include "voxel_aggregates.h"
#include "voxel_operator.h"

namespace fibrolite {

/// Chebyshev smoothing on the nodes, then smoothed aggregates of rigid bodies. A trilinear coarse grid cannot bend a
/// member thinner than its cells and joins members that only pass each other; bodies with rotations can and do not.
/// Single precision: it only has to be a good direction. Symmetric.
class VoxelMultigrid {
 public:
  /// Cost: as some 30 products with K. @throws Error Cancelled.
  VoxelMultigrid(const VoxelOperator& fine, const Context& context);
  ~VoxelMultigrid();
  /// z is about K^-1 r; r is 0 where fixed. Cost: 2 * degree + 2 products with K and the coarse levels.
  void apply(const float* r, float* z) const;

 private:
  struct Nodes;
  const VoxelOperator& fine_;
  std::unique_ptr<Nodes> nodes_;
  VoxelAggregates aggregates_;
  std::unique_ptr<BlockMultigrid> coarse_;
  double omega_ = 0;
  Chebyshev smoother_;
  mutable std::vector<float> product_, direction_, coarse_b_, coarse_x_;
};

}  // namespace fibrolite
