// SPDX-License-Identifier: Apache-2.0
#include "voxel_multigrid.h"

#include <algorithm>
#include <utility>

namespace fibrolite {

struct VoxelMultigrid::Nodes final : SmoothLevel {
  explicit Nodes(const VoxelOperator& f) : fine(f), inverse(f.inverse_diagonal()) {}
  [[nodiscard]] std::size_t size() const override { return fine.size(); }
  void apply(const float* x, float* y) const override { fine.apply(x, y); }
  void relax(const float* b, const float* y, float keep, float step, float* d, float* x) const override {
    chunked(inverse.size(), [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const float s = step * inverse[i];
        for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
          const float r = s * (y != nullptr ? b[k] - y[k] : b[k]);
          d[k] = keep != 0 ? keep * d[k] + r : r;
          x[k] += d[k];
        }
      }
    });
    fine.mask(d);
    fine.mask(x);
  }
  const VoxelOperator& fine;
  std::vector<float> inverse;  // 1 / diagonal
};

VoxelMultigrid::VoxelMultigrid(const VoxelOperator& fine, const Context& context)
    : fine_(fine), nodes_(std::make_unique<Nodes>(fine)), aggregates_(fine) {
  // No eigenvalue of D^-1 K is above the largest of a cell's own.
  const double bound = fine.element().largest / fine.element().diagonal;
  smoother_ = {std::min(bound, largest_eigenvalue(*nodes_, 12)), 12, 2};
  omega_ = 4.0 / (3 * smoother_.largest);
  coarse_ = std::make_unique<BlockMultigrid>(
      aggregates_.coarse_matrix(omega_, nodes_->inverse, context.part(0.1, 0.7, "multigrid")),
      AggregatePlaces{aggregates_.centres(), aggregates_.boxes()}, context);
  context.progress(1);
  product_.resize(fine.size());
  direction_.resize(fine.size());
  coarse_b_.resize(6 * aggregates_.size());
  coarse_x_.resize(6 * aggregates_.size());
}

VoxelMultigrid::~VoxelMultigrid() = default;

void VoxelMultigrid::apply(const float* r, float* z) const {
  float* y = product_.data();
  float* d = direction_.data();
  const std::vector<float>& inverse = nodes_->inverse;
  const std::size_t n = inverse.size();
  const auto omega = static_cast<float>(omega_);
  std::fill_n(z, 3 * n, 0.0F);
  smoother_.smooth(*nodes_, r, z, y, d, true);

  // Down: T^T (1 - omega K D^-1) (r - K z).
  fine_.apply(z, y);
  chunked(n, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) d[k] = inverse[i] * (r[k] - y[k]);
    }
  });
  fine_.mask(d);
  fine_.apply(d, y);
  chunked(n, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) y[k] = d[k] / inverse[i] - omega * y[k];
    }
  });
  fine_.mask(y);
  aggregates_.from_nodes(y, coarse_b_.data());

  coarse_->solve(coarse_b_.data(), coarse_x_.data());

  // Up: z += (1 - omega D^-1 K) T x.
  aggregates_.to_nodes(coarse_x_.data(), d);
  fine_.apply(d, y);
  chunked(n, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) z[k] += d[k] - omega * inverse[i] * y[k];
    }
  });
  smoother_.smooth(*nodes_, r, z, y, d, false);
}

}  // namespace fibrolite
