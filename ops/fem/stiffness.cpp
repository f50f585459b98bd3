// SPDX-License-Identifier: GPL-3.0-or-later
#include "stiffness.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "fibrolite/error.h"

namespace fibrolite::fem {
namespace {

/// Row: component of the one node; column: of the other.
using Block = std::array<double, 9>;

/// Nodes that share a tetrahedron with each node, rising, among the first `Locals` of its nodes.
template <std::size_t Locals>
std::vector<std::vector<std::uint32_t>> neighbours(const System& system, const Context& context) {
  std::vector<std::vector<std::uint32_t>> result(system.mesh.nodes.size());
  parallel(result.size(), context, [&](std::size_t i) {
    auto& list = result[i];
    for (const Incidence::Use use : system.incidence.of(i)) {
      if (use.local >= Locals) continue;
      const auto& tet = system.mesh.tets[use.tet];
      list.insert(list.end(), tet.begin(), tet.begin() + Locals);
    }
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  });
  return result;
}

/// What a unit displacement of node i does to its neighbours: the blocks (neighbour, i). `of_tet(t, a)` are those of
/// one tetrahedron for its node a; each sum runs in the order of the tetrahedra.
template <std::size_t Locals, class OfTet>
std::vector<Block> column_of_node(const System& system, const std::vector<std::uint32_t>& list, std::size_t i,
                                  const OfTet& of_tet) {
  std::vector<Block> sum(list.size(), Block{});
  for (const Incidence::Use use : system.incidence.of(i)) {
    if (use.local >= Locals) continue;
    const std::array<Block, Locals> blocks = of_tet(use.tet, use.local);
    for (std::size_t b = 0; b < Locals; ++b) {
      const auto at = std::lower_bound(list.begin(), list.end(), system.mesh.tets[use.tet][b]) - list.begin();
      Block& to = sum[static_cast<std::size_t>(at)];
      for (std::size_t k = 0; k < 9; ++k) to[k] += blocks[b][k];
    }
  }
  return sum;
}

std::array<Block, 10> quadratic(const System& system, std::size_t t, std::size_t a) {
  const Element e(system.mesh, t);
  std::array<Block, 10> blocks{};
  for (const Barycentric& at : four_points) {
    const Gradients g = e.gradients(at);
    const Vec3d ga = (e.volume / 4) * g[a];
    for (std::size_t b = 0; b < 10; ++b) {
      const Vec3d gb = g[b];
      const double shear = system.lame.mu * dot(ga, gb);
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
          blocks[b][static_cast<std::size_t>(3 * r + c)] +=
              system.lame.lambda * gb[r] * ga[c] + system.lame.mu * ga[r] * gb[c] + (r == c ? shear : 0);
        }
      }
    }
  }
  return blocks;
}

std::array<Block, 4> linear(const System& system, std::size_t t, std::size_t a) {
  const Element e(system.mesh, t);
  const auto& nodes = system.mesh.tets[t];
  const auto masked = [&](std::size_t k, Vec3d v) {
    return Vec3d{system.free(nodes[k], 0) ? v.x : 0, system.free(nodes[k], 1) ? v.y : 0,
                 system.free(nodes[k], 2) ? v.z : 0};
  };
  bool any_held = false;  // else the displacement is linear, and one point is enough
  for (std::size_t k = 0; k < 10; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) any_held = any_held || !system.free(nodes[k], axis);
  }
  std::array<Block, 4> blocks{};
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3d unit{c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0, c == 2 ? 1.0 : 0.0};
    Nodal moved{};
    moved[a] = masked(a, unit);
    for (std::size_t k = 0; k < 6; ++k) {
      if (edges[k][0] == a || edges[k][1] == a) moved[4 + k] = masked(4 + k, 0.5 * unit);
    }
    Nodal f = any_held ? e.force(system.lame, moved, four_points) : e.force(system.lame, moved, centroid);
    for (std::size_t k = 0; k < 6; ++k) {
      const Vec3d half = masked(4 + k, 0.5 * f[4 + k]);
      for (const std::size_t end : edges[k]) f[end] = f[end] + half;
    }
    for (std::size_t b = 0; b < 4; ++b) {
      for (int r = 0; r < 3; ++r) blocks[b][3 * static_cast<std::size_t>(r) + c] = f[b][r];
    }
  }
  return blocks;
}

