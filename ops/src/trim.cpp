// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/trim.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "fibrolite/frame.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr int rounds = 8;

/// Capsules that cover what hangs free and a voxel around it, but nothing of what holds it.
void cover(const LooseEnd& end, double voxel_mm, std::vector<Capsule>& out) {
  const double radius = end.radius_mm + voxel_mm, length = norm(end.end_mm - end.held_mm);
  if (length > 0) {
    const Vec3d along = (1 / length) * (end.end_mm - end.held_mm);
    // Out to the far side of an end cut at a slant, and of what the part's border overlaps.
    const Vec3d a = end.held_mm + std::min(radius, length) * along, b = end.end_mm + 2 * radius * along;
    out.push_back({a, end.knob_mm > 0 ? end.end_mm : b, radius});
  }
  if (end.knob_mm > 0) out.push_back({end.end_mm, end.end_mm, end.knob_mm + voxel_mm});
}

/// The nearest material in sight of an end, not behind it, within the length of what hangs free.
std::optional<Vec3d> in_sight(const LooseEnd& end, const Solid& solid, const TieParams& params) {
  constexpr int rays = 192;
  const double voxel = solid.grid().voxel_mm, length = norm(end.end_mm - end.held_mm);
  if (length == 0) return std::nullopt;
  const Vec3d out = (1 / length) * (end.end_mm - end.held_mm);
  const double own = end.radius_mm + 0.5 * voxel;  // beside the axis, all of it is the stick itself
  std::optional<Vec3d> best;
  double nearest = length + voxel;
  const Frame frame = frame_along(end.end_mm, out);
  for (int i = 0; i < rays; ++i) {  // evenly over the half sphere in front, from its middle
    const double z = 1 - (i + 0.5) / rays, ring = std::sqrt(1 - z * z),
                 turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vec3d d = ring * std::cos(turn) * frame.x + ring * std::sin(turn) * frame.y + z * frame.z;
    bool left = false;  // out of the stick's own material
    for (double s = 0.5 * voxel; s < nearest; s += 0.5 * voxel) {
      const Vec3d at = end.end_mm + s * d;
      const bool inside = solid.distance(at) < 0;
      left = left || !inside;
      if (!inside || !left || (s * ring < own && s * z < 2 * own + end.knob_mm)) continue;
      if (params.keep_out(at) > 0.5 * params.strut_mm) {
        nearest = s;
        best = at;
      }
      break;
    }
  }
  return best;
}

}  // namespace

Tied trim(const Tied& tied, const Solid& body, const std::vector<Sticks>& sticks, double shell_mm,
          const TieParams& params, const Context& context) {
  Tied out = tied;
  const double voxel = body.grid().voxel_mm;
  const Shape b = distance_to(body);
  for (int round = 0;; ++round) {
    const Solid solid = out.solid;
    std::vector<LooseEnd> ends;
    for (const Sticks& part : sticks) {
      const auto found = loose_ends(part, b, shell_mm, solid, context);
      ends.insert(ends.end(), found.begin(), found.end());
    }
    out.dangling = static_cast<std::int64_t>(ends.size());
    if (ends.empty() || round == rounds) return out;

    std::vector<std::optional<Vec3d>> hold;
    for (const LooseEnd& end : ends) hold.push_back(in_sight(end, solid, params));
    // An end cannot be tied to what is removed.
    std::vector<Capsule> gone;
    std::vector<bool> counted(ends.size(), false);
    for (bool changed = true; changed;) {
      changed = false;
      const Shape away = capsules(gone);
      for (std::size_t i = 0; i < ends.size(); ++i) {
        if (counted[i] || (hold[i] && (gone.empty() || away(*hold[i]) > 0))) continue;
        hold[i].reset();
        counted[i] = changed = true;
        cover(ends[i], voxel, gone);
      }
    }
    std::vector<Capsule> struts;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (!hold[i]) continue;
      const Vec3d root = 0.5 * params.strut_mm * normalized(*hold[i] - ends[i].end_mm);
      struts.push_back({ends[i].end_mm, *hold[i] + root, 0.5 * params.strut_mm});
    }
    const auto tied_now = static_cast<std::int64_t>(struts.size());
    out.tips_tied += tied_now;
    out.tips_removed += static_cast<std::int64_t>(ends.size()) - tied_now;

    Shape changed = distance_to(solid);
    if (!gone.empty()) changed = subtract(changed, capsules(gone));
    if (!struts.empty()) changed = unite({changed, subtract(intersect({b, capsules(struts)}), params.keep_out)});
    out.removed.insert(out.removed.end(), gone.begin(), gone.end());
    out.struts.insert(out.struts.end(), struts.begin(), struts.end());
    out = tie_again(out, realize(changed, body, context), body, params, context);
  }
}

}  // namespace fibrolite
