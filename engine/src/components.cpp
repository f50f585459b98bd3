// SPDX-License-Identifier: Apache-2.0
#include "components.h"

#include <openvdb/tree/LeafManager.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <numeric>

#include "fibrolite/clones.h"
#include "fibrolite/error.h"
#include "inner_tiles.h"

namespace fibrolite {
namespace {

using Planes [[gnu::vector_size(64)]] = std::uint64_t;

/// Fills lines of samples in both directions, all at once: `step` bits apart, where no bit of `first` and `last` has a
/// neighbour before and after it. Fills twice as far each time (Kogge and Stone 1973).
template <int step>
[[gnu::always_inline]] inline void fill_lines(Planes& grown, const Planes& within, std::uint64_t first,
                                              std::uint64_t last) {
  Planes way = within & ~first;
  grown |= way & grown << step;
  way &= way << step;
  grown |= way & grown << 2 * step;
  way &= way << 2 * step;
  grown |= way & grown << 4 * step;
  way = within & ~last;
  grown |= way & grown >> step;
  way &= way >> step;
  grown |= way & grown >> 2 * step;
  way &= way >> 2 * step;
  grown |= way & grown >> 4 * step;
}

/// All of `within` that hangs together with what is set in `grown`.
FIBROLITE_CLONES void flood(LeafBits& grown, const LeafBits& within) {
  Planes all;
  std::memcpy(&all, within.data(), sizeof all);
  for (LeafBits before = within; before != grown;) {
    before = grown;
    for (std::size_t x = 1; x < 8; ++x) grown[x] |= grown[x - 1] & within[x];
    for (std::size_t x = 7; x-- > 0;) grown[x] |= grown[x + 1] & within[x];
    Planes now;
    std::memcpy(&now, grown.data(), sizeof now);
    fill_lines<1>(now, all, first_column, first_column << 7);
    fill_lines<8>(now, all, 0, 0);
    std::memcpy(grown.data(), &now, sizeof now);
    if (grown == within) return;
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
      LeafSet& set = sets.emplace_back(LeafSet{{}, 0, static_cast<std::uint16_t>(64 * x + bit), in});
      set.bits[x] = std::uint64_t{1} << bit;
      flood(set.bits, within);
      int voxels = 0;
      for (std::size_t w = 0; w < 8; ++w) {
        open[w] &= ~set.bits[w];
        voxels += std::popcount(set.bits[w]);
      }
      set.voxels = static_cast<std::uint16_t>(voxels);
    }
  }
}

}  // namespace

Components::Components(const Solid& solid, const Context& context, float below, const SampleRange* range)
    : solid_(solid), below_(below) {
  const Tree& tree = solid.impl().grid->tree();
  openvdb::CoordBBox box;
  tree.evalLeafBoundingBox(box);
  const std::vector<openvdb::CoordBBox> tiles = inner_tiles(tree);
  for (const openvdb::CoordBBox& tile : tiles) box.expand(tile);
  if (box.empty()) return;
  low_ = openvdb::Coord((box.min().x() >> 3) - 1, (box.min().y() >> 3) - 1, (box.min().z() >> 3) - 1);
  n_ = openvdb::Coord((box.max().x() >> 3) + 2, (box.max().y() >> 3) + 2, (box.max().z() >> 3) + 2) - low_;
  if (range != nullptr) {
    low_[static_cast<std::size_t>(range->axis)] = range->low >> 3;
    n_[static_cast<std::size_t>(range->axis)] = (range->high - range->low) >> 3;
  }
  find_blocks(tree, tiles);
  context.check();
  label(context);
  join();
  number();
  count_voxels();
}

Components::Id Components::at(const openvdb::Coord& ijk) const {
  const openvdb::Coord b = openvdb::Coord(ijk.x() >> 3, ijk.y() >> 3, ijk.z() >> 3) - low_;
  if (b.x() < 0 || b.y() < 0 || b.z() < 0 || b.x() >= n_.x() || b.y() >= n_.y() || b.z() >= n_.z()) return exterior;
  const std::size_t i = index(b);
  if (block_[i] < 0) return component_[offset_[i]];
  return component_[offset_[i] + labels_of(block_[i]).at(Leaf::coordToOffset(ijk))];
}

openvdb::Coord Components::origin(std::size_t b) const {
  const auto z = static_cast<int>(b % static_cast<std::size_t>(n_.z()));
  const std::size_t xy = b / static_cast<std::size_t>(n_.z());
  const auto y = static_cast<int>(xy % static_cast<std::size_t>(n_.y()));
  const auto x = static_cast<int>(xy / static_cast<std::size_t>(n_.y()));
  return openvdb::Coord((x + low_.x()) * 8, (y + low_.y()) * 8, (z + low_.z()) * 8);
}

void Components::find_blocks(const Tree& tree, const std::vector<openvdb::CoordBBox>& tiles) {
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
  for (openvdb::CoordBBox part : tiles) {
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
      fetch_ahead(tree_leaves_, leaf);
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
  component_.resize(next);
  std::iota(component_.begin(), component_.end(), Id{0});
}

/// The smaller id becomes the root, so the result does not depend on the order of joining.
void Components::unite(Id a, Id b) {
  a = root_of(a);
  b = root_of(b);
  if (a != b) component_[std::max(a, b)] = std::min(a, b);
}
Components::Id Components::root_of(Id i) {
  while (component_[i] != i) {
    component_[i] = component_[component_[i]];
    i = component_[i];
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
}

/// A component's root is its smallest label, and labels are in scan order: so are the roots.
void Components::number() {
  for (std::size_t b = 0; b < block_.size(); ++b) {
    for (Id i = offset_[b]; i < offset_[b + 1]; ++i) {
      if (component_[i] != i) {
        component_[i] = component_[component_[i]];  // smaller than i, and has its number already
        continue;
      }
      const auto id = static_cast<Id>(list_.size());
      component_[i] = id;
      Component& found = list_.emplace_back(Component{id, block_[b] == full_tile, 0, origin(b)});
      if (block_[b] < 0) continue;
      const LeafSet& set = labels_of(block_[b]).sets[i - offset_[b]];
      found.inside = set.inside;
      found.first += Leaf::offsetToLocalCoord(set.first);
    }
  }
}

void Components::count_voxels() {
  std::vector<std::atomic<std::int64_t>> voxels(list_.size());
  const std::size_t layer = index(openvdb::Coord(1, 0, 0));
  tbb::parallel_for(0, n_.x(), [&](int x) {
    // Mostly one component on each side.
    struct Run {
      Id of = exterior;
      std::int64_t voxels = 0;
    };
    std::array<Run, 2> runs;
    const auto add = [&](Id component, int count) {
      Run& run = runs[list_[component].inside ? 1 : 0];
      if (run.of != component) {
        voxels[run.of].fetch_add(run.voxels, std::memory_order_relaxed);
        run = {component, 0};
      }
      run.voxels += count;
    };
    const std::size_t first = index(openvdb::Coord(x, 0, 0));
    for (std::size_t b = first; b < first + layer; ++b) {
      if (block_[b] < 0) {
        add(component_[offset_[b]], Leaf::SIZE);
        continue;
      }
      Id label = offset_[b];
      for (const LeafSet& set : labels_of(block_[b]).sets) add(component_[label++], set.voxels);
    }
    for (const Run& run : runs) voxels[run.of].fetch_add(run.voxels, std::memory_order_relaxed);
  });
  for (Component& one : list_) one.voxels = voxels[one.id].load(std::memory_order_relaxed);
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
