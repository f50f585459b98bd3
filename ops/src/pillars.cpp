// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/pillars.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/frame.h"
#include "pillars_under.h"
#include "print_limits.h"

namespace fibrolite {
namespace {

constexpr double flattest_deg = 15;  ///< A head is never slimmer than this, or it would be as high as wide cells allow.
constexpr double slenderness = 25;

/// The nearest point of a lattice of triangles with this edge: its two numbers.
std::pair<int, int> nearest_on_lattice(double x, double y, double edge) {
  const double v = y / (edge * std::sqrt(0.75)), u = x / edge - 0.5 * v;
  std::pair<int, int> best{};
  double least = INFINITY;
  for (int i = static_cast<int>(std::floor(u)); i <= static_cast<int>(std::floor(u)) + 1; ++i)
    for (int j = static_cast<int>(std::floor(v)); j <= static_cast<int>(std::floor(v)) + 1; ++j) {
      const double du = u - i, dv = v - j, away = du * du + du * dv + dv * dv;
      if (away < least) {
        least = away;
        best = {i, j};
      }
    }
  return best;
}

/// Steep spots in the pillars' frame, lowest first.
using Storey = std::vector<Vec3d>;

class Builder {
 public:
  Builder(const Solid& solid, const PillarParams& params)
      : solid_(solid),
        params_(params),
        h_(solid.grid().voxel_mm),
        frame_(frame_along({}, params.up)),
        reach_(norm(solid.bounds_mm().size())) {
    const double steepest = std::clamp(params.print.overhang_deg, flattest_deg, 45.0);
    widening_ = std::tan(steepest * std::numbers::pi / 180);
    rays_.push_back(-frame_.z);
    for (const double lean : {0.5, 0.9}) {
      for (int k = 0; k < 8; ++k) {
        const double turn = k * std::numbers::pi / 4, out = lean * widening_;
        rays_.push_back(normalized(-frame_.z + out * std::cos(turn) * frame_.x + out * std::sin(turn) * frame_.y));
      }
    }
  }

  /// By cell, then by height.
  [[nodiscard]] std::vector<Storey> storeys(const std::vector<Spot>& spots) const {
    std::map<std::pair<int, int>, Storey> cells;
    for (const Spot& spot : spots) {
      const Vec3d p = frame_.to_local(spot.foot_mm);
      cells[nearest_on_lattice(p.x, p.y, std::sqrt(3.0) * params_.cell_mm)].push_back(p);
    }
    std::vector<Storey> result;
    for (auto& [place, cell] : cells) {
      std::sort(cell.begin(), cell.end(),
                [](Vec3d a, Vec3d b) { return std::tie(a.z, a.x, a.y) < std::tie(b.z, b.x, b.y); });
      for (std::size_t i = 0; i < cell.size(); ++i) {
        if (i == 0 || cell[i].z - cell[i - 1].z > 0.5 * params_.cell_mm) result.emplace_back();
        result.back().push_back(cell[i]);
      }
    }
    return result;
  }

