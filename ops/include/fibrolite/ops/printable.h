// SPDX-License-Identifier: GPL-3.0-or-later
// What a printer would fail at: walls too thin, gaps too small, steep faces inside.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// The recipe's block `print`.
struct PrintParams {
  double wall_mm = 0.4;              ///< Thinnest wall or stick; above 0.
  double gap_mm = 0.4;               ///< Narrowest gap inside; above 0.
  double overhang_deg = 45;          ///< Steepest face that needs no support: 0 is upright, 90 a ceiling; 0 to 90.
  std::optional<double> drain_mm{};  ///< Diameter of drain holes; none: only mending drains, with default_drain_mm.
  bool check = true;  ///< Look for such places also if nothing is mended; a tenth to a fifth of a run at fine voxels.
};
inline constexpr double default_drain_mm = 2;
/// What the lattice makes of a slope, degrees: a face counts as steep above overhang_deg and this.
inline constexpr double overhang_tolerance_deg = 5;

struct PrintPlace {
  Vec3d at_mm{};
  double mm = 0;  ///< Least thickness or width there; how far across an overhang reaches.
  double area_mm2 = 0;
};
struct PrintFault {
  std::int64_t places = 0;
  double area_mm2 = 0;            ///< Of both faces of walls and gaps.
  double volume_mm3 = 0;          ///< Of the thin walls or small gaps; 0 of overhangs.
  double least_mm = 0;            ///< Thinnest or narrowest; 0 if there is none.
  std::vector<PrintPlace> worst;  ///< At most five: the thinnest or narrowest, the overhangs of the largest area.
};
struct Printable {
  PrintFault thin_walls, small_gaps;
  PrintFault overhangs;          ///< Steep faces in the lumen that reach farther than a node.
  double node_overhang_mm2 = 0;  ///< Those that do not: undersides of nodes.
  double lumen_mm2 = 0;          ///< All faces in the lumen.
};
/// Checks the finished solid. `lumen` is negative inside the shell's middle: gaps and overhangs outside are the model's
/// own. A wall's thickness and a gap's width are measured along the normal of one face to a face that looks the other
/// way within 30 degrees: for plates, sticks and tubes that is the largest ball that fits, and corners of 30 degrees or
/// more are forgiven. A wall counts as thin below wall_mm less a quarter of a voxel, a face as steep above overhang_deg
/// plus 5 degrees (what the lattice makes of a slope). An overhang no wider than `node_mm` in any direction is the
/// underside of a node, which prints as a bridge. Nothing smaller than four squares of a voxel is a place, nor a gap
/// with faces smaller than a square of twice gap_mm: a crevice beside a contact, which prints as a fillet. `up` is of
/// any length above zero. Cost: O(samples near the surface * wall / voxel), parallel, tile by tile; the same bits on
/// any number of threads.
/// @throws Error BadRecipe: a range above; Cancelled.
[[nodiscard]] Printable printable(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up,
                                  double node_mm, const Context& context = {});

}  // namespace fibrolite
