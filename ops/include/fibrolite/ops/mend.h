// SPDX-License-Identifier: GPL-3.0-or-later
// Mends what the print checks find: thin walls, small gaps, overhangs, enclosed voids.
#pragma once

#include <cstdint>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/drain.h"
#include "fibrolite/ops/pillars.h"
#include "fibrolite/ops/printable.h"
#include "fibrolite/ops/tie.h"

namespace fibrolite {

struct MendParams {
  PrintParams print{};
  bool faults = true;                  ///< Walls, gaps and overhangs.
  double drain_mm = default_drain_mm;  ///< 0: voids stay closed; else 2 voxels or more.
  Vec3d up{0, 0, 1};
  double shell_mm = 1;        ///< How deep the lumen lies.
  TieParams tie{};            ///< Should mending leave loose pieces.
  double node_mm = 0.8;       ///< Overhangs no wider than this stay.
  Shape lattice = nothing();  ///< And those on the surface of this (PillarParams::lattice).
};
struct Mended {
  Tied tied;                         ///< As before, with what was mended; changes of both.
  std::vector<Capsule> thickened{};  ///< Balls in walls that were too thin and gaps that were too small.
  std::vector<Pillar> pillars{};
  std::vector<Drain> drains{};
  std::vector<Capsule> shaved{};  ///< Slivers beside holes, which hung on too thin a neck.
  std::int64_t voids_filled = 0;  ///< Too small for a hole.

  /// Where no tie may lie: holes, and what was shaved off beside them.
  [[nodiscard]] Shape keep_out() const;
};
/// A wall is thickened by balls of wall_mm in its middle, a gap closed by balls that reach tie.strut_mm / 2 into both
/// its faces, overhangs get pillars, all inside `body`: what the model itself makes too thin stays. Then voids with
/// less room than a ball of drain_mm are filled and the others drained, in at most three rounds each. Cost: a scan and
/// a realize per round.
/// @throws Error BadRecipe: as printable() and drains(); Cancelled.
[[nodiscard]] Mended mend(const Tied& tied, const Solid& body, const MendParams& params, const Context& context = {});
/// The solid as a function: `whole`, made before any tie, with the ties and with what was mended.
[[nodiscard]] Shape with_mends(const Shape& whole, const Shape& body, const Mended& mended);

}  // namespace fibrolite
