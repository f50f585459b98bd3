// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/thickness.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fibrolite {
namespace {

/// Lines at a level of the bilinear image, pixel coordinates.
std::vector<Segment2d> lines_at(const FloatImage& image, float level) {
  std::vector<Segment2d> lines;
  for (int y = 0; y + 1 < image.height; ++y)
    for (int x = 0; x + 1 < image.width; ++x) {
      const std::array<float, 4> corner{image(x, y) - level, image(x + 1, y) - level, image(x + 1, y + 1) - level,
                                        image(x, y + 1) - level};
      constexpr std::array<Vec2d, 4> at{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
      std::array<Vec2d, 4> crossing;
      std::size_t count = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const auto a = static_cast<double>(corner[k]), b = static_cast<double>(corner[(k + 1) % 4]);
        if ((a > 0) == (b > 0)) continue;
        const double t = a / (a - b);
        crossing[count++] = Vec2d{x + 0.0, y + 0.0} + (1 - t) * at[k] + t * at[(k + 1) % 4];
      }
      if (count == 2) lines.push_back({crossing[0], crossing[1]});
      // Two corners above, across from each other: not joined, so that what is above never gains.
      if (count == 4) {
        const bool first_above = corner[0] > 0;
        lines.push_back({crossing[first_above ? 3 : 0], crossing[first_above ? 0 : 1]});
        lines.push_back({crossing[first_above ? 1 : 2], crossing[first_above ? 2 : 3]});
      }
    }
  return lines;
}

/// Distance to where `depth` is above the level; negative there.
FloatImage distance_to_level(const FloatImage& depth, const Raster& raster, double level_mm, double far_mm) {
  std::vector<Segment2d> lines = lines_at(depth, static_cast<float>(level_mm));
  for (Segment2d& s : lines) s = {raster.corner_mm + raster.pixel_mm * s.a, raster.corner_mm + raster.pixel_mm * s.b};
  FloatImage distance =
      distance_to_segments(lines, raster.corner_mm, raster.pixel_mm, raster.width, raster.height, far_mm);
  for (std::size_t i = 0; i < distance.pixels.size(); ++i)
    if (static_cast<double>(depth.pixels[i]) > level_mm) distance.pixels[i] = -distance.pixels[i];
  return distance;
}

/// Ridges of the distance to the voids that are wall, but lower than a wall's middle: fillings with a void on either
/// side, too thin.
std::vector<Vec2d> thin_ridges(const FloatImage& e, const Raster& raster, double wall_from_mm, double middle_mm) {
  std::vector<Vec2d> ridges;
  const double px = raster.pixel_mm;
  for (int y = 1; y + 1 < e.height; ++y)
    for (int x = 1; x + 1 < e.width; ++x) {
      const auto own = static_cast<double>(e(x, y));
      if (own < wall_from_mm - px || own >= middle_mm) continue;
      for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{0, 1}, std::pair{1, 1}, std::pair{1, -1}}) {
        const auto a = static_cast<double>(e(x - dx, y - dy)), b = static_cast<double>(e(x + dx, y + dy));
        const double step = px * std::hypot(dx, dy);
        // Two slopes that fall away on either side meet in between; a fillet falls away on one side only.
        if (own < a || own < b || 2 * own - a - b < 0.8 * step) continue;
        if (0.5 * (a + b) + step >= middle_mm - 0.1 * px) continue;
        ridges.push_back(raster.corner_mm + px * Vec2d{x + 0.0, y + 0.0});
        break;
      }
    }
  return ridges;
}

}  // namespace

FloatImage walls_along(std::vector<Segment2d> lines, const Raster& raster, const Thickness& thickness, double far_mm) {
  // Where the section is shrunk most, a void's core is what lies half a wall and half a gap off the lines: discs of
  // half a gap about it fill the void, and discs of half a wall fit between any two of them. As the section grows the
  // discs of the void grow by what the wall would have gained.
  const double core_mm = 0.5 * (thickness.wall_mm + thickness.gap_mm) / thickness.least_scale;
  const double void_mm = core_mm - 0.5 * thickness.wall_mm;
  const double least_void_mm = 0.5 * thickness.gap_mm / thickness.least_scale;

  // A rim as wide as the distances reach, so that the image's frame changes nothing.
  const int rim = static_cast<int>(std::ceil((far_mm + core_mm) / raster.pixel_mm)) + 1;
  const Raster wide{raster.corner_mm - raster.pixel_mm * Vec2d{rim + 0.0, rim + 0.0}, raster.pixel_mm,
                    raster.width + 2 * rim, raster.height + 2 * rim};
  FloatImage to_void;
  constexpr int rounds = 12;  // a wall across a neck settles it; what it leaves on either side may take another
  for (int round = 0; round < rounds; ++round) {
    const FloatImage to_line = distance_to_segments(lines, wide.corner_mm, wide.pixel_mm, wide.width, wide.height,
                                                    core_mm + 2 * wide.pixel_mm);
    to_void = distance_to_level(to_line, wide, core_mm, far_mm + core_mm);
    const std::vector<Vec2d> thin = thin_ridges(to_void, wide, least_void_mm, core_mm);
    if (thin.empty()) break;
    for (const Vec2d p : thin) lines.push_back({p, p});
  }

  FloatImage walls(raster.width, raster.height);
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x)
      walls(x, y) = std::clamp(static_cast<float>(void_mm) - to_void(x + rim, y + rim), -static_cast<float>(far_mm),
                               static_cast<float>(far_mm));
  return walls;
}

}  // namespace fibrolite
