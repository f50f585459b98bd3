// SPDX-License-Identifier: GPL-3.0-or-later
// Surface -> tetrahedra, by the program fibrolite-tetgen in a child process.
#pragma once

#include <filesystem>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/ops/diameter.h"
#include "fibrolite/shape.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

struct TetrahedralizeParams {
  double max_volume_mm3 = 0;   ///< Largest tetrahedron, as far as the triangles of the surface allow; 0: no limit.
  double radius_edge = 1.6;    ///< TetGen's quality bound; above 1.2.
  int cpu_limit_s = 60;        ///< The child is ended after this.
  int memory_limit_mb = 4096;  ///< The child gets no more than this.
};
/// Ten-node tetrahedra of the volume inside a closed surface. The answer is checked: tets > 0, all positively oriented,
/// volume within 0.1 % of the surface's. @throws Error SolverFailed, Cancelled.
[[nodiscard]] TetMesh tetrahedralize(const Mesh& closed_surface, const TetrahedralizeParams& params = {},
                                     const Context& context = {});

/// Where the child program is: FIBROLITE_TETGEN, beside the running program, the build folder, the install folder.
/// @throws Error SolverFailed if it is nowhere.
[[nodiscard]] std::filesystem::path tetgen_program();

struct ExtractParams {
  double voxel_mm = 0;               ///< Of the surface that is simplified; 0: the proxy's.
  int max_surface_triangles = 6000;  ///< Aim of the simplification.
  double max_distance_vox = 0.5;     ///< Bound of the simplification, voxels.
};
/// One component as tetrahedra: realize max(body, region), surface, simplify within a bound (flat faces keep their
/// share of the triangles, for load may act on a patch of one), check, tetrahedralize; when that fails, again with a
/// coarser surface, and once more with one that is not simplified. The shell that encloses most is kept, with its
/// cavities of 27 voxels or more; loose islands are dropped. @throws Error SolverFailed, BadRecipe, Cancelled.
[[nodiscard]] TetMesh extract(const Proxy& proxy, const Shape& region, const ExtractParams& params = {},
                              const Context& context = {});

}  // namespace fibrolite
