// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <bitset>
#include <unordered_map>
#include <vector>

#include "fibrolite/solid.h"

namespace fibrolite {

/// Whether samples are as deep as asked for, by their values or, where those may understate it, by the distance to
/// where the lattice's edges cross the surface. Of a range, nothing is known beyond its ends: what lies so near them
/// that this matters is judged by its value alone.
class Depth {
 public:
  Depth(const Solid& solid, double depth_mm, const SampleRange* range = nullptr);

  [[nodiscard]] bool inside(const openvdb::Coord& at) { return access_.getValue(at) < 0; }
  /// Cost: O(1); the first time in a block of 8 x 8 x 8 samples where values are not enough, O((8 + depth / voxel)^3)
  /// and O((depth / voxel)^3) for each edge that crosses. Keeps 64 bytes for each such block.
  [[nodiscard]] bool deep(const openvdb::Coord& at);

 private:
  static constexpr int side = 8;
  using Shallow = std::bitset<side * side * side>;

  [[nodiscard]] Shallow shallow_in(const openvdb::Coord& origin);
  /// Marks the samples of a block to which an edge's crossing is too near: the edge starts `from` the block's origin
  /// and is crossed after `share` of its length.
  void mark(Shallow& shallow, const openvdb::Coord& from, unsigned axis, double share) const;

  openvdb::FloatGrid::ConstUnsafeAccessor access_;
  const SampleRange* range_;
  float depth_mm_;
  double depth_vox_;
  int reach_;
  std::unordered_map<openvdb::Coord, Shallow> blocks_;
  std::vector<float> values_;  // of a block and what is around it; kept for its memory
};

}  // namespace fibrolite
