// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/piece_sweep.h"

#include <openvdb/openvdb.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include "components.h"
#include "depth.h"
#include "nearest_way.h"

namespace fibrolite {
namespace {

using Id = std::uint32_t;
using Tree = Components::Tree;
using openvdb::Coord;

constexpr Id exterior = Components::exterior;

std::tuple<int, int, int> key(const Vec3i& v) { return {v.x, v.y, v.z}; }

/// What is known of a set of samples that hang together.
struct Set {
  bool inside = false, held = false;
  std::int64_t voxels = 0;
  Coord first{};
  openvdb::CoordBBox box{};
  std::vector<Flips::Block> samples;  ///< All of them, as long as they are few.
};

/// Order of first samples: by block, x slowest, then within it.
bool earlier(const Coord& a, const Coord& b) {
  const Coord block_a = a & ~7, block_b = b & ~7;
  return std::tie(block_a, a) < std::tie(block_b, b);
}

/// The layer of samples of a block that the next slab touches.
struct Face {
  std::array<Id, 64> id;
  std::uint64_t inside = 0;
};

}  // namespace

struct PieceSweep::Impl {
  Impl(Grid g, const Params& p)
      : grid(g),
        params(p),
        axis(static_cast<std::size_t>(p.axis)),
        few(std::max(p.clean.drop_below_vox, p.clean.fill_below_vox)) {
    make(false);  // the exterior
  }

