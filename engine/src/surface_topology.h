// SPDX-License-Identifier: Apache-2.0
// What the sign of a distance needs to know about a triangle mesh: normals of its edges and vertices, and where it is
// open.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/mesh.h"
#include "weld.h"

namespace fibrolite {

/// Angle-weighted pseudonormals (Baerentzen and Aanaes 2005): their dot product with the vector from the closest point
/// tells the side. Zero where the mesh does not allow it: a border, an edge of more or fewer than two triangles or of
/// two that run the same way, a triangle without area, a vertex with more than one fan.
struct SurfaceTopology {
  Weld weld;
  std::vector<std::array<Vec3f, 3>> edge_normals;  ///< One triple per triangle; edge i runs from corner i to i + 1.
  std::vector<Vec3f> vertex_normals;               ///< One per welded vertex.
  /// Edges run through more often one way than the other, where the winding number changes by degrees. mm.
  struct Border {
    Vec3d from, to;
    int times;
  };
  std::vector<Border> border;
  std::int64_t irregular_edges = 0;  ///< Edges (per triangle side) without a normal.

  [[nodiscard]] bool closed() const { return border.empty(); }
};
/// Cost: O(n), parallel.
[[nodiscard]] SurfaceTopology surface_topology(const Mesh& mesh);

}  // namespace fibrolite
