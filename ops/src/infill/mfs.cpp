// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/mfs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "infill/sweep.h"
#include "plane_image.h"

namespace fibrolite {
namespace {

constexpr int section_side_px = 160;  // at most, for measuring a lumen

class Membranes final : public Shape::Function {
 public:
  Membranes(MembraneImage image, const Axis& axis, Vec2d center_mm) : image_(std::move(image)), sweep_(axis) {
    per_pixel_ = static_cast<float>(1 / image_.pixel_mm);
    corner_x_ = static_cast<float>(center_mm.x - 0.5 * (image_.distance_mm.width - 1) * image_.pixel_mm);
    corner_y_ = static_cast<float>(center_mm.y - 0.5 * (image_.distance_mm.height - 1) * image_.pixel_mm);
    const auto [lo, hi] = std::minmax_element(image_.distance_mm.pixels.begin(), image_.distance_mm.pixels.end());
    range_ = {*lo, *hi};
    const double reach = 0.5 * std::hypot(image_.width_mm(), image_.height_mm()) + norm(center_mm);
    sweep_lipschitz_ = 1.02 * std::hypot(1, reach * sweep_.twist_per_mm());
  }

  void evaluate(const PointBlock& block, float* out) const override {
    std::array<float, PointBlock::capacity> u, v;
    sweep_.map(block, u.data(), v.data());
    for (int i = 0; i < block.count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      out[i] = bilinear(image_.distance_mm, (u[k] - corner_x_) * per_pixel_, (v[k] - corner_y_) * per_pixel_);
    }
  }

  /// The samples and the sweep are 1-Lipschitz; what bilinear values add to that is below 1.5 pixels (each is a mean of
  /// samples at most 0.71 pixel away, at both ends).
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Vec3f c = to_float(box.center());
    float value = 0;
    evaluate({&c.x, &c.y, &c.z, 1}, &value);
    const auto reach = static_cast<float>(sweep_lipschitz_ * 0.5 * norm(box.size()) + 1.5 * image_.pixel_mm);
    return {std::max(range_.lo, value - reach), std::min(range_.hi, value + reach)};
  }

  /// Between the samples of a 1-Lipschitz image the bilinear slope is at most 1 along each axis, so sqrt(2).
  [[nodiscard]] double lipschitz() const override { return sweep_lipschitz_ * std::sqrt(2.0); }

 private:
  MembraneImage image_;
  Sweep sweep_;
  double sweep_lipschitz_ = 1.02;  // 1 along a smooth line; stations of 0.08 rad add less than this
  float per_pixel_ = 1, corner_x_ = 0, corner_y_ = 0;
  Interval range_{0, 0};
};

struct Extent {
  Vec2d min{1e30, 1e30}, max{-1e30, -1e30};
  [[nodiscard]] bool empty() const { return min.x > max.x; }
  void include(Vec2d p) {
    min = {std::min(min.x, p.x), std::min(min.y, p.y)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y)};
  }
  [[nodiscard]] Vec2d center() const { return 0.5 * (min + max); }
};

/// Where the part lies across its axis: samples of its box, as places in the section. Grown by what samples can miss.
Extent extent_across(const Part& part, const Shape& inside, const Sweep& sweep) {
  const Box3d& box = part.bounds_mm();
  const double step = std::max(box.longest_side() / 64, 1e-3);
  const auto count = [&](double side) { return static_cast<int>(std::ceil(side / step)) + 1; };
  const int nx = count(box.size().x), ny = count(box.size().y), nz = count(box.size().z);
  std::vector<Vec3d> points;
  points.reserve(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz));
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < nz; ++k) points.push_back(box.min + step * Vec3d{i + 0.0, j + 0.0, k + 0.0});
  std::vector<float> value;
  evaluate_parallel(inside, points, value);
  Extent extent;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (value[i] >= 0) continue;
    const Vec3f p = to_float(points[i]);
    float u = 0, v = 0;
    sweep.map({&p.x, &p.y, &p.z, 1}, &u, &v);
    extent.include({u, v});
  }
  if (extent.empty()) return extent;
  const Vec2d slack{1.5 * step, 1.5 * step};
  return {extent.min - slack, extent.max + slack};
}

/// The lumen (body without its shell) in one section of the part: values below 0 inside.
struct LumenSection {
  PlaneGrid grid;
  FloatImage value;
  double inscribed_mm = 0;
};

