// SPDX-License-Identifier: GPL-3.0-or-later
#include "elasticity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "cholesky.h"
#include "fibrolite/box.h"
#include "fibrolite/disjoint_sets.h"
#include "fibrolite/error.h"
#include "stiffness.h"
#include "tet_element.h"
#include "two_level.h"

namespace fibrolite::fem {
namespace {

/// Every connected piece of the mesh must be held against all six rigid motions; said before the solver stumbles over
/// it.
void require_held(const System& system, const std::vector<Fixed>& fixed) {
  const TetMesh& mesh = system.mesh;
  DisjointSets sets(mesh.nodes.size());
  for (const auto& tet : mesh.tets)
    for (const std::uint32_t node : tet) sets.join(tet[0], node);
  struct Piece {
    Box3d box;
    Eigen::Matrix<double, 6, 6> held = Eigen::Matrix<double, 6, 6>::Zero();
  };
  std::vector<Piece> pieces;
  std::vector<std::uint32_t> piece(mesh.nodes.size(), none);
  for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!system.incidence.used(node)) continue;
    const std::uint32_t r = sets.root(node);
    if (piece[r] == none) {
      piece[r] = static_cast<std::uint32_t>(pieces.size());
      pieces.emplace_back();
    }
    piece[node] = piece[r];
    pieces[piece[node]].box.include(mesh.nodes[node]);
  }
  for (const Fixed& f : fixed) {
    if (piece[f.node] == none) continue;
    Piece& p = pieces[piece[f.node]];
    const Vec3d arm = (2 / p.box.longest_side()) * (mesh.nodes[f.node] - p.box.center());
    const Vec3d unit{f.axis == 0 ? 1.0 : 0.0, f.axis == 1 ? 1.0 : 0.0, f.axis == 2 ? 1.0 : 0.0};
    const Vec3d turn = cross(arm, unit);
    Eigen::Matrix<double, 6, 1> row;
    row << unit.x, unit.y, unit.z, turn.x, turn.y, turn.z;
    p.held += row * row.transpose();
  }
  for (const Piece& p : pieces) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> modes(p.held, Eigen::EigenvaluesOnly);
    if (modes.eigenvalues()[0] > 1e-9 * std::max(1.0, modes.eigenvalues()[5])) continue;
    const Vec3d c = p.box.center();
    const auto mm = [](double v) { return std::to_string(std::lround(v)); };
    throw Error(Code::SolverFailed, "a piece of the body is not held and can float away",
                "elasticity, piece at (" + mm(c.x) + ", " + mm(c.y) + ", " + mm(c.z) + ") mm",
                "join it to the rest or give it a support");
  }
}

double component(Vec3d v, std::size_t axis) { return v[static_cast<int>(axis)]; }
void set_component(Vec3d& v, std::size_t axis, double value) { (axis == 0 ? v.x : axis == 1 ? v.y : v.z) = value; }

/// What rounding makes of the forces of a rigid motion is in proportion to this.
double rigid_force_n(const Material& material, double moved_mm, const Box3d& box) {
  return material.young_mpa * moved_mm * box.longest_side();
}

/// Judge a displacement without the matrix it came from.
Solution finish(const System& system, const Material& material, std::vector<Vec3d> displacement, const LoadCase& load,
                const Context& context) {
  const TetMesh& mesh = system.mesh;
  Solution solution;
  const std::vector<Vec3d> internal = internal_force(system, displacement, context);
  solution.reaction_n.resize(mesh.nodes.size());
  double wrong = 0, loaded = 0, held = 0, moved = 0, borne = 0;
  Box3d box;
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!system.incidence.used(node)) continue;
    box.include(mesh.nodes[node]);
    moved = std::max(moved, norm(displacement[node]));
    const Vec3d external = load.force_n.empty() ? Vec3d{} : load.force_n[node];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double f = component(external, axis), q = component(internal[node], axis);
      loaded += f * f;
      if (!system.free(node, axis)) {
        set_component(solution.reaction_n[node], axis, q - f);
        held += (q - f) * (q - f);
      } else {
        wrong += (q - f) * (q - f);
      }
    }
    solution.imbalance_n = solution.imbalance_n + external + solution.reaction_n[node];
    borne += norm(external) + norm(solution.reaction_n[node]);
  }
  // A pure rigid motion has no forces but those of rounding: they are no fault of the solver.
  const double rounding = 1e-7 * rigid_force_n(material, moved, box);
  const double scale = std::sqrt(loaded) + std::sqrt(held) + rounding;
  solution.residual = scale > 0 ? std::sqrt(wrong) / scale : 0;
  const bool balanced = norm(solution.imbalance_n) <= 1e-6 * (borne + rounding);
  if (!(solution.residual < 1e-6) || !balanced) {
    throw Error(Code::SolverFailed, "the linear solver's answer does not satisfy the equations", "elasticity",
                "look for parts that hang by a point or an edge");
  }
  solution.centroid_stress.resize(mesh.tets.size());
  parallel(mesh.tets.size(), context, [&](std::size_t t) {
    solution.centroid_stress[t] =
        stress_at(Element(mesh, t).gradients(centroid.front()), system.lame, nodal(mesh, t, displacement));
  });
  solution.displacement_mm = std::move(displacement);
  return solution;
}