  Id make(bool inside) {
    parent.push_back(static_cast<Id>(parent.size()));
    sets.emplace_back().inside = inside;
    return parent.back();
  }
  Id root(Id i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void join(Id a, Id b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    if (a > b) std::swap(a, b);
    parent[b] = a;
    Set &to = sets[a], &from = sets[b];
    if (to.voxels == 0 || (from.voxels > 0 && earlier(from.first, to.first))) to.first = from.first;
    to.voxels += from.voxels;
    to.held = to.held || from.held;
    to.box.expand(from.box);
    if (a == exterior || to.voxels >= few) {
      to.samples = {};
    } else {
      to.samples.insert(to.samples.end(), from.samples.begin(), from.samples.end());
    }
    from = {};
  }

  /// Place of a block across the axis.
  [[nodiscard]] std::pair<int, int> across(const Coord& origin) const {
    return {origin[(axis + 1) % 3], origin[(axis + 2) % 3]};
  }

  void join_faces(const Face& a, const Face& b) {
    for (std::size_t n = 0; n < 64; ++n) {
      const bool repeats = n > 0 && a.id[n] == a.id[n - 1] && b.id[n] == b.id[n - 1];
      if (repeats || ((a.inside ^ b.inside) >> n & 1U) != 0) continue;
      join(a.id[n], b.id[n]);
    }
  }
  static Face outside() {
    Face face;
    face.id.fill(exterior);
    return face;
  }

  [[nodiscard]] Components components_of(const Solid& solid, const SampleRange& range, const Context& context) const {
    return {solid, context, -static_cast<float>(params.skin_mm), &range};
  }
  /// `solid`: if there is a skin.
  void add(const Components& components, const SampleRange& range, const Shape& anchor, const Solid* solid,
           const Context& context) {
    std::map<std::pair<int, int>, Face> next;
    if (!components.empty()) take(components, range, anchor, solid, next, context);
    // What the slab before left open, against this one's first layer or the exterior.
    for (const auto& [place, face] : faces) join_faces(face, outside_if_absent(first_layer, place));
    for (const auto& [place, face] : first_layer)
      if (faces.find(place) == faces.end()) join_faces(face, outside());
    first_layer.clear();
    faces = std::move(next);
  }
  static Face outside_if_absent(const std::map<std::pair<int, int>, Face>& layer, const std::pair<int, int>& place) {
    const auto found = layer.find(place);
    return found != layer.end() ? found->second : outside();
  }

  void take(const Components& components, const SampleRange& range, const Shape& anchor, const Solid* solid,
            std::map<std::pair<int, int>, Face>& next, const Context& context) {
    // The slab's components get numbers of their own.
    const auto& list = components.list();
    const auto numbers = static_cast<Id>(sets.size()) - 1;  // of those before
    const auto number = [&](Id component) { return component == exterior ? exterior : numbers + component; };
    bool any_few = false;
    for (std::size_t i = 1; i < list.size(); ++i) {
      const Id id = make(list[i].inside);
      sets[id].voxels = list[i].voxels;
      sets[id].first = list[i].first;
      any_few = any_few || list[i].voxels < few;
    }
    std::vector<Id> id;
    components.each_block([&](const Coord& origin, const LeafLabels* labels, std::span<const Id> of) {
      id.resize(of.size());
      std::transform(of.begin(), of.end(), id.begin(), number);
      const auto box = openvdb::CoordBBox::createCube(origin, 8);
      for (const Id i : id) sets[i].box.expand(box);
      if (any_few) remember(origin, labels, id);
      const int first = params.falling ? range.high - 8 : range.low, last = params.falling ? range.low : range.high - 8;
      if (origin[axis] == first) first_layer.emplace(across(origin), face(labels, id, params.falling));
      if (origin[axis] == last) next.emplace(across(origin), face(labels, id, !params.falling));
      hold(origin, labels, id, anchor);
    });
    if (solid != nullptr) regrow(components, numbers, *solid, range, anchor, context);
  }

  /// Values of a union understate depth, so that a skin cuts off more than it should: what is not held is grown by the
  /// samples around it that are deep all the same, until it meets what is.
  void regrow(const Components& components, Id numbers, const Solid& solid, const SampleRange& range,
              const Shape& anchor, const Context& context) {
    constexpr std::int64_t most = 1 << 20;  // larger ones are met by those around them
    struct Open {
      Id set;
      Coord from;
      std::vector<Id> met{};
      bool anchored = false;
    };
    const auto number = [&](Id component) { return component == exterior ? exterior : numbers + component; };
    std::vector<Open> all;
    for (const Components::Component& one : components.list()) {
      const Id id = number(one.id);
      if (one.inside && !sets[id].held && one.voxels <= most) all.push_back({id, one.first});
    }
    tbb::enumerable_thread_specific<Depth> depths([&] { return Depth(solid, params.skin_mm, &range); });
    tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
      if (context.cancelled()) return;
      Open& mine = all[i];
      Depth& depth = depths.local();
      openvdb::MaskTree seen;
      seen.setValueOn(mine.from);
      std::vector<Coord> samples{mine.from};
      for (std::size_t done = 0; done < samples.size(); ++done) {
        for (const auto& s : face_steps) {
          const Coord to = samples[done].offsetBy(s[0], s[1], s[2]);
          if (!range.holds({to.x(), to.y(), to.z()}) || seen.isValueOn(to)) continue;
          seen.setValueOn(to);
          if (!depth.deep(to)) continue;
          const Id other = number(components.at(to));
          if (other == mine.set || !sets[other].inside) {
            samples.push_back(to);
            continue;
          }
          if (mine.met.empty() || mine.met.back() != other) mine.met.push_back(other);
          if (sets[other].held) return;
        }
      }
      mine.anchored = any_inside(anchor, samples, grid.voxel_mm);
    });
    context.check();
    for (const Open& one : all) {
      if (one.anchored) sets[root(one.set)].held = true;
      for (const Id other : one.met) join(one.set, other);
    }
  }

  [[nodiscard]] Face face(const LeafLabels* labels, const std::vector<Id>& id, bool upper) const {
    Face result;
    for (std::size_t k = 0; k < id.size(); ++k) {
      const std::uint64_t mine =
          labels != nullptr ? face_of(labels->sets[k].bits, params.axis, upper) : ~std::uint64_t{0};
      for (std::uint64_t rest = mine; rest != 0; rest &= rest - 1)
        result.id[static_cast<std::size_t>(std::countr_zero(rest))] = id[k];
      if (sets[id[k]].inside) result.inside |= mine;
    }
    return result;
  }

