// SPDX-License-Identifier: Apache-2.0
// What is left of material when a skin has been taken off it.
#pragma once

#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace fibrolite {

/// A leaf's samples as bits: bit 8 y + z of word x.
using LeafBits = std::array<std::uint64_t, 8>;
[[nodiscard]] inline bool holds(const LeafBits& bits, std::size_t sample) {
  return (bits[sample >> 6] >> (sample & 63U) & 1U) != 0;
}

/// Half the diagonal of a voxel: samples as near to a line as that make a chain of neighbours along it, those whose
/// cubes it passes.
constexpr double half_diagonal = 0.8661;
/// What ridge_depth() may say too little about such a chain, voxels.
constexpr double ridge_slack = 0.25;

struct LatticeLine {
  int x, y, z;
  float length;  // of a step, voxels
};
/// The 13 directions from a sample to those around it, opposite ones counted once; those that tell most first.
extern const std::array<LatticeLine, 13> lattice_lines;

/// How deep material is where no sample lies: the depth of the ridge beside a sample, at least the sample's own. Along
/// lines of the lattice the two flanks of the depth are drawn on to where they meet. Along round sticks and wide plates
/// some chain of samples is told the depth of their middle, never more and 0.05 voxels less at most; up to a quarter
/// less where a stick of ten voxels runs into a ball. Along a plate's edge it can be 0.4 voxels too much.
/// `value(x, y, z)`: distance to the surface, negative inside, from the sample, in voxels. Stops at `enough`.
template <class Value>
[[nodiscard]] float ridge_depth(const Value& value, float enough) {
  const float here = -value(0, 0, 0);
  float best = here;
  for (const LatticeLine& line : lattice_lines) {
    if (best >= enough) break;
    const auto depth = [&](int k) { return -value(k * line.x, k * line.y, k * line.z); };
    const float left = depth(-1), right = depth(1);
    if (here < left || here < right) continue;
    // A flank that sags outwards belongs to something else: what is left of it is its last step.
    const float rise = std::min(std::max(left - depth(-2), here - left), line.length);
    const float fall = std::min(std::max(right - depth(2), here - right), line.length);
    if (rise + fall <= 0) continue;
    const float at = std::clamp((right + fall - left - rise) / (rise + fall), -1.0F, 1.0F);
    best = std::max(best, std::min(left + rise * (at + 1), right + fall * (1 - at)));
  }
  return best;
}

class Skin {
 public:
  using Tree = openvdb::FloatTree;
  using Leaf = Tree::LeafNodeType;
  Skin(const Tree& tree, double skin_mm, double voxel_mm)
      : access_(tree), skin_vox_(static_cast<float>(skin_mm / voxel_mm)), voxel_mm_(static_cast<float>(voxel_mm)) {}

  /// The samples of a leaf of the tree deeper than the skin, by their values or, next to a ridge, by its depth. 0:
  /// those inside. Tiles count as deep.
  [[nodiscard]] LeafBits below(const Leaf& leaf);

 private:
  /// The leaf and those around it.
  class Around {
   public:
    Around(const Leaf& leaf, openvdb::FloatGrid::ConstUnsafeAccessor& access);
    /// At a sample of the leaf or two beyond it.
    [[nodiscard]] float operator()(int x, int y, int z) const {
      const auto k = static_cast<std::size_t>(9 * ((x + 8) >> 3) + 3 * ((y + 8) >> 3) + ((z + 8) >> 3));
      return values_[k] == nullptr ? tile_[k] : values_[k][(x & 7) << 6 | (y & 7) << 3 | (z & 7)];
    }

   private:
    std::array<const float*, 27> values_{};
    std::array<float, 27> tile_{};
  };

  openvdb::FloatGrid::ConstUnsafeAccessor access_;
  float skin_vox_, voxel_mm_;
};

}  // namespace fibrolite
