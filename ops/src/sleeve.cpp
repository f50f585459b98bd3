// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/sleeve.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>
#include <utility>

#include "fibrolite/disjoint_sets.h"
#include "fibrolite/error.h"
#include "plane_image.h"

namespace fibrolite {
namespace {

constexpr double most_px = 4096;  // along either side of an unrolled mantle

/// Half a wall to either side of a cylinder about the z axis, from 0 to a height.
struct Tube final : Shape::Function {
  Tube(double radius_mm, double height_mm, double wall_mm)
      : radius(static_cast<float>(radius_mm)),
        middle(static_cast<float>(0.5 * height_mm)),
        half_wall(static_cast<float>(0.5 * wall_mm)) {}
  void evaluate(const PointBlock& block, float* out) const override {
    for (int i = 0; i < block.count; ++i) {
      const float beside = std::abs(std::hypot(block.x[i], block.y[i]) - radius) - half_wall;
      const float beyond = std::abs(block.z[i] - middle) - middle;
      out[i] = beside > 0 && beyond > 0 ? std::hypot(beside, beyond) : std::max(beside, beyond);
    }
  }
  float radius, middle, half_wall;
};

/// A cylinder about the z axis of a frame, unrolled: pixel (i, j) is so far around and along.
struct Unrolled {
  Unrolled(const Interface& mantle, double pixel_mm) : frame(mantle.frame), radius(mantle.radius_mm) {
    const double around = 2 * std::numbers::pi * radius;
    const double pixel = std::max({pixel_mm, around / most_px, mantle.length_mm / most_px});
    width = std::max(8, static_cast<int>(std::lround(around / pixel)));
    height = std::max(2, static_cast<int>(std::lround(mantle.length_mm / pixel)));
    pixel_x = around / width;
    pixel_y = mantle.length_mm / height;
  }
  [[nodiscard]] Vec3d normal(int i) const {
    const double turn = 2 * std::numbers::pi * (i + 0.5) / width;
    return std::cos(turn) * frame.x + std::sin(turn) * frame.y;
  }
  /// So far outside of the mantle.
  [[nodiscard]] Vec3d place(int i, int j, double outside_mm) const {
    return frame.origin + ((j + 0.5) * pixel_y) * frame.z + (radius + outside_mm) * normal(i);
  }
  [[nodiscard]] FloatImage sample(const Shape& shape, double outside_mm = 0) const {
    std::vector<Vec3d> points;
    points.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i) points.push_back(place(i, j, outside_mm));
    FloatImage image(width, height);
    evaluate_parallel(shape, points, image.pixels);
    return image;
  }
  [[nodiscard]] double pixel_mm2() const { return pixel_x * pixel_y; }

  Frame frame;
  double radius, pixel_x = 0, pixel_y = 0;
  int width = 0, height = 0;
};

/// Connected regions of an image whose first column is next to its last.
int regions_around(const Image<std::uint8_t>& mask) {
  const Regions found = regions_of(mask);
  DisjointSets sets(static_cast<std::size_t>(found.count) + 1);
  for (int j = 0; j < mask.height; ++j) {
    const int first = found.label(0, j), last = found.label(mask.width - 1, j);
    if (first > 0 && last > 0) sets.join(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last));
  }
  std::set<std::uint32_t> roots;
  for (int r = 1; r <= found.count; ++r) roots.insert(sets.root(static_cast<std::uint32_t>(r)));
  return static_cast<int>(roots.size());
}

double area_of(const Image<std::uint8_t>& mask, double pixel_mm2) {
  return pixel_mm2 * static_cast<double>(std::count(mask.pixels.begin(), mask.pixels.end(), 1));
}

}  // namespace

