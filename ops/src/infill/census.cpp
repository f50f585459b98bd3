// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/census.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "plane_image.h"

namespace fibrolite {
namespace {

/// Twice the depth of a membrane's middle, in pixels, where (x, y) is nearest to it: two slopes that meet there or up
/// to half a pixel beside. 0 elsewhere.
double thickness_at(const FloatImage& membranes, int x, int y) {
  const auto depth = [&](int i, int j) { return -static_cast<double>(membranes(i, j)); };
  double thickness = std::numeric_limits<double>::infinity();  // straight across is shortest
  for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{0, 1}, std::pair{1, 1}, std::pair{1, -1}}) {
    const double own = depth(x, y), a = depth(x - dx, y - dy), b = depth(x + dx, y + dy);
    const double step = std::hypot(dx, dy);
    if (own < a || own < b || 2 * own - a - b < 0.8 * step) continue;
    thickness = std::min(thickness, a + b + 2 * step);
  }
  return std::isinf(thickness) ? 0 : thickness;
}

}  // namespace

FibreCensus census(const FloatImage& membranes, double pixel, double least_area, const FloatImage* lumen) {
  const auto counts = [&](int x, int y) { return lumen == nullptr || (*lumen)(x, y) < 0; };
  Image<std::uint8_t> open(membranes.width, membranes.height);
  std::vector<double> thickness;
  double inside = 0, hollow = 0, deepest = 0;
  FloatImage scaled = membranes;
  for (float& d : scaled.pixels) d /= static_cast<float>(pixel);
  for (int y = 0; y < open.height; ++y)
    for (int x = 0; x < open.width; ++x) {
      if (!counts(x, y)) continue;
      open(x, y) = membranes(x, y) > 0;
      inside += 1;
      hollow += open(x, y);
      const bool rim = x == 0 || y == 0 || x + 1 == open.width || y + 1 == open.height;
      if (rim || membranes(x, y) >= 0) continue;
      deepest = std::max(deepest, -1.0 * scaled(x, y));
      if (const double t = thickness_at(scaled, x, y); t > 0) thickness.push_back(t);
    }

  // Fibres cut off by the frame or the shell are counted, but have no area of their own.
  const Regions voids = regions_of(open);
  std::vector<char> cut(static_cast<std::size_t>(voids.count), 0);
  for (int y = 0; y < open.height; ++y)
    for (int x = 0; x < open.width; ++x) {
      if (voids.label(x, y) == 0) continue;
      const bool rim = x == 0 || y == 0 || x + 1 == open.width || y + 1 == open.height;
      if (rim || !counts(x - 1, y) || !counts(x + 1, y) || !counts(x, y - 1) || !counts(x, y + 1))
        cut[static_cast<std::size_t>(voids.label(x, y) - 1)] = 1;
    }
  FibreCensus result;
  double area[2] = {0, 0};
  int of[2] = {0, 0};
  for (std::size_t i = 0; i < cut.size(); ++i) {
    const double own = static_cast<double>(voids.pixels[i]) * pixel * pixel;
    if (own < least_area) continue;
    ++result.fibres;
    ++of[static_cast<std::size_t>(cut[i])];
    area[static_cast<std::size_t>(cut[i])] += own;
  }
  const std::size_t from = of[0] > 0 ? 0 : 1;
  if (of[from] > 0) result.mean_area = area[from] / of[from];
  if (inside > 0) result.porosity = hollow / inside;
  if (!thickness.empty()) {
    const auto middle = thickness.begin() + static_cast<std::ptrdiff_t>(thickness.size() / 2);
    std::nth_element(thickness.begin(), middle, thickness.end());
    result.membrane = *middle * pixel;
  } else {
    result.membrane = 2 * deepest * pixel;  // lumps without a middle line
  }
  return result;
}

int count_free_edges(const FloatImage& wall, const FloatImage& lumen, double wall_mm, double pixel_mm) {
  // A circle about the end of one, wider than the membrane, meets material once and over
  // less than half its length; about a wall it meets material twice, about a junction three times or more.
  constexpr int probes = 48;
  constexpr double wider = 1.3, most = 0.4;
  Image<std::uint8_t> ends(wall.width, wall.height);
  for (int j = 0; j < wall.height; ++j)
    for (int i = 0; i < wall.width; ++i) {
      const auto depth = static_cast<double>(-wall(i, j));
      if (depth < 0.4 * wall_mm || static_cast<double>(lumen(i, j)) > -wider * depth) continue;
      const double radius_px = wider * depth / pixel_mm;
      int material = 0, starts = 0;
      bool before = true;
      for (int k = 0; k <= probes; ++k) {
        const double turn = 2 * std::numbers::pi * k / probes;
        const float v = bilinear(wall, static_cast<float>(i + radius_px * std::cos(turn)),
                                 static_cast<float>(j + radius_px * std::sin(turn)));
        const bool now = v < 0;
        if (k > 0) {
          material += now ? 1 : 0;
          starts += now && !before ? 1 : 0;
        }
        before = now;
      }
      ends(i, j) = starts == 1 && material < most * probes;
    }
  return regions_of(ends).count;
}

}  // namespace fibrolite
