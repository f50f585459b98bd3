// SPDX-License-Identifier: GPL-3.0-or-later
#include "two_level.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Dense>
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

void TwoLevel::precondition(const std::vector<Vec3d>& r, std::vector<Vec3d>& z) {
  Nodes& n = *nodes_;
  each(r.size(), [&](std::size_t i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      n.b[3 * i + axis] = static_cast<float>(r[i][static_cast<int>(axis)]);
      n.x[3 * i + axis] = 0;
    }
  });
  n.smoother.smooth(n, n.b.data(), n.x.data(), n.y.data(), n.d.data(), true);
  n.apply(n.x.data(), n.y.data());
  n.correct();
  n.smoother.smooth(n, n.b.data(), n.x.data(), n.y.data(), n.d.data(), false);
  const auto value = [&](std::size_t k) { return static_cast<double>(n.x[k]); };
  each(r.size(), [&](std::size_t i) { z[i] = {value(3 * i), value(3 * i + 1), value(3 * i + 2)}; });
}

int TwoLevel::solve(const std::vector<Vec3d>& force_n, std::vector<Vec3d>& displacement, const Goal& goal,
                    const Context& context) {
  const std::size_t count = displacement.size();
  const auto free_part = [&](std::size_t i, Vec3d v) {
    return Vec3d{system_.free(i, 0) ? v.x : 0, system_.free(i, 1) ? v.y : 0, system_.free(i, 2) ? v.z : 0};
  };
  const auto inner_product = [&](const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
    return sum(count, [&](std::size_t i) { return dot(a[i], b[i]); });
  };
  std::vector<Vec3d> rest(count);  // of all components: where nothing is free, minus the reaction
  const auto true_rest = [&] {
    rest = internal_force(system_, displacement, context);
    each(count, [&](std::size_t i) { rest[i] = (force_n.empty() ? Vec3d{} : force_n[i]) - rest[i]; });
  };
  const double loaded = force_n.empty() ? 0 : std::sqrt(inner_product(force_n, force_n));
  double error = 0;
  const auto reached = [&] {
    const double all = inner_product(rest, rest);
    const double wrong = sum(count, [&](std::size_t i) {
      const Vec3d r = free_part(i, rest[i]);
      return dot(r, r);
    });
    error = std::sqrt(wrong);
    return error <= goal.relative * (loaded + std::sqrt(std::max(0.0, all - wrong))) + goal.absolute_n;
  };

  std::vector<Vec3d> r(count), before(count), z(count), p(count);
  const auto fresh = [&] { each(count, [&](std::size_t i) { r[i] = free_part(i, rest[i]); }); };
  true_rest();
  fresh();
  double first = 0, rz = 0;
  for (int iteration = 0;; ++iteration) {
    if (reached()) {
      true_rest();  // the running one has drifted
      if (reached()) return iteration;
      fresh();
      rz = 0;
    }
    if (iteration == 0) first = error;
    if (iteration == goal.max_iterations || !std::isfinite(error)) {
      throw Error(Code::SolverFailed,
                  "the iterative solver did not reach its residual in " + std::to_string(iteration) + " iterations",
                  "elasticity",
                  "look for parts that hang by a point or an edge, or for a Poisson's ratio close to 0.5");
    }
    context.check();
    context.progress(std::clamp(std::log(error / first) / std::log(goal.relative), 0.0, 1.0));
    precondition(r, z);
    // Single precision makes the preconditioner a little different each time: this form of the next direction does not
    // mind.
    const double fresh_part = inner_product(z, r), stale = rz > 0 ? inner_product(z, before) : 0;
    const double keep = rz > 0 ? (fresh_part - stale) / rz : 0;
    rz = fresh_part;
    each(count, [&](std::size_t i) { p[i] = z[i] + keep * p[i]; });
    const std::vector<Vec3d> image = internal_force(system_, p, context);
    const double step = rz / inner_product(p, image);
    std::swap(before, r);
    each(count, [&](std::size_t i) {
      displacement[i] = displacement[i] + step * p[i];
      rest[i] = rest[i] - step * image[i];
      r[i] = free_part(i, rest[i]);
    });
  }
}

}  // namespace fibrolite::fem
