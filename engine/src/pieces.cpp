// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/pieces.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "components.h"
#include "fibrolite/piece_sweep.h"
#include "nearest_way.h"

namespace fibrolite {
namespace {

using Id = Components::Id;

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

/// From one piece, given by its id and a sample, through void to the nearest other.
std::optional<Gap> gap_of(const Components& components, Id id, const openvdb::Coord& sample, double voxel,
                          double reach_mm) {
  std::vector<openvdb::Coord> edge, stack{sample};
  openvdb::MaskTree seen;
  seen.setValueOn(sample);
  while (!stack.empty()) {
    const openvdb::Coord at = stack.back();
    stack.pop_back();
    bool outermost = false;
    for (const auto& s : face_steps) {
      const openvdb::Coord to = at.offsetBy(s[0], s[1], s[2]);
      if (components.at(to) != id) {
        outermost = true;
      } else if (!seen.isValueOn(to)) {
        seen.setValueOn(to);
        stack.push_back(to);
      }
    }
    if (outermost) edge.push_back(at);
  }
  const auto found = nearest_way(
      edge, seen, std::ceil(reach_mm / voxel), [](const openvdb::Coord&) { return true; },
      [&](const SampleWay& way) { return components.at(way.to) != id && components.inside(way.to); });
  if (!found) return std::nullopt;
  return Gap{world_mm(found->from, voxel), world_mm(found->to, voxel)};
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
    const auto& list = components.list();
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

CleanResult clean(Solid solid, const CleanParams& params, const Context& context) {
  openvdb::CoordBBox box;
  solid.impl().grid->tree().evalActiveVoxelBoundingBox(box);
  if (box.empty()) return {std::move(solid), 0, 0, {}};
  PieceSweep sweep(solid.grid(), {.axis = 0, .clean = params});
  sweep.add(solid, (box.min().x() & ~7) - 8, (box.max().x() | 7) + 9, nothing(), context);
  PieceSweep::Result found = sweep.finish();
  CleanResult result{flipped(std::move(solid), found.flips), found.dropped, found.filled, std::move(found.left)};
  // A void that was filled may have been all that kept two pieces apart.
  if (result.filled > 0 && result.left.material.size() > 1) result.left = pieces(result.solid, context);
  return result;
}

std::vector<Gap> gaps(const Solid& solid, double reach_mm, const Context& context) {
  const Components components(solid, context);
  std::vector<Gap> result;
  if (components.empty()) return result;
  const auto& list = components.list();
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
