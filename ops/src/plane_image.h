// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes sampled on a plane, or a bent one. Private to ops.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "fibrolite/frame.h"
#include "fibrolite/image.h"
#include "fibrolite/ops/bent_plane.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// A raster in the xy plane of a frame: pixel (i, j) lies at local corner_mm + pixel_mm * (i, j), or over that place on
/// the bent plane.
struct PlaneGrid {
  Frame frame;
  Vec2d corner_mm;
  double pixel_mm = 0.1;
  int width = 0, height = 0;
  Bend bend{};

  [[nodiscard]] Vec2d local(double i, double j) const { return corner_mm + pixel_mm * Vec2d{i, j}; }
  [[nodiscard]] Vec3d world(int i, int j, double z_mm = 0) const {
    return BentPlane{frame, bend}.at(local(i, j), z_mm);
  }
  [[nodiscard]] std::size_t pixels() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  /// The raster that covers a disc about the origin, a pixel at the origin, `border_px` more on each side.
  static PlaneGrid about(const BentPlane& surface, double radius_mm, double pixel_mm, int border_px);
};

/// The shape's value at every pixel, `z_mm` above the surface. Parallel.
[[nodiscard]] FloatImage sample(const Shape& shape, const PlaneGrid& grid, double z_mm = 0);

/// The same for points given in local coordinates; any number. Parallel, 512 points at a time.
void evaluate_parallel(const Shape& shape, const std::vector<Vec3d>& points, std::vector<float>& out);

/// Connected regions (4-neighbour) of the pixels that are not 0: labels 1..count in scan order, 0 elsewhere.
struct Regions {
  Image<std::int32_t> label;
  int count = 0;
  std::vector<std::int64_t> pixels;  ///< Of region i + 1.
};
[[nodiscard]] Regions regions_of(const Image<std::uint8_t>& mask);

/// Share of a pixel that material covers, from the distance at its centre.
[[nodiscard]] inline double coverage(double distance_mm, double pixel_mm) {
  return std::clamp(0.5 - distance_mm / pixel_mm, 0.0, 1.0);
}

/// Bilinear value at pixel coordinates, clamped to the image.
[[nodiscard]] inline float bilinear(const FloatImage& image, float x, float y) {
  x = x < 0 ? 0 : x > static_cast<float>(image.width - 1) ? static_cast<float>(image.width - 1) : x;
  y = y < 0 ? 0 : y > static_cast<float>(image.height - 1) ? static_cast<float>(image.height - 1) : y;
  const int i = static_cast<int>(x) < image.width - 2 ? static_cast<int>(x) : image.width - 2;
  const int j = static_cast<int>(y) < image.height - 2 ? static_cast<int>(y) : image.height - 2;
  const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
  const float* row = &image(i, j);
  const float* below = row + image.width;
  const float top = row[0] + fx * (row[1] - row[0]);
  const float bottom = below[0] + fx * (below[1] - below[0]);
  return top + fy * (bottom - top);
}

}  // namespace fibrolite