LumenSection lumen_section(const Shape& lumen, const Frame& frame, const Extent& extent, double pixel_mm) {
  const Vec2d size = extent.max - extent.min;
  LumenSection section;
  section.grid.frame = frame;
  section.grid.corner_mm = extent.min;
  section.grid.pixel_mm = std::max(pixel_mm / 8, std::max(size.x, size.y) / section_side_px);
  section.grid.width = static_cast<int>(std::ceil(size.x / section.grid.pixel_mm)) + 1;
  section.grid.height = static_cast<int>(std::ceil(size.y / section.grid.pixel_mm)) + 1;
  section.value = sample(lumen, section.grid);
  cv::Mat mask = cv::Mat::zeros(section.grid.height + 2, section.grid.width + 2, CV_8U), depth;
  for (int j = 0; j < section.grid.height; ++j)
    for (int i = 0; i < section.grid.width; ++i)
      mask.at<std::uint8_t>(j + 1, i + 1) = section.value(i, j) < 0 ? 255 : 0;
  cv::distanceTransform(mask, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  double deepest_px = 0;
  cv::minMaxLoc(depth, nullptr, &deepest_px);
  section.inscribed_mm = deepest_px * section.grid.pixel_mm;
  return section;
}

/// Membranes that end in a void: a circle about the end of one, wider than the membrane, meets material once and over
/// less than half its length; about a wall it meets material twice, about a junction three times or more.
int count_free_edges(const FloatImage& wall, const FloatImage& lumen, double wall_mm, double pixel_mm) {
  constexpr int probes = 48;
  constexpr double wider = 1.3, most = 0.4;
  Image<std::uint8_t> ends(wall.width, wall.height);
  for (int j = 0; j < wall.height; ++j)
    for (int i = 0; i < wall.width; ++i) {
      const auto depth = static_cast<double>(-wall(i, j));
      if (depth < 0.4 * wall_mm || static_cast<double>(lumen(i, j)) > -wider * depth) continue;
      const double radius_px = wider * depth / pixel_mm;
      int material = 0, starts = 0;
      bool before = true;
      for (int k = 0; k <= probes; ++k) {
        const double turn = 2 * std::numbers::pi * k / probes;
        const float v = bilinear(wall, static_cast<float>(i + radius_px * std::cos(turn)),
                                 static_cast<float>(j + radius_px * std::sin(turn)));
        const bool now = v < 0;
        if (k > 0) {
          material += now ? 1 : 0;
          starts += now && !before ? 1 : 0;
        }
        before = now;
      }
      ends(i, j) = starts == 1 && material < most * probes;
    }
  return regions_of(ends).count;
}

struct SectionCount {
  int fibres = 0, free_edges = 0;
};

/// Voids inside the lumen of a section, by connected regions of the membrane image itself.
SectionCount count_fibres(const LumenSection& section, const Shape& membranes, double wall_mm, double pixel_mm) {
  PlaneGrid fine = section.grid;
  const double zoom = fine.pixel_mm / pixel_mm;
  fine.pixel_mm = pixel_mm;
  fine.width = static_cast<int>((section.grid.width - 1) * zoom) + 1;
  fine.height = static_cast<int>((section.grid.height - 1) * zoom) + 1;
  const FloatImage wall = sample(membranes, fine);
  Image<std::uint8_t> voids(fine.width, fine.height);
  FloatImage lumen(fine.width, fine.height);
  for (int j = 0; j < fine.height; ++j)
    for (int i = 0; i < fine.width; ++i) {
      lumen(i, j) = bilinear(section.value, static_cast<float>(i / zoom), static_cast<float>(j / zoom));
      voids(i, j) = lumen(i, j) < 0 && wall(i, j) > 0;
    }
  const Regions found = regions_of(voids);
  const double least_px = wall_mm * wall_mm / 4 / (pixel_mm * pixel_mm);  // slits at the shell are no fibres
  const auto fibres = std::count_if(found.pixels.begin(), found.pixels.end(),
                                    [&](std::int64_t n) { return static_cast<double>(n) >= least_px; });
  return {static_cast<int>(fibres), count_free_edges(wall, lumen, wall_mm, pixel_mm)};
}

void check(const MfsParams& p) {
  if (!(p.wall_mm > 0) || !std::isfinite(p.wall_mm))
    throw Error(Code::BadRecipe, "the membrane must have a thickness above zero", "mfs.wall_mm", "try 0.8");
  if (!(p.fibre_mm > least_fibre_mm(p.wall_mm, p.walls)) || !std::isfinite(p.fibre_mm))
    throw Error(Code::BadRecipe, "a fibre must be wider than two membranes", "mfs.fibre_mm",
                "raise fibre_mm or lower wall_mm");
}

std::string mm(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f mm", value);
  return text.data();
}

}  // namespace

Shape sweep(MembraneImage image, const Axis& axis, Vec2d center_mm) {
  return Shape(std::make_shared<Membranes>(std::move(image), axis, center_mm));
}

Fill generate(const Part& part, const MfsParams& params, const Shape& body, double shell_mm) {
  check(params);
  const double pixel_mm = std::min(params.wall_mm / 4, 0.1);
  const Sweep across(part.axis());
  const Extent extent = extent_across(part, intersect({body, part.region()}), across);

  // The lumen in five sections of the middle of the part; the middle one is also where fibres are counted.
  const Shape lumen = intersect({offset(body, -shell_mm), part.region()});
  std::vector<LumenSection> sections;
  if (!extent.empty())
    for (const double share : {0.5, 0.3, 0.4, 0.6, 0.7})
      sections.push_back(lumen_section(lumen, across.frame_at(share), extent, pixel_mm));
  double lumen_mm = 0;
  for (const LumenSection& s : sections) lumen_mm = std::max(lumen_mm, 2 * s.inscribed_mm);
  if (lumen_mm < 2 * params.fibre_mm) {
    return {.shape = everything(),
            .warnings = {"part " + std::to_string(part.id()) + ": its lumen is " + mm(lumen_mm) +
                         " wide, narrower than two fibres (" + mm(2 * params.fibre_mm) + "): filled solid"}};
  }

  const FibreMap map = find_fibres(read_gray(params.micrograph ? *params.micrograph : bundled_micrograph()));
  MembraneParams wanted;
  wanted.fibre_mm = params.fibre_mm;
  wanted.wall_mm = params.wall_mm;
  wanted.walls = params.walls;
  // What reaches into the neighbour or out to the surface must still find membranes, not the clamped rim of the image.
  wanted.width_mm = extent.max.x - extent.min.x + 2 * params.fibre_mm;
  wanted.height_mm = extent.max.y - extent.min.y + 2 * params.fibre_mm;
  wanted.pixel_mm = pixel_mm;
  wanted.seed = mix(params.seed + static_cast<std::uint64_t>(part.id()));
  Fill fill;
  fill.shape = sweep(synthesize(map, wanted), part.axis(), extent.center());
  const SectionCount count = count_fibres(sections.front(), fill.shape, params.wall_mm, pixel_mm);
  fill.fibres = count.fibres;
  fill.free_edges = count.free_edges;
  return fill;
}

}  // namespace fibrolite