template <std::size_t Locals, class OfTet>
SymmetricMatrix lower_triangle(const System& system, const Numbers& numbers, const OfTet& of_tet,
                               const Context& context) {
  const auto lists = neighbours<Locals>(system, context);
  std::vector<std::size_t> length(numbers.count, 0);
  parallel(lists.size(), context, [&](std::size_t i) {
    for (const std::uint32_t column : numbers.of[i]) {
      if (column == none) continue;
      for (const std::uint32_t j : lists[i]) {
        for (const std::uint32_t row : numbers.of[j]) length[column] += row != none && row >= column ? 1 : 0;
      }
    }
  });
  const std::size_t entries = std::accumulate(length.begin(), length.end(), std::size_t{0});
  if (entries > std::numeric_limits<int>::max()) {
    throw Error(Code::TooLarge, "the mesh is too fine for the direct solver", "elasticity", "take fewer tetrahedra");
  }
  SymmetricMatrix matrix;
  matrix.begin.reserve(length.size() + 1);
  for (const std::size_t n : length) matrix.begin.push_back(matrix.begin.back() + static_cast<int>(n));
  matrix.row.resize(entries);
  matrix.value.resize(entries);
  parallel(lists.size(), context, [&](std::size_t i) {
    if (numbers.of[i] == std::array{none, none, none}) return;
    const std::vector<Block> blocks = column_of_node<Locals>(system, lists[i], i, of_tet);
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t column = numbers.of[i][c];
      if (column == none) continue;
      auto at = static_cast<std::size_t>(matrix.begin[column]);
      for (std::size_t k = 0; k < lists[i].size(); ++k) {
        for (std::size_t r = 0; r < 3; ++r) {
          const std::uint32_t row = numbers.of[lists[i][k]][r];
          if (row == none || row < column) continue;
          matrix.row[at] = static_cast<int>(row);
          matrix.value[at++] = blocks[k][3 * r + c];
        }
      }
    }
  });
  return matrix;
}

}  // namespace

System::System(const TetMesh& body, const Material& material, const std::vector<Fixed>& fixed)
    : mesh(body), incidence(body), lame(material) {
  unknowns.of.assign(mesh.nodes.size(), {0, 0, 0});
  for (const Fixed& f : fixed) unknowns.of[f.node][static_cast<std::size_t>(f.axis)] = none;
  for (std::size_t node = 0; node < unknowns.of.size(); ++node) {
    for (std::uint32_t& n : unknowns.of[node]) n = n == none || !incidence.used(node) ? none : unknowns.count++;
  }
}

std::vector<Vec3d> internal_force(const System& system, const std::vector<Vec3d>& displacement,
                                  const Context& context) {
  std::vector<Nodal> of_tet(system.mesh.tets.size());
  parallel(of_tet.size(), context, [&](std::size_t t) {
    of_tet[t] = Element(system.mesh, t).force(system.lame, nodal(system.mesh, t, displacement), std::span(four_points));
  });
  std::vector<Vec3d> force(system.mesh.nodes.size());
  parallel(force.size(), context, [&](std::size_t node) {
    for (const Incidence::Use use : system.incidence.of(node)) force[node] = force[node] + of_tet[use.tet][use.local];
  });
  return force;
}

SymmetricMatrix stiffness(const System& system, const Context& context) {
  return lower_triangle<10>(
      system, system.unknowns, [&](std::size_t t, std::size_t a) { return quadratic(system, t, a); }, context);
}

SymmetricMatrix corner_stiffness(const System& system, const Numbers& corners, const Context& context) {
  return lower_triangle<4>(
      system, corners, [&](std::size_t t, std::size_t a) { return linear(system, t, a); }, context);
}

BlockRows block_stiffness(const System& system, const Context& context) {
  BlockRows rows;
  auto lists = neighbours<10>(system, context);
  rows.begin.assign(1, 0);
  for (const auto& list : lists) rows.begin.push_back(rows.begin.back() + list.size());
  rows.node.resize(rows.begin.back());
  rows.block.resize(rows.begin.back());
  parallel(lists.size(), context, [&](std::size_t i) {
    const std::vector<Block> column =
        column_of_node<10>(system, lists[i], i, [&](std::size_t t, std::size_t a) { return quadratic(system, t, a); });
    for (std::size_t k = 0; k < column.size(); ++k) {
      const std::uint32_t j = lists[i][k];
      rows.node[rows.begin[i] + k] = j;
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {  // K is symmetric: the block (i, j) is that of (j, i) turned over
          rows.block[rows.begin[i] + k][3 * r + c] =
              system.free(i, r) && system.free(j, c) ? static_cast<float>(column[k][3 * c + r]) : 0.0F;
        }
      }
    }
    std::vector<std::uint32_t>().swap(lists[i]);
  });
  return rows;
}

}  // namespace fibrolite::fem
