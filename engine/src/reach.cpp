// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/reach.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "components.h"
#include "depth.h"
#include "fibrolite/disjoint_sets.h"
#include "nearest_way.h"

namespace fibrolite {
namespace {

using openvdb::Coord;
using Leaf = Components::Leaf;
using Id = Components::Id;

/// Of each component, whether it is inside and holds a sample where the anchor is negative.
std::vector<bool> find_anchored(const Components& components, const Shape& anchor, double voxel_mm) {
  const auto& list = components.list();
  std::vector<bool> anchored(list.size(), false);
  components.each_block([&](const Coord& origin, const LeafLabels* labels, std::span<const Id> of) {
    // Most blocks hold nothing but what is known to be reached: no need to ask for the anchor there.
    if (std::none_of(of.begin(), of.end(), [&](Id c) { return list[c].inside && !anchored[c]; })) return;
    std::array<float, Leaf::SIZE> x, y, z, value;
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
      const Vec3f p = to_float(world_mm(origin + Leaf::offsetToLocalCoord(i), voxel_mm));
      x[i] = p.x, y[i] = p.y, z[i] = p.z;
    }
    const Vec3i leaf{origin.x(), origin.y(), origin.z()};
    anchor.evaluate({x.data(), y.data(), z.data(), Leaf::SIZE, &leaf, voxel_mm}, value.data());
    for (std::size_t i = 0; i < Leaf::SIZE; ++i) {
      const Id mine = of[labels != nullptr ? labels->at(i) : 0];
      if (list[mine].inside && value[i] < 0) anchored[mine] = true;
    }
  });
  return anchored;
}

/// Components that the values leave unreached, each grown by the samples around it that are deep all the same. Those
/// that meet are one; those that meet what is reached, or the anchor, are reached. Set 0 is what is reached.
class Regrown {
 public:
  Regrown(const Components& components, const std::vector<bool>& anchored, Depth& depth)
      : components_(components), anchored_(anchored), depth_(depth), sets_(1) {}

  void grow(const std::vector<Components::Component>& unreached, const Shape& anchor, double voxel_mm,
            const Context& context) {
    sets_ = DisjointSets(unreached.size() + 1);
    samples_.resize(unreached.size());
    for (std::size_t i = 0; i < unreached.size(); ++i) {
      context.check();
      flood(unreached[i], static_cast<std::uint32_t>(i + 1));
    }
    for (std::size_t i = 0; i < samples_.size(); ++i)
      if (any_inside(anchor, samples_[i], voxel_mm)) sets_.join(0, static_cast<std::uint32_t>(i + 1));
  }

  [[nodiscard]] std::uint32_t set_of(std::size_t i) { return sets_.root(static_cast<std::uint32_t>(i + 1)); }
  [[nodiscard]] const std::vector<Coord>& samples(std::size_t i) const { return samples_[i]; }
  /// The set that a sample belongs to: 0 is reached, -1 is none.
  [[nodiscard]] std::int64_t at(const Coord& at) {
    if (const std::int32_t mine = owner_.getValue(at); mine > 0) return sets_.root(static_cast<std::uint32_t>(mine));
    return anchored_[components_.at(at)] ? 0 : -1;
  }
  void reach(std::uint32_t set) { sets_.join(0, set); }

 private:
  void flood(const Components::Component& from, std::uint32_t mine) {
    std::vector<Coord>& stack = samples_[mine - 1];  // of which the first `done` have been looked around from
    if (const std::int32_t taken = owner_.getValue(from.first); taken > 0) {
      sets_.join(static_cast<std::uint32_t>(taken), mine);
      return;
    }
    stack.push_back(from.first);
    owner_.setValue(from.first, static_cast<std::int32_t>(mine));
    for (std::size_t done = 0; done < stack.size(); ++done) {
      for (const auto& s : face_steps) {
        const Coord to = stack[done].offsetBy(s[0], s[1], s[2]);
        if (const std::int32_t taken = owner_.getValue(to); taken > 0) {
          sets_.join(static_cast<std::uint32_t>(taken), mine);
          continue;
        }
        if (!depth_.deep(to)) continue;
        if (anchored_[components_.at(to)]) {
          sets_.join(0, mine);
          continue;
        }
        owner_.setValue(to, static_cast<std::int32_t>(mine));
        stack.push_back(to);
      }
    }
  }

