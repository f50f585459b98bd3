// SPDX-License-Identifier: GPL-3.0-or-later
#include "elasticity.h"

#include <cblas.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/CholmodSupport>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <string>

#include "fibrolite/box.h"
#include "fibrolite/error.h"

// Of libgomp, which CHOLMOD brings; its header belongs to the compiler and is not everywhere.
extern "C" void omp_set_max_active_levels(int levels);
extern "C" int omp_get_max_active_levels();

namespace fibrolite::fem {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
constexpr std::array<std::array<std::size_t, 2>, 6> edges{{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
using Gradients = std::array<Vec3d, 10>;
using Barycentric = std::array<double, 4>;

/// The four-point rule of degree 2: exact for the stiffness of straight-sided ten-node tetrahedra. Weights are 1/4.
constexpr double inner = 0.58541019662496845, outer = 0.13819660112501051;
constexpr std::array<Barycentric, 4> rule{{{inner, outer, outer, outer},
                                           {outer, inner, outer, outer},
                                           {outer, outer, inner, outer},
                                           {outer, outer, outer, inner}}};
constexpr Barycentric centroid{0.25, 0.25, 0.25, 0.25};

struct Element {
  double volume = 0;
  std::array<Vec3d, 4> grad;  ///< Of the barycentric coordinates, constant.
};

Element element(const TetMesh& mesh, std::size_t t) {
  const auto& n = mesh.tets[t];
  const Vec3d a = mesh.nodes[n[0]];
  const Vec3d u = mesh.nodes[n[1]] - a, v = mesh.nodes[n[2]] - a, w = mesh.nodes[n[3]] - a;
  const double six_volumes = dot(cross(u, v), w);
  Element result;
  result.volume = six_volumes / 6;
  result.grad[1] = cross(v, w) / six_volumes;
  result.grad[2] = cross(w, u) / six_volumes;
  result.grad[3] = cross(u, v) / six_volumes;
  result.grad[0] = -(result.grad[1] + result.grad[2] + result.grad[3]);
  return result;
}

Gradients gradients(const Element& e, const Barycentric& at) {
  Gradients g;
  for (std::size_t i = 0; i < 4; ++i) g[i] = (4 * at[i] - 1) * e.grad[i];
  for (std::size_t k = 0; k < 6; ++k) {
    const auto [i, j] = edges[k];
    g[4 + k] = 4 * (at[i] * e.grad[j] + at[j] * e.grad[i]);
  }
  return g;
}

struct Lame {
  double lambda, mu;
  explicit Lame(const Material& m)
      : lambda(m.young_mpa * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson))),
        mu(m.young_mpa / (2 * (1 + m.poisson))) {}
};

Stress stress_at(const TetMesh& mesh, std::size_t t, const Gradients& g, const Lame& lame,
                 const std::vector<Vec3d>& displacement) {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
  for (std::size_t i = 0; i < 10; ++i) {
    const Vec3d u = displacement[mesh.tets[t][i]];
    xx += g[i].x * u.x;
    yy += g[i].y * u.y;
    zz += g[i].z * u.z;
    xy += g[i].y * u.x + g[i].x * u.y;
    yz += g[i].z * u.y + g[i].y * u.z;
    zx += g[i].x * u.z + g[i].z * u.x;
  }
  const double pressure = lame.lambda * (xx + yy + zz);
  return {pressure + 2 * lame.mu * xx,
          pressure + 2 * lame.mu * yy,
          pressure + 2 * lame.mu * zz,
          lame.mu * xy,
          lame.mu * yz,
          lame.mu * zx};
}

/// Which tetrahedra a node belongs to, and as which of their ten; in the order of the tetrahedra, so that every sum
/// over them has a fixed order.
struct Incidence {
  std::vector<std::size_t> first;  // per node, one more at the end
  struct Use {
    std::uint32_t tet;
    std::uint32_t local;
  };
  std::vector<Use> uses;

  explicit Incidence(const TetMesh& mesh) : first(mesh.nodes.size() + 1, 0), uses(10 * mesh.tets.size()) {
    for (const auto& tet : mesh.tets) {
      for (const std::uint32_t node : tet) ++first[node + 1];
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
      for (std::uint32_t i = 0; i < 10; ++i) uses[next[mesh.tets[t][i]]++] = {t, i};
    }
  }
  [[nodiscard]] bool used(std::size_t node) const { return first[node] != first[node + 1]; }
};

template <class Body>
void parallel(std::size_t count, const Context& context, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
    context.check();
    for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
  });
}

