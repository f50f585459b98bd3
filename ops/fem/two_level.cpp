// SPDX-License-Identifier: GPL-3.0-or-later
#include "two_level.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Dense>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "fibrolite/chebyshev.h"
#include "fibrolite/error.h"

namespace fibrolite::fem {
namespace {

template <class Body>
void each(std::size_t count, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 512), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
  });
}

/// Sum of term(i); cut the same way on any number of threads.
template <class Term>
double sum(std::size_t count, const Term& term) {
  return tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, count, 4096), 0.0,
      [&](const auto& range, double s) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) s += term(i);
        return s;
      },
      std::plus<>());
}

/// The corners a node follows: itself and nothing, or the ends of its edge.
using Ends = std::array<std::uint32_t, 2>;

/// The vectors at the nodes that a column of components, three per node, stands for.
std::vector<Vec3d> nodal_vectors(const Eigen::VectorXd& components) {
  std::vector<Vec3d> vectors(static_cast<std::size_t>(components.size()) / 3);
  each(vectors.size(), [&](std::size_t i) {
    const double* c = components.data() + 3 * i;
    vectors[i] = {c[0], c[1], c[2]};
  });
  return vectors;
}

using Product = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// What Eigen's conjugate gradients ask of a preconditioner.
struct Preconditioner {
  Product apply;
  template <class Matrix>
  void compute(const Matrix& /*known*/) {}
  [[nodiscard]] static Eigen::ComputationInfo info() { return Eigen::Success; }
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& r) const { return apply(r); }
};

class Symmetric;

}  // namespace
}  // namespace fibrolite::fem

template <>
struct Eigen::internal::traits<fibrolite::fem::Symmetric> : Eigen::internal::traits<Eigen::SparseMatrix<double>> {};

namespace fibrolite::fem {
namespace {

/// A matrix that is known by its products alone, as Eigen wants it (its page on matrix-free solvers).
class Symmetric : public Eigen::EigenBase<Symmetric> {
 public:
  using Scalar = double;
  using RealScalar = double;
  using StorageIndex = int;
  enum { ColsAtCompileTime = Eigen::Dynamic, MaxColsAtCompileTime = Eigen::Dynamic, IsRowMajor = false };

  Symmetric(Eigen::Index size, Product product) : size_(size), product_(std::move(product)) {}
  [[nodiscard]] Eigen::Index rows() const { return size_; }
  [[nodiscard]] Eigen::Index cols() const { return size_; }
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd& v) const { return product_(v); }
  template <class Vector>
  Eigen::Product<Symmetric, Vector, Eigen::AliasFreeProduct> operator*(const Eigen::MatrixBase<Vector>& v) const {
    return {*this, v.derived()};
  }

 private:
  Eigen::Index size_;
  Product product_;
};

}  // namespace
}  // namespace fibrolite::fem

template <class Vector>
struct Eigen::internal::generic_product_impl<fibrolite::fem::Symmetric, Vector, Eigen::SparseShape, Eigen::DenseShape,
                                             Eigen::GemvProduct>
    : Eigen::internal::generic_product_impl_base<
          fibrolite::fem::Symmetric, Vector, Eigen::internal::generic_product_impl<fibrolite::fem::Symmetric, Vector>> {
  using Scalar = double;
  template <class Result>
  static void scaleAndAddTo(Result& result, const fibrolite::fem::Symmetric& matrix, const Vector& v,
                            const Scalar& alpha) {
    result += alpha * matrix.times(v);
  }
};

namespace fibrolite::fem {
namespace {

[[noreturn]] void not_reached(int iterations) {
  throw Error(Code::SolverFailed,
              std::string("the iterative solver did not reach its residual in ")
                  .append(std::to_string(iterations))
                  .append(" iterations"),
              "elasticity", "look for parts that hang by a point or an edge, or for a Poisson's ratio close to 0.5");
}

}  // namespace

struct TwoLevel::Nodes final : SmoothLevel {
  BlockRows matrix;
  std::vector<std::array<float, 9>> inverse;  // of the diagonal blocks
  Chebyshev smoother;
  std::vector<Ends> ends;
  std::vector<std::size_t> middle_begin;  // of each corner
  std::vector<std::uint32_t> middle;
  Numbers corners;
  std::optional<Cholesky> coarse;
  std::vector<float> b, x, y, d;
  std::vector<double> coarse_x;

  [[nodiscard]] std::size_t size() const override { return 3 * inverse.size(); }

