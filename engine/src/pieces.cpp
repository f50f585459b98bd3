// SPDX-License-Identifier: Apache-2.0
// Connected components: label each 8x8x8 block on its own, in parallel, then join labels across block faces.
#include "fibrolite/pieces.h"

#include <openvdb/openvdb.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <iterator>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "fibrolite/error.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using Id = std::uint32_t;

constexpr std::array<openvdb::Index, 3> stride{64, 8, 1};  // of x, y, z in a leaf's buffer

/// One leaf's labels, dense from 0 in scan order.
struct LeafLabels {
  std::array<std::uint16_t, Leaf::SIZE> label;
  std::vector<std::uint16_t> voxels;  // per label
  std::vector<std::uint16_t> first;   // per label: its first voxel
};

LeafLabels label_leaf(const float* value, float below) {
  LeafLabels result;
  constexpr auto unset = std::numeric_limits<std::uint16_t>::max();
  result.label.fill(unset);
  std::array<std::uint16_t, Leaf::SIZE> stack;
  for (std::uint16_t seed = 0; seed < Leaf::SIZE; ++seed) {
    if (result.label[seed] != unset) continue;
    const auto id = static_cast<std::uint16_t>(result.voxels.size());
    const bool inside = value[seed] < below;
    std::size_t top = 0;
    std::uint16_t count = 0;
    stack[top++] = seed;
    result.label[seed] = id;
    while (top > 0) {
      const unsigned v = stack[--top];
      ++count;
      for (unsigned axis = 0; axis < 3; ++axis) {
        const unsigned step = stride[axis], at = (v / step) & 7U;
        if (at > 0 && result.label[v - step] == unset && (value[v - step] < below) == inside) {
          result.label[v - step] = id;
          stack[top++] = static_cast<std::uint16_t>(v - step);
        }
        if (at < 7 && result.label[v + step] == unset && (value[v + step] < below) == inside) {
          result.label[v + step] = id;
          stack[top++] = static_cast<std::uint16_t>(v + step);
        }
      }
    }
    result.voxels.push_back(count);
    result.first.push_back(seed);
  }
  return result;
}

/// All 8x8x8 blocks of the solid's box and one layer around it, with globally joined labels. Inside is what reads less
/// than `below`, 0 or a depth within the band.
class Components {
 public:
  Components(const Solid& solid, const Context& context, float below = 0) : solid_(solid), below_(below) {
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
    find_blocks(tree);
    context.check();
    label(context);
    join();
  }

  [[nodiscard]] bool empty() const { return offset_.empty(); }

