// SPDX-License-Identifier: Apache-2.0
#include "band_check.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "leaf_bits.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using openvdb::Coord;

/// Of two values on different sides.
bool contradict(float a, float b, float limit) { return (a - b) * (a - b) > limit * limit; }

/// `side`: which are negative.
bool within(const float* v, const LeafBits& side, float limit) {
  constexpr std::uint64_t last_column = first_column << 7, last_row = std::uint64_t{255} << 56;
  for (std::size_t x = 0; x < 8; ++x) {
    const std::uint64_t here = side[x];
    const auto any = [&](std::uint64_t crossed, std::size_t step) {
      for (; crossed != 0; crossed &= crossed - 1) {
        const std::size_t at = 64 * x + static_cast<std::size_t>(std::countr_zero(crossed));
        if (contradict(v[at], v[at + step], limit)) return true;
      }
      return false;
    };
    if (any((here ^ here >> 1) & ~last_column, 1) || any((here ^ here >> 8) & ~last_row, 8) ||
        any(x < 7 ? here ^ side[x + 1] : 0, 64))
      return true;
  }
  return false;
}

/// Between a leaf's face and the samples beyond it: `other` are a leaf's values, or one value that stands for all.
bool across(const float* v, const LeafBits& side, bool upper, const float* other, float tile, unsigned axis,
            float limit) {
  const std::uint64_t beyond = other != nullptr ? face_of(bits_below(other, 0), axis, !upper) : tile < 0 ? ~0ULL : 0;
  for (std::uint64_t crossed = face_of(side, axis, upper) ^ beyond; crossed != 0; crossed &= crossed - 1) {
    const auto n = static_cast<unsigned>(std::countr_zero(crossed));
    const float next = other != nullptr ? other[sample_of_face(n, axis, !upper)] : tile;
    if (contradict(v[sample_of_face(n, axis, upper)], next, limit)) return true;
  }
  return false;
}

/// Blocks of inner tiles that touch outer ones, and those outer ones. Almost all tiles lie among others of their node,
/// whose table is quicker to read than the tree.
void inner_tiles_at_the_outside(const Tree& tree, const openvdb::CoordBBox& known, std::vector<Coord>& blocks) {
  using Node = Tree::RootNodeType::ChildNodeType::ChildNodeType;
  std::vector<const Node*> nodes;
  tree.getNodes(nodes);
  std::vector<std::vector<Coord>> found(nodes.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size()), [&](const auto& range) {
    openvdb::tree::ValueAccessor<const Tree> access(tree);
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Node& node = *nodes[i];
      const auto outer = [&](const Coord& place) {
        return access.probeConstLeaf(place) == nullptr && access.getValue(place) >= 0;
      };
      for (openvdb::Index n = 0; n < Node::NUM_VALUES; ++n) {
        if (node.isChildMaskOn(n) || node.getTable()[n].getValue() >= 0) continue;
        const openvdb::Index local[3] = {n >> 8, n >> 4 & 15, n & 15};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const openvdb::Index stride = axis == 0 ? 256 : axis == 1 ? 16 : 1;
          for (const int step : {-1, 1}) {
            const bool same_node = step < 0 ? local[axis] > 0 : local[axis] < 15;
            const openvdb::Index m = step < 0 ? n - stride : n + stride;
            if (same_node && (node.isChildMaskOn(m) || node.getTable()[m].getValue() < 0)) continue;
            Coord place = node.offsetToGlobalCoord(n);
            const Coord inner = place;
            place[axis] += 8 * step;
            if (!known.isInside(place) || (!same_node && !outer(place))) continue;
            found[i].push_back(inner);
            found[i].push_back(place);
          }
        }
      }
    }
  });
  for (const auto& list : found) blocks.insert(blocks.end(), list.begin(), list.end());
  // Tiles of 128.
  openvdb::tree::ValueAccessor<const Tree> access(tree);
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 2);
  for (; tile; ++tile) {
    if (*tile >= 0) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = (axis + 1) % 3, w = (axis + 2) % 3;
      for (const int step : {-1, 1}) {
        Coord place;
        place[axis] = step < 0 ? box.min()[axis] - 8 : box.max()[axis] + 1;
        for (place[u] = box.min()[u]; place[u] <= box.max()[u]; place[u] += 8) {
          for (place[w] = box.min()[w]; place[w] <= box.max()[w]; place[w] += 8) {
            if (!known.isInside(place) || access.probeConstLeaf(place) != nullptr || access.getValue(place) < 0)
              continue;
            Coord inner = place;
            inner[axis] -= 8 * step;
            blocks.push_back(inner);
            blocks.push_back(place);
          }
        }
      }
    }
  }
}

