// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/printable.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fibrolite/error.h"
#include "print_limits.h"

namespace fibrolite {
namespace {

constexpr std::size_t most_places = 5;

PrintFault fault(std::vector<Patch> patches) {
  PrintFault result;
  std::stable_sort(patches.begin(), patches.end(),
                   [](const Patch& a, const Patch& b) { return a.least_mm < b.least_mm; });
  for (const Patch& patch : patches) {
    result.area_mm2 += patch.area_mm2;
    result.volume_mm3 += patch.volume_mm3;
    if (result.worst.size() < most_places) result.worst.push_back({patch.at_mm, patch.least_mm, patch.area_mm2});
  }
  result.places = static_cast<std::int64_t>(patches.size());
  if (!patches.empty()) result.least_mm = patches.front().least_mm;
  return result;
}

ScanLimits limits_of(const PrintParams& params, Vec3d up, double voxel_mm) {
  if (!(params.wall_mm > 0 && params.gap_mm > 0))
    throw Error(Code::BadRecipe, "walls and gaps need a least width above 0", "print");
  if (!(params.overhang_deg >= 0 && params.overhang_deg <= 90))
    throw Error(Code::BadRecipe, "an overhang lies between 0 and 90 degrees", "print.overhang_deg");
  const double tolerance = 0.25 * voxel_mm, steepest = std::min(params.overhang_deg + 5, 90.0);
  return {.wall_mm = params.wall_mm - tolerance,
          .gap_mm = params.gap_mm - tolerance,
          .up = normalized(up),
          .steep_sine = std::sin(steepest * std::numbers::pi / 180)};
}

}  // namespace

void drop_noise(Scan& found, const PrintParams& params, double voxel_mm) {
  const double noise_mm2 = 4 * voxel_mm * voxel_mm;
  for (std::vector<Spot>* spots : {&found.walls, &found.gaps, &found.steep}) sort_spots(*spots);
  drop_small_patches(found.walls, noise_mm2);
  drop_small_patches(found.gaps, std::max(noise_mm2, 8 * params.gap_mm * params.gap_mm));
  drop_small_patches(found.steep, noise_mm2);
}

Scan print_scan(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up, const Context& context) {
  Scan found = scan(solid, lumen, limits_of(params, up, solid.grid().voxel_mm), context);
  drop_noise(found, params, solid.grid().voxel_mm);
  return found;
}

Scan print_scan(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up, const SampleRange& range,
                const Context& context) {
  return scan(solid, lumen, limits_of(params, up, solid.grid().voxel_mm), context, &range);
}

Printable printable(const Solid& solid, const Shape& lumen, const PrintParams& params, Vec3d up, double node_mm,
                    const Context& context) {
  return summed(print_scan(solid, lumen, params, up, context), up, node_mm);
}

Printable summed(const Scan& found, Vec3d up, double node_mm) {
  Printable result;
  result.lumen_mm2 = found.lumen_mm2;
  result.thin_walls = fault(patches(found.walls, up));
  result.small_gaps = fault(patches(found.gaps, up));
  for (const Patch& patch : patches(found.steep, up)) {
    if (patch.across_mm <= node_mm) {
      result.node_overhang_mm2 += patch.area_mm2;
      continue;
    }
    PrintFault& steep = result.overhangs;
    ++steep.places;
    steep.area_mm2 += patch.area_mm2;
    if (steep.worst.size() < most_places) steep.worst.push_back({patch.at_mm, patch.across_mm, patch.area_mm2});
  }
  return result;
}

}  // namespace fibrolite
