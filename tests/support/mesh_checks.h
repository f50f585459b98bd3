// SPDX-License-Identifier: GPL-3.0-or-later
// An independent judge of meshes: shares no code with the library's own check().
#pragma once

#include <cstdint>

#include "fibrolite/mesh.h"

namespace fibrolite::testing {

struct IndependentCount {
  std::int64_t boundary_edges = 0, nonmanifold_edges = 0, nonmanifold_vertices = 0, degenerate_triangles = 0;
  double volume_mm3 = 0;
  [[nodiscard]] bool sound() const {
    return boundary_edges + nonmanifold_edges + nonmanifold_vertices + degenerate_triangles == 0;
  }
};
/// Counts by brute hash maps on welded coordinates; O(n).
IndependentCount count(const Mesh& mesh);

}  // namespace fibrolite::testing