/// Forces that the stresses of a displacement put on the nodes: K u without K.
std::vector<Vec3d> internal_force(const TetMesh& mesh, const Incidence& incidence, const Lame& lame,
                                  const std::vector<Vec3d>& displacement, const Context& context) {
  std::vector<std::array<Vec3d, 10>> of_tet(mesh.tets.size());
  parallel(mesh.tets.size(), context, [&](std::size_t t) {
    const Element e = element(mesh, t);
    for (const Barycentric& at : rule) {
      const Gradients g = gradients(e, at);
      const Stress s = stress_at(mesh, t, g, lame, displacement);
      for (std::size_t i = 0; i < 10; ++i) {
        const Vec3d f{g[i].x * s[0] + g[i].y * s[3] + g[i].z * s[5], g[i].x * s[3] + g[i].y * s[1] + g[i].z * s[4],
                      g[i].x * s[5] + g[i].y * s[4] + g[i].z * s[2]};
        of_tet[t][i] = of_tet[t][i] + (e.volume / 4) * f;
      }
    }
  });
  std::vector<Vec3d> force(mesh.nodes.size());
  parallel(mesh.nodes.size(), context, [&](std::size_t node) {
    for (std::size_t k = incidence.first[node]; k < incidence.first[node + 1]; ++k) {
      force[node] = force[node] + of_tet[incidence.uses[k].tet][incidence.uses[k].local];
    }
  });
  return force;
}

/// Numbers of the unknowns: three per node, `none` where the displacement is prescribed.
struct Unknowns {
  std::vector<std::array<std::uint32_t, 3>> number;
  std::uint32_t count = 0;

  Unknowns(const TetMesh& mesh, const Incidence& incidence, const std::vector<Fixed>& fixed)
      : number(mesh.nodes.size(), {0, 0, 0}) {
    for (const Fixed& f : fixed) number[f.node][static_cast<std::size_t>(f.axis)] = none;
    for (std::size_t node = 0; node < number.size(); ++node) {
      for (std::uint32_t& n : number[node]) n = n == none || !incidence.used(node) ? none : count++;
    }
  }
};

/// Every connected piece of the mesh must be held against all six rigid motions; said before the solver stumbles over
/// it.
void require_held(const TetMesh& mesh, const Incidence& incidence, const std::vector<Fixed>& fixed) {
  std::vector<std::uint32_t> root(mesh.nodes.size());
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](std::uint32_t n) {
    while (root[n] != n) n = root[n] = root[root[n]];
    return n;
  };
  for (const auto& tet : mesh.tets) {
    for (const std::uint32_t node : tet) root[std::max(find(tet[0]), find(node))] = std::min(find(tet[0]), find(node));
  }
  struct Piece {
    Box3d box;
    Eigen::Matrix<double, 6, 6> held = Eigen::Matrix<double, 6, 6>::Zero();
  };
  std::vector<Piece> pieces;
  std::vector<std::uint32_t> piece(mesh.nodes.size(), none);
  for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!incidence.used(node)) continue;
    const std::uint32_t r = find(node);
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

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

