// SPDX-License-Identifier: GPL-3.0-or-later
// The recipe's print limits as a scan, with their tolerances.
#pragma once

#include "fibrolite/ops/printable.h"
#include "print_patches.h"
#include "print_scan.h"

namespace fibrolite {

/// What is too thin, too narrow or too steep, without what is too small to be a place: less than four squares of a
/// voxel, and of gaps less than two squares (one on either face) of twice the gap. That is a crevice beside a contact,
/// which prints as a fillet. @throws Error BadRecipe: a range of PrintParams.
[[nodiscard]] Scan print_scan(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up,
                              const Context& context);
/// Steep spots alone.
[[nodiscard]] std::vector<Spot> overhangs(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up,
                                          const Context& context);
/// The same for solids that come in ranges, which a tally joins.
[[nodiscard]] PatchRules patch_rules(const PrintParams& params, Vec3d up, double node_mm, double voxel_mm);
[[nodiscard]] PrintTally print_tally(const Solid& solid, const Shape& lumen, const PrintParams& params,
                                     const PatchRules& rules, const SampleRange& range, const Context& context);

}  // namespace fibrolite