  void remember(const Coord& origin, const LeafLabels* labels, const std::vector<Id>& id) {
    if (labels == nullptr) {  // one value for all
      if (id[0] == exterior || sets[id[0]].voxels >= few) return;
      Flips::Block& block = sets[id[0]].samples.emplace_back();
      block.origin = {origin.x(), origin.y(), origin.z()};
      block.tile = true;
      return;
    }
    for (std::size_t k = 0; k < id.size(); ++k) {
      Set& set = sets[id[k]];
      if (id[k] == exterior || set.voxels >= few) continue;
      const bool here = !set.samples.empty() && set.samples.back().origin == Vec3i{origin.x(), origin.y(), origin.z()};
      Flips::Block& block = here ? set.samples.back() : set.samples.emplace_back();
      block.origin = {origin.x(), origin.y(), origin.z()};
      for (std::size_t w = 0; w < block.which.size(); ++w) block.which[w] |= labels->sets[k].bits[w];
    }
  }

  /// Most blocks hold nothing but what is known to be held: no need to ask for the anchor there.
  void hold(const Coord& origin, const LeafLabels* labels, const std::vector<Id>& id, const Shape& anchor) {
    const auto open = [&](Id i) { return sets[i].inside && !sets[i].held; };
    if (std::none_of(id.begin(), id.end(), open)) return;
    const double h = grid.voxel_mm;
    const Vec3d low = h * Vec3d{1.0 * origin.x(), 1.0 * origin.y(), 1.0 * origin.z()};
    if (anchor.bound({low, low + Vec3d{7 * h, 7 * h, 7 * h}}).lo >= 0) return;
    std::array<float, LeafLabels::size> x, y, z, value;
    for (std::size_t i = 0; i < LeafLabels::size; ++i) {
      x[i] = static_cast<float>(h * (origin.x() + static_cast<int>(i >> 6)));
      y[i] = static_cast<float>(h * (origin.y() + static_cast<int>(i >> 3 & 7U)));
      z[i] = static_cast<float>(h * (origin.z() + static_cast<int>(i & 7U)));
    }
    const Vec3i leaf{origin.x(), origin.y(), origin.z()};
    anchor.evaluate({x.data(), y.data(), z.data(), PointBlock::capacity, &leaf, h}, value.data());
    for (std::size_t i = 0; i < LeafLabels::size; ++i) {
      const Id at = id[labels != nullptr ? labels->at(i) : 0];
      if (value[i] < 0 && sets[at].inside) sets[at].held = true;
    }
  }

  Result finish() {
    for (const auto& [place, face] : faces) join_faces(face, outside());
    std::vector<Id> order;
    for (Id i = 1; i < parent.size(); ++i)
      if (parent[i] == i) order.push_back(i);
    std::sort(order.begin(), order.end(), [&](Id a, Id b) { return earlier(sets[a].first, sets[b].first); });
    Id keep = exterior;
    for (const Id i : order)
      if (sets[i].inside && (keep == exterior || sets[i].voxels > sets[keep].voxels)) keep = i;

    Result result;
    struct Kept {
      Piece piece;
      SampleBox box;
      bool held;
    };
    std::vector<Kept> material, cavities;
    const double h = grid.voxel_mm;
    for (const Id i : order) {
      Set& set = sets[i];
      const bool drop = set.inside && i != keep && set.voxels < params.clean.drop_below_vox;
      const bool fill = !set.inside && set.voxels < params.clean.fill_below_vox;
      result.dropped += drop ? 1 : 0;
      result.filled += fill ? 1 : 0;
      if (drop || fill) {
        result.flips.blocks.insert(result.flips.blocks.end(), set.samples.begin(), set.samples.end());
        continue;
      }
      const Vec3d first = h * Vec3d{1.0 * set.first.x(), 1.0 * set.first.y(), 1.0 * set.first.z()};
      const Coord a = set.box.min(), b = set.box.max().offsetBy(1);
      (set.inside ? material : cavities)
          .push_back({{set.voxels, static_cast<double>(set.voxels) * h * h * h, first},
                      {{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}},
                      set.held});
    }
    const auto larger = [](const Kept& a, const Kept& b) { return a.piece.voxels > b.piece.voxels; };
    std::stable_sort(material.begin(), material.end(), larger);
    std::stable_sort(cavities.begin(), cavities.end(), larger);
    for (const Kept& kept : material) {
      result.left.material.push_back(kept.piece);
      result.boxes.push_back(kept.box);
      result.held.push_back(kept.held);
    }
    for (const Kept& kept : cavities) result.left.cavities.push_back(kept.piece);
    merge(result.flips.blocks);
    return result;
  }

