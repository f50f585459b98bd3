// SPDX-License-Identifier: Apache-2.0
// From nodes to aggregates: the first coarsening of the voxel solver.
#pragma once

#include <cstdint>
#include <vector>

#include "block_matrix.h"
#include "voxel_operator.h"

namespace fibrolite {

/// Nodes in one 3x3x3 box that hang together through cells form an aggregate, which moves as a rigid body: members that
/// pass each other in one box stay apart, and a chain of aggregates bends as a beam. Smoothed aggregation (Vanek,
/// Mandel, Brezina 1996): a coarse vector c stands for (1 - omega D^-1 K) T c, T the rigid motions (translation and
/// rotation about the mean of the nodes, in cell edges).
class VoxelAggregates {
 public:
  /// Cost: O(cells), serial.
  explicit VoxelAggregates(const VoxelOperator& fine);

  [[nodiscard]] std::size_t size() const { return centre_.size(); }
  [[nodiscard]] const std::vector<Vec3d>& centres() const { return centre_; }  ///< Cells.
  [[nodiscard]] const std::vector<Vec3i>& boxes() const { return box_; }       ///< Node / 3.
  /// u = T c, 0 where fixed.
  void to_nodes(const float* c, float* u) const;
  /// c = T^T f; f must be 0 where fixed.
  void from_nodes(const float* f, float* c) const;
  /// P^T K P with P = (1 - omega D^-1 K) T. Cost: about 20 k flops per cell, parallel; same bits on any number of
  /// threads. @throws Error Cancelled.
  [[nodiscard]] BlockMatrix coarse_matrix(double omega, const std::vector<float>& inverse_diagonal,
                                          const Context& context) const;

 private:
  struct Worker;
  /// Of node i of aggregate g, cells.
  [[nodiscard]] Vec3f from_centre(std::size_t i, std::size_t g) const {
    const int x = 3 * box_[g].x + place_[i] / 9, y = 3 * box_[g].y + place_[i] / 3 % 3,
              z = 3 * box_[g].z + place_[i] % 3;
    return to_float(Vec3d{x - centre_[g].x, y - centre_[g].y, z - centre_[g].z});
  }
  const VoxelOperator& fine_;
  std::vector<std::uint32_t> of_node_;  // none: wholly fixed
  std::vector<std::uint8_t> place_;     // 9 x + 3 y + z in the box
  std::vector<std::uint32_t> begin_, node_;
  std::vector<Vec3d> centre_;
  std::vector<Vec3i> box_;
};

}  // namespace fibrolite