  void apply(const float* from, float* to) const override {
    each(inverse.size(), [&](std::size_t i) {
      float s0 = 0, s1 = 0, s2 = 0;
      for (std::size_t k = matrix.begin[i]; k < matrix.begin[i + 1]; ++k) {
        const float* m = matrix.block[k].data();
        const float* v = from + std::size_t{3} * matrix.node[k];
        s0 += m[0] * v[0] + m[1] * v[1] + m[2] * v[2];
        s1 += m[3] * v[0] + m[4] * v[1] + m[5] * v[2];
        s2 += m[6] * v[0] + m[7] * v[1] + m[8] * v[2];
      }
      to[3 * i] = s0;
      to[3 * i + 1] = s1;
      to[3 * i + 2] = s2;
    });
  }

  void relax(const float* rhs, const float* image, float keep, float step, float* direction, float* at) const override {
    each(inverse.size(), [&](std::size_t i) {
      std::array<float, 3> r{};
      for (std::size_t k = 0; k < 3; ++k) r[k] = rhs[3 * i + k] - (image != nullptr ? image[3 * i + k] : 0.0F);
      const auto& m = inverse[i];
      for (std::size_t k = 0; k < 3; ++k) {
        float& v = direction[3 * i + k];
        const float z = step * (m[3 * k] * r[0] + m[3 * k + 1] * r[1] + m[3 * k + 2] * r[2]);
        v = keep != 0 ? keep * v + z : z;
        at[3 * i + k] += v;
      }
    });
  }

  void invert_diagonal(const System& system) {
    inverse.resize(system.mesh.nodes.size());
    each(inverse.size(), [&](std::size_t i) {
      inverse[i].fill(0);
      Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
      for (std::size_t k = matrix.begin[i]; k < matrix.begin[i + 1]; ++k) {
        if (matrix.node[k] != i) continue;
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c)
            block(r, c) = static_cast<double>(matrix.block[k][static_cast<std::size_t>(3 * r + c)]);
        }
      }
      for (int r = 0; r < 3; ++r) block(r, r) = system.free(i, static_cast<std::size_t>(r)) ? block(r, r) : 1;
      const Eigen::Matrix3d found = block.inverse();
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
          if (!system.free(i, r) || !system.free(i, c)) continue;
          inverse[i][3 * r + c] = static_cast<float>(found(static_cast<int>(r), static_cast<int>(c)));
        }
      }
    });
  }

  void find_corners(const System& system) {
    const std::size_t count = system.mesh.nodes.size();
    ends.assign(count, {none, none});
    corners.of.assign(count, {none, none, none});
    for (const auto& tet : system.mesh.tets) {
      for (std::size_t k = 0; k < 4; ++k) ends[tet[k]] = {tet[k], none};
      for (std::size_t k = 0; k < 6; ++k) ends[tet[4 + k]] = {tet[edges[k][0]], tet[edges[k][1]]};
    }
    middle_begin.assign(count + 1, 0);
    for (std::uint32_t i = 0; i < count; ++i) {
      if (ends[i][1] == none) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          corners.of[i][axis] = system.free(i, axis) ? corners.count++ : none;
      } else {
        for (const std::uint32_t end : ends[i]) ++middle_begin[end + 1];
      }
    }
    for (std::size_t i = 0; i < count; ++i) middle_begin[i + 1] += middle_begin[i];
    middle.resize(middle_begin.back());
    std::vector<std::size_t> next(middle_begin.begin(), middle_begin.end() - 1);
    for (std::uint32_t i = 0; i < count; ++i) {
      if (ends[i][1] == none) continue;
      for (const std::uint32_t end : ends[i]) middle[next[end]++] = i;
    }
  }

  /// x += P A_corners^-1 P^T (b - y).
  void correct() {
    each(inverse.size(), [&](std::size_t i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint32_t number = corners.of[i][axis];
        if (number == none) continue;
        const auto rest = [&](std::size_t node) {
          return static_cast<double>(b[3 * node + axis]) - static_cast<double>(y[3 * node + axis]);
        };
        double s = rest(i);
        for (std::size_t k = middle_begin[i]; k < middle_begin[i + 1]; ++k) s += 0.5 * rest(middle[k]);
        coarse_x[number] = s;
      }
    });
    coarse->solve(coarse_x);
    each(inverse.size(), [&](std::size_t i) {
      if (ends[i][0] == none) return;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (inverse[i][4 * axis] == 0) continue;  // held
        const auto value = [&](std::uint32_t corner) {
          return corner == none || corners.of[corner][axis] == none ? 0.0 : coarse_x[corners.of[corner][axis]];
        };
        const double moved = ends[i][1] == none ? value(ends[i][0]) : 0.5 * (value(ends[i][0]) + value(ends[i][1]));
        x[3 * i + axis] += static_cast<float>(moved);
      }
    });
  }

  /// The preconditioner's answer to a residual.
  Eigen::VectorXd answer(const Eigen::VectorXd& r) {
    each(size(), [&](std::size_t k) {
      b[k] = static_cast<float>(r[static_cast<Eigen::Index>(k)]);
      x[k] = 0;
    });
    smoother.smooth(*this, b.data(), x.data(), y.data(), d.data(), true);
    apply(x.data(), y.data());
    correct();
    smoother.smooth(*this, b.data(), x.data(), y.data(), d.data(), false);
    return Eigen::Map<const Eigen::VectorXf>(x.data(), r.size()).cast<double>();
  }
};

