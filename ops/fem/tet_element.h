// SPDX-License-Identifier: GPL-3.0-or-later
// One ten-node tetrahedron of an elastic body, and how the nodes of a mesh share them.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "elasticity.h"

namespace fibrolite::fem {

inline constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
/// Ends of the edges whose middles are the nodes 4 to 9.
inline constexpr std::array<std::array<std::size_t, 2>, 6> edges{{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

using Barycentric = std::array<double, 4>;
/// The four-point rule of degree 2: exact for the stiffness of straight-sided ten-node tetrahedra. Weights are equal.
inline constexpr double inner = 0.58541019662496845, outer = 0.13819660112501051;
inline constexpr std::array<Barycentric, 4> four_points{{{inner, outer, outer, outer},
                                                         {outer, inner, outer, outer},
                                                         {outer, outer, inner, outer},
                                                         {outer, outer, outer, inner}}};
/// Exact for linear displacements.
inline constexpr std::array<Barycentric, 1> centroid{{{0.25, 0.25, 0.25, 0.25}}};

struct Lame {
  double lambda, mu;
  explicit Lame(const Material& m)
      : lambda(m.young_mpa * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson))),
        mu(m.young_mpa / (2 * (1 + m.poisson))) {}
};

/// Of the shape functions of the ten nodes.
using Gradients = std::array<Vec3d, 10>;
/// A vector at each of the ten nodes.
using Nodal = std::array<Vec3d, 10>;

struct Element {
  double volume = 0;
  std::array<Vec3d, 4> grad;  ///< Of the barycentric coordinates, constant.

  Element(const TetMesh& mesh, std::size_t t);
  [[nodiscard]] Gradients gradients(const Barycentric& at) const;
  /// Forces on the nodes that the stresses of a displacement make.
  [[nodiscard]] Nodal force(const Lame& lame, const Nodal& displacement, std::span<const Barycentric> rule) const;
};

[[nodiscard]] Stress stress_at(const Gradients& gradients, const Lame& lame, const Nodal& displacement);
/// The ten of one tetrahedron.
[[nodiscard]] Nodal nodal(const TetMesh& mesh, std::size_t t, const std::vector<Vec3d>& of_mesh);

/// Which tetrahedra a node belongs to, and as which of their ten; in the order of the tetrahedra, so that every sum
/// over them has a fixed order.
struct Incidence {
  std::vector<std::size_t> first;  ///< Per node, one more at the end.
  struct Use {
    std::uint32_t tet;
    std::uint32_t local;
  };
  std::vector<Use> uses;

  explicit Incidence(const TetMesh& mesh);
  [[nodiscard]] bool used(std::size_t node) const { return first[node] != first[node + 1]; }
  [[nodiscard]] std::span<const Use> of(std::size_t node) const {
    return {uses.data() + first[node], first[node + 1] - first[node]};
  }
};

template <class Body>
void parallel(std::size_t count, const Context& context, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
    context.check();
    for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
  });
}

}  // namespace fibrolite::fem
