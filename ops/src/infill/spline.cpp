// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/spline.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace fibrolite {

double steepest(const FloatImage& image) {
  if (image.width < 3 || image.height < 3) return 0;
  // Three places a third of a pixel apart: how they weigh the samples, and the differences between them.
  struct Place {
    std::array<float, 3> value;
    std::array<float, 2> slope;
  };
  std::array<Place, 3> places{};
  for (int k = 0; k < 3; ++k) {
    const float t = static_cast<float>(k - 1) / 3;
    const SplineWeights w(t);
    places[static_cast<std::size_t>(k)] = {{w.before, w.at, w.after}, {0.5F - t, 0.5F + t}};
  }
  const auto rows = [&](const tbb::blocked_range<int>& range, float most) {
    for (int y = range.begin(); y < range.end(); ++y)
      for (int x = 1; x + 1 < image.width; ++x) {
        const std::array<const float*, 3> row{&image(x, y - 1), &image(x, y), &image(x, y + 1)};
        for (const Place& a : places)
          for (const Place& d : places) {
            float across = 0, down = 0;
            for (std::size_t j = 0; j < 3; ++j)
              across += d.value[j] * (a.slope[0] * (row[j][0] - row[j][-1]) + a.slope[1] * (row[j][1] - row[j][0]));
            for (std::size_t i = 0; i < 3; ++i) {
              const auto at = static_cast<std::ptrdiff_t>(i) - 1;
              down += a.value[i] * (d.slope[0] * (row[1][at] - row[0][at]) + d.slope[1] * (row[2][at] - row[1][at]));
            }
            most = std::max(most, across * across + down * down);
          }
      }
    return most;
  };
  const float most = tbb::parallel_reduce(tbb::blocked_range<int>(1, image.height - 1), 0.F, rows,
                                          [](float a, float b) { return std::max(a, b); });
  return std::sqrt(static_cast<double>(most));
}

}  // namespace fibrolite
