// SPDX-License-Identifier: Apache-2.0
// The stiffness of all cells of a voxel model as an operator on node displacements; no matrix is stored.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "fibrolite/context.h"
#include "voxel_element.h"
#include "voxel_model.h"

namespace fibrolite {

/// Chunks of this many entries are summed on their own and their sums in order: the same bits on any number of threads.
inline constexpr std::size_t sum_chunk = 1U << 14U;

/// Sum of work(begin, end) over fixed chunks of [0, n), in order. Cost: parallel.
[[nodiscard]] double chunked_sum(std::size_t n, const std::function<double(std::size_t, std::size_t)>& work);
/// work(begin, end) over [0, n) in parallel; the chunks must not depend on each other.
void chunked(std::size_t n, const std::function<void(std::size_t, std::size_t)>& work);

/// Vectors hold three displacements or forces per node, axis fastest. In units of Young's modulus times cell edge.
/// Source of the idea: Bielak, Ghattas, Kim 2005 (octree elasticity without a matrix); the modal form of the element is
/// worked out in voxel_element.h.
class VoxelOperator {
 public:
  /// `fixed` are the entries of a vector that do not move, rising.
  VoxelOperator(const VoxelModel& model, const VoxelElement& element, std::vector<std::uint32_t> fixed,
                Context context);

  [[nodiscard]] const VoxelModel& model() const { return model_; }
  [[nodiscard]] const VoxelElement& element() const { return element_; }
  [[nodiscard]] const std::vector<std::uint32_t>& fixed() const { return fixed_; }
  [[nodiscard]] const Context& context() const { return context_; }
  [[nodiscard]] std::size_t size() const { return 3 * model_.nodes(); }

  /// f = K u with every node free. Cost: about 250 flops per cell. @throws Error Cancelled.
  void apply_free(const double* u, double* f) const;
  /// f = K u, then 0 at the fixed entries (u must be 0 there too). @throws Error Cancelled.
  void apply(const double* u, double* f) const;
  void apply(const float* u, float* f) const;
  /// Zero the fixed entries.
  template <class T>
  void mask(T* v) const {
    for (const std::uint32_t i : fixed_) v[i] = 0;
  }
  /// 1 / diagonal, one number per node: it is the same for its three axes. Cost: as apply().
  [[nodiscard]] std::vector<float> inverse_diagonal() const;

 private:
  const VoxelModel& model_;
  const VoxelElement& element_;
  std::vector<std::uint32_t> fixed_;
  Context context_;
};

}  // namespace fibrolite
