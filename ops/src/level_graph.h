// SPDX-License-Identifier: GPL-3.0-or-later
// The graph of the level sets of a distance inside one piece (its Reeb graph): limbs are its arcs, forks its junctions.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "limb.h"

namespace fibrolite {

struct LevelNode {
  std::vector<std::int32_t> samples;
  std::set<int> beside;
  Vec3d centroid{};
  double level_mm = 0;     ///< Mean distance of its samples.
  double diameter_mm = 0;  ///< Of the disc with the area of its section.
  bool cut = false;        ///< It touches a cut of the piece.
  bool gone = false;       ///< Merged into another.
};

struct LevelGraph {
  std::vector<LevelNode> nodes;
  [[nodiscard]] std::size_t degree(int node) const { return nodes[static_cast<std::size_t>(node)].beside.size(); }
  [[nodiscard]] bool has_junction() const;
  [[nodiscard]] bool is_ring() const;
  /// Nodes that are left, ascending.
  [[nodiscard]] std::vector<int> alive() const;
  /// From `junction` through `next` up to the next junction or end, both included.
  [[nodiscard]] std::vector<int> arc(int junction, int next) const;
};

/// Level sets of `level` (mm, per inside sample; negative where undefined), branches and holes shorter than the local
/// diameter merged.
[[nodiscard]] LevelGraph make_level_graph(const VoxelBody& body, const Links& links, const LimbPiece& piece,
                                          const std::vector<float>& level);
/// Of the distance from the piece's cuts, or from a tip if it has none.
[[nodiscard]] LevelGraph level_graph_of(const VoxelBody& body, const Links& links, const LimbPiece& piece);

/// Distances from the two ends of a piece, found by two sweeps.
struct Tips {
  std::vector<float> from_first, from_second;
};
[[nodiscard]] Tips sweep_tips(const VoxelBody& body, const Links& links, const std::vector<std::int32_t>& samples);

/// The sample with the largest value.
[[nodiscard]] std::int32_t farthest(const std::vector<std::int32_t>& samples, const std::vector<float>& distance);

}  // namespace fibrolite
