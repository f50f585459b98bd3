// SPDX-License-Identifier: Apache-2.0
// Along which diagonal a quad of a dual surface may be split, so that its triangles cut no other quad's.
#pragma once

#include <array>
#include <optional>

#include "fibrolite/vec.h"

namespace fibrolite {

/// Is it the wrong diagonal, and the other one right? A quad runs around an edge of the lattice, a vertex in each of
/// the four cells at it. Its envelope is the four tetrahedra between that edge and two neighbouring vertices each;
/// those of different edges do not overlap. Its sides are in it, and nearly always one diagonal or both. Quads that
/// hardly fold are not looked into.
/// @param corners  In a circle.
/// @param first    The diagonal from the first corner to the third, or the other one.
/// @returns false too where the corners do not tell of which edge they are.
/// Cost: O(1). Source: Ju and Udeshi 2006 (intersection-free contouring).
[[nodiscard]] bool wrong_diagonal(const std::array<Vec3d, 4>& corners, double voxel_mm, bool first);
/// The axis of the quad's edge, if neither diagonal is right; not looked into if it hardly folds along this one.
[[nodiscard]] std::optional<int> no_diagonal(const std::array<Vec3d, 4>& corners, double voxel_mm, bool first);

}  // namespace fibrolite
