// SPDX-License-Identifier: Apache-2.0
// A tetrahedral mesh, linear or quadratic.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/vec.h"

namespace fibrolite {

/// Corners 0-3 are positively oriented. Ten-node elements add the edge midpoints of
/// (0,1) (1,2) (0,2) (0,3) (1,3) (2,3) as nodes 4-9 (VTK's order).
struct TetMesh {
  std::vector<Vec3d> nodes;                         ///< mm
  std::vector<std::array<std::uint32_t, 10>> tets;  ///< Quadratic tetrahedra.
};
/// Sum of the straight-sided tetrahedra, mm3.
[[nodiscard]] double volume_mm3(const TetMesh& mesh);

}  // namespace fibrolite
