// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/measure.h"

#include <algorithm>
#include <array>

#include "fibrolite/blocks.h"

namespace fibrolite {
namespace {

using Values = std::array<float, PointBlock::capacity>;

/// Share of a voxel below zero, from the distance at its sample.
float below(float distance, float inverse_voxel) { return std::clamp(0.5F - distance * inverse_voxel, 0.0F, 1.0F); }

struct Sums {
  double part = 0, lumen = 0, infill = 0;
  Vec3d moment{};
  Sums& operator+=(const Sums& o) {
    part += o.part;
    lumen += o.lumen;
    infill += o.infill;
    moment = moment + o.moment;
    return *this;
  }
};

/// Which region owns each point of a block: the one with the least value. One region with the least bound owns all.
void owners(const std::vector<Shape>& regions, const PointBlock& block, const Box3d& box, std::vector<int>& out) {
  out.assign(static_cast<std::size_t>(block.count), 0);
  if (regions.size() < 2) return;
  std::vector<Interval> bounds;
  float least_hi = far_mm;
  for (const Shape& r : regions) {
    bounds.push_back(r.bound(box));
    least_hi = std::min(least_hi, bounds.back().hi);
  }
  Values best, value;
  best.fill(far_mm);
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (bounds[i].lo > least_hi) continue;
    regions[i].evaluate(block, value.data());
    for (std::size_t k = 0; k < out.size(); ++k) {
      if (value[k] < best[k]) {
        best[k] = value[k];
        out[k] = static_cast<int>(i);
      }
    }
  }
}

}  // namespace

std::vector<PartVolumes> measure(const Solid& body, const Solid& solid, const std::vector<Shape>& regions,
                                 double shell_mm, const Context& context) {
  const double h = body.grid().voxel_mm;
  const auto inverse = static_cast<float>(1 / h), shell = static_cast<float>(shell_mm);
  const auto origins = blocks(body);
  const Shape body_shape = distance_to(body), solid_shape = distance_to(solid);
  const std::size_t n = std::max<std::size_t>(regions.size(), 1);

  // Chunks of blocks are summed on their own and added in order: the same bits on any number of threads.
  constexpr std::size_t chunk = 256;
  std::vector<Sums> total(n);
  std::vector<Sums> sums(std::min(origins.size(), 64 * chunk) * n);
  for (std::size_t start = 0; start < origins.size(); start += 64 * chunk) {
    context.check();
    const std::vector<Vec3i> batch(
        origins.begin() + static_cast<std::ptrdiff_t>(start),
        origins.begin() + static_cast<std::ptrdiff_t>(std::min(start + 64 * chunk, origins.size())));
    std::fill(sums.begin(), sums.end(), Sums{});
    for_each_block(batch, h, [&](std::size_t number, const PointBlock& block) {
      Values b, s;
      body_shape.evaluate(block, b.data());
      solid_shape.evaluate(block, s.data());
      const Vec3d low = h * Vec3d{1.0 * block.leaf->x, 1.0 * block.leaf->y, 1.0 * block.leaf->z};
      thread_local std::vector<int> owner;
      owners(regions, block, {low, low + Vec3d{7 * h, 7 * h, 7 * h}}, owner);
      for (std::size_t k = 0; k < PointBlock::capacity; ++k) {
        const float part = below(b[k], inverse);
        if (part <= 0) continue;
        Sums& into = sums[number * n + static_cast<std::size_t>(owner[k])];
        const float lumen = below(b[k] + shell, inverse);
        into.part += part;
        into.lumen += lumen;
        into.infill += std::min(lumen, below(s[k], inverse));
        into.moment = into.moment + static_cast<double>(part) * Vec3d{block.x[k], block.y[k], block.z[k]};
      }
    });
    for (std::size_t i = 0; i < batch.size(); ++i) {
      for (std::size_t r = 0; r < n; ++r) total[r] += sums[i * n + r];
    }
  }
  std::vector<PartVolumes> result;
  for (const Sums& t : total) {
    result.push_back(
        {t.part * h * h * h, t.lumen * h * h * h, t.infill * h * h * h, t.part > 0 ? t.moment / t.part : Vec3d{}});
  }
  return result;
}

}  // namespace fibrolite
