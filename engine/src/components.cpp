// SPDX-License-Identifier: Apache-2.0
#include "components.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

/// All of `within` that hangs together with what is set in `grown`. Whole planes move at a time.
void flood(LeafBits& grown, const LeafBits& within) {
  for (bool changed = true; changed;) {
    changed = false;
    const auto spread = [&](std::size_t x, std::uint64_t from) {
      std::uint64_t now = (grown[x] | from) & within[x];
      for (std::uint64_t before = ~now; now != before;) {
        before = now;
        now |= (now << 1 & ~first_column) | (now & ~first_column) >> 1 | now << 8 | now >> 8;
        now &= within[x];
      }
      changed = changed || now != grown[x];
      grown[x] = now;
    };
    for (std::size_t x = 0; x < 8; ++x) spread(x, x > 0 ? grown[x - 1] : 0);
    for (std::size_t x = 7; x-- > 0;) spread(x, grown[x + 1]);
  }
}

/// Appends the labels of a leaf, in scan order.
void label_leaf(const float* value, float below, std::vector<LeafSet>& sets) {
  const LeafBits inside = bits_below(value, below);
  LeafBits open;
  open.fill(~std::uint64_t{0});
  for (std::size_t x = 0; x < 8; ++x) {
    while (open[x] != 0) {
      const auto bit = static_cast<std::size_t>(std::countr_zero(open[x]));
      const bool in = (inside[x] >> bit & 1U) != 0;
      LeafBits within;
      for (std::size_t w = 0; w < 8; ++w) within[w] = open[w] & (in ? inside[w] : ~inside[w]);
      LeafSet& set = sets.emplace_back(LeafSet{{}, in});
      set.bits[x] = std::uint64_t{1} << bit;
      flood(set.bits, within);
      for (std::size_t w = 0; w < 8; ++w) open[w] &= ~set.bits[w];
    }
  }
}

}  // namespace

int LeafSet::voxels() const {
  int count = 0;
  for (const std::uint64_t word : bits) count += std::popcount(word);
  return count;
}

unsigned LeafSet::first() const {
  unsigned x = 0;
  while (bits[x] == 0) ++x;
  return 64 * x + static_cast<unsigned>(std::countr_zero(bits[x]));
}

Components::Components(const Solid& solid, const Context& context, float below, const SampleRange* range)
    : solid_(solid), below_(below) {
  const Tree& tree = solid.impl().grid->tree();
  openvdb::CoordBBox box;
  tree.evalLeafBoundingBox(box);
  openvdb::CoordBBox tiles;
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile < 0) tiles.expand(tile.getBoundingBox());
  }
  box.expand(tiles);
  if (box.empty()) return;
  low_ = openvdb::Coord((box.min().x() >> 3) - 1, (box.min().y() >> 3) - 1, (box.min().z() >> 3) - 1);
  n_ = openvdb::Coord((box.max().x() >> 3) + 2, (box.max().y() >> 3) + 2, (box.max().z() >> 3) + 2) - low_;
  if (range != nullptr) {
    low_[static_cast<std::size_t>(range->axis)] = range->low >> 3;
    n_[static_cast<std::size_t>(range->axis)] = (range->high - range->low) >> 3;
  }
  find_blocks(tree);
  context.check();
  label(context);
  join();
}

std::vector<Components::Component> Components::list() const {
  std::vector<Component> result;
  std::vector<std::int64_t> slot(parent_.size(), -1);
  each_block([&](const openvdb::Coord& origin, const LeafLabels* labels, Id offset) {
    const std::size_t count = labels != nullptr ? labels->sets.size() : 1;
    for (std::size_t k = 0; k < count; ++k) {
      const Id root = find(offset + static_cast<Id>(k));
      if (slot[root] < 0) {
        slot[root] = static_cast<std::int64_t>(result.size());
        const unsigned first = labels != nullptr ? labels->sets[k].first() : 0;
        const openvdb::Coord at =
            origin + openvdb::Coord(static_cast<int>(first >> 6), static_cast<int>((first >> 3) & 7U),
                                    static_cast<int>(first & 7U));
        result.push_back({root, inside(at), 0, at});
      }
      result[static_cast<std::size_t>(slot[root])].voxels += labels != nullptr ? labels->sets[k].voxels() : Leaf::SIZE;
    }
  });
  return result;
}

