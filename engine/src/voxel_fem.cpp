// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/voxel_fem.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "fibrolite/error.h"
#include "voxel_loads.h"
#include "voxel_model.h"
#include "voxel_multigrid.h"
#include "voxel_operator.h"
#include "voxel_stress.h"

namespace fibrolite {

struct VoxelFemResult::Impl {
  VoxelModel model;
  VoxelElement element;
  double young_mpa = 0, poisson = 0;
  std::vector<double> u;  ///< mm, three per node.

  /// The cell with material around a point: its block's nodes, the place of its lowest corner among them, and where in
  /// the cell the point is.
  struct Found {
    std::array<std::uint32_t, 729> table;
    int low;
    std::array<double, 3> s;
  };
  [[nodiscard]] std::optional<Found> find(Vec3d p) const {
    Found found{};
    std::array<int, 3> cell{};
    for (int axis = 0; axis < 3; ++axis) {
      const double at = (p[axis] + model.half_sample_mm) / model.edge_mm;
      if (!(std::abs(at) < 1e9)) return {};
      const auto k = static_cast<std::size_t>(axis);
      cell[k] = static_cast<int>(std::floor(at));
      found.s[k] = at - cell[k];
    }
    const std::uint32_t block = model.find({cell[0] & ~7, cell[1] & ~7, cell[2] & ~7});
    if (block == VoxelModel::none) return {};
    const int c = 64 * (cell[0] & 7) + 8 * (cell[1] & 7) + (cell[2] & 7);
    if (!(model.fraction[std::size_t{512} * block + static_cast<std::size_t>(c)] > 0)) return {};
    model.node_table(block, found.table.data());
    found.low = VoxelModel::lowest_corner(c);
    return found;
  }
};

std::optional<Vec3d> VoxelFemResult::displacement_mm(Vec3d p) const {
  const auto found = impl_->find(p);
  if (!found) return {};
  Vec3d sum{};
  for (unsigned a = 0; a < 8; ++a) {
    double shape = 1;
    for (unsigned k = 0; k < 3; ++k) shape *= ((a >> (2 - k)) & 1U) != 0 ? found->s[k] : 1 - found->s[k];
    const std::size_t i = std::size_t{3} * found->table[static_cast<std::size_t>(found->low + VoxelModel::corner[a])];
    sum = sum + shape * Vec3d{impl_->u[i], impl_->u[i + 1], impl_->u[i + 2]};
  }
  return sum;
}

std::optional<double> VoxelFemResult::von_mises_mpa(Vec3d p) const {
  const auto found = impl_->find(p);
  if (!found) return {};
  return von_mises(cell_stress(impl_->model, impl_->element, impl_->young_mpa, impl_->poisson, impl_->u,
                               found->table.data(), found->low));
}

namespace {

void check(const VoxelFemProblem& p) {
  const auto need = [](bool good, const char* what, const char* where) {
    if (!good) throw Error(Code::BadRecipe, what, where);
  };
  need(p.young_mpa > 0 && std::isfinite(p.young_mpa), "Young's modulus must be positive", "young_mpa");
  need(p.poisson >= 0 && p.poisson < 0.5, "Poisson's ratio must be 0 or more and less than 0.5", "poisson");
  need(p.coarsen == 1 || p.coarsen == 2 || p.coarsen == 4, "a cell is 1, 2 or 4 samples a side", "coarsen");
  need(p.residual >= 1e-12 && p.residual <= 0.1, "the residual must lie in 1e-12 to 0.1", "residual");
  need(p.max_iterations > 0, "the solver needs an iteration or more", "max_iterations");
  if (p.solid.empty()) throw Error(Code::BadRecipe, "the solid is empty", "solid");
}

using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  return chunked_sum(a.size(), [&](std::size_t from, std::size_t to) {
    double s = 0;
    for (std::size_t i = from; i < to; ++i) s += a[i] * b[i];
    return s;
  });
}

struct Solved {
  int iterations = 0;
  double residual = 0;
};

/// Conjugate gradients from x; f in units of the operator. Each direction is made conjugate to the last by the product
/// itself, so that the rounding of the preconditioner does no harm.
Solved conjugate_gradients(const VoxelOperator& k, const VoxelMultigrid& precondition, const Vector& f, Vector& x,
                           const VoxelFemProblem& problem, const Context& context) {
  const std::size_t n = x.size();
  Vector r(n), p(n, 0.0), image(n, 0.0);
  std::vector<float> r_single(n), z(n);
  const auto true_residual = [&] {
    k.apply_free(x.data(), r.data());
    for (std::size_t i = 0; i < n; ++i) r[i] = f[i] - r[i];
    k.mask(r.data());
    return std::sqrt(dot(r, r));
  };
  const double start = true_residual();
  if (start == 0) return {};
  if (!std::isfinite(start)) {
    throw Error(Code::SolverFailed, "the loads are too large for the stiffness", {}, "check the units");
  }
  Solved result;
  double norm = start, curvature = 0, best = start;
  int since_best = 0;
  while (true) {
    if (norm <= problem.residual * start) {
      norm = true_residual();
      if (norm <= problem.residual * start) break;
      curvature = 0;  // what was carried along had drifted: start again from here
    }
    if (result.iterations == problem.max_iterations || !std::isfinite(norm) || since_best > 100) {
      throw Error(Code::SolverFailed, "the voxel solver did not reach its residual",
                  std::to_string(norm / start) + " after " + std::to_string(result.iterations) + " iterations",
                  "coarsen the cells or thicken what is one voxel thin");
    }
    ++result.iterations;
    const double scale = 1 / norm;
    for (std::size_t i = 0; i < n; ++i) r_single[i] = static_cast<float>(scale * r[i]);
    precondition.apply(r_single.data(), z.data());
    double beta = 0;
    if (curvature > 0) {
      beta = -chunked_sum(n, [&](std::size_t from, std::size_t to) {
        double s = 0;
        for (std::size_t i = from; i < to; ++i) s += static_cast<double>(z[i]) * image[i];
        return s;
      }) / curvature;
    }
    chunked(n, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) p[i] = static_cast<double>(z[i]) + beta * p[i];
    });
    k.apply(p.data(), image.data());
    curvature = dot(p, image);
    const double alpha = dot(r, p) / curvature;
    if (!(curvature > 0) || !std::isfinite(alpha)) {
      throw Error(Code::SolverFailed, "the voxel solver met a motion without stiffness", {},
                  "support the solid better");
    }
    chunked(n, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        x[i] += alpha * p[i];
        r[i] -= alpha * image[i];
      }
    });
    norm = std::sqrt(dot(r, r));
    since_best = norm < best ? 0 : since_best + 1;
    best = std::min(best, norm);
    context.progress(std::clamp(std::log(norm / start) / std::log(problem.residual), 0.0, 1.0));
  }
  result.residual = norm / start;
  return result;
}

}  // namespace

