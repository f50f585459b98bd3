// SPDX-License-Identifier: GPL-3.0-or-later
// The distance image as a shape: swept along the centre line, with a taper or without.

#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "infill/spline.h"
#include "infill/sweep.h"
#include "infill/taper.h"

namespace fibrolite {
namespace {

constexpr double most_slope = 1.035;  // of the image as it is evaluated
constexpr double of_stations = 1.01;  // 0.08 rad from one to the next add less

class Membranes final : public Shape::Function {
 public:
  Membranes(MembraneImage image, const Axis& axis, Vec2d center_mm, const Taper& taper)
      : image_(std::move(image)), sweep_(axis) {
    per_pixel_ = static_cast<float>(1 / image_.pixel_mm);
    corner_x_ = static_cast<float>(center_mm.x - 0.5 * (image_.distance_mm.width - 1) * image_.pixel_mm);
    corner_y_ = static_cast<float>(center_mm.y - 0.5 * (image_.distance_mm.height - 1) * image_.pixel_mm);
    if (taper.scale.size() > 1 && taper.least() < taper.most()) {
      scale_.assign(taper.scale.begin(), taper.scale.end());
      per_step_ = static_cast<float>((static_cast<double>(scale_.size()) - 1) / sweep_.length_mm());
    } else if (!taper.scale.empty()) {
      scale_.assign(2, static_cast<float>(taper.scale.front()));
    }

    // What the map stretches, by a taper along the fibres' slope, by a ring's twist, and what the image itself is
    // steeper than a distance between its samples: divided out, so that values stay at most the distance.
    const double reach = 0.5 * std::hypot(image_.width_mm(), image_.height_mm()) + norm(center_mm);
    const double stretch = std::hypot(1, taper.slope, reach * sweep_.twist_per_mm());
    const double slope = std::max(1e-6, steepest(image_.distance_mm) / image_.pixel_mm);
    const double divisor = stretch * std::max(1.0, slope / most_slope);
    divide_ = static_cast<float>(1 / divisor);
    lipschitz_ = of_stations * slope * stretch / divisor;

    const auto [lo, hi] = std::minmax_element(image_.distance_mm.pixels.begin(), image_.distance_mm.pixels.end());
    for (const double scale : {taper.least(), taper.most()}) {
      range_.lo = std::min(range_.lo, static_cast<float>(scaled(*lo, static_cast<float>(scale)) * divide_));
      range_.hi = std::max(range_.hi, static_cast<float>(scaled(*hi, static_cast<float>(scale)) * divide_));
    }
  }

  void evaluate(const PointBlock& block, float* out) const override {
    std::array<float, PointBlock::capacity> u, v;
    const auto count = static_cast<std::size_t>(block.count);
    if (scale_.empty()) {
      sweep_.map(block, u.data(), v.data());
      for (std::size_t i = 0; i < count; ++i) out[i] = divide_ * at(u[i], v[i]);
      return;
    }
    std::array<float, PointBlock::capacity> along;
    sweep_.map(block, u.data(), v.data(), along.data());
    for (std::size_t i = 0; i < count; ++i) {
      const float scale = scale_at(along[i]), shrink = 1 / scale;
      out[i] = divide_ * scaled(at(shrink * u[i], shrink * v[i]), scale);
    }
  }

  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Vec3f c = to_float(box.center());
    float value = 0;
    evaluate({&c.x, &c.y, &c.z, 1}, &value);
    const auto reach = static_cast<float>(lipschitz_ * 0.5 * norm(box.size()));
    return {std::max(range_.lo, value - reach), std::min(range_.hi, value + reach)};
  }

  [[nodiscard]] double lipschitz() const override { return lipschitz_; }

 private:
  [[nodiscard]] float at(float u, float v) const {
    return spline(image_.distance_mm, (u - corner_x_) * per_pixel_, (v - corner_y_) * per_pixel_);
  }
  /// Lines between cells move apart by the scale, walls about them keep their thickness.
  [[nodiscard]] float scaled(float distance, float scale) const {
    return scale * distance + (scale - 1) * 0.5F * static_cast<float>(image_.wall_mm);
  }
  [[nodiscard]] float scale_at(float along) const {
    const float place = std::clamp(along * per_step_, 0.F, static_cast<float>(scale_.size() - 1));
    const int k = std::min(static_cast<int>(place), static_cast<int>(scale_.size()) - 2);
    const float* scale = scale_.data() + k;
    return scale[0] + (place - static_cast<float>(k)) * (scale[1] - scale[0]);
  }

  MembraneImage image_;
  Sweep sweep_;
  std::vector<float> scale_;  // empty: 1
  double lipschitz_ = 1;
  float per_step_ = 0, per_pixel_ = 1, corner_x_ = 0, corner_y_ = 0, divide_ = 1;
  Interval range_{far_mm, -far_mm};
};

}  // namespace

Shape sweep(MembraneImage image, const Axis& axis, Vec2d center_mm, const Taper& taper) {
  return Shape(std::make_shared<Membranes>(std::move(image), axis, center_mm, taper));
}

}  // namespace fibrolite
