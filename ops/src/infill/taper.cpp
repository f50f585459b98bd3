// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/taper.h"

#include <algorithm>
#include <cmath>

namespace fibrolite {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// What is 0 becomes its nearest neighbour's, the one before if both are as near.
std::vector<double> held(const std::vector<double>& values) {
  const int n = static_cast<int>(values.size());
  std::vector<double> result = values;
  for (int i = 0; i < n; ++i)
    for (int d = 0; d < n && result[static_cast<std::size_t>(i)] == 0; ++d)
      for (const int j : {i + d, i - d})
        if (j >= 0 && j < n && values[static_cast<std::size_t>(j)] > 0)
          result[static_cast<std::size_t>(i)] = values[static_cast<std::size_t>(j)];
  return result;
}

/// Gaussian mean; beyond the ends their values go on, round a ring the other end does.
std::vector<double> smoothed(const std::vector<double>& values, double width, bool ring) {
  const int n = static_cast<int>(values.size()), reach = std::min(n - 1, static_cast<int>(std::ceil(3 * width)));
  std::vector<double> result;
  for (int i = 0; i < n; ++i) {
    double sum = 0, weights = 0;
    for (int d = -reach; d <= reach; ++d) {
      const int j = ring ? (i + d + 2 * (n - 1)) % (n - 1) : std::clamp(i + d, 0, n - 1);
      const double weight = std::exp(-0.5 * (d / width) * (d / width));
      sum += weight * values[static_cast<std::size_t>(j)];
      weights += weight;
    }
    result.push_back(sum / weights);
  }
  return result;
}

}  // namespace

Taper taper_along(const Sweep& sweep, const std::vector<LimbSection>& sections, const TaperLimits& limits) {
  std::vector<double> size, reach, whole;
  for (const LimbSection& s : sections) {
    size.push_back(s.size_mm);
    reach.push_back(s.reach_mm);
    if (s.size_mm > 0) whole.push_back(s.size_mm);
  }
  if (whole.size() < 2) return {};
  const double typical = median(whole), step = sweep.length_mm() / static_cast<double>(sections.size() - 1);
  size = held(size);
  reach = held(reach);
  for (double& s : size) s = std::clamp(s / typical, limits.least, limits.most);
  Taper taper;
  taper.scale = smoothed(size, std::max(0.5, typical / step), sweep.closed());

  // A fibre r off the line runs at the slope r * scale' / scale, more on the inner side of a bend, where the same turn
  // is a shorter way. The wider side of a step gives in: nothing gets narrower than the limb asks for.
  const std::size_t n = taper.scale.size();
  std::vector<double> lever(n - 1);  // slope per relative change of scale from one section to the next
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double r = std::max(reach[i], reach[i + 1]);
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(n - 1);
    lever[i] = r / step / std::max(0.05, 1 - r * sweep.curvature_at(share));
  }
  const auto limited = [&](std::size_t wide, std::size_t narrow) {
    const double most = 1 + limits.steepest / lever[std::min(wide, narrow)];
    taper.scale[wide] = std::min(taper.scale[wide], taper.scale[narrow] * most);
  };
  for (int round = 0; round < (sweep.closed() ? 2 : 1); ++round) {
    for (std::size_t i = 1; i < n; ++i) limited(i, i - 1);
    for (std::size_t i = n - 1; i > 0; --i) limited(i - 1, i);
    if (sweep.closed()) taper.scale.front() = taper.scale.back() = std::min(taper.scale.front(), taper.scale.back());
  }
  for (std::size_t i = 0; i + 1 < n; ++i)
    taper.slope = std::max(taper.slope, lever[i] * std::abs(taper.scale[i + 1] - taper.scale[i]) /
                                            std::min(taper.scale[i + 1], taper.scale[i]));
  return taper;
}

}  // namespace fibrolite