  const Components& components_;
  const std::vector<bool>& anchored_;
  Depth& depth_;
  DisjointSets sets_;
  std::vector<std::vector<Coord>> samples_;
  openvdb::Int32Tree owner_{0};
};

/// Samples within half a cube's diagonal of a line make a chain of neighbours along it: those whose cubes it passes.
constexpr double half_diagonal = 0.8661;
constexpr double told_beyond = 0.5;  ///< Voxels that values must be told deeper than the skin.

}  // namespace

double skin_mm(double neck_mm, Grid grid) {
  const double told = std::max(grid.band_vox, grid.inside_vox) - told_beyond;
  return std::clamp(0.5 * neck_mm - half_diagonal * grid.voxel_mm, 0.0, told * grid.voxel_mm);
}

double coarsest_voxel(double neck_mm, double held_mm) { return 0.5 * (neck_mm - held_mm) / half_diagonal; }

Grid telling(double neck_mm, Grid grid) {
  // A block without a value of its own is at least this deep in its middle.
  const float most = grid.band_vox + 3.5F;
  const auto needed = static_cast<float>(0.5 * neck_mm / grid.voxel_mm - half_diagonal + told_beyond);
  grid.inside_vox = needed > grid.band_vox ? std::min(needed, most) : 0;
  return grid;
}

std::vector<Unreached> unreached(const Solid& solid, const Shape& anchor, const ReachParams& params,
                                 const Context& context) {
  const Grid grid = solid.grid();
  const double voxel = grid.voxel_mm;
  const double depth_mm = skin_mm(params.neck_mm, grid);
  const Components components(solid, context, -static_cast<float>(depth_mm));
  if (components.empty()) return {};
  auto list = components.list();
  const std::vector<bool> anchored = find_anchored(components, anchor, voxel);
  std::erase_if(list, [&](const auto& c) { return !c.inside || anchored[c.id]; });
  if (list.empty()) return {};

  std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.voxels > b.voxels; });
  Depth depth(solid, depth_mm);
  Regrown regrown(components, anchored, depth);
  regrown.grow(list, anchor, voxel, context);

  std::vector<Unreached> found;
  std::vector<std::vector<Coord>> samples;
  std::vector<std::uint32_t> set;
  std::vector<std::size_t> number(list.size() + 1, list.size());  // of each set, among those found
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::uint32_t mine = regrown.set_of(i);
    if (mine == 0) continue;
    if (number[mine] == list.size()) {
      number[mine] = found.size();
      set.push_back(mine);
      samples.emplace_back();
      found.push_back({.piece = {0, 0, world_mm(list[i].first, voxel)}});
    }
    std::vector<Coord>& all = samples[number[mine]];
    all.insert(all.end(), regrown.samples(i).begin(), regrown.samples(i).end());
  }
  for (std::size_t n = 0; n < found.size(); ++n) {
    Piece& piece = found[n].piece;
    piece.voxels = static_cast<std::int64_t>(samples[n].size());
    piece.volume_mm3 = static_cast<double>(piece.voxels) * voxel * voxel * voxel;
  }

  for (std::size_t n = 0; n < found.size() && params.way_mm > 0; ++n) {
    context.check();
    const std::vector<Coord>& sources = samples[n];
    const auto clear = [&](const SampleWay& way) {
      const Vec3d a = world_mm(way.from, voxel), b = world_mm(way.to, voxel);
      const int steps = 1 + static_cast<int>(norm(b - a) / voxel);
      for (int k = 0; k <= steps; ++k)
        if (params.keep_out(a + (1.0 * k / steps) * (b - a)) < 0.5 * params.neck_mm) return false;
      return true;
    };
    const auto look = [&](const auto& passable) {
      openvdb::MaskTree seen;
      for (const Coord& at : sources) seen.setValueOn(at);
      return nearest_way(sources, seen, params.way_mm / voxel, passable,
                         [&](const SampleWay& way) { return regrown.at(way.to) == 0 && clear(way); });
    };
    auto way = look([&](const Coord& at) { return depth.inside(at); });
    if (!way) way = look([](const Coord&) { return true; });
    if (!way) continue;
    found[n].way = Gap{world_mm(way->from, voxel), world_mm(way->to, voxel)};
    regrown.reach(set[n]);  // the next may hang on this one
  }
  return found;
}

}  // namespace fibrolite
