// SPDX-License-Identifier: Apache-2.0
#include "skin.h"

#include <bit>

namespace fibrolite {

const std::array<LatticeLine, 13> lattice_lines{{{1, 0, 0, 1},
                                                 {0, 1, 0, 1},
                                                 {0, 0, 1, 1},
                                                 {1, 1, 0, 1.41422F},
                                                 {1, -1, 0, 1.41422F},
                                                 {1, 0, 1, 1.41422F},
                                                 {1, 0, -1, 1.41422F},
                                                 {0, 1, 1, 1.41422F},
                                                 {0, 1, -1, 1.41422F},
                                                 {1, 1, 1, 1.73206F},
                                                 {1, 1, -1, 1.73206F},
                                                 {1, -1, 1, 1.73206F},
                                                 {1, -1, -1, 1.73206F}}};

Skin::Around::Around(const Leaf& leaf, openvdb::FloatGrid::ConstUnsafeAccessor& access) {
  for (int k = 0; k < 27; ++k) {
    const auto n = static_cast<std::size_t>(k);
    const openvdb::Coord at = leaf.origin().offsetBy(8 * (k / 9 - 1), 8 * (k / 3 % 3 - 1), 8 * (k % 3 - 1));
    const Leaf* there = k == 13 ? &leaf : access.probeConstLeaf(at);
    if (there != nullptr) {
      values_[n] = there->buffer().data();
    } else {
      tile_[n] = access.getValue(at);
    }
  }
}

LeafBits Skin::below(const Leaf& leaf) {
  const float* const value = leaf.buffer().data();
  const auto bits_below = [&](float limit) {
    LeafBits bits;
    for (std::size_t x = 0; x < 8; ++x) {
      std::uint64_t word = 0;
      for (std::size_t i = 0; i < 64; ++i) word |= std::uint64_t{value[64 * x + i] < limit} << i;
      bits[x] = word;
    }
    return bits;
  };
  LeafBits deep = bits_below(-skin_vox_ * voxel_mm_);
  if (skin_vox_ <= 0) return deep;
  // What is nearer to the surface is not needed for a chain along a member that is thick enough.
  const auto least = static_cast<float>(std::max(skin_vox_ + ridge_slack - half_diagonal, 0.0));
  const LeafBits near = bits_below(-least * voxel_mm_);
  if (near == deep) return deep;
  const Around around(leaf, access_);
  const float scale = 1 / voxel_mm_;
  for (std::size_t word = 0; word < 8; ++word) {
    for (std::uint64_t rest = near[word] & ~deep[word]; rest != 0; rest &= rest - 1) {
      const int bit = std::countr_zero(rest), x = static_cast<int>(word), y = bit >> 3, z = bit & 7;
      const auto distance = [&](int i, int j, int k) { return scale * around(x + i, y + j, z + k); };
      if (ridge_depth(distance, skin_vox_) >= skin_vox_) deep[word] |= std::uint64_t{1} << bit;
    }
  }
  return deep;
}

}  // namespace fibrolite
