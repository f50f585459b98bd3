// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/trim.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
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

/// What is in sight of each end.
std::vector<std::optional<Vec3d>> holds(const std::vector<LooseEnd>& ends, const Surroundings& around, double voxel_mm,
                                        const TieParams& params) {
  std::vector<Box3d> boxes;
  for (const LooseEnd& end : ends)
    boxes.push_back(Box3d{end.end_mm, end.end_mm}.grown(norm(end.end_mm - end.held_mm) + 2 * voxel_mm));
  std::vector<std::optional<Vec3d>> found(ends.size());
  around(boxes, [&](std::size_t i, const Solid& solid) { found[i] = in_sight(ends[i], solid, params); });
  return found;
}

/// Takes off what has no hold, and ties the others to it.
TieChange change(const std::vector<LooseEnd>& ends, std::vector<std::optional<Vec3d>> hold, double voxel_mm,
                 const TieParams& params) {
  TieChange made;
  // An end cannot be tied to what is removed.
  std::vector<bool> counted(ends.size(), false);
  for (bool changed = true; changed;) {
    changed = false;
    const Shape away = capsules(made.removed);
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (counted[i] || (hold[i] && away(*hold[i]) > 0)) continue;
      hold[i].reset();
      counted[i] = changed = true;
      cover(ends[i], voxel_mm, made.removed);
    }
  }
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (!hold[i]) continue;
    const Vec3d root = 0.5 * params.strut_mm * normalized(*hold[i] - ends[i].end_mm);
    made.struts.push_back({ends[i].end_mm, *hold[i] + root, 0.5 * params.strut_mm});
  }
  return made;
}

}  // namespace

void trim(Tied& tied, const Trimmed& solid, double voxel_mm, const TieParams& params) {
  for (int round = 0;; ++round) {
    const std::vector<LooseEnd> ends = solid.loose_ends();
    tied.dangling = static_cast<std::int64_t>(ends.size());
    if (ends.empty() || round == rounds) return;
    TieChange made = change(ends, holds(ends, solid.around, voxel_mm, params), voxel_mm, params);
    const auto tied_now = static_cast<std::int64_t>(made.struts.size());
    tied.tips_tied += tied_now;
    tied.tips_removed += static_cast<std::int64_t>(ends.size()) - tied_now;
    tied.changes.push_back(std::move(made));
    solid.remake();
  }
}

Tied trim(Tied tied, const Shape& whole, const Solid& body, const std::vector<Sticks>& sticks, double shell_mm,
          const TieParams& params, const Context& context) {
  const auto ends = [&] {
    std::vector<LooseEnd> all;
    for (const Sticks& part : sticks) {
      const auto found = loose_ends(part, body, shell_mm, tied.solid, context);
      all.insert(all.end(), found.begin(), found.end());
    }
    return all;
  };
  const auto around = [&](const std::vector<Box3d>& boxes,
                          const std::function<void(std::size_t, const Solid&)>& visit) {
    surroundings(tied.solid)(boxes, visit);
  };
  const auto remake = [&] {
    tied.solid = {};
    tied.dropped = tied.filled = 0;  // found again
    const Solid solid = realize(with_ties(whole, distance_to(body), tied.changes, params.keep_out), body, context);
    tied = tie_again(tied, solid, body, params, context);
  };
  trim(tied, {ends, around, remake}, body.grid().voxel_mm, params);
  return tied;
}

}  // namespace fibrolite
