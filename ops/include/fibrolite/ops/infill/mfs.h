// SPDX-License-Identifier: GPL-3.0-or-later
// Muscle fibre structure (paper Sec. 5.1).
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "fibrolite/ops/fill.h"
#include "fibrolite/ops/infill/micrograph.h"
#include "fibrolite/ops/part.h"

namespace fibrolite {

/// Muscle fibres: voids packed side by side, separated by membranes that run along the column.
struct MfsParams {
  /// Mean distance between fibre centres (void + wall); more than 2 * wall_mm and wall_mm + gap_mm (Walls::Delaunay:
  /// twice that).
  double fibre_mm = 2.4;
  double wall_mm = 0.8;  ///< Least membrane thickness; 2 voxels or more.
  double gap_mm = 0.4;   ///< Least width of a void between membranes; what is narrower becomes membrane.
  /// Delaunay walls are 1.7 times as long as the membranes of the same fibres: for the same mass, 1.7 times fibre_mm.
  Walls walls = Walls::Image;
  /// Fibres converge where the limb narrows and spread where it widens, by 1.25 at most; membranes keep their
  /// thickness.
  bool taper = false;
  std::optional<std::filesystem::path> micrograph;  ///< Template image; default: the bundled one.
  std::uint64_t seed = 1;
};
/// The membranes, unclipped: a 2-D distance image swept along the column's centre line with a rotation-minimising
/// frame. `body` and `shell_mm` bound the lumen: narrower than two fibres becomes solid, with a warning.
/// @throws Error BadRecipe (a range above), BadInput (unreadable template, or one without fibres). Cost: O(1) per point
/// after setting up. Source: paper Sec. 5.1; sweep and distance image ours.
[[nodiscard]] Fill generate(const Part& part, const MfsParams& params, const Shape& body, double shell_mm);

/// How a section grows and shrinks along a centre line, while membranes keep their thickness.
struct Taper {
  std::vector<double> scale{};  ///< Equally spaced along the line, first and last at its ends; empty: 1 everywhere.
  double slope = 0;             ///< The steepest any fibre in the limb runs to the line (a tangent).
  [[nodiscard]] double least() const { return scale.empty() ? 1 : *std::min_element(scale.begin(), scale.end()); }
  [[nodiscard]] double most() const { return scale.empty() ? 1 : *std::max_element(scale.begin(), scale.end()); }
};

/// The image swept along the axis; its middle lies at `center_mm` of the section (at scale 1), the centre line at
/// (0, 0). A distance along smooth centre lines whose normal planes do not cross; beyond the image its rim is
/// continued. Within the limb Lipschitz 1.05 for images of synthesize(); values are divided by what a taper or a ring's
/// twist adds.
[[nodiscard]] Shape sweep(MembraneImage image, const Axis& axis, Vec2d center_mm = {}, const Taper& taper = {});

}  // namespace fibrolite
