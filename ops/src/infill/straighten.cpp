// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/straighten.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace fibrolite {
namespace {

constexpr double most_bend = 0.8;
constexpr int directions = 5;  // half a turn about the inner side of the bend

bool is_ring(const std::vector<Vec3d>& line) { return line.size() > 3 && norm(line.front() - line.back()) < 1e-9; }

/// Gaussian mean over `width` points; beyond an end the line goes on as its own mirror image, so that ends stay.
std::vector<Vec3d> smoothed(const std::vector<Vec3d>& line, double width) {
  const int n = static_cast<int>(line.size()), last = n - 1;
  const bool ring = is_ring(line);
  const auto at = [&](int i) {
    if (ring) return line[static_cast<std::size_t>(((i % last) + last) % last)];
    const int low = std::clamp(-i, 0, last), high = std::clamp(2 * last - i, 0, last);
    if (i < 0) return 2 * line.front() - line[static_cast<std::size_t>(low)];
    if (i > last) return 2 * line.back() - line[static_cast<std::size_t>(high)];
    return line[static_cast<std::size_t>(i)];
  };
  const int reach = std::min(last, static_cast<int>(std::ceil(3 * width)));
  std::vector<Vec3d> result;
  for (int i = 0; i < n; ++i) {
    Vec3d sum;
    double weights = 0;
    for (int d = -reach; d <= reach; ++d) {
      const double weight = std::exp(-0.5 * (d / width) * (d / width));
      sum = sum + weight * at(i + d);
      weights += weight;
    }
    result.push_back((1 / weights) * sum);
  }
  if (ring) result.back() = result.front();
  return result;
}

}  // namespace

double sharpest_bend(const Axis& axis, const Shape& inside) {
  const std::vector<Vec3d>& line = axis.centre_line();
  const int n = static_cast<int>(line.size());
  if (n < 4) return 0;
  // Turns are measured over a few points: a line of straight pieces turns at its corners only.
  const int span = std::max(1, n / 64);
  const double farthest = axis.length_mm();
  double sharpest = 0;
  for (int k = span; k + span < n; k += span) {
    const Vec3d at = line[static_cast<std::size_t>(k)];
    const Vec3d to = line[static_cast<std::size_t>(k + span)] - at,
                from = at - line[static_cast<std::size_t>(k - span)];
    const double step = 0.5 * (norm(to) + norm(from));
    const Vec3d bend = (1 / step) * (normalized(to) - normalized(from));
    const double curvature = norm(bend);
    if (curvature * farthest < 0.1) continue;
    const Vec3d along = normalized(to + from), inward = normalized(bend - dot(bend, along) * along);
    const Vec3d beside = cross(along, inward);
    const double stride = 0.02 / curvature;  // a fiftieth of the way to where planes meet
    for (int d = 0; d < directions; ++d) {
      const double turn = std::numbers::pi * ((d + 0.5) / directions - 0.5);
      const Vec3d out = std::cos(turn) * inward + std::sin(turn) * beside;
      const double towards = curvature * std::cos(turn);
      for (double r = 0; r * towards < 2 && r < farthest; r += stride) {
        if (inside(at + r * out) >= 0) break;
        sharpest = std::max(sharpest, r * towards);
      }
    }
  }
  return sharpest;
}

Axis straightened(const Axis& axis, const Shape& inside) {
  Axis best = axis;
  double least = sharpest_bend(axis, inside);
  const std::vector<Vec3d>& line = axis.centre_line();
  const auto points = static_cast<double>(line.size());
  // A line between two ends gets straight at last; of a ring, which gets smaller, the best of them.
  for (double width = points / 64; least > most_bend && width < 4 * points; width *= 1.4) {
    Axis next = Axis::along(smoothed(line, std::max(1.0, width)));
    const double bend = sharpest_bend(next, inside);
    if (bend >= least) continue;
    best = std::move(next);
    least = bend;
  }
  return best;
}

}  // namespace fibrolite