Components::Id Components::at(const openvdb::Coord& ijk) const {
  const openvdb::Coord b = openvdb::Coord(ijk.x() >> 3, ijk.y() >> 3, ijk.z() >> 3) - low_;
  if (b.x() < 0 || b.y() < 0 || b.z() < 0 || b.x() >= n_.x() || b.y() >= n_.y() || b.z() >= n_.z()) return find(0);
  const std::size_t i = index(b);
  if (block_[i] < 0) return find(offset_[i]);
  return find(offset_[i] + static_cast<Id>(labels_of(block_[i]).at(Leaf::coordToOffset(ijk))));
}

openvdb::Coord Components::origin(std::size_t b) const {
  const auto z = static_cast<int>(b % static_cast<std::size_t>(n_.z()));
  const std::size_t xy = b / static_cast<std::size_t>(n_.z());
  const auto y = static_cast<int>(xy % static_cast<std::size_t>(n_.y()));
  const auto x = static_cast<int>(xy / static_cast<std::size_t>(n_.y()));
  return openvdb::Coord((x + low_.x()) * 8, (y + low_.y()) * 8, (z + low_.z()) * 8);
}

void Components::find_blocks(const Tree& tree) {
  const double count = 1.0 * n_.x() * n_.y() * n_.z();
  if (count > 2e9) {
    throw Error(Code::TooLarge, "the solid is too large to count its pieces", {}, "use a larger --voxel");
  }
  const openvdb::Coord low(low_.x() * 8, low_.y() * 8, low_.z() * 8);
  const openvdb::CoordBBox box(low, low.offsetBy(8 * n_.x() - 1, 8 * n_.y() - 1, 8 * n_.z() - 1));
  block_.assign(static_cast<std::size_t>(count), void_tile);
  const openvdb::tree::LeafManager<const Tree> leaves(tree);
  tree_leaves_.reserve(leaves.leafCount());
  for (std::size_t i = 0; i < leaves.leafCount(); ++i) {
    if (box.isInside(leaves.leaf(i).origin())) tree_leaves_.push_back(&leaves.leaf(i));
  }
  tbb::parallel_for(std::size_t{0}, tree_leaves_.size(), [&](std::size_t i) {
    const openvdb::Coord o = tree_leaves_[i]->origin();
    block_[index(openvdb::Coord(o.x() >> 3, o.y() >> 3, o.z() >> 3) - low_)] = static_cast<std::int32_t>(i);
  });
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile >= 0) continue;
    openvdb::CoordBBox part = tile.getBoundingBox();
    part.intersect(box);
    for (int x = part.min().x() >> 3; x <= part.max().x() >> 3; ++x) {
      for (int y = part.min().y() >> 3; y <= part.max().y() >> 3; ++y) {
        for (int z = part.min().z() >> 3; z <= part.max().z() >> 3; ++z) {
          block_[index(openvdb::Coord(x, y, z) - low_)] = full_tile;
        }
      }
    }
  }
}

void Components::label(const Context& context) {
  chunks_.resize((tree_leaves_.size() + chunk_size - 1) / chunk_size);
  tbb::parallel_for(std::size_t{0}, chunks_.size(), [&](std::size_t c) {
    if (context.cancelled()) return;
    thread_local std::vector<LeafSet> room;
    room.clear();
    Chunk& chunk = chunks_[c];
    for (std::size_t i = 0; i < chunk_size; ++i) {
      const std::size_t leaf = c * chunk_size + i;
      if (leaf < tree_leaves_.size()) label_leaf(tree_leaves_[leaf]->buffer().data(), below_, room);
      chunk.start[i + 1] = static_cast<std::uint16_t>(room.size());
    }
    chunk.sets = room;
  });
  context.check();
  offset_.resize(block_.size() + 1);
  Id next = 0;
  for (std::size_t b = 0; b < block_.size(); ++b) {
    offset_[b] = next;
    next += block_[b] >= 0 ? static_cast<Id>(labels_of(block_[b]).sets.size()) : 1U;
  }
  offset_.back() = next;
  parent_.resize(next);
  std::iota(parent_.begin(), parent_.end(), Id{0});
}

/// The smaller id becomes the root, so the result does not depend on the order of joining.
void Components::unite(Id a, Id b) {
  a = root_of(a);
  b = root_of(b);
  if (a != b) parent_[std::max(a, b)] = std::min(a, b);
}
Components::Id Components::root_of(Id i) {
  while (parent_[i] != i) {
    parent_[i] = parent_[parent_[i]];
    i = parent_[i];
  }
  return i;
}

