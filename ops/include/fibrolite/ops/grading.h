// SPDX-License-Identifier: GPL-3.0-or-later
// How thick members are where: fields of factors for the graded crystal (TcsParams::grade).
#pragma once

#include <functional>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/context.h"
#include "fibrolite/shape.h"

namespace fibrolite {

struct StressGrade {
  double least = 1, most = 1.5;  ///< Factors where nothing is carried, and from the full stress on; 0 < least <= most.
  double slope_mm = 10;          ///< From the one to the other takes this long at least; > 0.
};
/// least + (most - least) * stress / full, at most `most`, where the full stress is the one that 95 % of the body's
/// volume stays below; raised around the places that need it so that it never falls faster than slope_mm allows. It
/// follows the stresses' course, not their size: twice the load gives the same field. A table with a step of
/// slope_mm / 4 over `box` (coarser beyond 2 million entries); outside the box the nearest entry counts.
/// `stress_mpa`: any measure of how much a point carries, 0 or more, thread-safe; `body`: negative inside.
/// lipschitz(): sqrt(3) (most - least) / slope_mm. @throws Error BadRecipe (a range above); Cancelled. Cost: one call
/// of `stress_mpa` per entry inside. Source: ours.
[[nodiscard]] Shape thicker_where_stressed(const StressGrade& grade, const Box3d& box, const Shape& body,
                                           const std::function<double(Vec3d)>& stress_mpa, const Context& context = {});

/// How deep inside `body`, an exact distance (within half a step): its values on a lattice over `box`, trilinear
/// between. Where a neighbourhood of the lattice lies outside, only a lower bound of them; outside the box the nearest
/// entry counts. `step_mm` > 0, coarser beyond 2 million entries. For fields that vary over several steps.
/// @throws Error Cancelled. Cost: one value of `body` per entry inside or near, one per 64 of the others; parallel.
[[nodiscard]] Shape depth_table(const Shape& body, const Box3d& box, double step_mm, const Context& context = {});

/// Places evenly spread over where `body`, an exact distance, is deeper than shell_mm, and `where` is negative: on a
/// lattice so fine that a body of volume_mm3 (counted as a twentieth of the box at least) has about 20 thousand of its
/// nodes. Mean values over them are those over the volume within 0.2 %, of a field that varies over its width. @throws
/// Error Cancelled. Cost: as depth_table().
[[nodiscard]] std::vector<Vec3d> places_inside(const Shape& body, const Box3d& box, double volume_mm3, double shell_mm,
                                               const Shape& where, const Context& context = {});

}  // namespace fibrolite
