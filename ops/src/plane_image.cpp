// SPDX-License-Identifier: GPL-3.0-or-later
#include "plane_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace fibrolite {
namespace {

/// Evaluates points [from, to) of a sequence, 512 at a time: point(i) is a world position.
template <class Point>
void evaluate_range(const Shape& shape, std::size_t from, std::size_t to, const Point& point, float* out) {
  std::array<float, PointBlock::capacity> x, y, z;
  for (std::size_t first = from; first < to; first += PointBlock::capacity) {
    const auto count = static_cast<int>(std::min<std::size_t>(PointBlock::capacity, to - first));
    for (int k = 0; k < count; ++k) {
      const Vec3f p = to_float(point(first + static_cast<std::size_t>(k)));
      const auto at = static_cast<std::size_t>(k);
      x[at] = p.x;
      y[at] = p.y;
      z[at] = p.z;
    }
    shape.evaluate({x.data(), y.data(), z.data(), count}, out + first);
  }
}

template <class Point>
void evaluate_all(const Shape& shape, std::size_t count, const Point& point, float* out) {
  constexpr std::size_t chunk = 4 * PointBlock::capacity;
  tbb::parallel_for(std::size_t{0}, (count + chunk - 1) / chunk, [&](std::size_t c) {
    evaluate_range(shape, c * chunk, std::min(count, (c + 1) * chunk), point, out);
  });
}

}  // namespace

PlaneGrid PlaneGrid::about(const BentPlane& surface, double radius_mm, double pixel_mm, int border_px) {
  const int half = static_cast<int>(std::ceil(radius_mm / pixel_mm)) + border_px;
  return {surface.frame, {-half * pixel_mm, -half * pixel_mm}, pixel_mm, 2 * half + 1, 2 * half + 1, surface.bend};
}

FloatImage sample(const Shape& shape, const PlaneGrid& grid, double z_mm) {
  FloatImage image(grid.width, grid.height);
  // Squares of 16 x 16 pixels keep a block's points close together, which is what a shape's bound and buckets like.
  constexpr int side = 16;
  const int columns = (grid.width + side - 1) / side, rows = (grid.height + side - 1) / side;
  tbb::parallel_for(0, columns * rows, [&](int square) {
    const int i0 = square % columns * side, j0 = square / columns * side;
    const int w = std::min(side, grid.width - i0), h = std::min(side, grid.height - j0);
    std::array<float, side * side> values;
    evaluate_range(
        shape, 0, static_cast<std::size_t>(w * h),
        [&](std::size_t k) { return grid.world(i0 + static_cast<int>(k) % w, j0 + static_cast<int>(k) / w, z_mm); },
        values.data());
    for (int j = 0; j < h; ++j) std::copy_n(&values[static_cast<std::size_t>(j * w)], w, &image(i0, j0 + j));
  });
  return image;
}

void evaluate_parallel(const Shape& shape, const std::vector<Vec3d>& points, std::vector<float>& out) {
  out.resize(points.size());
  evaluate_all(
      shape, points.size(), [&](std::size_t i) { return points[i]; }, out.data());
}

Regions regions_of(const Image<std::uint8_t>& mask) {
  Regions found;
  found.label = Image<std::int32_t>(mask.width, mask.height);
  std::vector<std::size_t> stack;
  const auto width = static_cast<std::size_t>(mask.width);
  for (std::size_t start = 0; start < mask.pixels.size(); ++start) {
    if (mask.pixels[start] == 0 || found.label.pixels[start] != 0) continue;
    ++found.count;
    found.pixels.push_back(0);
    const auto take = [&](std::size_t i) {
      if (mask.pixels[i] == 0 || found.label.pixels[i] != 0) return;
      found.label.pixels[i] = found.count;
      ++found.pixels.back();
      stack.push_back(i);
    };
    take(start);
    while (!stack.empty()) {
      const std::size_t i = stack.back();
      stack.pop_back();
      const std::size_t x = i % width;
      if (x > 0) take(i - 1);
      if (x + 1 < width) take(i + 1);
      if (i >= width) take(i - width);
      if (i + width < mask.pixels.size()) take(i + width);
    }
  }
  return found;
}

}  // namespace fibrolite
