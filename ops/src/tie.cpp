// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/tie.h"

#include <utility>

#include "fibrolite/realize.h"

namespace fibrolite {

Tied tie(const Solid& solid, const Shape& assembled, const Solid& body, const TieParams& params,
         const Context& context) {
  constexpr int rounds = 3;  // a strut may end on another loose piece, which the next round ties
  Tied result;
  CleanResult cleaned = clean(solid, params.clean, context);
  for (int round = 0; round < rounds && cleaned.left.material.size() > 1; ++round) {
    const auto found = gaps(cleaned.solid, params.reach_mm, context);
    if (found.empty()) break;
    for (const Gap& gap : found) result.struts.push_back(strut(gap, params.strut_mm));
    const Shape tied = unite({assembled, intersect({distance_to(body), capsules(result.struts)})});
    cleaned = clean(realize(tied, body, context), params.clean, context);
  }
  result.solid = std::move(cleaned.solid);
  result.dropped = cleaned.dropped;
  result.filled = cleaned.filled;
  result.left = std::move(cleaned.left);
  return result;
}

Capsule strut(const Gap& gap, double strut_mm) {
  const Vec3d root = 0.5 * strut_mm * normalized(gap.to_mm - gap.from_mm);
  return {gap.from_mm - root, gap.to_mm + root, 0.5 * strut_mm};
}

}  // namespace fibrolite
