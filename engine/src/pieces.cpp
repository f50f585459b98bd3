// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/pieces.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <iterator>
#include <optional>
#include <queue>
#include <utility>

#include "components.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using Id = Components::Id;

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

/// From one piece, given by its id and a sample, to the nearest other.
std::optional<Gap> gap_of(const Components& components, Id id, const openvdb::Coord& sample, double voxel,
                          double reach_mm) {
  const auto reach = static_cast<int>(std::ceil(reach_mm / voxel));
  // The piece's samples, then a wave through void that remembers which sample it came from.
  struct Front {
    openvdb::Coord at, from;
  };
  std::deque<Front> wave;
  openvdb::MaskTree seen;
  openvdb::CoordBBox box;
  std::vector<openvdb::Coord> stack{sample};
  seen.setValueOn(sample);
  constexpr std::array<std::array<int, 3>, 6> steps{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  while (!stack.empty()) {
    const openvdb::Coord at = stack.back();
    stack.pop_back();
    bool edge = false;
    for (const auto& s : steps) {
      const openvdb::Coord to = at.offsetBy(s[0], s[1], s[2]);
      if (components.at(to) != id) {
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
    const Id here = components.at(f.at);
    if (here != id && components.inside(f.at)) {
      return Gap{world(f.from, voxel), world(f.at, voxel)};
    }
    for (const auto& s : steps) {
      const openvdb::Coord to = f.at.offsetBy(s[0], s[1], s[2]);
      if (seen.isValueOn(to)) continue;
      seen.setValueOn(to);
      queue.push({to, f.from});
    }
  }
  return std::nullopt;
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
  for (const auto& piece : list) {
    context.check();
    if (!piece.inside || piece.id == keep) continue;
    if (const auto gap = gap_of(components, piece.id, piece.first, solid.grid().voxel_mm, reach_mm))
      result.push_back(*gap);
  }
  return result;
}

std::optional<Gap> gap_from(const Solid& solid, Vec3d sample_mm, double reach_mm, const Context& context) {
  const Components components(solid, context);
  const double voxel = solid.grid().voxel_mm;
  const auto nearest = [&](double mm) { return static_cast<int>(std::lround(mm / voxel)); };
  const openvdb::Coord at(nearest(sample_mm.x), nearest(sample_mm.y), nearest(sample_mm.z));
  if (components.empty() || !components.inside(at)) return std::nullopt;
  return gap_of(components, components.at(at), at, voxel, reach_mm);
}

}  // namespace fibrolite
