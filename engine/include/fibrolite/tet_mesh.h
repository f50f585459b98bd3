// SPDX-License-Identifier: Apache-2.0
// A tetrahedral mesh of ten-node elements.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/vec.h"

namespace fibrolite {

/// Corners 0-3 are positively oriented: dot(cross(1 - 0, 2 - 0), 3 - 0) > 0. Nodes 4-9 are the middles of the edges
/// (0,1) (1,2) (0,2) (0,3) (1,3) (2,3) (VTK's order). Sides are straight.
struct TetMesh {
  std::vector<Vec3d> nodes;                         ///< mm
  std::vector<std::array<std::uint32_t, 10>> tets;  ///< Quadratic tetrahedra.
};
/// Adds the middles of the edges behind the corners. Cost: O(n log n).
[[nodiscard]] TetMesh ten_node(std::vector<Vec3d> corners, const std::vector<std::array<std::uint32_t, 4>>& tets);

/// A side of one tetrahedron only. Corners 0-2 are counterclockwise seen from outside; nodes 3-5 are the middles of the
/// edges (0,1) (1,2) (2,0).
struct TetFace {
  std::uint32_t tet = 0;
  std::array<std::uint32_t, 6> nodes{};
};
/// The surface of the mesh, in the order of its tetrahedra. Cost: O(n log n).
[[nodiscard]] std::vector<TetFace> boundary(const TetMesh& mesh);

/// Sum of the straight-sided tetrahedra, mm3.
[[nodiscard]] double volume_mm3(const TetMesh& mesh);

}  // namespace fibrolite
