// SPDX-License-Identifier: GPL-3.0-or-later
// Muscle fibre structure (paper Sec. 5.1).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "fibrolite/ops/fill.h"
#include "fibrolite/ops/infill/micrograph.h"
#include "fibrolite/ops/part.h"

namespace fibrolite {

/// Muscle fibres: voids packed side by side, separated by membranes that run along the column.
struct MfsParams {
  double fibre_mm =
      2.4;  ///< Mean distance between fibre centres (void + wall); more than 2 * wall_mm (Walls::Delaunay: 4).
  double wall_mm = 0.8;  ///< Least membrane thickness; 2 voxels or more.
  /// Delaunay walls are 1.7 times as long as the membranes of the same fibres: for the same mass, 1.7 times fibre_mm.
  Walls walls = Walls::Image;
  std::optional<std::filesystem::path> micrograph;  ///< Template image; default: the bundled one.
  std::uint64_t seed = 1;
};
/// The membranes, unclipped: a 2-D distance image swept along the column's centre line with a rotation-minimising
/// frame. `body` and `shell_mm` bound the lumen: narrower than two fibres becomes solid, with a warning.
/// @throws Error BadRecipe (a range above), BadInput (unreadable template, or one without fibres). Cost: O(1) per point
/// after setting up. Source: paper Sec. 5.1; sweep and distance image ours.
[[nodiscard]] Fill generate(const Part& part, const MfsParams& params, const Shape& body, double shell_mm);

/// The image swept along the axis; its middle lies at `center_mm` of the section, the centre line at (0, 0). A distance
/// along smooth centre lines whose normal planes do not cross; beyond the image its rim is continued. Lipschitz
/// constant about sqrt(2).
[[nodiscard]] Shape sweep(MembraneImage image, const Axis& axis, Vec2d center_mm = {});

}  // namespace fibrolite
