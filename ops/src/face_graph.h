// SPDX-License-Identifier: GPL-3.0-or-later
// Faces of a closed triangle mesh and their neighbours.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/mesh.h"

namespace fibrolite {

struct FaceGraph {
  /// Across the edges (0,1) (1,2) (2,0) of each triangle.
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  std::vector<double> area_mm2;
  std::vector<Vec3d> normal;  ///< Unit, outward.
  std::vector<Vec3d> centroid;
  double total_area_mm2 = 0;

  [[nodiscard]] std::size_t size() const { return neighbours.size(); }
};

/// @throws Error BadInput: no triangles, or an edge whose triangles do not run to and fro equally often.
[[nodiscard]] FaceGraph make_face_graph(const Mesh& mesh);

}  // namespace fibrolite