TwoLevel::TwoLevel(const System& system, const Context& context) : system_(system), nodes_(std::make_unique<Nodes>()) {
  Nodes& n = *nodes_;
  n.find_corners(system);
  n.coarse.emplace(corner_stiffness(system, n.corners, context));
  n.coarse_x.resize(n.corners.count);
  context.check();
  n.matrix = block_stiffness(system, context);
  n.invert_diagonal(system);
  n.smoother = {.largest = largest_eigenvalue(n, 12), .ratio = 20, .degree = 3};
  for (auto* v : {&n.b, &n.x, &n.y, &n.d}) v->resize(n.size());
}

TwoLevel::~TwoLevel() = default;

int TwoLevel::solve(const std::vector<Vec3d>& force_n, std::vector<Vec3d>& displacement, const Goal& goal,
                    const Context& context) {
  const auto free_part = [&](const std::vector<Vec3d>& v) {
    Eigen::VectorXd kept(static_cast<Eigen::Index>(3 * v.size()));
    each(v.size(), [&](std::size_t i) {
      for (int axis = 0; axis < 3; ++axis) {
        kept[static_cast<Eigen::Index>(3 * i) + axis] =
            system_.free(i, static_cast<std::size_t>(axis)) ? v[i][axis] : 0;
      }
    });
    return kept;
  };
  const auto squares = [&](const std::vector<Vec3d>& v) {
    return sum(v.size(), [&](std::size_t i) { return dot(v[i], v[i]); });
  };
  const double loaded = std::sqrt(squares(force_n));
  const Symmetric matrix(static_cast<Eigen::Index>(3 * displacement.size()), [&](const Eigen::VectorXd& p) {
    context.check();
    return free_part(internal_force(system_, nodal_vectors(p), context));
  });
  Eigen::ConjugateGradient<Symmetric, Eigen::Lower | Eigen::Upper, Preconditioner> gradients(matrix);
  int iterations = 0;
  double first = 0;
  gradients.preconditioner().apply = [&](const Eigen::VectorXd& r) {
    const double error = r.norm();
    if (!std::isfinite(error)) not_reached(iterations);
    context.progress(std::clamp(std::log(error / first) / std::log(goal.relative), 0.0, 1.0));
    return nodes_->answer(r);
  };

  // What the library takes for its residual drifts from the true one: measure, and go on from there.
  for (;;) {
    std::vector<Vec3d> rest = internal_force(system_, displacement, context);  // where nothing is free: - the reaction
    each(rest.size(), [&](std::size_t i) { rest[i] = (force_n.empty() ? Vec3d{} : force_n[i]) - rest[i]; });
    const Eigen::VectorXd wrong = free_part(rest);
    const double error = wrong.norm();
    const double held = std::sqrt(std::max(0.0, squares(rest) - error * error));
    const double wanted = goal.relative * (loaded + held) + goal.absolute_n;
    if (error <= wanted) return iterations;
    if (!std::isfinite(error) || iterations >= goal.max_iterations) not_reached(iterations);
    if (iterations == 0) first = error;
    gradients.setTolerance(0.7 * wanted / error);
    gradients.setMaxIterations(goal.max_iterations - iterations);
    const std::vector<Vec3d> step = nodal_vectors(gradients.solve(wrong));
    iterations += std::max(1, static_cast<int>(gradients.iterations()));
    each(displacement.size(), [&](std::size_t i) { displacement[i] = displacement[i] + step[i]; });
  }
}

}  // namespace fibrolite::fem
