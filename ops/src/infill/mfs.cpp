// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/mfs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "infill/census.h"
#include "infill/straighten.h"
#include "infill/sweep.h"
#include "infill/taper.h"
#include "plane_image.h"

namespace fibrolite {
namespace {

constexpr int section_side_px = 160;  // at most, for measuring a lumen
constexpr int limb_side_px = 64;      // for measuring a limb along its line, at
constexpr int taper_sections = 49;    // of these
constexpr double most_taper = 1.25;   // fibres get this much wider or narrower than in the limb's middle, or less

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

/// The middle section at the resolution of the membranes: their distance, and how far inside the lumen.
struct FineSection {
  FloatImage membranes, lumen;
};

FineSection fine_section(const LumenSection& section, const Shape& membranes, double pixel_mm) {
  PlaneGrid fine = section.grid;
  const double zoom = fine.pixel_mm / pixel_mm;
  fine.pixel_mm = pixel_mm;
  fine.width = static_cast<int>((section.grid.width - 1) * zoom) + 1;
  fine.height = static_cast<int>((section.grid.height - 1) * zoom) + 1;
  FineSection result{sample(membranes, fine), FloatImage(fine.width, fine.height)};
  for (int j = 0; j < fine.height; ++j)
    for (int i = 0; i < fine.width; ++i)
      result.lumen(i, j) = bilinear(section.value, static_cast<float>(i / zoom), static_cast<float>(j / zoom));
  return result;
}

/// The limb in the normal plane at a share of the line's length.
LimbSection limb_section(const Shape& body, const Shape& region, const Frame& frame, const Extent& extent) {
  const Vec2d size = extent.max - extent.min;
  PlaneGrid grid{frame, extent.min, std::max(size.x, size.y) / (limb_side_px - 1)};
  grid.width = static_cast<int>(std::ceil(size.x / grid.pixel_mm)) + 1;
  grid.height = static_cast<int>(std::ceil(size.y / grid.pixel_mm)) + 1;
  const FloatImage of_body = sample(body, grid), of_part = sample(region, grid);
  Image<std::uint8_t> mask(grid.width, grid.height);
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) mask.pixels[i] = of_body.pixels[i] < 0;
  // The piece nearest to the centre line: the same plane may meet the body again elsewhere.
  const Regions pieces = regions_of(mask);
  int piece = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      if (const double off = norm(grid.local(i, j)); pieces.label(i, j) > 0 && off < nearest) {
        nearest = off;
        piece = pieces.label(i, j);
      }
  LimbSection result;
  if (piece == 0) return result;
  std::int64_t pixels = 0;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      if (pieces.label(i, j) != piece) continue;
      if (of_part(i, j) >= 0) return {};
      ++pixels;
      result.reach_mm = std::max(result.reach_mm, norm(grid.local(i, j)));
    }
  result.size_mm = grid.pixel_mm * std::sqrt(static_cast<double>(pixels) / std::numbers::pi);
  return result;
}

/// Fibres converge with the limb as far as they stay wide enough.
Taper limb_taper(const Part& part, const MfsParams& params, const Shape& body, const Sweep& across,
                 const Extent& extent) {
  TaperLimits limits;
  limits.least = std::min(
      1.0,
      std::max(1 / most_taper, 1.2 * least_fibre_mm(params.wall_mm, params.gap_mm, params.walls) / params.fibre_mm));
  limits.most = most_taper;
  std::vector<LimbSection> sections;
  for (int k = 0; k < taper_sections; ++k)
    sections.push_back(limb_section(body, part.region(), across.frame_at(k / (taper_sections - 1.0)), extent));
  return taper_along(across, sections, limits);
}

void check(const MfsParams& p) {
  if (!(p.wall_mm > 0) || !std::isfinite(p.wall_mm))
    throw Error(Code::BadRecipe, "the membrane must have a thickness above zero", "mfs.wall_mm", "try 0.8");
  if (!(p.gap_mm > 0) || !std::isfinite(p.gap_mm))
    throw Error(Code::BadRecipe, "the narrowest void must have a width above zero", "mfs.gap_mm", "try 0.4");
  if (!(p.fibre_mm > least_fibre_mm(p.wall_mm, p.gap_mm, p.walls)) || !std::isfinite(p.fibre_mm))
    throw Error(Code::BadRecipe, "a fibre must be wider than two membranes, and than a membrane and a gap",
                "mfs.fibre_mm", "raise fibre_mm, or lower wall_mm or gap_mm");
}

std::string mm(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f mm", value);
  return text.data();
}

}  // namespace

Fill generate(const Part& part, const MfsParams& params, const Shape& body, double shell_mm) {
  check(params);
  const double pixel_mm = std::min({params.wall_mm / 4, params.gap_mm / 4, 0.1});
  const Shape limb = intersect({body, part.region()});
  const Axis axis = straightened(part.axis(), limb);
  const Sweep across(axis);
  const Extent extent = extent_across(part, limb, across);

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
  const Taper taper = params.taper ? limb_taper(part, params, body, across, extent) : Taper{};
  MembraneParams wanted;
  wanted.fibre_mm = params.fibre_mm;
  wanted.wall_mm = params.wall_mm;
  wanted.gap_mm = params.gap_mm;
  wanted.least_scale = std::min(1.0, taper.least());
  wanted.walls = params.walls;
  // What reaches into the neighbour or out to the surface must still find membranes, not the clamped rim of the image;
  // also where the section is drawn smallest.
  const Vec2d middle = extent.center();
  const auto side = [&](double low, double high) {
    const double shrunk = std::max(std::abs(low), std::abs(high)) * (1 / wanted.least_scale - 1);
    return high - low + 2 * (shrunk + params.fibre_mm);
  };
  wanted.width_mm = side(extent.min.x, extent.max.x);
  wanted.height_mm = side(extent.min.y, extent.max.y);
  wanted.pixel_mm = pixel_mm;
  wanted.seed = mix(params.seed + static_cast<std::uint64_t>(part.id()));
  Fill fill;
  fill.shape = sweep(synthesize(map, wanted), axis, middle, taper);
  const FineSection section = fine_section(sections.front(), fill.shape, pixel_mm);
  const double least_area = 0.25 * params.wall_mm * params.wall_mm;  // slits at the shell are no fibres
  fill.section = census(section.membranes, pixel_mm, least_area, &section.lumen);
  fill.micrograph = map.census;
  fill.fibres = fill.section.fibres;
  fill.free_edges = count_free_edges(section.membranes, section.lumen, params.wall_mm, pixel_mm);
  return fill;
}

}  // namespace fibrolite
