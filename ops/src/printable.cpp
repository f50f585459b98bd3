// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/printable.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "fibrolite/error.h"
#include "print_limits.h"

namespace fibrolite {
namespace {

ScanLimits limits_of(const PrintParams& params, Vec3d up, double voxel_mm) {
  if (!(params.wall_mm > 0 && params.gap_mm > 0))
    throw Error(Code::BadRecipe, "walls and gaps need a least width above 0", "print");
  if (!(params.overhang_deg >= 0 && params.overhang_deg <= 90))
    throw Error(Code::BadRecipe, "an overhang lies between 0 and 90 degrees", "print.overhang_deg");
  const double tolerance = 0.25 * voxel_mm, steepest = std::min(params.overhang_deg + overhang_tolerance_deg, 90.0);
  return {.wall_mm = params.wall_mm - tolerance,
          .gap_mm = params.gap_mm - tolerance,
          .up = normalized(up),
          .steep_sine = std::sin(steepest * std::numbers::pi / 180)};
}

/// Of walls, gaps and steep faces.
std::array<double, 3> least_mm2(const PrintParams& params, double voxel_mm) {
  const double noise_mm2 = 4 * voxel_mm * voxel_mm;
  return {noise_mm2, std::max(noise_mm2, 8 * params.gap_mm * params.gap_mm), noise_mm2};
}

}  // namespace

Scan print_scan(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up, const Context& context) {
  Scan found = scan(solid, lumen, limits_of(params, up, solid.grid().voxel_mm), context);
  const std::array<double, 3> least = least_mm2(params, solid.grid().voxel_mm);
  drop_small_patches(found.walls, least[0]);
  drop_small_patches(found.gaps, least[1]);
  drop_small_patches(found.steep, least[2]);
  return found;
}

std::vector<Spot> overhangs(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up,
                            const Context& context) {
  ScanLimits limits = limits_of(params, up, solid.grid().voxel_mm);
  limits.wall_mm = limits.gap_mm = 0;
  Scan found = scan(solid, lumen, limits, context);
  drop_small_patches(found.steep, least_mm2(params, solid.grid().voxel_mm)[2]);
  return std::move(found.steep);
}

PatchRules patch_rules(const PrintParams& params, Vec3d up, double node_mm, double voxel_mm) {
  // A wall's sample lies in its middle.
  const double across_mm = std::max(params.wall_mm, params.gap_mm);
  return {.up = up,
          .node_mm = node_mm,
          .least_mm2 = least_mm2(params, voxel_mm),
          .reach_vox = static_cast<int>(std::ceil(0.5 * across_mm / voxel_mm)) + 2};
}

PrintTally print_tally(const Solid& solid, const Shape& lumen, const PrintParams& params, const PatchRules& rules,
                       const SampleRange& range, const Context& context) {
  return {scan(solid, lumen, limits_of(params, rules.up, solid.grid().voxel_mm), context, &range), range, rules};
}

Printable printable(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up, double node_mm,
                    const Context& context) {
  constexpr SampleRange everywhere{.axis = 2, .low = -(1 << 20), .high = 1 << 20};
  const PatchRules rules = patch_rules(params, up, node_mm, solid.grid().voxel_mm);
  return print_tally(solid, lumen, params, rules, everywhere, context).total(rules);
}

}  // namespace fibrolite