  struct Component {
    Id id;
    bool inside;
    std::int64_t voxels;
    openvdb::Coord first;
  };
  /// Joined components in scan order of their first voxel. The exterior is the first of all.
  [[nodiscard]] std::vector<Component> list() const {
    std::vector<Component> result;
    std::vector<std::int64_t> slot(parent_.size(), -1);
    for (std::size_t b = 0; b < block_.size(); ++b) {
      const Id count = offset_[b + 1] - offset_[b];
      for (Id k = 0; k < count; ++k) {
        const Id root = find(offset_[b] + k);
        const std::int64_t voxels =
            block_[b] >= 0 ? leaves_[static_cast<std::size_t>(block_[b])].voxels[k] : Leaf::SIZE;
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

  /// Root id of a sample; samples outside the box belong to the exterior.
  [[nodiscard]] Id at(const openvdb::Coord& ijk) const {
    const openvdb::Coord b = openvdb::Coord(ijk.x() >> 3, ijk.y() >> 3, ijk.z() >> 3) - low_;
    if (b.x() < 0 || b.y() < 0 || b.z() < 0 || b.x() >= n_.x() || b.y() >= n_.y() || b.z() >= n_.z()) return find(0);
    const std::size_t i = index(b);
    if (block_[i] < 0) return find(offset_[i]);
    return find(offset_[i] + leaves_[static_cast<std::size_t>(block_[i])].label[Leaf::coordToOffset(ijk)]);
  }
  [[nodiscard]] bool inside(const openvdb::Coord& ijk) const {
    return solid_.impl().grid->tree().getValue(ijk) < below_;
  }

  /// Calls visit(origin, leaf labels or null for a tile, global id of label 0) for each block, in scan order.
  template <class Visit>
  void each_block(const Visit& visit) const {
    for (std::size_t b = 0; b < block_.size(); ++b) {
      visit(origin(b), block_[b] >= 0 ? &leaves_[static_cast<std::size_t>(block_[b])] : nullptr, offset_[b]);
    }
  }
  [[nodiscard]] Id find(Id i) const {
    while (parent_[i] != i) i = parent_[i];
    return i;
  }

 private:
  [[nodiscard]] std::size_t index(const openvdb::Coord& b) const {
    return (static_cast<std::size_t>(b.x()) * static_cast<std::size_t>(n_.y()) + static_cast<std::size_t>(b.y())) *
               static_cast<std::size_t>(n_.z()) +
           static_cast<std::size_t>(b.z());
  }
  [[nodiscard]] openvdb::Coord origin(std::size_t b) const {
    const auto z = static_cast<int>(b % static_cast<std::size_t>(n_.z()));
    const std::size_t xy = b / static_cast<std::size_t>(n_.z());
    const auto y = static_cast<int>(xy % static_cast<std::size_t>(n_.y()));
    const auto x = static_cast<int>(xy / static_cast<std::size_t>(n_.y()));
    return openvdb::Coord((x + low_.x()) * 8, (y + low_.y()) * 8, (z + low_.z()) * 8);
  }

  static constexpr std::int32_t void_tile = -1, full_tile = -2;

  void find_blocks(const Tree& tree) {
    const double count = 1.0 * n_.x() * n_.y() * n_.z();
    if (count > 2e9) {
      throw Error(Code::TooLarge, "the solid is too large to count its pieces", {}, "use a larger --voxel");
    }
    block_.assign(static_cast<std::size_t>(count), void_tile);
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
      const openvdb::Coord o = leaf->origin();
      block_[index(openvdb::Coord(o.x() >> 3, o.y() >> 3, o.z() >> 3) - low_)] =
          static_cast<std::int32_t>(tree_leaves_.size());
      tree_leaves_.push_back(leaf.getLeaf());
    }
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
      if (*tile >= 0) continue;
      const openvdb::CoordBBox box = tile.getBoundingBox();
      for (int x = box.min().x() >> 3; x <= box.max().x() >> 3; ++x) {
        for (int y = box.min().y() >> 3; y <= box.max().y() >> 3; ++y) {
          for (int z = box.min().z() >> 3; z <= box.max().z() >> 3; ++z) {
            block_[index(openvdb::Coord(x, y, z) - low_)] = full_tile;
          }
        }
      }
    }
  }

  void label(const Context& context) {
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
  void unite(Id a, Id b) {
    a = root_of(a);
    b = root_of(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }
  Id root_of(Id i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }

  void join() {
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
  void join_faces(std::size_t a, std::size_t b, unsigned axis) {
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

  Solid solid_;
  float below_;
  openvdb::Coord low_, n_;
  std::vector<std::int32_t> block_;  // leaf number or a tile kind
  std::vector<const Leaf*> tree_leaves_;
  std::vector<LeafLabels> leaves_;
  std::vector<Id> offset_;  // first global id of each block
  std::vector<Id> parent_;
};

Vec3d world(const openvdb::Coord& c, double voxel) { return voxel * Vec3d{1.0 * c.x(), 1.0 * c.y(), 1.0 * c.z()}; }

Pieces summarize(const std::vector<Components::Component>& list, double voxel) {
  Pieces result;
  for (std::size_t i = 1; i < list.size(); ++i) {  // 0 is the exterior
    auto& into = list[i].inside ? result.material : result.cavities;
    into.push_back(
        {list[i].voxels, static_cast<double>(list[i].voxels) * voxel * voxel * voxel, world(list[i].first, voxel)});
  }
  const auto larger = [](const Piece& a, const Piece& b) { return a.voxels > b.voxels; };
  std::stable_sort(result.material.begin(), result.material.end(), larger);
  std::stable_sort(result.cavities.begin(), result.cavities.end(), larger);
  return result;
}

/// The largest material component, the one that is never loose.
Id main_piece(const std::vector<Components::Component>& list) {
  Id best = 0;
  std::int64_t most = -1;
  for (const auto& c : list) {
    if (c.inside && c.voxels > most) {
      most = c.voxels;
      best = c.id;
    }
  }
  return best;
}

}  // namespace

Pieces pieces(const Solid& solid, const Context& context) {
  const Components components(solid, context);
  if (components.empty()) return {};
  return summarize(components.list(), solid.grid().voxel_mm);
}

struct VoidMap::Impl {
  Impl(const Solid& solid, const Context& context) : components(solid, context) {
    if (components.empty()) return;
    std::vector<Components::Component> voids;
    const auto list = components.list();
    std::copy_if(list.begin() + 1, list.end(), std::back_inserter(voids), [](const auto& c) { return !c.inside; });
    std::stable_sort(voids.begin(), voids.end(), [](const auto& a, const auto& b) { return a.voxels > b.voxels; });
    for (const Components::Component& c : voids) number.emplace_back(c.id, static_cast<int>(number.size()) + 1);
    std::sort(number.begin(), number.end());
    voids.insert(voids.begin(), list.front());  // where summarize() expects the exterior
    cavities = summarize(voids, solid.grid().voxel_mm).cavities;
  }

  Components components;
  std::vector<Piece> cavities;
  std::vector<std::pair<Id, int>> number;  // of each cavity, by its id
};

VoidMap::VoidMap(const Solid& solid, const Context& context) : impl_(std::make_shared<const Impl>(solid, context)) {}
const std::vector<Piece>& VoidMap::cavities() const { return impl_->cavities; }
int VoidMap::at(Vec3i sample) const {
  const openvdb::Coord at(sample.x, sample.y, sample.z);
  if (impl_->components.empty()) return outside;
  if (impl_->components.inside(at)) return material;
  const Id id = impl_->components.at(at);
  const auto found = std::lower_bound(impl_->number.begin(), impl_->number.end(), std::pair(id, 0));
  return found != impl_->number.end() && found->first == id ? found->second : outside;
}

CleanResult clean(const Solid& solid, const CleanParams& params, const Context& context) {
  CleanResult result{solid, 0, 0, {}};
  const Components components(solid, context);
  if (components.empty()) return result;
  auto list = components.list();
  const Id keep = main_piece(list);
  std::vector<Id> flip;
  std::vector<Components::Component> left;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const auto& c = list[i];
    const bool drop = c.inside && c.id != keep && c.voxels < params.drop_below_vox;
    const bool fill = !c.inside && i > 0 && c.voxels < params.fill_below_vox;
    result.dropped += drop ? 1 : 0;
    result.filled += fill ? 1 : 0;
    if (drop || fill) {
      flip.push_back(c.id);
    } else {
      left.push_back(c);
    }
  }
  result.left = summarize(left, solid.grid().voxel_mm);
  if (flip.empty()) return result;

  std::sort(flip.begin(), flip.end());
  auto grid = solid.impl().grid->deepCopy();
  Tree& tree = grid->tree();
  components.each_block([&](const openvdb::Coord& origin, const LeafLabels* labels, Id offset) {
    const auto flipped = [&](Id local) {
      return std::binary_search(flip.begin(), flip.end(), components.find(offset + local));
    };
    if (labels == nullptr) {
      if (flipped(0)) tree.addTile(1, origin, -tree.getValue(origin), false);
      return;
    }
    std::vector<bool> which(labels->voxels.size());
    bool any = false;
    for (std::size_t k = 0; k < which.size(); ++k) {
      which[k] = flipped(static_cast<Id>(k));
      any = any || which[k];
    }
    if (!any) return;
    float* values = tree.probeLeaf(origin)->buffer().data();
    for (std::size_t v = 0; v < Leaf::SIZE; ++v) {
      if (which[labels->label[v]]) values[v] = -values[v];
    }
  });
  result.solid = make_solid(grid, solid.grid());
  return result;
}

std::vector<Piece> unreached(const Solid& solid, const Shape& anchor, double neck_mm, const Context& context) {
  const Grid grid = solid.grid();
  // A member of this width keeps a chain of neighbouring samples this deep, however it lies on the lattice.
  const double depth = std::clamp(0.5 * neck_mm - grid.voxel_mm, 0.0, (grid.band_vox - 0.5) * grid.voxel_mm);
  const Components components(solid, context, -static_cast<float>(depth));
  if (components.empty()) return {};
  auto list = components.list();
  std::vector<Id> loose;
  for (const auto& c : list)
    if (c.inside) loose.push_back(c.id);
  std::sort(loose.begin(), loose.end());
  std::vector<bool> reached(loose.size(), false);
  components.each_block([&](const openvdb::Coord& origin, const LeafLabels* labels, Id offset) {
    // Most blocks hold nothing but what is known to be reached: no need to ask for the anchor there.
    const std::size_t kinds = labels != nullptr ? labels->voxels.size() : 1;
    std::vector<std::size_t> open(kinds, loose.size());
    bool any = false;
    for (std::size_t k = 0; k < kinds; ++k) {
      const Id id = components.find(offset + static_cast<Id>(k));
      const auto at = std::lower_bound(loose.begin(), loose.end(), id);
      if (at == loose.end() || *at != id) continue;
      open[k] = static_cast<std::size_t>(at - loose.begin());
      any = any || !reached[open[k]];
    }
    if (!any) return;
    std::array<float, Leaf::SIZE> x, y, z, value;
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
      const Vec3f p = to_float(world(origin + Leaf::offsetToLocalCoord(i), grid.voxel_mm));
      x[i] = p.x, y[i] = p.y, z[i] = p.z;
    }
    const Vec3i leaf{origin.x(), origin.y(), origin.z()};
    anchor.evaluate({x.data(), y.data(), z.data(), Leaf::SIZE, &leaf, grid.voxel_mm}, value.data());
    for (std::size_t i = 0; i < Leaf::SIZE; ++i) {
      const std::size_t slot = open[labels != nullptr ? labels->label[i] : 0];
      if (slot < loose.size() && value[i] < 0) reached[slot] = true;
    }
  });
  std::erase_if(list, [&](const Components::Component& c) {
    const auto slot = std::lower_bound(loose.begin(), loose.end(), c.id) - loose.begin();
    return !c.inside || reached[static_cast<std::size_t>(slot)];
  });
  list.insert(list.begin(), {0, false, 0, {}});  // where summarize() expects the exterior
  return summarize(list, grid.voxel_mm).material;
}

std::vector<Gap> gaps(const Solid& solid, double reach_mm, const Context& context) {
  const Components components(solid, context);
  std::vector<Gap> result;
  if (components.empty()) return result;
  const auto list = components.list();
  const Id keep = main_piece(list);
  const double voxel = solid.grid().voxel_mm;
  const auto reach = static_cast<int>(std::ceil(reach_mm / voxel));

  for (const auto& piece : list) {
    context.check();
    if (!piece.inside || piece.id == keep) continue;
    // The piece's samples, then a wave through void that remembers which sample it came from.
    struct Front {
      openvdb::Coord at, from;
    };
    std::deque<Front> wave;
    openvdb::MaskTree seen;
    openvdb::CoordBBox box;
    std::vector<openvdb::Coord> stack{piece.first};
    seen.setValueOn(piece.first);
    constexpr std::array<std::array<int, 3>, 6> steps{
        {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
    while (!stack.empty()) {
      const openvdb::Coord at = stack.back();
      stack.pop_back();
      bool edge = false;
      for (const auto& s : steps) {
        const openvdb::Coord to = at.offsetBy(s[0], s[1], s[2]);
        if (components.at(to) != piece.id) {
          edge = true;
        } else if (!seen.isValueOn(to)) {
          seen.setValueOn(to);
          stack.push_back(to);
        }
      }
      if (edge) wave.push_back({at, at});
    }
    const auto distance2 = [](const openvdb::Coord& a, const openvdb::Coord& b) {
      const openvdb::Coord d = a - b;
      return 1.0 * d.x() * d.x() + 1.0 * d.y() * d.y() + 1.0 * d.z() * d.z();
    };
    // First by distance, then by place, so that the answer does not depend on how the wave started.
    const auto later = [&](const Front& a, const Front& b) {
      const double da = distance2(a.at, a.from), db = distance2(b.at, b.from);
      return da != db ? da > db : std::pair(a.at, a.from) > std::pair(b.at, b.from);
    };
    std::priority_queue<Front, std::vector<Front>, decltype(later)> queue(later,
                                                                          std::vector<Front>(wave.begin(), wave.end()));
    while (!queue.empty()) {
      const Front f = queue.top();
      queue.pop();
      if (distance2(f.at, f.from) > 1.0 * reach * reach) break;
      const Id id = components.at(f.at);
      if (id != piece.id && components.inside(f.at)) {
        result.push_back({world(f.from, voxel), world(f.at, voxel)});
        break;
      }
      for (const auto& s : steps) {
        const openvdb::Coord to = f.at.offsetBy(s[0], s[1], s[2]);
        if (seen.isValueOn(to)) continue;
        seen.setValueOn(to);
        queue.push({to, f.from});
      }
    }
  }
  return result;
}

}  // namespace fibrolite
