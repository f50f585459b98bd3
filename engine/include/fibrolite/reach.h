// SPDX-License-Identifier: Apache-2.0
// What material hangs on necks that are too thin.
#pragma once

#include <optional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/pieces.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct ReachParams {
  double neck_mm = 0.8;        ///< Thinnest neck that holds; above 0, at most twice what the grid tells inside.
  double way_mm = 0;           ///< Longest way to look for; 0: none.
  Shape keep_out = nothing();  ///< What a way keeps half a neck away from.
};
struct Unreached {
  Piece piece;  ///< Without its skin, skin_mm() thick.
  std::optional<Gap>
      way{};  ///< To the nearest reached material: through the neck if one leads there, else through void.
};
/// How deep the skin is that is taken off, mm: half a neck less half the diagonal of a voxel, 0.87 of its edge, as far
/// as the grid's values tell. It is the deepest for which a member as wide as the neck keeps a chain of neighbouring
/// samples, however it lies on the lattice.
[[nodiscard]] double skin_mm(double neck_mm, Grid grid);
/// Coarsest voxel, mm, at which necks thinner than held_mm are told from members of neck_mm; 0 or less if none does.
[[nodiscard]] double coarsest_voxel(double neck_mm, double held_mm);
/// The grid with values inside told as deep as that takes, but never deeper than 3.5 voxels below the band.
[[nodiscard]] Grid telling(double neck_mm, Grid grid);
/// Material that hangs on `anchor` (where that is negative) only through necks clearly thinner than neck_mm, largest
/// first: the pieces that taking skin_mm() off the surface cuts off. So a neck is found if it is thinner than
/// neck_mm - 1.74 voxels, and never if it is neck_mm thick. Values of a union understate depth: what they
/// find is measured again, from the surface itself, only there. A capsule of neck_mm along every way makes all reached.
/// Cost: as pieces(), and O((neck / voxel)^3) per sample of what the values found. The same answer on any number of
/// threads.
[[nodiscard]] std::vector<Unreached> unreached(const Solid& solid, const Shape& anchor, const ReachParams& params,
                                               const Context& context = {});

}  // namespace fibrolite
