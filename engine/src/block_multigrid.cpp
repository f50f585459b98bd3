// SPDX-License-Identifier: Apache-2.0
#include "block_multigrid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "fibrolite/disjoint_sets.h"

#include "fibrolite/chebyshev.h"
#include "voxel_operator.h"

namespace fibrolite {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
constexpr std::size_t dense_rows = 160;

int third(int v) { return v >= 0 ? v / 3 : -((2 - v) / 3); }

/// Inverse on the range of a positive semidefinite block; an aggregate of one node or of nodes in a line has rotations
/// that move nothing.
Matrix6 pseudo_inverse(const Matrix6& a) {
  Eigen::Matrix<double, 6, 1> scale;
  for (int i = 0; i < 6; ++i) scale[i] = a(i, i) > 0 ? 1 / std::sqrt(a(i, i)) : 0;
  const Matrix6 unit = scale.asDiagonal() * a * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(unit);
  Eigen::Matrix<double, 6, 1> inverse;
  for (int i = 0; i < 6; ++i) inverse[i] = eigen.eigenvalues()[i] > 1e-5 ? 1 / eigen.eigenvalues()[i] : 0;
  const Matrix6 vectors = eigen.eigenvectors();
  return scale.asDiagonal() * vectors * inverse.asDiagonal() * vectors.transpose() * scale.asDiagonal();
}

/// Motion of a body at `centre` when one it is part of moves about `about`.
Matrix6 carried(Vec3d centre, Vec3d about) {
  const Vec3d r = centre - about;
  Matrix6 t = Matrix6::Identity();
  t(0, 4) = r.z, t(0, 5) = -r.y;
  t(1, 3) = -r.z, t(1, 5) = r.x;
  t(2, 3) = r.y, t(2, 4) = -r.x;
  return t;
}

}  // namespace

/// A matrix, its smoother, and the way to the next level.
struct BlockMultigrid::Level final : SmoothLevel {
  BlockMatrix matrix;
  AggregatePlaces places;
  std::vector<float> inverse;  // of the diagonal blocks
  Chebyshev smoother;
  // Prolongation: rows of (aggregate of the next level, 6x6), and the same by column.
  std::vector<std::size_t> begin, back_begin;
  std::vector<std::uint32_t> column, back_row;
  std::vector<std::size_t> back_slot;
  std::vector<float> value;
  mutable std::vector<float> product, direction, rest, coarse_b, coarse_x;

