// SPDX-License-Identifier: GPL-3.0-or-later
// The equations of an elastic body, in the forms in which its solvers want them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cholesky.h"
#include "fibrolite/context.h"
#include "tet_element.h"

namespace fibrolite::fem {

/// Three per node; `none` where a component does not move of its own.
struct Numbers {
  std::vector<std::array<std::uint32_t, 3>> of;
  std::uint32_t count = 0;
};

struct System {
  const TetMesh& mesh;
  Incidence incidence;
  Lame lame;
  Numbers unknowns;  ///< `none` where the displacement is prescribed, and at nodes without a tetrahedron.

  System(const TetMesh& body, const Material& material, const std::vector<Fixed>& fixed);
  [[nodiscard]] bool free(std::size_t node, std::size_t axis) const { return unknowns.of[node][axis] != none; }
};

/// Forces that the stresses of a displacement put on the nodes: K u without K. Cost: parallel; the same bits on any
/// number of threads, as everything here.
[[nodiscard]] std::vector<Vec3d> internal_force(const System& system, const std::vector<Vec3d>& displacement,
                                                const Context& context);

/// The stiffness of the unknowns. @throws Error TooLarge; Cancelled.
[[nodiscard]] SymmetricMatrix stiffness(const System& system, const Context& context);

/// The same between displacements that are linear in each tetrahedron, told by those of its corners: middles of edges
/// follow as the mean of their ends, but stay where they are held. @throws as above.
[[nodiscard]] SymmetricMatrix corner_stiffness(const System& system, const Numbers& corners, const Context& context);

/// All of K, a row of 3x3 blocks for each node, in single precision; zero where a component is not free.
struct BlockRows {
  std::vector<std::size_t> begin;  ///< Of each node; one more at the end.
  std::vector<std::uint32_t> node;
  std::vector<std::array<float, 9>> block;  ///< Row by row.
};
[[nodiscard]] BlockRows block_stiffness(const System& system, const Context& context);

}  // namespace fibrolite::fem