  /// Of the upright cones that hold all spots, the one with the highest tip: under a slope it stands downhill. Steps of
  /// falling length away from the spot that is worst (subgradients; the problem is convex).
  [[nodiscard]] Vec3d highest_tip(const Storey& spots) const {
    Box3d box;
    for (const Vec3d& p : spots) box.include(p);
    Vec3d best{0, 0, -INFINITY}, tip = box.center();
    const double stride = 0.5 * std::hypot(box.size().x, box.size().y) + h_;
    for (int k = 0; k < 64; ++k) {
      Vec3d worst{};
      tip.z = INFINITY;
      for (const Vec3d& p : spots) {
        const double below = p.z - std::hypot(p.x - tip.x, p.y - tip.y) / widening_;
        if (below < tip.z) {
          tip.z = below;
          worst = p;
        }
      }
      if (tip.z > best.z) best = tip;
      const double away = std::hypot(worst.x - tip.x, worst.y - tip.y);
      if (away == 0) break;
      const double step = std::min(stride / (k + 2), away) / away;
      tip = tip + step * Vec3d{worst.x - tip.x, worst.y - tip.y, 0};
    }
    return best;
  }
  [[nodiscard]] Pillar under(const Storey& spots) const {
    const Vec3d tip = highest_tip(spots);
    const Vec3d middle{tip.x, tip.y, 0};
    const double lowest = spots.front().z, top = spots.back().z + h_;  // let in
    const double slim = 0.5 * params_.shaft_mm;
    const double wide = std::max(slim, (top - tip.z) * widening_ + h_);
    const double high = std::max((wide - slim) / widening_, 2 * h_);
    Pillar pillar{.head = {frame_.to_world({middle.x, middle.y, top - high}), slim,
                           frame_.to_world({middle.x, middle.y, top}), wide}};
    // Below all of the overhang its axis is in the void, or in a wall beside it.
    const Vec3d tip_of_head = pillar.head.a, under_all = frame_.to_world({middle.x, middle.y, lowest - 0.5 * h_});
    const double way = dot(under_all - tip_of_head, frame_.z);
    if (way < 0 || to_material(under_all, -frame_.z, way) < way) return pillar;
    double shortest = reach_;
    Vec3d along{};
    for (const Vec3d& ray : rays_) {
      const double length = to_material(tip_of_head, ray, shortest);
      if (length >= shortest) continue;
      shortest = length;
      along = ray;
    }
    if (shortest < reach_) {
      const double thick = std::max(slim, 0.5 * shortest / slenderness);
      pillar.head.radius_a_mm = std::min(thick, wide);
      pillar.shaft = Capsule{tip_of_head, tip_of_head + (shortest + 0.5 * thick) * along, thick};
    }
    return pillar;
  }

 private:
  /// How far it is along a ray, mm; `most`: farther.
  [[nodiscard]] double to_material(Vec3d from, Vec3d ray, double most) const {
    for (double t = 0; t < most; t += 0.5 * h_)
      if (solid_.distance(from + t * ray) < 0) return t;
    return most;
  }

  const Solid& solid_;
  const PillarParams& params_;
  double h_;
  Frame frame_;
  double reach_, widening_ = 1;
  std::vector<Vec3d> rays_;  ///< Where a shaft may go: straight down first.
};

}  // namespace

std::vector<Pillar> pillars(const Solid& solid, const Shape& lumen, const PillarParams& params,
                            const Context& context) {
  return pillars_under(overhangs(solid, lumen, params.print, params.up, context), solid, params, context);
}

std::vector<Pillar> pillars_under(std::vector<Spot> spots, const Solid& solid, const PillarParams& params,
                                  const Context& context) {
  const double voxel = solid.grid().voxel_mm;
  if (!(params.shaft_mm >= 2 * voxel * (1 - 1e-9)))
    throw Error(Code::BadRecipe, "a shaft is at least two voxels thick", "shaft_mm");
  if (!(params.cell_mm > 0)) throw Error(Code::BadRecipe, "the cell must be above 0", "cell_mm");
  std::vector<Vec3d> feet;
  for (const Spot& spot : spots) feet.push_back(spot.foot_mm);
  std::vector<float> beside(feet.size());
  params.lattice.evaluate(feet, beside);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < spots.size(); ++i)
    if (std::abs(beside[i]) > 0.5 * voxel) spots[kept++] = spots[i];
  spots.resize(kept);
  keep_wide_patches(spots, params.up, params.node_mm);

  const Builder builder(solid, params);
  std::vector<Pillar> result;
  for (const Storey& storey : builder.storeys(spots)) {
    context.check();
    result.push_back(builder.under(storey));
  }
  return result;
}

Shape shape(const std::vector<Pillar>& pillars) {
  std::vector<Frustum> heads;
  std::vector<Capsule> shafts;
  for (const Pillar& pillar : pillars) {
    heads.push_back(pillar.head);
    if (pillar.shaft) shafts.push_back(*pillar.shaft);
  }
  return unite({frusta(std::move(heads)), capsules(std::move(shafts))});
}

}  // namespace fibrolite