/// Lower triangle of the stiffness of the unknowns, and what prescribed displacements pull on them (subtracted from
/// `loads`). Row by row of nodes, in parallel, each sum in the order of the tetrahedra: the same bits on any number of
/// threads.
Sparse assemble(const TetMesh& mesh, const Incidence& incidence, const Lame& lame, const Unknowns& unknowns,
                const std::vector<std::vector<Vec3d>>& prescribed, Eigen::MatrixXd& loads, const Context& context) {
  const std::size_t nodes = mesh.nodes.size();
  std::vector<std::vector<std::uint32_t>> neighbours(nodes);
  parallel(nodes, context, [&](std::size_t i) {
    auto& list = neighbours[i];
    for (std::size_t k = incidence.first[i]; k < incidence.first[i + 1]; ++k) {
      const auto& tet = mesh.tets[incidence.uses[k].tet];
      list.insert(list.end(), tet.begin(), tet.end());
    }
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  });

  Sparse matrix(unknowns.count, unknowns.count);
  std::vector<std::size_t> length(unknowns.count, 0);
  parallel(nodes, context, [&](std::size_t i) {
    for (const std::uint32_t column : unknowns.number[i]) {
      if (column == none) continue;
      for (const std::uint32_t j : neighbours[i]) {
        for (const std::uint32_t row : unknowns.number[j]) length[column] += row != none && row >= column ? 1 : 0;
      }
    }
  });
  const std::size_t entries = std::accumulate(length.begin(), length.end(), std::size_t{0});
  if (entries > std::numeric_limits<int>::max()) {
    throw Error(Code::SolverFailed, "the mesh is too fine for a direct solver", "elasticity", "take fewer tetrahedra");
  }
  matrix.resizeNonZeros(static_cast<Eigen::Index>(entries));
  int* begin = matrix.outerIndexPtr();
  begin[0] = 0;
  for (std::size_t c = 0; c < length.size(); ++c) begin[c + 1] = begin[c] + static_cast<int>(length[c]);

  parallel(nodes, context, [&](std::size_t i) {
    const auto& list = neighbours[i];
    std::vector<std::array<double, 9>> blocks(list.size(), std::array<double, 9>{});
    for (std::size_t k = incidence.first[i]; k < incidence.first[i + 1]; ++k) {
      const auto [t, a] = incidence.uses[k];
      const Element e = element(mesh, t);
      std::array<std::size_t, 10> slot{};
      for (std::size_t b = 0; b < 10; ++b) {
        slot[b] = static_cast<std::size_t>(std::lower_bound(list.begin(), list.end(), mesh.tets[t][b]) - list.begin());
      }
      for (const Barycentric& at : rule) {
        const Gradients g = gradients(e, at);
        const Vec3d ga = (e.volume / 4) * g[a];
        for (std::size_t b = 0; b < 10; ++b) {
          const Vec3d gb = g[b];
          const double shear = lame.mu * dot(ga, gb);
          auto& block = blocks[slot[b]];  // row: component of b, column: component of a
          for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) {
              block[static_cast<std::size_t>(3 * r + c)] +=
                  lame.lambda * gb[r] * ga[c] + lame.mu * ga[r] * gb[c] + (r == c ? shear : 0);
            }
          }
        }
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t column = unknowns.number[i][c];
      if (column == none) continue;
      int at = begin[column];
      for (std::size_t k = 0; k < list.size(); ++k) {
        for (std::size_t r = 0; r < 3; ++r) {
          const std::uint32_t row = unknowns.number[list[k]][r];
          const double value = blocks[k][3 * r + c];
          if (row != none) {
            if (row < column) continue;
            matrix.innerIndexPtr()[at] = static_cast<int>(row);
            matrix.valuePtr()[at++] = value;
          } else {
            for (std::size_t s = 0; s < prescribed.size(); ++s) {
              loads(column, static_cast<Eigen::Index>(s)) -= value * prescribed[s][list[k]][static_cast<int>(r)];
            }
          }
        }
      }
    }
  });
  return matrix;
}

/// While it lives, OpenMP regions of this thread run on this thread alone. Debian's CHOLMOD asks for four threads in
/// each of its many small regions; beside TBB's own they wait for each other far longer than they work (27 s for 6 s of
/// work, measured).
class SerialOpenMp {
 public:
  SerialOpenMp() : before_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }
  ~SerialOpenMp() { omp_set_max_active_levels(before_); }
  SerialOpenMp(const SerialOpenMp&) = delete;
  SerialOpenMp& operator=(const SerialOpenMp&) = delete;

 private:
  int before_;
};

Eigen::MatrixXd cholesky_solve(const Sparse& matrix, const Eigen::MatrixXd& loads) {
  const SerialOpenMp serial;
  openblas_set_num_threads(1);
  Eigen::CholmodSupernodalLLT<Sparse, Eigen::Lower> solver;
  solver.cholmod().print = 0;  // it would write its complaints to stdout
  solver.cholmod().nmethods =
      1;  // nested dissection wins on volume meshes: trying others first costs a third of the time
  solver.cholmod().method[0].ordering = CHOLMOD_METIS;
  {
    // METIS draws its random numbers from one state of the whole process: two orderings at once would spoil each
    // other's bits.
    static std::mutex one_ordering_at_a_time;
    const std::lock_guard lock(one_ordering_at_a_time);
    solver.analyzePattern(matrix);
  }
  if (solver.info() == Eigen::Success) solver.factorize(matrix);
  if (solver.info() != Eigen::Success) {
    throw Error(Code::SolverFailed, "the stiffness matrix is singular or does not fit the memory", "elasticity",
                "look for parts that hang by a point or an edge");
  }
  return solver.solve(loads);
}

double component(Vec3d v, std::size_t axis) { return v[static_cast<int>(axis)]; }
void set_component(Vec3d& v, std::size_t axis, double value) { (axis == 0 ? v.x : axis == 1 ? v.y : v.z) = value; }

