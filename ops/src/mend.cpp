// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/mend.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "fibrolite/realize.h"
#include "pillars_under.h"
#include "print_limits.h"

namespace fibrolite {
namespace {

constexpr int rounds = 3;  // what is mended can make a new gap, or a new void

/// A ball in the middle of each wall or gap, one per voxel. Magnitudes of a union are understated where its operands
/// meet, so what closes a gap reaches half a member into both its faces: then it does not look as if it hung by a
/// thread.
void add_balls(const std::vector<Spot>& spots, bool wall, const MendParams& params, double voxel_mm,
               std::vector<Capsule>& balls) {
  std::vector<std::pair<std::tuple<long, long, long>, Capsule>> found;
  for (const Spot& spot : spots) {
    const Vec3d middle = spot.foot_mm + (wall ? -0.5 : 0.5) * spot.mm * spot.normal;
    const double radius = wall ? 0.5 * params.print.wall_mm : 0.5 * (spot.mm + params.tie.strut_mm) + voxel_mm;
    const auto cell = [&](double v) { return std::lround(v / voxel_mm); };
    found.push_back({{cell(middle.x), cell(middle.y), cell(middle.z)}, {middle, middle, radius}});
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i == 0 || found[i].first != found[i - 1].first) balls.push_back(found[i].second);
  }
}

/// A ball about what a hole has left on too thin a neck, where no tie can lie: a sliver between the hole and a face. It
/// leaves half of the shell.
std::vector<Capsule> slivers(const Tied& tied, const Shape& lumen, const MendParams& params) {
  std::vector<Capsule> balls;
  for (const Piece& piece : tied.unreached) {
    const double size = std::cbrt(0.75 / std::numbers::pi * piece.volume_mm3);
    const double radius = std::min(size + 0.5 * params.tie.strut_mm, -1.0 * lumen(piece.sample_mm));
    if (size < 0.5 * params.drain_mm && radius > 0) balls.push_back({piece.sample_mm, piece.sample_mm, radius});
  }
  return balls;
}

}  // namespace

Shape with_mends(const Shape& whole, const Shape& body, const Mended& m) {
  Shape result = with_ties(whole, body, m.tied.changes);
  if (!m.thickened.empty()) result = unite({result, intersect({body, capsules(m.thickened)})});
  if (!m.pillars.empty()) result = unite({result, intersect({body, shape(m.pillars)})});
  if (!m.drains.empty()) result = subtract(result, m.keep_out());
  return result;
}

Shape Mended::keep_out() const {
  std::vector<Capsule> all = shapes(drains);
  all.insert(all.end(), shaved.begin(), shaved.end());
  return capsules(all);
}

Mended mend(const Tied& tied, const Solid& body, const MendParams& params, const Context& context) {
  Mended out{.tied = tied};
  const double voxel = body.grid().voxel_mm;
  const Shape b = distance_to(body), lumen = offset(b, -0.5 * params.shell_mm);
  const PillarParams bearing{.print = params.print,
                             .up = params.up,
                             .node_mm = params.node_mm,
                             .shaft_mm = params.tie.strut_mm,
                             .cell_mm = 2.5 * params.tie.strut_mm,
                             .lattice = params.lattice};
  for (int round = 0; params.faults && round < rounds; ++round) {
    Scan found = print_scan(out.tied.solid, lumen, params.print, params.up, context);
    std::vector<Capsule> balls;
    add_balls(found.walls, true, params, voxel, balls);
    add_balls(found.gaps, false, params, voxel, balls);
    const std::vector<Pillar> under = pillars_under(std::move(found.steep), out.tied.solid, bearing, context);
    if (balls.empty() && under.empty()) break;
    const Shape thicker = unite({distance_to(out.tied.solid), intersect({b, unite({capsules(balls), shape(under)})})});
    out.tied = tie_again(out.tied, realize(thicker, body, context), body, params.tie, context);
    out.thickened.insert(out.thickened.end(), balls.begin(), balls.end());
    out.pillars.insert(out.pillars.end(), under.begin(), under.end());
  }
  if (params.drain_mm == 0) return out;
  const double ball_vox = std::numbers::pi / 6 * std::pow(params.drain_mm / voxel, 3);
  const CleanResult filled =
      clean(out.tied.solid, {.drop_below_vox = 0, .fill_below_vox = std::lround(ball_vox)}, context);
  out.tied.solid = filled.solid;
  out.tied.left = filled.left;
  out.voids_filled = filled.filled;
  const auto take_away = [&](const std::vector<Capsule>& holes) {
    TieParams around = params.tie;
    around.keep_out = out.keep_out();
    const Shape drilled = subtract(distance_to(out.tied.solid), capsules(holes));
    out.tied = tie_again(out.tied, realize(drilled, body, context), body, around, context);
  };
  for (int round = 0; round < rounds && !out.tied.left.cavities.empty(); ++round) {
    const auto holes =
        drains(out.tied.solid, {.hole_mm = params.drain_mm, .up = params.up, .reach_mm = 4 * params.shell_mm}, context);
    out.drains.insert(out.drains.end(), holes.begin(), holes.end());
    take_away(shapes(holes));
    for (int shave = 0; shave < rounds && !out.tied.unreached.empty(); ++shave) {
      const std::vector<Capsule> balls = slivers(out.tied, lumen, params);
      if (balls.empty()) break;
      out.shaved.insert(out.shaved.end(), balls.begin(), balls.end());
      take_away(balls);
    }
  }
  return out;
}

}  // namespace fibrolite
