// SPDX-License-Identifier: GPL-3.0-or-later
// Where in a tetrahedral mesh a point lies.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite::fem {

/// A uniform grid of buckets over the tetrahedra. The mesh must outlive it. Immutable, thread-safe.
class Locator {
 public:
  /// Cost: O(tetrahedra).
  explicit Locator(const TetMesh& mesh);
  struct Place {
    std::uint32_t tet = 0;
    std::array<double, 4> barycentric{};  ///< Clamped to the tetrahedron if the point lies outside of all.
  };
  /// The tetrahedron that holds the point, or sticks out nearest to it; ties go to the first. Cost: O(1).
  [[nodiscard]] Place find(Vec3d p) const;
  /// A nodal field at a point, by the quadratic shape functions.
  [[nodiscard]] Vec3d interpolate(const std::vector<Vec3d>& nodal, Vec3d p) const;

 private:
  [[nodiscard]] std::array<int, 3> cell(Vec3d p) const;

  const TetMesh* mesh_;
  Box3d box_;
  double cell_mm_ = 1;
  std::array<int, 3> cells_{1, 1, 1};
  std::vector<std::size_t> first_;   // per bucket, one more at the end
  std::vector<std::uint32_t> tets_;  // of all buckets, ascending in each
};

}  // namespace fibrolite::fem