void Components::join() {
  // Blocks are numbered along x, and so are labels: each share joins its own, then the shares are joined.
  const int shares = std::min(n_.x(), 16);
  const auto first = [&](int share) { return n_.x() * share / shares; };
  tbb::parallel_for(0, shares, [&](int share) {
    for (int x = first(share); x < first(share + 1); ++x) {
      if (x > first(share)) join_to_next(x - 1);
      join_across(x);
    }
  });
  for (int share = 1; share < shares; ++share) join_to_next(first(share) - 1);
  for (Id i = 0; i < parent_.size(); ++i) parent_[i] = parent_[parent_[i]];  // a parent is smaller, and done already
}

/// The blocks of a layer, along y and z.
void Components::join_across(int x) {
  std::size_t b = index(openvdb::Coord(x, 0, 0));
  for (int y = 0; y < n_.y(); ++y) {
    for (int z = 0; z < n_.z(); ++z, ++b) {
      if (y + 1 < n_.y()) join_faces(b, b + static_cast<std::size_t>(n_.z()), 1);
      if (z + 1 < n_.z()) join_faces(b, b + 1, 2);
    }
  }
}
void Components::join_to_next(int x) {
  const std::size_t end = index(openvdb::Coord(x + 1, 0, 0)), layer = end - index(openvdb::Coord(x, 0, 0));
  for (std::size_t b = end - layer; b < end; ++b) join_faces(b, b + layer, 0);
}

/// `b` lies after `a` along `axis`.
void Components::join_faces(std::size_t a, std::size_t b, unsigned axis) {
  if (block_[a] < 0 && block_[b] < 0) {
    if (block_[a] == block_[b]) unite(offset_[a], offset_[b]);
    return;
  }
  struct Side {
    std::array<std::uint64_t, 64> face;
    std::array<Id, 64> id;
    std::array<bool, 64> inside;
    std::size_t count = 0;
  };
  const auto side = [&](std::size_t block, bool upper) {
    Side found;
    const auto take = [&](std::uint64_t face, Id id, bool inside) {
      if (face == 0) return;
      found.face[found.count] = face;
      found.id[found.count] = id;
      found.inside[found.count++] = inside;
    };
    if (block_[block] < 0) {
      take(~std::uint64_t{0}, offset_[block], block_[block] == full_tile);
    } else {
      Id id = offset_[block];
      for (const LeafSet& set : labels_of(block_[block]).sets) take(face_of(set.bits, axis, upper), id++, set.inside);
    }
    return found;
  };
  const Side below = side(a, true), above = side(b, false);
  for (std::size_t i = 0; i < below.count; ++i)
    for (std::size_t j = 0; j < above.count; ++j)
      if (below.inside[i] == above.inside[j] && (below.face[i] & above.face[j]) != 0) unite(below.id[i], above.id[j]);
}

Vec3d world_mm(const openvdb::Coord& c, double voxel_mm) {
  return voxel_mm * Vec3d{1.0 * c.x(), 1.0 * c.y(), 1.0 * c.z()};
}

bool any_inside(const Shape& shape, const std::vector<openvdb::Coord>& samples, double voxel_mm) {
  std::vector<Vec3d> points;
  points.reserve(samples.size());
  for (const openvdb::Coord& at : samples) points.push_back(world_mm(at, voxel_mm));
  std::vector<float> value(points.size());
  shape.evaluate(points, value);
  return std::any_of(value.begin(), value.end(), [](float v) { return v < 0; });
}

Pieces summarize(const std::vector<Components::Component>& list, double voxel_mm) {
  Pieces result;
  for (std::size_t i = 1; i < list.size(); ++i) {  // 0 is the exterior
    auto& into = list[i].inside ? result.material : result.cavities;
    into.push_back({list[i].voxels, static_cast<double>(list[i].voxels) * voxel_mm * voxel_mm * voxel_mm,
                    world_mm(list[i].first, voxel_mm)});
  }
  const auto larger = [](const Piece& a, const Piece& b) { return a.voxels > b.voxels; };
  std::stable_sort(result.material.begin(), result.material.end(), larger);
  std::stable_sort(result.cavities.begin(), result.cavities.end(), larger);
  return result;
}

}  // namespace fibrolite