  [[nodiscard]] std::size_t size() const override { return 6 * matrix.rows(); }
  void apply(const float* x, float* y) const override { matrix.apply(x, y); }
  void relax(const float* b, const float* y, float keep, float step, float* d, float* x) const override {
    chunked(matrix.rows(), [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        std::array<float, 6> r{}, z{};
        for (std::size_t k = 0; k < 6; ++k) r[k] = b[6 * i + k] - (y != nullptr ? y[6 * i + k] : 0);
        const float* m = inverse.data() + 36 * i;
        for (std::size_t c = 0; c < 6; ++c) {
          for (std::size_t k = 0; k < 6; ++k) z[k] += m[6 * c + k] * r[c];
        }
        for (std::size_t k = 0; k < 6; ++k) {
          float& v = d[6 * i + k];
          v = keep != 0 ? keep * v + step * z[k] : step * z[k];
          x[6 * i + k] += v;
        }
      }
    });
  }

  void prepare() {
    inverse.resize(36 * matrix.rows());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, matrix.rows(), 256), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        for (const BlockMatrix::Entry e : matrix.row(i)) {
          if (e.column != i) continue;
          const Block6 b = matrix.block(e);
          const Matrix6 m = pseudo_inverse(Eigen::Map<const Matrix6>(b.data()));
          for (int k = 0; k < 36; ++k) inverse[36 * i + static_cast<std::size_t>(k)] = static_cast<float>(m.data()[k]);
        }
      }
    });
    product.resize(size());
    direction.resize(size());
    rest.resize(size());
  }

  /// Parents: rows in one 3x3x3 of boxes that hang together through the matrix. Returns how many.
  std::size_t group(std::vector<std::uint32_t>& parent) const {
    const std::size_t n = matrix.rows();
    const auto box = [&](std::size_t i) {
      const Vec3i b = places.box[i];
      return Vec3i{third(b.x), third(b.y), third(b.z)};
    };
    DisjointSets sets(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (const BlockMatrix::Entry e : matrix.row(i)) {
        if (e.column <= i || !(box(i) == box(e.column))) continue;
        sets.join(static_cast<std::uint32_t>(i), e.column);
      }
    }
    std::uint32_t next = 0;
    parent.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) parent[i] = sets.root(i) == i ? next++ : parent[sets.root(i)];
    return next;
  }

  /// P = (1 - omega D^-1 A) T. The next level's matrix is P^T A P.
  BlockMatrix coarsen(const std::vector<std::uint32_t>& parent, AggregatePlaces& next, double omega,
                      const Context& context) {
    const std::size_t n = matrix.rows();
    next.centre.assign(next.box.size(), {});
    std::vector<double> count(next.box.size(), 0);
    for (std::size_t i = 0; i < n; ++i) {
      next.centre[parent[i]] = next.centre[parent[i]] + places.centre[i];
      count[parent[i]] += 1;
    }
    for (std::size_t g = 0; g < count.size(); ++g) next.centre[g] = next.centre[g] / count[g];

    struct Piece {
      std::vector<std::pair<std::uint32_t, Matrix6>> list;
      Matrix6& at(std::uint32_t c) {
        for (auto& [k, m] : list) {
          if (k == c) return m;
        }
        list.emplace_back(c, Matrix6::Zero());
        return list.back().second;
      }
    };
    const auto motion = [&](std::size_t i) { return carried(places.centre[i], next.centre[parent[i]]); };
    constexpr std::size_t batch = 8192, grain = 256;
    begin.assign(1, 0);
    // Growing by doubling would hold three times the memory for a moment: count first.
    std::size_t total = 0;
    std::vector<std::uint32_t> parents;
    for (std::size_t i = 0; i < n; ++i) {
      parents.clear();
      for (const BlockMatrix::Entry e : matrix.row(i)) {
        const std::uint32_t p = parent[e.column];
        if (std::find(parents.begin(), parents.end(), p) == parents.end()) parents.push_back(p);
      }
      total += parents.size();
    }
    column.reserve(total);
    value.reserve(36 * total);
    std::vector<Piece> pieces(std::min(batch, n));
    for (std::size_t start = 0; start < n; start += batch) {
      context.check();
      const std::size_t here = std::min(batch, n - start);
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, here, 64), [&](const auto& range) {
        for (std::size_t k = range.begin(); k < range.end(); ++k) {
          const std::size_t i = start + k;
          Piece& p = pieces[k];
          p.list.clear();
          p.at(parent[i]) = motion(i);
          Piece image;
          for (const BlockMatrix::Entry e : matrix.row(i)) {
            const Block6 b = matrix.block(e);
            image.at(parent[e.column]) += Eigen::Map<const Matrix6>(b.data()) * motion(e.column);
          }
          const Matrix6 d =
              Eigen::Map<const Eigen::Matrix<float, 6, 6, Eigen::RowMajor>>(inverse.data() + 36 * i).cast<double>();
          for (const auto& [c, m] : image.list) p.at(c) -= omega * d * m;
        }
      });
      for (std::size_t k = 0; k < here; ++k) {
        for (const auto& [c, m] : pieces[k].list) {
          column.push_back(c);
          for (int q = 0; q < 36; ++q) value.push_back(static_cast<float>(m.data()[q]));
        }
        begin.push_back(column.size());
      }
    }
    transpose(next.box.size());

    const auto prolong = [&](std::size_t slot) {
      return Matrix6(
          Eigen::Map<const Eigen::Matrix<float, 6, 6, Eigen::RowMajor>>(value.data() + 36 * slot).cast<double>());
    };
    BlockMatrix coarse(next.box.size());
    std::vector<BlockSum> sums(batch / grain);
    for (std::size_t start = 0; start < n; start += batch) {
      context.check();
      const std::size_t parts = (std::min(batch, n - start) + grain - 1) / grain;
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, parts, 1), [&](const auto& range) {
        for (std::size_t s = range.begin(); s < range.end(); ++s) {
          sums[s].clear();
          const std::size_t end = std::min(n, start + (s + 1) * grain);
          for (std::size_t i = start + s * grain; i < end; ++i) {
            Piece image;  // (A P) of row i
            for (const BlockMatrix::Entry e : matrix.row(i)) {
              const Block6 b = matrix.block(e);
              const Matrix6 a = Eigen::Map<const Matrix6>(b.data());
              for (std::size_t k = begin[e.column]; k < begin[e.column + 1]; ++k) {
                image.at(column[k]).noalias() += a * prolong(k);
              }
            }
            for (std::size_t k = begin[i]; k < begin[i + 1]; ++k) {
              const Matrix6 left = prolong(k).transpose();
              for (const auto& [c, m] : image.list) {
                if (c < column[k]) continue;
                Eigen::Map<Matrix6>(sums[s].at(column[k], c).data()).noalias() += left * m;
              }
            }
          }
        }
      });
      for (std::size_t s = 0; s < parts; ++s) coarse.add(sums[s]);
    }
    coarse.finish();
    coarse_b.resize(6 * next.box.size());
    coarse_x.resize(6 * next.box.size());
    return coarse;
  }

  void transpose(std::size_t columns) {
    back_begin.assign(columns + 1, 0);
    for (const std::uint32_t c : column) ++back_begin[c + 1];
    for (std::size_t c = 0; c < columns; ++c) back_begin[c + 1] += back_begin[c];
    back_row.resize(column.size());
    back_slot.resize(column.size());
    std::vector<std::size_t> fill(back_begin.begin(), back_begin.end() - 1);
    for (std::size_t i = 0; i + 1 < begin.size(); ++i) {
      for (std::size_t k = begin[i]; k < begin[i + 1]; ++k) {
        const std::size_t at = fill[column[k]]++;
        back_row[at] = static_cast<std::uint32_t>(i);
        back_slot[at] = k;
      }
    }
  }

  /// c = P^T r.
  void restrict_to(const float* r, float* c) const {
    chunked(back_begin.size() - 1, [&](std::size_t from, std::size_t to) {
      for (std::size_t g = from; g < to; ++g) {
        std::array<float, 6> sum{};
        for (std::size_t k = back_begin[g]; k < back_begin[g + 1]; ++k) {
          const float* m = value.data() + 36 * back_slot[k];
          const float* v = r + std::size_t{6} * back_row[k];
          for (std::size_t i = 0; i < 6; ++i) {
            for (std::size_t j = 0; j < 6; ++j) sum[j] += m[6 * i + j] * v[i];
          }
        }
        std::copy(sum.begin(), sum.end(), c + 6 * g);
      }
    });
  }
  /// x += P c.
  void prolong_from(const float* c, float* x) const {
    chunked(matrix.rows(), [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        for (std::size_t k = begin[i]; k < begin[i + 1]; ++k) {
          const float* m = value.data() + 36 * k;
          const float* v = c + std::size_t{6} * column[k];
          for (std::size_t r = 0; r < 6; ++r) {
            for (std::size_t j = 0; j < 6; ++j) x[6 * i + r] += m[6 * r + j] * v[j];
          }
        }
      }
    });
  }
};

