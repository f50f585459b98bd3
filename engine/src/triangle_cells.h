// SPDX-License-Identifier: Apache-2.0
// Which triangles each cell of 64^3 samples has to look at.
#pragma once

#include <openvdb/openvdb.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fibrolite/mesh.h"

namespace fibrolite {

struct TriangleCells {
  static constexpr int size = 64;
  struct Cell {
    openvdb::Coord origin;     ///< A multiple of its size.
    int size;                  ///< 64, or 128 for a node that no triangle reaches.
    std::size_t first, count;  ///< Its triangles in `triangles`; none for a far cell.
  };
  std::vector<Cell> cells;               ///< Those with triangles first. Together they fill the mesh's bounding box.
  std::vector<std::uint64_t> triangles;  ///< The lower 32 bits count.
};
/// A cell is given every triangle within `reach_vox` of its samples (and some more). Cost: O(triangles + cells),
/// parallel.
/// @throws Error TooLarge: more than 2^32 cells.
[[nodiscard]] TriangleCells triangle_cells(const Mesh& mesh, double voxel_mm, double reach_vox);

}  // namespace fibrolite