/// Judge a displacement without the matrix it came from.
Solution finish(const TetMesh& mesh, const Incidence& incidence, const Material& material, const Unknowns& unknowns,
                std::vector<Vec3d> displacement, const LoadCase& load, const Context& context) {
  const Lame lame(material);
  Solution solution;
  const std::vector<Vec3d> internal = internal_force(mesh, incidence, lame, displacement, context);
  solution.reaction_n.resize(mesh.nodes.size());
  double wrong = 0, loaded = 0, held = 0, moved = 0;
  Box3d box;
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!incidence.used(node)) continue;
    box.include(mesh.nodes[node]);
    moved = std::max(moved, norm(displacement[node]));
    const Vec3d external = load.force_n.empty() ? Vec3d{} : load.force_n[node];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double f = component(external, axis), q = component(internal[node], axis);
      loaded += f * f;
      if (unknowns.number[node][axis] == none) {
        set_component(solution.reaction_n[node], axis, q - f);
        held += (q - f) * (q - f);
      } else {
        wrong += (q - f) * (q - f);
      }
    }
    solution.imbalance_n = solution.imbalance_n + external + solution.reaction_n[node];
  }
  // A pure rigid motion has no forces but those of rounding: they are no fault of the solver.
  const double rounding = 1e-7 * material.young_mpa * moved * box.longest_side();
  const double scale = std::sqrt(loaded) + std::sqrt(held) + rounding;
  solution.residual = scale > 0 ? std::sqrt(wrong) / scale : 0;
  if (!(solution.residual < 1e-6)) {
    throw Error(Code::SolverFailed, "the linear solver's answer does not satisfy the equations", "elasticity",
                "look for parts that hang by a point or an edge");
  }
  solution.centroid_stress.resize(mesh.tets.size());
  parallel(mesh.tets.size(), context, [&](std::size_t t) {
    solution.centroid_stress[t] = stress_at(mesh, t, gradients(element(mesh, t), centroid), lame, displacement);
  });
  solution.displacement_mm = std::move(displacement);
  return solution;
}

}  // namespace

double normal_stress(const Stress& s, Vec3d n) {
  return s[0] * n.x * n.x + s[1] * n.y * n.y + s[2] * n.z * n.z +
         2 * (s[3] * n.x * n.y + s[4] * n.y * n.z + s[5] * n.z * n.x);
}

std::vector<Solution> solve(const TetMesh& mesh, const Material& material, const std::vector<Fixed>& fixed,
                            const std::vector<LoadCase>& cases, const Context& context) {
  if (!(material.young_mpa > 0) || !(material.poisson >= 0 && material.poisson < 0.499)) {
    throw Error(Code::BadRecipe, "Young's modulus must be positive and Poisson's ratio from 0 to below 0.499",
                "material.young_mpa, material.poisson");
  }
  context.check();
  const Lame lame(material);
  const Incidence incidence(mesh);
  require_held(mesh, incidence, fixed);
  const Unknowns unknowns(mesh, incidence, fixed);

  std::vector<std::vector<Vec3d>> displacement(cases.size(), std::vector<Vec3d>(mesh.nodes.size()));
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(unknowns.count, static_cast<Eigen::Index>(cases.size()));
  for (std::size_t s = 0; s < cases.size(); ++s) {
    for (std::size_t k = 0; k < cases[s].fixed_mm.size(); ++k) {
      set_component(displacement[s][fixed[k].node], static_cast<std::size_t>(fixed[k].axis), cases[s].fixed_mm[k]);
    }
    for (std::size_t node = 0; node < cases[s].force_n.size(); ++node) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint32_t row = unknowns.number[node][axis];
        if (row != none) loads(row, static_cast<Eigen::Index>(s)) = component(cases[s].force_n[node], axis);
      }
    }
  }
  if (unknowns.count > 0) {
    const Sparse matrix = assemble(mesh, incidence, lame, unknowns, displacement, loads, context);
    context.progress(0.3);
    context.check();
    const Eigen::MatrixXd answer = cholesky_solve(matrix, loads);
    for (std::size_t s = 0; s < cases.size(); ++s) {
      for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const std::uint32_t row = unknowns.number[node][axis];
          if (row != none) set_component(displacement[s][node], axis, answer(row, static_cast<Eigen::Index>(s)));
        }
      }
    }
  }
  context.progress(0.9);
  std::vector<Solution> solutions;
  for (std::size_t s = 0; s < cases.size(); ++s) {
    solutions.push_back(finish(mesh, incidence, material, unknowns, std::move(displacement[s]), cases[s], context));
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
      const Element e = element(mesh, t);
      Barycentric at{0, 0, 0, 0};
      if (local < 4) {
        at[local] = 1;
      } else {
        at[edges[local - 4][0]] = at[edges[local - 4][1]] = 0.5;
      }
      const Stress s = stress_at(mesh, t, gradients(e, at), lame, displacement_mm);
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
