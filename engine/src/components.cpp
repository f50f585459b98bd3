// SPDX-License-Identifier: Apache-2.0
#include "components.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

constexpr std::array<openvdb::Index, 3> stride{64, 8, 1};  // of x, y, z in a leaf's buffer

/// A leaf's samples as bits: bit 8 y + z of word x.
using Bits = std::array<std::uint64_t, 8>;

/// All of `within` that hangs together with what is set in `grown`. Whole planes move at a time.
void flood(Bits& grown, const Bits& within) {
  constexpr std::uint64_t first_column = 0x0101010101010101U;
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

LeafLabels label_leaf(const float* value, float below) {
  LeafLabels result;
  result.label.fill(0);
  Bits inside;
  for (std::size_t x = 0; x < 8; ++x) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < 64; ++i) word |= std::uint64_t{value[64 * x + i] < below} << i;
    inside[x] = word;
  }
  Bits open;
  open.fill(~std::uint64_t{0});
  for (std::size_t x = 0; x < 8; ++x) {
    while (open[x] != 0) {
      const auto bit = static_cast<std::size_t>(std::countr_zero(open[x]));
      const bool in = (inside[x] >> bit & 1U) != 0;
      Bits within, grown{};
      for (std::size_t w = 0; w < 8; ++w) within[w] = open[w] & (in ? inside[w] : ~inside[w]);
      grown[x] = std::uint64_t{1} << bit;
      flood(grown, within);
      const auto id = static_cast<std::uint16_t>(result.voxels.size());
      int count = 0;
      for (std::size_t w = 0; w < 8; ++w) {
        open[w] &= ~grown[w];
        count += std::popcount(grown[w]);
        for (std::uint64_t rest = id > 0 ? grown[w] : 0; rest != 0; rest &= rest - 1)
          result.label[64 * w + static_cast<std::size_t>(std::countr_zero(rest))] = id;
      }
      result.voxels.push_back(static_cast<std::uint16_t>(count));
      result.first.push_back(static_cast<std::uint16_t>(64 * x + bit));
    }
  }
  return result;
}

}  // namespace

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
  for (std::size_t b = 0; b < block_.size(); ++b) {
    const Id count = offset_[b + 1] - offset_[b];
    for (Id k = 0; k < count; ++k) {
      const Id root = find(offset_[b] + k);
      const std::int64_t voxels = block_[b] >= 0 ? leaves_[static_cast<std::size_t>(block_[b])].voxels[k] : Leaf::SIZE;
      if (slot[root] < 0) {
        slot[root] = static_cast<std::int64_t>(result.size());
        const unsigned first = block_[b] >= 0 ? leaves_[static_cast<std::size_t>(block_[b])].first[k] : 0U;
        const openvdb::Coord at =
            origin(b) + openvdb::Coord(static_cast<int>(first >> 6), static_cast<int>((first >> 3) & 7U),
                                       static_cast<int>(first & 7U));
        result.push_back({root, inside(at), 0, at});
      }
      result[static_cast<std::size_t>(slot[root])].voxels += voxels;
    }
  }
  return result;
}

Components::Id Components::at(const openvdb::Coord& ijk) const {
  const openvdb::Coord b = openvdb::Coord(ijk.x() >> 3, ijk.y() >> 3, ijk.z() >> 3) - low_;
  if (b.x() < 0 || b.y() < 0 || b.z() < 0 || b.x() >= n_.x() || b.y() >= n_.y() || b.z() >= n_.z()) return find(0);
  const std::size_t i = index(b);
  if (block_[i] < 0) return find(offset_[i]);
  return find(offset_[i] + leaves_[static_cast<std::size_t>(block_[i])].label[Leaf::coordToOffset(ijk)]);
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
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord o = leaf->origin();
    if (!box.isInside(o)) continue;
    block_[index(openvdb::Coord(o.x() >> 3, o.y() >> 3, o.z() >> 3) - low_)] =
        static_cast<std::int32_t>(tree_leaves_.size());
    tree_leaves_.push_back(leaf.getLeaf());
  }
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
  leaves_.resize(tree_leaves_.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves_.size(), 64), [&](const auto& range) {
    if (context.cancelled()) return;
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      leaves_[i] = label_leaf(tree_leaves_[i]->buffer().data(), below_);
  });
  context.check();
  offset_.resize(block_.size() + 1);
  Id next = 0;
  for (std::size_t b = 0; b < block_.size(); ++b) {
    offset_[b] = next;
    next += block_[b] >= 0 ? static_cast<Id>(leaves_[static_cast<std::size_t>(block_[b])].voxels.size()) : 1U;
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
  for (int x = 0; x < n_.x(); ++x) {
    for (int y = 0; y < n_.y(); ++y) {
      for (int z = 0; z < n_.z(); ++z) {
        const std::size_t b = index(openvdb::Coord(x, y, z));
        if (x + 1 < n_.x()) join_faces(b, index(openvdb::Coord(x + 1, y, z)), 0);
        if (y + 1 < n_.y()) join_faces(b, index(openvdb::Coord(x, y + 1, z)), 1);
        if (z + 1 < n_.z()) join_faces(b, index(openvdb::Coord(x, y, z + 1)), 2);
      }
    }
  }
}

/// `b` lies after `a` along `axis`.
void Components::join_faces(std::size_t a, std::size_t b, unsigned axis) {
  if (block_[a] < 0 && block_[b] < 0) {
    if (block_[a] == block_[b]) unite(offset_[a], offset_[b]);
    return;
  }
  const float* va = block_[a] >= 0 ? tree_leaves_[static_cast<std::size_t>(block_[a])]->buffer().data() : nullptr;
  const float* vb = block_[b] >= 0 ? tree_leaves_[static_cast<std::size_t>(block_[b])]->buffer().data() : nullptr;
  const unsigned s = stride[axis], u = stride[(axis + 1) % 3], v = stride[(axis + 2) % 3];
  Id last_a = 0, last_b = 0;
  bool any = false;
  for (unsigned i = 0; i < 8; ++i) {
    for (unsigned j = 0; j < 8; ++j) {
      const unsigned pa = 7 * s + i * u + j * v, pb = i * u + j * v;
      const bool ia = va != nullptr ? va[pa] < below_ : block_[a] == full_tile;
      const bool ib = vb != nullptr ? vb[pb] < below_ : block_[b] == full_tile;
      if (ia != ib) continue;
      const Id la = offset_[a] + (va != nullptr ? leaves_[static_cast<std::size_t>(block_[a])].label[pa] : 0U);
      const Id lb = offset_[b] + (vb != nullptr ? leaves_[static_cast<std::size_t>(block_[b])].label[pb] : 0U);
      if (any && la == last_a && lb == last_b) continue;  // neighbours on a face mostly repeat
      unite(la, lb);
      last_a = la;
      last_b = lb;
      any = true;
    }
  }
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