/// The coarsest level, factorised in double precision.
struct BlockMultigrid::Dense {
  Eigen::LLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd scale;

  explicit Dense(const BlockMatrix& a) {
    const auto n = static_cast<Eigen::Index>(6 * a.rows());
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t i = 0; i < a.rows(); ++i) {
      for (const BlockMatrix::Entry e : a.row(i)) {
        const Block6 b = a.block(e);
        full.block<6, 6>(static_cast<Eigen::Index>(6 * i), Eigen::Index{6} * e.column) =
            Eigen::Map<const Matrix6>(b.data());
      }
    }
    scale.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) scale[i] = full(i, i) > 0 ? 1 / std::sqrt(full(i, i)) : 0;
    full = scale.asDiagonal() * full * scale.asDiagonal();
    // Directions that move nothing get a pivot; no load ever points along them.
    for (Eigen::Index i = 0; i < n; ++i) full(i, i) = full(i, i) > 0 ? full(i, i) + 1e-12 : 1;
    factor.compute(full);
    for (double shift = 1e-10; factor.info() != Eigen::Success && shift < 1; shift *= 100) {
      full.diagonal().array() += shift;
      factor.compute(full);
    }
  }
  void solve(const float* b, float* x) const {
    Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXf>(b, scale.size()).cast<double>().cwiseProduct(scale);
    v = factor.solve(v).cwiseProduct(scale);
    Eigen::Map<Eigen::VectorXf>(x, scale.size()) = v.cast<float>();
  }
};

