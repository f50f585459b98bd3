// SPDX-License-Identifier: Apache-2.0
// The coarse levels of the voxel solver: smoothed aggregation of rigid bodies, level by level, to a dense solve.
#pragma once

#include <memory>
#include <vector>

#include "block_matrix.h"
#include "fibrolite/context.h"
#include "fibrolite/vec.h"

namespace fibrolite {

/// Where the aggregates of a level are: the point their rotation is about (cells), and the box they lie in.
struct AggregatePlaces {
  std::vector<Vec3d> centre;
  std::vector<Vec3i> box;
};

class BlockMultigrid {
 public:
  /// Cost: O(blocks of the matrix). @throws Error Cancelled.
  BlockMultigrid(BlockMatrix matrix, AggregatePlaces places, const Context& context);
  ~BlockMultigrid();
  /// x is about A^-1 b, by one W cycle: a symmetric positive operator. Same bits on any number of threads.
  void solve(const float* b, float* x) const;

 private:
  struct Level;
  struct Dense;
  void cycle(std::size_t level, const float* b, float* x, bool zero) const;
  std::vector<std::unique_ptr<Level>> levels_;
  std::unique_ptr<Dense> dense_;
};

}  // namespace fibrolite
