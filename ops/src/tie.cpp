// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/tie.h"

#include <algorithm>
#include <utility>

#include "fibrolite/reach.h"
#include "fibrolite/realize.h"

namespace fibrolite {

Tied tie(Solid solid, const Shape& assembled, const Solid& body, const TieParams& params, const Context& context) {
  Tied result;
  TieChange change;
  CleanResult cleaned = clean(std::move(solid), params.clean, context);
  const auto add = [&](const Gap& gap) { change.struts.push_back(strut(gap, params.strut_mm)); };
  const auto make = [&] {
    const Shape changed = with_ties(assembled, distance_to(body), {change}, params.keep_out);
    cleaned = clean(realize(changed, body, context), params.clean, context);
  };
  for (int round = 0; round < tie_rounds && cleaned.left.material.size() > 1; ++round) {
    const auto found = gaps(cleaned.solid, params.reach_mm, context);
    if (found.empty()) break;
    for (const Gap& gap : found) add(gap);
    make();
  }
  for (int round = 0; params.neck_mm > 0; ++round) {
    const Shape there = unite({params.held, capsules(change.struts)});
    const std::size_t before = change.struts.size();
    std::vector<Piece> left;
    for (const Unreached& one :
         unreached(cleaned.solid, params.anchor, {params.neck_mm, params.reach_mm, params.keep_out}, context)) {
      if (one.way && runs_in(*one.way, there)) continue;
      left.push_back(one.piece);
      if (one.way && round < tie_rounds) add(*one.way);
    }
    if (change.struts.size() == before) {
      result.unreached = std::move(left);
      break;
    }
    result.necks += static_cast<std::int64_t>(change.struts.size() - before);
    make();
  }
  if (!change.struts.empty()) result.changes.push_back(std::move(change));
  result.solid = std::move(cleaned.solid);
  result.dropped = cleaned.dropped;
  result.filled = cleaned.filled;
  result.left = std::move(cleaned.left);
  return result;
}

Capsule strut(const Gap& gap, double strut_mm) {
  const Vec3d along = gap.to_mm - gap.from_mm;
  const Vec3d root = 0.5 * strut_mm / std::max(norm(along), 1e-9) * along;
  return {gap.from_mm - root, gap.to_mm + root, 0.5 * strut_mm};
}

bool runs_in(const Gap& way, const Shape& struts) {
  return struts(way.from_mm) < 0 && struts(0.5 * (way.from_mm + way.to_mm)) < 0 && struts(way.to_mm) < 0;
}

Shape with_ties(const Shape& whole, const Shape& body, const std::vector<TieChange>& changes, const Shape& keep_out) {
  Shape result = whole;
  for (const TieChange& change : changes) {
    if (!change.removed.empty()) result = subtract(result, capsules(change.removed));
    if (!change.struts.empty())
      result = unite({result, subtract(intersect({body, capsules(change.struts)}), keep_out)});
  }
  return result;
}

Tied and_then(const Tied& before, Tied now) {
  now.changes.insert(now.changes.begin(), before.changes.begin(), before.changes.end());
  now.dropped += before.dropped;
  now.filled += before.filled;
  now.necks += before.necks;
  now.tips_tied += before.tips_tied;
  now.tips_removed += before.tips_removed;
  now.dangling += before.dangling;
  return now;
}

Tied tie_again(const Tied& before, const Solid& solid, const Solid& body, const TieParams& params,
               const Context& context) {
  TieParams again = params;
  again.held = unite({params.held, capsules(before.struts())});
  return and_then(before, tie(solid, distance_to(solid), body, again, context));
}

namespace {

std::vector<Capsule> gathered(const std::vector<TieChange>& changes, std::vector<Capsule> TieChange::*list) {
  std::vector<Capsule> all;
  for (const TieChange& change : changes) all.insert(all.end(), (change.*list).begin(), (change.*list).end());
  return all;
}

}  // namespace

std::vector<Capsule> Tied::struts() const { return gathered(changes, &TieChange::struts); }
std::vector<Capsule> Tied::removed() const { return gathered(changes, &TieChange::removed); }

}  // namespace fibrolite
