// SPDX-License-Identifier: GPL-3.0-or-later
#include "discs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace fibrolite {
namespace {

/// Squared distance of each sample to the nearest marked one, by lower envelopes of parabolas (Felzenszwalb and
/// Huttenlocher 2012), samples apart 1.
FloatImage squared_distance_to(const Image<std::uint8_t>& marked) {
  constexpr float far = 1e12F;
  FloatImage f(marked.width, marked.height);
  for (std::size_t i = 0; i < f.pixels.size(); ++i) f.pixels[i] = marked.pixels[i] != 0 ? 0 : far;
  const auto along = [](std::vector<double>& line) {
    std::vector<int> from;
    std::vector<double> start;
    for (int q = 0; q < static_cast<int>(line.size()); ++q) {
      const double height = line[static_cast<std::size_t>(q)] + 1.0 * q * q;
      double at = -std::numeric_limits<double>::infinity();
      while (!from.empty()) {
        const int v = from.back();
        at = (height - (line[static_cast<std::size_t>(v)] + 1.0 * v * v)) / (2.0 * (q - v));
        if (at > start.back()) break;
        from.pop_back();
        start.pop_back();
        at = -std::numeric_limits<double>::infinity();
      }
      from.push_back(q);
      start.push_back(at);
    }
    std::vector<double> result(line.size());
    std::size_t k = 0;
    for (int q = 0; q < static_cast<int>(line.size()); ++q) {
      while (k + 1 < from.size() && start[k + 1] < q) ++k;
      result[static_cast<std::size_t>(q)] =
          1.0 * (q - from[k]) * (q - from[k]) + line[static_cast<std::size_t>(from[k])];
    }
    line = result;
  };
  for (int y = 0; y < f.height; ++y) {
    std::vector<double> line(&f(0, y), &f(0, y) + f.width);
    along(line);
    for (int x = 0; x < f.width; ++x) f(x, y) = static_cast<float>(std::min(line[static_cast<std::size_t>(x)], 1e12));
  }
  for (int x = 0; x < f.width; ++x) {
    std::vector<double> line(static_cast<std::size_t>(f.height));
    for (int y = 0; y < f.height; ++y) line[static_cast<std::size_t>(y)] = f(x, y);
    along(line);
    for (int y = 0; y < f.height; ++y) f(x, y) = static_cast<float>(line[static_cast<std::size_t>(y)]);
  }
  return f;
}

}  // namespace

bool holds_discs(const Image<std::uint8_t>& marked, double diameter, int rim, double slack) {
  Image<std::uint8_t> outside = marked;
  for (std::uint8_t& m : outside.pixels) m = m == 0;
  const FloatImage depth2 = squared_distance_to(outside);
  Image<std::uint8_t> centres(marked.width, marked.height);
  for (std::size_t i = 0; i < centres.pixels.size(); ++i)
    centres.pixels[i] = std::sqrt(static_cast<double>(depth2.pixels[i])) >= diameter / 2;
  const FloatImage to_centre2 = squared_distance_to(centres);
  for (int y = rim; y < marked.height - rim; ++y)
    for (int x = rim; x < marked.width - rim; ++x)
      if (marked(x, y) != 0 && std::sqrt(static_cast<double>(to_centre2(x, y))) > diameter / 2 + slack) return false;
  return true;
}

Discs::Discs(const Shape& shape, const Frame& section, double width_mm, double height_mm, double step_mm)
    : wall_(static_cast<int>(width_mm / step_mm) + 1, static_cast<int>(height_mm / step_mm) + 1),
      gap_(wall_.width, wall_.height),
      step_mm_(step_mm) {
  std::vector<Vec3d> points;
  for (int y = 0; y < wall_.height; ++y)
    for (int x = 0; x < wall_.width; ++x)
      points.push_back(section.to_world({x * step_mm - 0.5 * width_mm, y * step_mm - 0.5 * height_mm, 0}));
  std::vector<float> value(points.size());
  shape.evaluate(points, value);
  for (std::size_t i = 0; i < value.size(); ++i) {
    wall_.pixels[i] = value[i] < 0;
    gap_.pixels[i] = value[i] >= 0;
  }
}

}  // namespace fibrolite
