// SPDX-License-Identifier: GPL-3.0-or-later
// Tetrahedra that always exist: the staircase of a body on a coarse lattice.
#pragma once

#include "fibrolite/shape.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// Cubes of a lattice whose centres are inside, the largest face-connected piece of them, each split into the six
/// tetrahedra along its diagonal (Kuhn 1960), which meet face to face. About `cells` cubes; the surface is a staircase,
/// so peak stresses mean nothing, but means over a part do. For bodies that TetGen cannot mesh.
/// @throws Error SolverFailed: no cube is inside. Cost: O(cubes of the box).
[[nodiscard]] TetMesh voxel_tetrahedra(const Shape& shape, const Box3d& box, double volume_mm3, int cells = 4000);

}  // namespace fibrolite