VoxelFemResult solve(const VoxelFemProblem& problem, const Context& context) {
  check(problem);
  auto impl = std::make_shared<VoxelFemResult::Impl>();
  impl->young_mpa = problem.young_mpa;
  impl->poisson = problem.poisson;
  impl->element = voxel_element(problem.poisson);
  VoxelSupports supports;
  {
    VoxelPieces pieces;
    impl->model = voxel_model(problem.solid, problem.coarsen, pieces, context);
    if (impl->model.nodes() == 0) throw Error(Code::BadRecipe, "the solid has no material", "solid");
    supports = voxel_supports(impl->model, problem.supports);
    context.check();
    check_held(impl->model, pieces, supports.fixed);
  }
  const VoxelModel& model = impl->model;
  const double unit = problem.young_mpa * model.edge_mm;
  Vector& u = impl->u;
  u.assign(3 * model.nodes(), 0.0);
  for (std::size_t i = 0; i < supports.fixed.size(); ++i) u[supports.fixed[i]] = supports.value_mm[i];

  VoxelFemResult result(impl);
  const VoxelOperator stiffness(model, impl->element, supports.fixed, context);
  VoxelForces forces = voxel_forces(model, problem);
  result.pressed_n = forces.pressed_n;
  Vector f = std::move(forces.node_n);
  for (double& v : f) v /= unit;
  {
    const Context setup = context.part(0, 0.3, "multigrid");
    const VoxelMultigrid multigrid(stiffness, setup);
    const Solved solved = conjugate_gradients(stiffness, multigrid, f, u, problem, context.part(0.3, 0.95, "solve"));
    result.iterations = solved.iterations;
    result.residual = solved.residual;
  }

  Vector internal(u.size());
  stiffness.apply_free(u.data(), internal.data());
  std::array<double, 3> load{}, reaction{};
  for (std::size_t i = 0; i < f.size(); ++i) load[i % 3] += unit * f[i];
  for (const std::uint32_t i : supports.fixed) reaction[i % 3] += unit * (internal[i] - f[i]);
  result.load_n = {load[0], load[1], load[2]};
  result.reaction_n = {reaction[0], reaction[1], reaction[2]};
  result.compliance_n_mm = unit * dot(u, f);
  internal = {};
  f = {};

  result.nodes = static_cast<std::int64_t>(model.nodes());
  for (const float c : model.fraction) {
    if (!(c > 0)) continue;
    ++result.cells;
    result.volume_mm3 += static_cast<double>(c);
  }
  result.volume_mm3 *= model.edge_mm * model.edge_mm * model.edge_mm;
  double largest = 0;
  for (std::size_t i = 0; i < u.size(); i += 3) {
    largest = std::max(largest, u[i] * u[i] + u[i + 1] * u[i + 1] + u[i + 2] * u[i + 2]);
  }
  result.max_displacement_mm = std::sqrt(largest);
  StressSummary stress = measure_stress(model, impl->element, problem, u, context);
  result.max_von_mises_mpa = stress.whole.max_von_mises_mpa;
  result.p99_von_mises_mpa = stress.whole.p99_von_mises_mpa;
  result.peak_von_mises_mpa = stress.whole.peak_von_mises_mpa;
  result.weakest_mm = stress.whole.weakest_mm;
  result.places = std::move(stress.places);
  if (!std::isfinite(result.compliance_n_mm + result.max_displacement_mm + result.max_von_mises_mpa)) {
    throw Error(Code::SolverFailed, "the loads are too large for the stiffness", {}, "check the units");
  }
  context.progress(1);
  return result;
}

}  // namespace fibrolite