BlockMultigrid::BlockMultigrid(BlockMatrix matrix, AggregatePlaces places, const Context& context) {
  while (true) {
    auto level = std::make_unique<Level>();
    level->matrix = std::move(matrix);
    level->places = std::move(places);
    if (level->matrix.rows() <= dense_rows) {
      dense_ = std::make_unique<Dense>(level->matrix);
      levels_.push_back(std::move(level));
      return;
    }
    level->prepare();
    std::vector<std::uint32_t> parent;
    const std::size_t groups = level->group(parent);
    const bool last = groups == level->matrix.rows();  // many loose pieces: nothing more to join
    BlockMatrix coarse;
    AggregatePlaces next;
    if (!last) {
      next.box.resize(groups);
      for (std::size_t i = 0; i < parent.size(); ++i) {
        const Vec3i b = level->places.box[i];
        next.box[parent[i]] = {third(b.x), third(b.y), third(b.z)};
      }
    }
    level->smoother.largest = largest_eigenvalue(*level, 12);
    level->smoother.degree = 4;
    level->smoother.ratio = 30;
    if (!last) coarse = level->coarsen(parent, next, 4.0 / (3 * level->smoother.largest), context);
    level->matrix.round();
    level->places = {};
    levels_.push_back(std::move(level));
    if (last) return;
    matrix = std::move(coarse);
    places = std::move(next);
  }
}

BlockMultigrid::~BlockMultigrid() = default;

void BlockMultigrid::solve(const float* b, float* x) const { cycle(0, b, x, true); }

void BlockMultigrid::cycle(std::size_t at, const float* b, float* x, bool zero) const {
  const Level& level = *levels_[at];
  const bool last = at + 1 == levels_.size();
  if (last && dense_ != nullptr) {
    dense_->solve(b, x);
    return;
  }
  const std::size_t n = level.size();
  float* y = level.product.data();
  float* d = level.direction.data();
  if (zero) std::fill_n(x, n, 0.0F);
  if (last) {
    Chebyshev{level.smoother.largest, 1000, 30}.smooth(level, b, x, y, d, zero);
    return;
  }
  level.smoother.smooth(level, b, x, y, d, zero);
  level.apply(x, y);
  chunked(n, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) level.rest[i] = b[i] - y[i];
  });
  level.restrict_to(level.rest.data(), level.coarse_b.data());
  // Twice (a W cycle): the coarse levels cost little and on lattices they are what slows the solve.
  cycle(at + 1, level.coarse_b.data(), level.coarse_x.data(), true);
  if (at + 2 < levels_.size()) cycle(at + 1, level.coarse_b.data(), level.coarse_x.data(), false);
  level.prolong_from(level.coarse_x.data(), x);
  level.smoother.smooth(level, b, x, y, d, false);
}

}  // namespace fibrolite
