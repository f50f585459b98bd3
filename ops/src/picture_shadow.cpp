// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture_shadow.h"

#include <algorithm>
#include <cmath>

namespace fibrolite {
namespace {

constexpr int grid_cells = 192;   ///< Along the longer side of the footprint.
constexpr int margin_cells = 64;  ///< Around it, for the blur.

/// Three box blurs come close to a Gaussian.
void blur(FloatImage& image, int radius) {
  FloatImage other = image;
  const auto line = [radius](const float* from, float* to, int count, int stride) {
    double sum = 0;
    const auto value = [&](int i) { return i < 0 || i >= count ? 0.0 : static_cast<double>(from[i * stride]); };
    for (int i = -radius; i < radius; ++i) sum += value(i);
    for (int i = 0; i < count; ++i) {
      sum += value(i + radius);
      to[i * stride] = static_cast<float>(sum / (2 * radius + 1));
      sum -= value(i - radius);
    }
  };
  for (int pass = 0; pass < 3; ++pass) {
    for (int y = 0; y < image.height; ++y) line(&image(0, y), &other(0, y), image.width, 1);
    for (int x = 0; x < image.width; ++x) line(&other(x, 0), &image(x, 0), image.height, image.width);
  }
}

}  // namespace

GroundShadow::GroundShadow(const Mesh& mesh, const std::optional<CutPlane>& cut, Vec3d up) {
  ground_ = frame_along({}, up);
  Box3d box;
  for (const Vec3f& v : mesh.vertices) box.include(ground_.to_local(to_double(v)));
  const double footprint = std::max(box.size().x, box.size().y);
  if (box.empty() || footprint <= 0) return;
  cell_mm_ = footprint / grid_cells;
  const double margin = margin_cells * cell_mm_;
  ground_.origin = ground_.to_world({box.min.x - margin, box.min.y - margin, box.min.z});
  const auto cells = [&](double length) { return static_cast<int>(length / cell_mm_) + 1 + 2 * margin_cells; };
  FloatImage near(cells(box.size().x), cells(box.size().y), 0), wide = near;
  const double size = box.longest_side();
  for (const Vec3f& v : mesh.vertices) {
    const Vec3d world = to_double(v);
    if (cut && cut->side(world) > 0) continue;
    const Vec3d p = ground_.to_local(world);
    const int x = std::clamp(static_cast<int>(p.x / cell_mm_), 0, near.width - 1);
    const int y = std::clamp(static_cast<int>(p.y / cell_mm_), 0, near.height - 1);
    near(x, y) = std::max(near(x, y), static_cast<float>(std::exp(-p.z / (0.03 * size))));
    wide(x, y) = std::max(wide(x, y), static_cast<float>(std::exp(-p.z / (0.30 * size))));
  }
  blur(near, 2);
  blur(wide, 9);
  dark_ = near;
  for (std::size_t i = 0; i < dark_.pixels.size(); ++i) {
    dark_.pixels[i] = std::min(0.75F, 0.55F * near.pixels[i] + 0.50F * wide.pixels[i]);
  }
}

double GroundShadow::at(const View& view, double x, double y) const {
  const double slope = dot(view.forward, ground_.z);
  if (dark_.width == 0 || slope > -0.05) return 0;  // the ground is seen edge on or from below
  const Vec3d eye = ground_.to_local(view.unproject(x, y, 0));
  const Vec3d ray{dot(view.forward, ground_.x), dot(view.forward, ground_.y), slope};
  const Vec3d hit = eye - (eye.z / slope) * ray;
  const double u = hit.x / cell_mm_ - 0.5, v = hit.y / cell_mm_ - 0.5;
  if (u < 0 || v < 0 || u >= dark_.width - 1 || v >= dark_.height - 1) return 0;
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const double s = u - i, t = v - j;
  return (1 - t) * ((1 - s) * dark_(i, j) + s * dark_(i + 1, j)) +
         t * ((1 - s) * dark_(i, j + 1) + s * dark_(i + 1, j + 1));
}

}  // namespace fibrolite
