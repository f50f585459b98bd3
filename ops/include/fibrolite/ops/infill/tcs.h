// SPDX-License-Identifier: GPL-3.0-or-later
// Tetrahedral crystal structure (paper Sec. 5.2).
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "fibrolite/ops/fill.h"
#include "fibrolite/ops/infill/cell_edges.h"
#include "fibrolite/ops/part.h"

namespace fibrolite {

/// What the crystal is made of; all three have the same lattice.
enum class TcsForm {
  Sticks,   ///< The paper's balls and sticks.
  Network,  ///< One side of a level set of the D nodal approximation: sticks without sharp joints.
  Sheet,    ///< The Schwarz D membrane between two such networks, equally thick everywhere.
};

/// The least edge of a cell over the thickness of its members; below it there is little void left.
constexpr double cell_per_member(TcsForm form) { return form == TcsForm::Network ? 3 : 4; }

/// Where members are thicker than elsewhere.
enum class TcsGrade {
  None,
  Surface,  ///< Toward the body's surface.
  Stress,   ///< Where the verification found that the body carries much.
};

/// Tetrahedral crystal (diamond cubic): balls at the nodes, sticks along the bonds; or the smooth forms of it.
struct TcsParams {
  TcsForm form = TcsForm::Sticks;
  CellEdges cell_mm = 6.0;  ///< Each edge cell_per_member() thickest members or more, at most 3 times another.
  double stick_mm = 0.8;    ///< Stick diameter; of a network: where it is thinnest. 2 voxels or more.
  double ball_mm = 1.6;     ///< Ball diameter of sticks; stick_mm or more.
  double wall_mm = 0.8;     ///< Thickness of a sheet; 2 voxels or more.
  /// Share of a cell that is material. If given, sticks and balls (which keep their ratio), necks or walls are made as
  /// thick as that takes; if graded too, in the mean over all that is filled with crystal.
  std::optional<double> density{};
  Vec3d shift_mm{};        ///< Lattice origin, world axes.
  Vec3d rotate_deg{};      ///< Turns about the origin: about world x, then y, then z.
  bool stretch_z = false;  ///< Cell taller by sqrt(2) along its z: of a cube, sticks at 45 degrees, self-supporting.
  Vec3d up{0, 0, 1};       ///< Which way it is printed: if stretched, z of the cell before rotate_deg turns it.
  TcsGrade grade = TcsGrade::None;
  double grade_least = 1;   ///< If graded, thickness of all members is multiplied by this deep inside, or idle...
  double grade_most = 1.5;  ///< ...and by this at the inner face of the shell, or at full stress; grade_least or more.
  double grade_depth_mm = 10;  ///< Within what the one becomes the other; the longest edge of the cell or more.
};
/// The crystal, unclipped, world frame. @throws Error BadRecipe (a range above). Cost: O(1) per point. Source: paper
/// Sec. 5.2; the sizes are ours. Sheet and network: von Schnering and Nesper 1991 (nodal approximation of the D
/// surface), as a table of true distances.
[[nodiscard]] Fill generate(const Part& part, const TcsParams& params);
/// The distance alone, for tests and benchmarks; members as thick as given everywhere.
[[nodiscard]] Shape crystal(const TcsParams& params);
/// Members `thickness` times as thick: a field of factors in [grade_least, grade_most], its lipschitz() that per mm.
/// Distances to within a hundredth, if a cell changes the thickness by no more than that of its thickest members.
[[nodiscard]] Shape crystal(const TcsParams& params, const Shape& thickness);
[[nodiscard]] Fill generate(const Part& part, const TcsParams& params, const Shape& thickness);
/// The factors of TcsGrade::Surface: `body` is a distance that is true to shell_mm + grade_depth_mm inside.
[[nodiscard]] Shape thicker_at_surface(const TcsParams& params, const Shape& body, double shell_mm);
/// Each stick that may reach into the box, once, from node to node; others near the box too. Cost: O(cells in the box).
void each_stick(const TcsParams& params, const Box3d& box, const std::function<void(const Capsule&)>& visit);

/// How far the flattest of the crystal's bonds leans from upright, degrees: 54.7 for a cube along the axes, 45
/// stretched.
[[nodiscard]] double steepest_overhang_deg(const TcsParams& params);

/// Share of the endless crystal, not graded, that is material, by integrating over a cell; within 0.5 %. Cost:
/// milliseconds.
[[nodiscard]] double density(const TcsParams& params);
/// The same crystal with its sizes instead of a density (which is then none). @throws Error BadRecipe: no sizes give
/// that density. Cost: tens of milliseconds, if there is a density.
[[nodiscard]] TcsParams sized(const TcsParams& params);
/// Sizes of a graded crystal with a density: members are then `factors` times as thick as these.
struct GradedSizes {
  TcsParams params;  ///< With sizes instead of a density.
  double density;    ///< Mean over the places; params.density within 0.5 %, unless a limit below is in the way.
};
/// So that the share of material is params.density in the mean over some places, evenly spread. `factors`: of the field
/// at those places, at least one, each in [grade_least, grade_most]. No member becomes thinner than `least_mm`, none
/// thicker than its cell allows (cell_per_member()). @throws Error BadRecipe: both limits cannot hold; as sized().
/// Cost: tens of milliseconds.
[[nodiscard]] GradedSizes sized(const TcsParams& params, std::span<const float> factors, double least_mm);
/// Thickness of its thinnest and thickest members (stick, neck or wall; balls left out), mm. Graded, but with its
/// density yet to be met: of the crystal not graded.
struct MemberRange {
  double least_mm, most_mm;
};
[[nodiscard]] MemberRange members(const TcsParams& params);

}  // namespace fibrolite
