// SPDX-License-Identifier: Apache-2.0
#include "band_check.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;

/// Pairs along one axis (stride 64, 8 or 1) within a leaf.
std::int64_t within(const float* v, int stride, float limit) {
  std::int64_t count = 0;
  for (int i = 0; i < static_cast<int>(Leaf::SIZE); ++i) {
    if ((i / stride & 7) < 7) count += std::abs(v[i] - v[i + stride]) > limit ? 1 : 0;
  }
  return count;
}

/// Pairs across the face towards the next leaf or tile.
std::int64_t across(const float* v, const float* next, float tile, int stride, float limit) {
  std::int64_t count = 0;
  for (int i = 0; i < static_cast<int>(Leaf::SIZE); ++i) {
    if ((i / stride & 7) != 7) continue;
    const float other = next != nullptr ? next[i - 7 * stride] : tile;
    count += std::abs(v[i] - other) > limit ? 1 : 0;
  }
  return count;
}

/// Pairs across the face towards a tile on the lower side; a leaf there has counted them already.
std::int64_t across_to_tile_below(const float* v, float tile, int stride, float limit) {
  std::int64_t count = 0;
  for (int i = 0; i < static_cast<int>(Leaf::SIZE); ++i) {
    if ((i / stride & 7) == 0) count += std::abs(v[i] - tile) > limit ? 1 : 0;
  }
  return count;
}

}  // namespace

std::int64_t contradictions(const Tree& tree, double voxel_mm) {
  const openvdb::tree::LeafManager<const Tree> leaves(tree);
  const auto limit = static_cast<float>(voxel_mm * 1.01);
  std::vector<std::int64_t> part(leaves.leafCount(), 0);
  constexpr std::array<int, 3> strides{64, 8, 1};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, part.size(), 64), [&](const auto& range) {
    openvdb::tree::ValueAccessor<const Tree> access(tree);
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Leaf& leaf = leaves.leaf(i);
      const float* v = leaf.buffer().data();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        openvdb::Coord step(0);
        step[axis] = Leaf::DIM;
        part[i] += within(v, strides[axis], limit);
        const openvdb::Coord above = leaf.origin() + step, below = leaf.origin() - step;
        const Leaf* next = access.probeConstLeaf(above);
        part[i] += across(v, next != nullptr ? next->buffer().data() : nullptr,
                          next != nullptr ? 0 : access.getValue(above), strides[axis], limit);
        if (access.probeConstLeaf(below) == nullptr) {
          part[i] += across_to_tile_below(v, access.getValue(below), strides[axis], limit);
        }
      }
    }
  });
  std::int64_t sum = 0;
  for (const std::int64_t n : part) sum += n;
  // Inner tiles may not touch the outside.
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  openvdb::tree::ValueAccessor<const Tree> access(tree);
  for (; tile; ++tile) {
    if (*tile >= 0) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      openvdb::Coord step(0);
      step[axis] = 1;
      sum += access.getValue(box.max() + step) > 0 || access.getValue(box.min() - step) > 0 ? 1 : 0;
    }
  }
  return sum;
}

}  // namespace fibrolite