/// Both ways start from the prescribed displacements alone and add what the unknowns answer.
void factorise(const System& system, const std::vector<LoadCase>& cases, std::vector<std::vector<Vec3d>>& displacement,
               const Context& context) {
  SymmetricMatrix matrix = stiffness(system, context);
  context.progress(0.3);
  context.check();
  const Cholesky factor(std::move(matrix));
  std::vector<double> b(system.unknowns.count);
  const auto each_unknown = [&](const auto& visit) {
    for (std::size_t node = 0; node < system.mesh.nodes.size(); ++node) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (system.free(node, axis)) visit(node, axis, b[system.unknowns.of[node][axis]]);
      }
    }
  };
  for (std::size_t s = 0; s < cases.size(); ++s) {
    context.check();
    const std::vector<Vec3d>& force = cases[s].force_n;
    const std::vector<Vec3d> pull = internal_force(system, displacement[s], context);
    each_unknown([&](std::size_t node, std::size_t axis, double& value) {
      value = (force.empty() ? 0 : component(force[node], axis)) - component(pull[node], axis);
    });
    factor.solve(b);
    each_unknown([&](std::size_t node, std::size_t axis, const double& value) {
      set_component(displacement[s][node], axis, value);
    });
  }
}

std::vector<int> iterate(const System& system, const Material& material, const std::vector<LoadCase>& cases,
                         std::vector<std::vector<Vec3d>>& displacement, const Context& context) {
  TwoLevel solver(system, context);
  context.progress(0.2);
  Box3d box;
  for (std::size_t node = 0; node < system.mesh.nodes.size(); ++node) {
    if (system.incidence.used(node)) box.include(system.mesh.nodes[node]);
  }
  std::vector<int> iterations;
  for (std::size_t s = 0; s < cases.size(); ++s) {
    double moved = 0;
    for (const Vec3d u : displacement[s]) moved = std::max(moved, norm(u));
    const auto share = [&](std::size_t done) {
      return 0.2 + 0.8 * static_cast<double>(done) / static_cast<double>(cases.size());
    };
    iterations.push_back(solver.solve(cases[s].force_n, displacement[s],
                                      {.absolute_n = 1e-14 * rigid_force_n(material, moved, box)},
                                      context.part(share(s), share(s + 1), "")));
  }
  return iterations;
}

}  // namespace

double normal_stress(const Stress& s, Vec3d n) {
  return s[0] * n.x * n.x + s[1] * n.y * n.y + s[2] * n.z * n.z +
         2 * (s[3] * n.x * n.y + s[4] * n.y * n.z + s[5] * n.z * n.x);
}

std::vector<Solution> solve(const TetMesh& mesh, const Material& material, const std::vector<Fixed>& fixed,
                            const std::vector<LoadCase>& cases, const SolveParams& params, const Context& context) {
  if (!(material.young_mpa > 0) || !(material.poisson >= 0 && material.poisson < 0.499)) {
    throw Error(Code::BadRecipe, "Young's modulus must be positive and Poisson's ratio from 0 to below 0.499",
                "material.young_mpa, material.poisson");
  }
  context.check();
  const System system(mesh, material, fixed);
  require_held(system, fixed);

  std::vector<std::vector<Vec3d>> displacement(cases.size(), std::vector<Vec3d>(mesh.nodes.size()));
  for (std::size_t s = 0; s < cases.size(); ++s) {
    for (std::size_t k = 0; k < cases[s].fixed_mm.size(); ++k) {
      set_component(displacement[s][fixed[k].node], static_cast<std::size_t>(fixed[k].axis), cases[s].fixed_mm[k]);
    }
  }
  std::vector<int> iterations(cases.size(), 0);
  if (system.unknowns.count > params.direct_limit) {
    iterations = iterate(system, material, cases, displacement, context.part(0, 0.9, ""));
  } else if (system.unknowns.count > 0) {
    factorise(system, cases, displacement, context);
  }
  context.progress(0.9);
  std::vector<Solution> solutions;
  for (std::size_t s = 0; s < cases.size(); ++s) {
    solutions.push_back(finish(system, material, std::move(displacement[s]), cases[s], context));
    solutions.back().iterations = iterations[s];
  }
  context.progress(1);
  return solutions;
}

std::vector<Stress> nodal_stress(const TetMesh& mesh, const Material& material,
                                 const std::vector<Vec3d>& displacement_mm) {
  const Lame lame(material);
  const Incidence incidence(mesh);
  std::vector<Stress> result(mesh.nodes.size(), Stress{});
  parallel(mesh.nodes.size(), {}, [&](std::size_t node) {
    double weight = 0;
    for (std::size_t k = incidence.first[node]; k < incidence.first[node + 1]; ++k) {
      const auto [t, local] = incidence.uses[k];
      const Element e(mesh, t);
      Barycentric at{0, 0, 0, 0};
      if (local < 4) {
        at[local] = 1;
      } else {
        at[edges[local - 4][0]] = at[edges[local - 4][1]] = 0.5;
      }
      const Stress s = stress_at(e.gradients(at), lame, nodal(mesh, t, displacement_mm));
      for (std::size_t c = 0; c < s.size(); ++c) result[node][c] += e.volume * s[c];
      weight += e.volume;
    }
    for (double& c : result[node]) c = weight > 0 ? c / weight : 0;
  });
  return result;
}

std::array<double, 10> shape_functions(const std::array<double, 4>& l) {
  std::array<double, 10> n{};
  for (std::size_t i = 0; i < 4; ++i) n[i] = l[i] * (2 * l[i] - 1);
  for (std::size_t k = 0; k < 6; ++k) n[4 + k] = 4 * l[edges[k][0]] * l[edges[k][1]];
  return n;
}

std::array<double, 6> face_shape_functions(const std::array<double, 3>& l) {
  return {l[0] * (2 * l[0] - 1), l[1] * (2 * l[1] - 1), l[2] * (2 * l[2] - 1),
          4 * l[0] * l[1],       4 * l[1] * l[2],       4 * l[2] * l[0]};
}

}  // namespace fibrolite::fem
