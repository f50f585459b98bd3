// SPDX-License-Identifier: GPL-3.0-or-later
// The joint of a curved border: a wall around a core.
#pragma once

#include "fibrolite/ops/interfaces.h"
#include "fibrolite/ops/joint.h"

namespace fibrolite {

/// The interface around a core, from one end inside the body to the other: Interface::length_mm above 0. `body` is the
/// distance to the mesh. Cost: O(samples at pixel_mm).
[[nodiscard]] Interface mantle_of(const Core& core, const Labels& labels, const Shape& body, double pixel_mm);

/// The transient layer of a mantle: a tube `wall_mm` thick, half in each part, as long as the interface. Membranes of
/// the core end on its inside, the crystal on its outside, the shell closes its ends. It is a solid wall, so what ends
/// on it is one piece with it; columns are not needed. Layer: the mantle unrolled, x around it, y along it, with what
/// both fills and the shell have there for regions_before and union_area_mm2. contact_area_mm2 is the crystal's on the
/// tube's outer face inside the lumen. `within`: distance to the two parts; beyond them there is no tube.
/// @throws Error BadRecipe: a wall not above zero. Cost: O(samples). Source: ours.
[[nodiscard]] Joint sleeve(const Interface& mantle, const Shape& fill_a, const Shape& fill_b, const Shape& within,
                           const Shape& body, double shell_mm, double wall_mm, double pixel_mm);

/// As demand_n() of a plane section.
[[nodiscard]] double mantle_demand_n(const Interface& mantle, const Labels& labels, const Shape& body,
                                     const std::function<double(Vec3d point_mm, Vec3d normal)>& traction_mpa);

}  // namespace fibrolite
