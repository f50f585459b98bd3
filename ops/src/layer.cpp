// SPDX-License-Identifier: GPL-3.0-or-later
// The transient layer of a joint (paper Sec. 6.1).

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "bridges.h"
#include "fibrolite/ops/joint.h"
#include "plane_image.h"

namespace fibrolite {
namespace {

constexpr int rim_px = 3;             // how far the layer reaches beyond the body, so that clipping closes it
constexpr std::int64_t least_px = 3;  // smaller regions are grazes of a stick, not material

/// The body's section that the interface stands for: the region of the disc whose centroid is nearest the frame's
/// origin.
Image<std::uint8_t> own_section(const Interface& interface, const PlaneGrid& grid, const FloatImage& depth,
                                double radius_mm) {
  Image<std::uint8_t> inside(grid.width, grid.height);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const Vec2d at = grid.local(i, j);
      inside(i, j) = depth(i, j) <= 0 && norm(at) <= radius_mm &&
                     (!interface.within || interface.parts_here(*interface.within, at, grid.pixel_mm));
    }
  const Regions found = regions_of(inside);
  std::vector<Vec2d> center(static_cast<std::size_t>(found.count));
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      if (const int r = found.label(i, j); r > 0) {
        const auto k = static_cast<std::size_t>(r - 1);
        center[k] = center[k] + (1.0 / static_cast<double>(found.pixels[k])) * grid.local(i, j);
      }
  const auto nearest =
      std::min_element(center.begin(), center.end(), [](Vec2d a, Vec2d b) { return dot(a, a) < dot(b, b); });
  const int own = nearest == center.end() ? 0 : static_cast<int>(nearest - center.begin()) + 1;
  for (std::size_t i = 0; i < inside.pixels.size(); ++i) inside.pixels[i] = own > 0 && found.label.pixels[i] == own;
  return inside;
}

/// Signed distance (mm) to the mask grown by rim_px; negative inside.
FloatImage rim_distance(const Image<std::uint8_t>& mask, double pixel_mm) {
  cv::Mat inside(mask.height, mask.width, CV_8U), outside, within, without;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) inside.at<std::uint8_t>(y, x) = mask(x, y) != 0 ? 255 : 0;
  cv::bitwise_not(inside, outside);
  cv::distanceTransform(inside, within, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(outside, without, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  FloatImage distance(mask.width, mask.height);
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      distance(x, y) = static_cast<float>((without.at<float>(y, x) - within.at<float>(y, x) - rim_px) * pixel_mm);
  return distance;
}

/// Take regions of a few pixels out of the layer, from its distance too.
void drop_grazes(Layer& layer) {
  const Regions found = regions_of(layer.solid);
  for (std::size_t i = 0; i < layer.solid.pixels.size(); ++i) {
    const int r = found.label.pixels[i];
    if (r == 0 || found.pixels[static_cast<std::size_t>(r - 1)] >= least_px) continue;
    layer.solid.pixels[i] = 0;
    layer.distance_mm.pixels[i] = static_cast<float>(0.25 * layer.pixel_mm);
  }
}

/// Area inside the body of what is negative, mm2. Pixels on an edge count in part, so that the raster's place does not
/// matter.
double area_mm2(const FloatImage& distance_mm, const FloatImage& depth, const FloatImage& rim, const PlaneGrid& grid) {
  const double pixel_mm = grid.pixel_mm;
  double pixels = 0;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      if (rim(i, j) < -(rim_px - 1.5) * pixel_mm)  // the section and the pixels around it
        pixels += coverage(distance_mm(i, j), pixel_mm) * coverage(depth(i, j), pixel_mm) *
                  grid.bend.stretch(grid.local(i, j));
  return pixels * pixel_mm * pixel_mm;
}

}  // namespace

int regions(const Layer& layer) { return regions_of(layer.solid).count; }

Layer transient_layer(const Interface& interface, const Shape& fill_a, const Shape& fill_b, const Shape& body,
                      double shell_mm, double pixel_mm, const JointParams& params) {
  const PlaneGrid grid = PlaneGrid::about(interface.surface(), interface.radius_mm, pixel_mm, rim_px + 3);
  const FloatImage depth = sample(body, grid), a = sample(fill_a, grid), b = sample(fill_b, grid);
  const Image<std::uint8_t> section = own_section(interface, grid, depth, interface.radius_mm + pixel_mm);
  const FloatImage rim = rim_distance(section, pixel_mm);

  Layer layer;
  layer.origin_mm = grid.corner_mm;
  layer.pixel_mm = pixel_mm;
  layer.solid = Image<std::uint8_t>(grid.width, grid.height);
  layer.distance_mm = FloatImage(grid.width, grid.height);
  FloatImage ring(grid.width, grid.height);
  for (std::size_t i = 0; i < section.pixels.size(); ++i) {
    // Outside the body the shell's ring goes on to the rim; assemble() clips it.
    ring.pixels[i] = -(depth.pixels[i] + static_cast<float>(shell_mm));
    const float joined = std::min({a.pixels[i], b.pixels[i], ring.pixels[i]});
    layer.distance_mm.pixels[i] = joined;
    layer.solid.pixels[i] = section.pixels[i] != 0 && joined < 0;
  }
  layer.shell_area_mm2 = area_mm2(ring, depth, rim, grid);
  drop_grazes(layer);
  layer.regions_before = regions(layer);
  layer.union_area_mm2 = area_mm2(layer.distance_mm, depth, rim, grid);
  if (layer.regions_before > 1) {
    Layer other = layer;
    join_regions(other, section, params.bridge == Bridge::Mst ? Bridge::Bbox : Bridge::Mst, params.min_wall_mm);
    layer.other_bridge_area_mm2 = std::max(0.0, area_mm2(other.distance_mm, depth, rim, grid) - layer.union_area_mm2);
  }
  join_regions(layer, section, params.bridge, params.min_wall_mm);
  layer.bridge_area_mm2 = std::max(0.0, area_mm2(layer.distance_mm, depth, rim, grid) - layer.union_area_mm2);
  layer.regions_after = regions(layer);
  // Bridges were drawn only that far around themselves: beyond, nothing larger may be claimed.
  const auto cap = static_cast<float>(Layer::cap_px * pixel_mm);
  for (std::size_t i = 0; i < rim.pixels.size(); ++i)
    layer.distance_mm.pixels[i] = std::max(std::min(layer.distance_mm.pixels[i], cap), rim.pixels[i]);
  return layer;
}

}  // namespace fibrolite
