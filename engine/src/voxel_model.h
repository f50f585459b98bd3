// SPDX-License-Identifier: Apache-2.0
// The cells and nodes of a solid for the voxel solver: 8x8x8 blocks of cells, where there is material only.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Cell (i, j, k) is a cube of edge_mm; its lowest corner is node (i, j, k), at edge_mm * (i, j, k) - half_sample_mm.
/// Nodes are numbered block by block; a node on the common face of blocks belongs to the first of them.
struct VoxelModel {
  static constexpr int side = 8, nodes_side = 9;
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  double edge_mm = 0, half_sample_mm = 0;
  std::vector<Vec3i> origin;              ///< Of each block, in cells; multiples of 8; sorted.
  std::vector<float> fraction;            ///< 512 per block, z fastest: share of the cell that is material.
  std::vector<std::uint32_t> ref_begin;   ///< Per block, its slice of the references below; one more than blocks.
  std::vector<std::uint32_t> ref_node;    ///< Node number.
  std::vector<std::uint16_t> ref_local;   ///< Place in the block's 9x9x9 nodes, rising.
  std::vector<std::uint32_t> node_begin;  ///< Per block, the first node it owns; one more than blocks.
  std::array<std::vector<std::uint32_t>, 8> colour;  ///< Blocks of one colour share no node.

  [[nodiscard]] std::size_t blocks() const { return origin.size(); }
  [[nodiscard]] std::size_t nodes() const { return node_begin.empty() ? 0 : node_begin.back(); }
  [[nodiscard]] Vec3d node_mm(Vec3i n) const {
    return Vec3d{edge_mm * n.x - half_sample_mm, edge_mm * n.y - half_sample_mm, edge_mm * n.z - half_sample_mm};
  }
  [[nodiscard]] Vec3d centre_mm(Vec3i cell) const {
    return node_mm(cell) + Vec3d{0.5 * edge_mm, 0.5 * edge_mm, 0.5 * edge_mm};
  }
  /// Block with this origin, or none. Cost: O(log blocks).
  [[nodiscard]] std::uint32_t find(Vec3i block_origin) const;
  /// Node numbers of the block's 9x9x9 places; none where no cell of the block has material.
  void node_table(std::size_t block, std::uint32_t* table) const;
  /// visit(number, Vec3i node) for each node the block owns.
  template <class Visit>
  void each_own_node(std::size_t block, const Visit& visit) const {
    for (std::uint32_t r = ref_begin[block]; r < ref_begin[block + 1]; ++r) {
      if (ref_node[r] < node_begin[block]) continue;
      visit(ref_node[r], node_at(block, ref_local[r]));
    }
  }
  [[nodiscard]] Vec3i node_at(std::size_t block, int local) const {
    return {origin[block].x + local / 81, origin[block].y + local / 9 % 9, origin[block].z + local % 9};
  }
  /// Places of a cell's corners in the 9x9x9 nodes, seen from the place of its lowest corner.
  static constexpr std::array<int, 8> corner{0, 1, 9, 10, 81, 82, 90, 91};
  [[nodiscard]] static constexpr int lowest_corner(int cell) {
    return (cell >> 6) * 81 + ((cell >> 3) & 7) * 9 + (cell & 7);
  }
};

/// Pieces of cells joined face to face: cells that meet at an edge or a corner only would turn on it freely.
struct VoxelPieces {
  struct Piece {
    Vec3i first{};  ///< Its first cell.
    double cells = 0;
  };
  std::vector<std::uint32_t> of_cell;  ///< 512 per block: piece, or VoxelModel::none.
  std::vector<Piece> list;
};

/// Cells of `coarsen` samples a side: the fraction of a sample is clamp(1/2 - distance / voxel, 0, 1), that of a cell
/// the mean. Cells below 1 % are left out, and pieces without a sample inside. Cost: O(samples near material).
/// @throws Error TooLarge: more than 1.3e9 nodes; Cancelled.
[[nodiscard]] VoxelModel voxel_model(const Solid& solid, int coarsen, VoxelPieces& pieces, const Context& context);

}  // namespace fibrolite