Interface mantle_of(const Core& core, const Labels& labels, const Shape& body, double pixel_mm) {
  Interface mantle;
  mantle.a = core.id;
  mantle.b = core.host;
  mantle.frame = core.frame;
  mantle.radius_mm = core.radius_mm;
  mantle.length_mm = core.length_mm;
  const Unrolled around(mantle, pixel_mm);
  const FloatImage depth = around.sample(body);
  int first = around.height, last = -1;
  double pixels = 0;
  for (int j = 0; j < around.height; ++j)
    for (int i = 0; i < around.width; ++i) {
      if (depth(i, j) >= 0 || labels.label(around.place(i, j, -pixel_mm)) != core.id) continue;
      first = std::min(first, j);
      last = std::max(last, j);
      if (labels.label(around.place(i, j, pixel_mm)) == core.host) ++pixels;
    }
  mantle.area_mm2 = pixels * around.pixel_mm2();
  if (last >= first) {
    mantle.frame.origin = core.frame.to_world({0, 0, first * around.pixel_y});
    mantle.length_mm = (last + 1 - first) * around.pixel_y;
  }
  return mantle;
}

Joint sleeve(const Interface& mantle, const Shape& fill_a, const Shape& fill_b, const Shape& within, const Shape& body,
             double shell_mm, double wall_mm, double pixel_mm) {
  if (!(wall_mm > 0)) throw Error(Code::BadRecipe, "must be above zero", "mfs.wall_mm");
  const Unrolled around(mantle, pixel_mm);
  const FloatImage depth = around.sample(body), parts = around.sample(within);
  const FloatImage a = around.sample(fill_a), b = around.sample(fill_b);
  const FloatImage outside = around.sample(fill_b, 0.5 * wall_mm), depth_outside = around.sample(body, 0.5 * wall_mm);
  Joint joint;
  Layer& layer = joint.layer;
  layer.pixel_mm = std::sqrt(around.pixel_mm2());
  layer.solid = Image<std::uint8_t>(around.width, around.height);
  layer.distance_mm = FloatImage(around.width, around.height);
  Image<std::uint8_t> before(around.width, around.height), touching(around.width, around.height);
  Image<std::uint8_t> ring(around.width, around.height);
  const auto shell = static_cast<float>(shell_mm);
  for (std::size_t i = 0; i < layer.solid.pixels.size(); ++i) {
    const bool inside = depth.pixels[i] <= 0 && parts.pixels[i] < 0;
    layer.solid.pixels[i] = inside ? 1 : 0;
    layer.distance_mm.pixels[i] = std::max(depth.pixels[i], parts.pixels[i]);
    before.pixels[i] = inside && std::min({a.pixels[i], b.pixels[i], -(depth.pixels[i] + shell)}) < 0 ? 1 : 0;
    ring.pixels[i] = inside && depth.pixels[i] >= -shell ? 1 : 0;
    touching.pixels[i] = inside && depth_outside.pixels[i] < -shell && outside.pixels[i] < 0 ? 1 : 0;
  }
  layer.regions_before = regions_around(before);
  layer.regions_after = regions_around(layer.solid);
  layer.union_area_mm2 = area_of(before, around.pixel_mm2());
  layer.shell_area_mm2 = area_of(ring, around.pixel_mm2());
  layer.bridge_area_mm2 = std::max(0.0, area_of(layer.solid, around.pixel_mm2()) - layer.union_area_mm2);
  joint.contact_area_mm2 = area_of(touching, around.pixel_mm2());
  const Shape tube =
      placed(Shape(std::make_shared<const Tube>(mantle.radius_mm, mantle.length_mm, wall_mm)), mantle.frame);
  joint.shape = intersect({tube, offset(within, 0.5 * wall_mm)});
  if (!(joint.contact_area_mm2 > 0))
    joint.warnings.push_back("joint around part " + std::to_string(mantle.a) + ": no crystal meets it");
  return joint;
}

double mantle_demand_n(const Interface& mantle, const Labels& labels, const Shape& body,
                       const std::function<double(Vec3d, Vec3d)>& traction_mpa) {
  const double pixel = std::sqrt(2 * std::numbers::pi * mantle.radius_mm * mantle.length_mm / 1000);
  const Unrolled around(mantle, pixel);
  const FloatImage depth = around.sample(body);
  double sum = 0;
  for (int j = 0; j < around.height; ++j)
    for (int i = 0; i < around.width; ++i)
      if (depth(i, j) < 0 && labels.label(around.place(i, j, 0.1 * pixel)) == mantle.b)
        sum += traction_mpa(around.place(i, j, 0), around.normal(i));
  return sum * around.pixel_mm2();
}

}  // namespace fibrolite
