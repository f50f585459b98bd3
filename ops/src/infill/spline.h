// SPDX-License-Identifier: GPL-3.0-or-later
// An image as a smooth function. Private to the fibre infill.
#pragma once

#include <algorithm>

#include "fibrolite/image.h"

namespace fibrolite {

/// Weights of three samples for a place `t` pixels off the middle one, -1/2 to 1/2.
struct SplineWeights {
  float before, at, after;
  explicit SplineWeights(float t)
      : before(0.5F * (0.5F - t) * (0.5F - t)), at(0.75F - t * t), after(0.5F * (0.5F + t) * (0.5F + t)) {}
};

/// Quadratic B-spline with the samples as coefficients: a weighted mean of nine, C1. Of a distance it is a distance to
/// second order in pixel / radius of curvature, and no steeper where two sides are equally near; a bilinear surface is
/// too steep there by up to sqrt(2), and by a third of pixel / radius elsewhere. Lines of radius r shift by
/// pixel^2 / (8 r) toward the middle of their bend. Beyond the image its rim is continued.
[[nodiscard]] inline float spline(const FloatImage& image, float x, float y) {
  x = std::clamp(x, 0.5F, static_cast<float>(image.width) - 1.5F);
  y = std::clamp(y, 0.5F, static_cast<float>(image.height) - 1.5F);
  const int i = std::min(static_cast<int>(x + 0.5F), image.width - 2);
  const int j = std::min(static_cast<int>(y + 0.5F), image.height - 2);
  const SplineWeights across(x - static_cast<float>(i)), down(y - static_cast<float>(j));
  const float* row = &image(i, j);
  const auto line = [&](const float* p) { return across.before * p[-1] + across.at * p[0] + across.after * p[1]; };
  return down.before * line(row - image.width) + down.at * line(row) + down.after * line(row + image.width);
}

/// The largest gradient of that surface, in units of the image per pixel, from nine places of each pixel; parallel.
[[nodiscard]] double steepest(const FloatImage& image);

}  // namespace fibrolite
