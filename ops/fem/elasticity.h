// SPDX-License-Identifier: GPL-3.0-or-later
// Linear elasticity on ten-node tetrahedra: small strains, isotropic, static.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/stress.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite::fem {

using Stress = StressTensor;
/// Normal stress on the plane with unit normal `n`, MPa.
[[nodiscard]] double normal_stress(const Stress& stress, Vec3d n);

/// One component of the displacement of one node is prescribed.
struct Fixed {
  std::uint32_t node = 0;
  int axis = 0;  ///< 0, 1 or 2.
  friend bool operator==(const Fixed&, const Fixed&) = default;
};
struct LoadCase {
  std::vector<Vec3d> force_n;    ///< One per node; empty: no forces.
  std::vector<double> fixed_mm;  ///< Displacement of each Fixed, in their order; empty: all zero.
};
struct Solution {
  std::vector<Vec3d> displacement_mm;   ///< One per node.
  std::vector<Vec3d> reaction_n;        ///< One per node; zero where nothing is fixed.
  std::vector<Stress> centroid_stress;  ///< One per tetrahedron: the mean over its volume.
  double residual = 0;                  ///< |K u - f| over the free components / (|f| + |reactions|).
  Vec3d imbalance_n{};                  ///< Sum of reactions + sum of loads.
  int iterations = 0;                   ///< Of conjugate gradients; 0: solved by Cholesky.
};
struct SolveParams {
  /// Most unknowns for supernodal Cholesky; above, conjugate gradients (docs/decisions/0010).
  std::int64_t direct_limit = 50'000;
};
/// All load cases with one factorisation or one preconditioner. Nodes without a tetrahedron stay at zero. The same bits
/// on any number of threads; for that it pins OpenBLAS to one thread for the whole process.
/// @throws Error SolverFailed: a piece of the mesh can move freely, the matrix is singular, the residual is above
/// 1e-6, or loads and reactions differ by more than 1e-6 of their sizes;
/// BadRecipe: a material constant out of range; TooLarge; Cancelled. Cost: up to the limit 2 s at most; above, on two
/// cores, 115 k unknowns 2 s and 0.2 GB, 523 k 13 s and 0.7 GB, of which each further load case takes about half again.
[[nodiscard]] std::vector<Solution> solve(const TetMesh& mesh, const Material& material,
                                          const std::vector<Fixed>& fixed, const std::vector<LoadCase>& cases,
                                          const SolveParams& params = {}, const Context& context = {});

/// Stress at the nodes, MPa: that of the tetrahedra around each, weighted by volume.
[[nodiscard]] std::vector<Stress> nodal_stress(const TetMesh& mesh, const Material& material,
                                               const std::vector<Vec3d>& displacement_mm);

/// Shape functions of the ten nodes at barycentric coordinates that sum to 1.
[[nodiscard]] std::array<double, 10> shape_functions(const std::array<double, 4>& barycentric);
/// Shape functions of a six-node face (corners 0-2, middles of (0,1) (1,2) (2,0)): spreads a force over its nodes.
[[nodiscard]] std::array<double, 6> face_shape_functions(const std::array<double, 3>& barycentric);

}  // namespace fibrolite::fem
