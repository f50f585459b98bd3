// SPDX-License-Identifier: GPL-3.0-or-later
// One piece of material that hangs together: specks go, loose pieces are tied in, micro-voids are filled, thin necks
// thickened.
#pragma once

#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/pieces.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Of loose pieces, and of thin necks: a strut may end on what hangs loose itself, or leave a thin place beside it.
inline constexpr int tie_rounds = 3;

struct TieParams {
  double strut_mm = 0.8;  ///< Diameter of a tie; 2 voxels or more.
  double reach_mm = 12;   ///< Longest tie.
  CleanParams clean{};
  double neck_mm = 0;  ///< What hangs on `anchor` by less is tied too; at most strut_mm; 0: anything holds.
  Shape anchor = everything();
  Shape keep_out = nothing();  ///< Where no tie may lie: drain holes.
  Shape held = nothing();      ///< Ties of before. What a way through them leads to is reached.
};
/// First something is taken off (trim.h), then struts are added.
struct TieChange {
  std::vector<Capsule> removed, struts;
};
struct Tied {
  Solid solid;
  std::vector<TieChange> changes{};  ///< One after the other.
  std::int64_t dropped = 0, filled = 0;
  std::int64_t necks = 0;                        ///< Of the struts, those along necks that were too thin.
  std::int64_t tips_tied = 0, tips_removed = 0;  ///< Stick ends in the void (trim.h).
  std::int64_t dangling = 0;                     ///< Those that are left.
  Pieces left;  ///< left.material.size() == 1 unless the model itself has pieces farther apart than the reach.
  std::vector<Piece> unreached{};  ///< Still on too thin a neck: none, unless the model itself or keep_out forbids it.

  [[nodiscard]] std::vector<Capsule> struts() const;   ///< Of all changes.
  [[nodiscard]] std::vector<Capsule> removed() const;  ///< Of all changes.
};
/// `assembled`: the composed shape the solid was made from; struts are united with it inside `body`. Loose pieces
/// first, then thin necks, at most tie_rounds each. Cost: as pieces() and unreached(), and a realize per round that
/// finds something.
[[nodiscard]] Tied tie(Solid solid, const Shape& assembled, const Solid& body, const TieParams& params = {},
                       const Context& context = {});
/// What crosses a gap: grown into both its ends by half its diameter.
[[nodiscard]] Capsule strut(const Gap& gap, double strut_mm);

/// Whether a way lies in struts. They are as thick as asked for, also where samples two to a diameter cannot tell.
[[nodiscard]] bool runs_in(const Gap& way, const Shape& struts);

/// `whole` with these changes; struts only inside `body`, and not in `keep_out`.
[[nodiscard]] Shape with_ties(const Shape& whole, const Shape& body, const std::vector<TieChange>& changes,
                              const Shape& keep_out = nothing());
/// What was done to `before`, and then to what came of it, added up.
[[nodiscard]] Tied and_then(const Tied& before, Tied now);
/// `before`, changed to `solid` and made one piece again; what was done adds up.
[[nodiscard]] Tied tie_again(const Tied& before, const Solid& solid, const Solid& body, const TieParams& params,
                             const Context& context = {});

}  // namespace fibrolite