/// Among these leaves; each meets its neighbours in the box, those before it as far as they are among them too.
std::vector<Coord> contradictions_of(const std::vector<const Leaf*>& leaves, const Tree& tree, double voxel_mm,
                                     const openvdb::CoordBBox& box) {
  const auto limit = static_cast<float>(voxel_mm * 1.01);
  // One bit per direction of the face (-x +x -y +y -z +z) and one for the inside.
  std::vector<unsigned char> found(leaves.size(), 0);
  const auto neighbour = [](const Coord& origin, int face) {
    Coord place = origin;
    place[static_cast<std::size_t>(face / 2)] += face % 2 == 1 ? 8 : -8;
    return place;
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, found.size(), 64), [&](const auto& range) {
    openvdb::tree::ValueAccessor<const Tree> access(tree);
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      fetch_ahead(leaves, i);
      const Leaf& leaf = *leaves[i];
      const float* v = leaf.buffer().data();
      const LeafBits side = bits_below(v, 0);
      unsigned bits = within(v, side, limit) ? 64U : 0U;
      for (int face = 0; face < 6; ++face) {
        const Coord place = neighbour(leaf.origin(), face);
        if (!box.isInside(place)) continue;
        const Leaf* next = access.probeConstLeaf(place);
        const bool upper = face % 2 == 1;
        if (next != nullptr && !upper) continue;  // seen from there
        const float tile = next != nullptr ? 0 : access.getValue(place);
        const float* other = next != nullptr ? next->buffer().data() : nullptr;
        if (across(v, side, upper, other, tile, static_cast<unsigned>(face / 2), limit)) bits |= 1U << face;
      }
      found[i] = static_cast<unsigned char>(bits);
    }
  });
  std::vector<Coord> blocks;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] == 0) continue;
    blocks.push_back(leaves[i]->origin());
    for (int face = 0; face < 6; ++face) {
      if ((found[i] >> face & 1) != 0) blocks.push_back(neighbour(leaves[i]->origin(), face));
    }
  }
  inner_tiles_at_the_outside(tree, box, blocks);
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

}  // namespace

std::vector<Coord> contradictions(const Tree& tree, double voxel_mm, const openvdb::CoordBBox& box) {
  std::vector<const Leaf*> leaves;
  leaves.reserve(tree.leafCount());
  tree.getNodes(leaves);
  return contradictions_of(leaves, tree, voxel_mm, box);
}

std::vector<Coord> contradictions_around(const std::vector<openvdb::CoordBBox>& changed, const Tree& tree,
                                         double voxel_mm) {
  std::vector<const Leaf*> leaves;
  openvdb::tree::ValueAccessor<const Tree> access(tree);
  for (openvdb::CoordBBox part : changed) {
    part.expand(8);
    for (int x = part.min().x(); x <= part.max().x(); x += 8) {
      for (int y = part.min().y(); y <= part.max().y(); y += 8) {
        for (int z = part.min().z(); z <= part.max().z(); z += 8) {
          if (const Leaf* leaf = access.probeConstLeaf(Coord(x, y, z))) leaves.push_back(leaf);
        }
      }
    }
  }
  const auto place = [](const Leaf* leaf) { return leaf->origin(); };
  std::ranges::sort(leaves, {}, place);
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  return contradictions_of(leaves, tree, voxel_mm, openvdb::CoordBBox::inf());
}

}  // namespace fibrolite
