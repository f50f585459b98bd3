// SPDX-License-Identifier: GPL-3.0-or-later
#include "inscribed_balls.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace fibrolite::testing {
namespace {

/// Lower envelope of the parabolas (q - p)^2 + value[p], at each q.
void envelope(std::vector<double>& value, std::vector<int>& place, std::vector<double>& from,
              std::vector<double>& out) {
  const int n = static_cast<int>(value.size());
  int last = -1;
  for (int q = 0; q < n; ++q) {
    const double own = value[static_cast<std::size_t>(q)];
    if (!std::isfinite(own)) continue;
    double start = -std::numeric_limits<double>::infinity();
    while (last >= 0) {
      const int p = place[static_cast<std::size_t>(last)];
      start = (own + 1.0 * q * q - value[static_cast<std::size_t>(p)] - 1.0 * p * p) / (2.0 * (q - p));
      if (start > from[static_cast<std::size_t>(last)]) break;
      --last;
    }
    if (last < 0) start = -std::numeric_limits<double>::infinity();
    ++last;
    place[static_cast<std::size_t>(last)] = q;
    from[static_cast<std::size_t>(last)] = start;
  }
  for (int q = 0, k = 0; q < n; ++q) {
    if (last < 0) {
      out[static_cast<std::size_t>(q)] = std::numeric_limits<double>::infinity();
      continue;
    }
    while (k < last && from[static_cast<std::size_t>(k + 1)] < q) ++k;
    const int p = place[static_cast<std::size_t>(k)];
    out[static_cast<std::size_t>(q)] = 1.0 * (q - p) * (q - p) + value[static_cast<std::size_t>(p)];
  }
}

}  // namespace

Voxels::Voxels(const Box3d& box, double voxel) : low(box.min), voxel_mm(voxel) {
  const Vec3d size = box.size();
  nx = static_cast<int>(std::ceil(size.x / voxel)) + 1;
  ny = static_cast<int>(std::ceil(size.y / voxel)) + 1;
  nz = static_cast<int>(std::ceil(size.z / voxel)) + 1;
  set.assign(at(0, 0, nz), 0);
}

void Voxels::fill(const std::function<void(const std::vector<Vec3d>& row, std::uint8_t* set)>& row) {
  tbb::parallel_for(0, nz, [&](int k) {
    std::vector<Vec3d> places(static_cast<std::size_t>(nx));
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) places[static_cast<std::size_t>(i)] = place(i, j, k);
      row(places, set.data() + at(0, j, k));
    }
  });
}

std::vector<float> distance2(const Voxels& v, bool to_set) {
  std::vector<float> result(v.set.size());
  for (std::size_t n = 0; n < result.size(); ++n)
    result[n] = (v.set[n] != 0) == to_set ? 0.0F : std::numeric_limits<float>::infinity();
  const auto along = [&](int count, std::size_t stride, int lines, const auto& first) {
    tbb::parallel_for(0, lines, [&](int line) {
      // One more at either end: what lies beyond the brick is not set.
      const auto n = static_cast<std::size_t>(count) + 2;
      const double beyond = to_set ? std::numeric_limits<double>::infinity() : 0;
      std::vector<double> value(n, beyond), from(n), out(n);
      std::vector<int> place(n);
      float* const start = result.data() + first(line);
      for (std::size_t k = 0; k + 2 < n; ++k) value[k + 1] = static_cast<double>(start[k * stride]);
      envelope(value, place, from, out);
      for (std::size_t k = 0; k + 2 < n; ++k) start[k * stride] = static_cast<float>(out[k + 1]);
    });
  };
  along(v.nx, 1, v.ny * v.nz, [&](int line) { return v.at(0, line % v.ny, line / v.ny); });
  along(v.ny, v.at(0, 1, 0), v.nx * v.nz, [&](int line) { return v.at(line % v.nx, 0, line / v.nx); });
  along(v.nz, v.at(0, 0, 1), v.nx * v.ny, [&](int line) { return v.at(line % v.nx, line / v.nx, 0); });
  return result;
}

ThinPlaces thin_places(const Voxels& v, double diameter_mm, const std::function<bool(Vec3d)>& counts) {
  const double radius = 0.5 * (diameter_mm / v.voxel_mm - 1.5);
  Voxels centres = v;
  {
    const std::vector<float> clear2 = distance2(v, false);
    for (std::size_t n = 0; n < clear2.size(); ++n)
      centres.set[n] = static_cast<double>(clear2[n]) >= radius * radius ? 1 : 0;
  }
  const std::vector<float> off2 = distance2(centres, true);
  const double corner = radius + (std::numbers::sqrt2 - 1) * 0.5 * diameter_mm / v.voxel_mm + 1.5;
  ThinPlaces thin;
  for (int k = 0; k < v.nz; ++k)
    for (int j = 0; j < v.ny; ++j)
      for (int i = 0; i < v.nx; ++i) {
        const std::size_t n = v.at(i, j, k);
        const double off = std::sqrt(static_cast<double>(off2[n]));
        if (v.set[n] == 0 || off <= corner || (counts && !counts(v.place(i, j, k)))) continue;
        ++thin.voxels;
        const double beside = (off - radius) * v.voxel_mm;
        if (beside <= thin.farthest_mm) continue;
        thin.farthest_mm = beside;
        thin.where = v.place(i, j, k);
      }
  return thin;
}

}  // namespace fibrolite::testing
