// SPDX-License-Identifier: GPL-3.0-or-later
// Walks the surface of a solid tile by tile: how thick the wall and how wide the void behind each of its points, and
// which way it faces.
#pragma once

#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// A piece of the surface: where it crosses an edge of the lattice.
struct Spot {
  Vec3i at{};           ///< The sample inside; of a wall or gap, the one nearest its middle.
  Vec3d foot_mm{};      ///< On the surface.
  Vec3d normal{};       ///< Out of the material.
  double area_mm2 = 0;  ///< Its share of the surface.
  double mm = 0;        ///< Thickness of the wall or width of the gap; 0 of a steep face.
};
struct ScanLimits {
  double wall_mm = 0;      ///< Walls thinner than this are noted; 0: none.
  double gap_mm = 0;       ///< Gaps in the lumen narrower than this are noted; 0: none.
  Vec3d up{0, 0, 1};       ///< Unit length.
  double steep_sine = 2;   ///< Faces in the lumen with -normal * up above this are noted.
  double opposed = 0.866;  ///< Both faces of a wall or gap look away from each other: the cosine is below minus this.
};
struct Scan {
  std::vector<Spot> walls, gaps, steep;
  double lumen_mm2 = 0;  ///< Surface in the lumen; exact in any order of summing.
};
/// Thickness is measured along the normal, from the zero set alone, since magnitudes of composed values are not
/// distances. `lumen` is negative where gaps and steep faces matter. Areas are right for planes at any angle. Cost:
/// O(samples near the surface * wall / voxel), in tiles with a margin, parallel; the same bits on any number of
/// threads.
/// `range`: only edges of the lattice that start there; the solid must be known as far beyond it as the limits reach.
[[nodiscard]] Scan scan(const Solid& solid, const Shape& lumen, const ScanLimits& limits, const Context& context,
                        const SampleRange* range = nullptr);

}  // namespace fibrolite
