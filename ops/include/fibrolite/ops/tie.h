// SPDX-License-Identifier: GPL-3.0-or-later
// One piece of material: specks go, loose pieces are tied in, micro-voids are filled.
#pragma once

#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/pieces.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct TieParams {
  double strut_mm = 0.8;  ///< Diameter of a tie; 2 voxels or more.
  double reach_mm = 12;   ///< Longest tie.
  CleanParams clean{};
};
struct Tied {
  Solid solid;
  std::vector<Capsule> struts;
  std::int64_t dropped = 0, filled = 0;
  Pieces left;  ///< left.material.size() == 1 unless the model itself has pieces farther apart than the reach.
};
/// `assembled`: the composed shape the solid was made from; struts are united with it inside `body`. At most three
/// rounds.
[[nodiscard]] Tied tie(const Solid& solid, const Shape& assembled, const Solid& body, const TieParams& params = {},
                       const Context& context = {});
/// What crosses a gap: grown into both its ends by half its diameter.
[[nodiscard]] Capsule strut(const Gap& gap, double strut_mm);

}  // namespace fibrolite