  /// One entry per block.
  static void merge(std::vector<Flips::Block>& blocks) {
    std::stable_sort(blocks.begin(), blocks.end(),
                     [](const Flips::Block& a, const Flips::Block& b) { return key(a.origin) < key(b.origin); });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (kept > 0 && blocks[kept - 1].origin == blocks[i].origin) {
        for (std::size_t w = 0; w < 8; ++w) blocks[kept - 1].which[w] |= blocks[i].which[w];
      } else {
        blocks[kept++] = blocks[i];
      }
    }
    blocks.resize(kept);
  }

  const Grid grid;
  const Params params;
  const std::size_t axis;
  const std::int64_t few;
  std::vector<Id> parent;
  std::vector<Set> sets;
  std::map<std::pair<int, int>, Face> faces, first_layer;
};

bool Flips::holds(Vec3i sample) const {
  const Vec3i origin{sample.x & ~7, sample.y & ~7, sample.z & ~7};
  const auto found = std::lower_bound(blocks.begin(), blocks.end(), origin,
                                      [](const Block& block, Vec3i at) { return key(block.origin) < key(at); });
  if (found == blocks.end() || found->origin != origin) return false;
  const auto word = static_cast<std::size_t>(sample.x & 7);
  return found->tile || (found->which[word] >> (8 * (sample.y & 7) + (sample.z & 7)) & 1U) != 0;
}

PieceSweep::PieceSweep(Grid grid, const Params& params) : impl_(std::make_shared<Impl>(grid, params)) {}

void PieceSweep::add(const Solid& solid, int low, int high, const Shape& anchor, const Context& context) {
  const SampleRange range{impl_->params.axis, low, high};
  impl_->add(impl_->components_of(solid, range, context), range, anchor, impl_->params.skin_mm > 0 ? &solid : nullptr,
             context);
}

PieceSweep::Result PieceSweep::finish() { return impl_->finish(); }

Solid flipped(Solid solid, const Flips& flips) {
  const Tree& from = solid.impl().grid->tree();
  const auto known = [&](const Flips::Block& block) {
    return block.tile || from.probeConstLeaf({block.origin.x, block.origin.y, block.origin.z}) != nullptr;
  };
  if (std::none_of(flips.blocks.begin(), flips.blocks.end(), known)) return solid;
  const Grid spec = solid.grid();
  const openvdb::FloatGrid::Ptr grid = editable(std::move(solid));
  Tree& tree = grid->tree();
  for (const Flips::Block& block : flips.blocks) {
    const Coord origin(block.origin.x, block.origin.y, block.origin.z);
    if (block.tile) {
      tree.addTile(1, origin, -tree.getValue(origin), false);
      continue;
    }
    Components::Leaf* leaf = tree.probeLeaf(origin);
    if (leaf == nullptr) continue;  // of another slab
    float* values = leaf->buffer().data();
    for (std::size_t i = 0; i < LeafLabels::size; ++i)
      if ((block.which[i >> 6] >> (i & 63U) & 1U) != 0) values[i] = -values[i];
  }
  return make_solid(grid, spec);
}

}  // namespace fibrolite
