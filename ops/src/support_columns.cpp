// SPDX-License-Identifier: GPL-3.0-or-later
#include "support_columns.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "plane_image.h"

namespace fibrolite {
namespace {

/// Sphere tracing of many rays at once. Every ray starts at its own height and climbs along the normal at its foot.
struct Ray {
  Vec2d foot;
  double z_mm;
};

/// For each ray the height at which `shape` first falls to `level` or below, or nothing within `end_mm`. `step_mm` is
/// the least step: what is thinner along the ray may be missed.
std::vector<std::optional<double>> climb(const Shape& shape, const BentPlane& surface, std::vector<Ray> rays,
                                         double level, double end_mm, double step_mm, const Context& context) {
  std::vector<std::optional<double>> hit(rays.size());
  std::vector<std::size_t> active(rays.size());
  for (std::size_t i = 0; i < active.size(); ++i) active[i] = i;
  std::vector<Vec3d> points;
  std::vector<float> value;
  const double lipschitz = std::max(1.0, shape.lipschitz());
  while (!active.empty()) {
    context.check();
    points.clear();
    for (const std::size_t i : active) points.push_back(surface.at(rays[i].foot, rays[i].z_mm));
    evaluate_parallel(shape, points, value);
    std::vector<std::size_t> still;
    for (std::size_t k = 0; k < active.size(); ++k) {
      Ray& ray = rays[active[k]];
      if (value[k] <= level) {
        hit[active[k]] = ray.z_mm;
        continue;
      }
      ray.z_mm += std::max(step_mm, (value[k] - level) / lipschitz);
      if (ray.z_mm <= end_mm) still.push_back(active[k]);
    }
    active.swap(still);
  }
  return hit;
}

/// Where a column may stand: every `stride`-th pixel of the layer's material, not at its very edge.
struct FootGrid {
  int stride, width, height;
  std::vector<Vec2d> foot;         // of the solid ones
  std::vector<std::size_t> place;  // their index in the coarse raster
};

FootGrid feet_of(const Layer& layer, double spacing_mm, double depth_mm) {
  FootGrid feet{};
  feet.stride = std::max(1, static_cast<int>(spacing_mm / layer.pixel_mm));
  feet.width = (layer.solid.width + feet.stride - 1) / feet.stride;
  feet.height = (layer.solid.height + feet.stride - 1) / feet.stride;
  for (int j = 0; j < feet.height; ++j)
    for (int i = 0; i < feet.width; ++i) {
      const int x = i * feet.stride, y = j * feet.stride;
      if (layer.solid(x, y) == 0 || layer.distance_mm(x, y) > -depth_mm) continue;
      feet.foot.push_back(layer.origin_mm + layer.pixel_mm * Vec2d{x + 0.0, y + 0.0});
      feet.place.push_back(static_cast<std::size_t>(j) * static_cast<std::size_t>(feet.width) +
                           static_cast<std::size_t>(i));
    }
  return feet;
}

/// Feet under crystal: the projection (paper Fig. 6a-c), clusters smaller than half a column's section left out.
std::vector<Vec2d> under_crystal(const FootGrid& feet, const std::vector<char>& below, double pixel_mm,
                                 double column_mm) {
  Image<std::uint8_t> mask(feet.width, feet.height);
  for (std::size_t k = 0; k < feet.foot.size(); ++k) mask.pixels[feet.place[k]] = below[k] != 0;
  const Regions clusters = regions_of(mask);
  const double foot_area = feet.stride * pixel_mm * feet.stride * pixel_mm;
  const double least = std::numbers::pi / 8 * column_mm * column_mm;
  std::vector<Vec2d> kept;
  for (std::size_t k = 0; k < feet.foot.size(); ++k) {
    const int cluster = clusters.label.pixels[feet.place[k]];
    if (cluster > 0 && static_cast<double>(clusters.pixels[static_cast<std::size_t>(cluster - 1)]) * foot_area >= least)
      kept.push_back(feet.foot[k]);
  }
  return kept;
}

PlaneGrid raster_of(const Layer& layer, const BentPlane& surface) {
  return {surface.frame, layer.origin_mm, layer.pixel_mm, layer.solid.width, layer.solid.height, surface.bend};
}

bool apart(Vec2d p, const std::vector<Vec2d>& others, double distance) {
  return std::none_of(others.begin(), others.end(), [&](Vec2d q) { return norm(p - q) < distance; });
}

}  // namespace

Face face_of(const Layer& layer, const BentPlane& surface, const Shape& fill, const Shape& lumen, double layer_mm) {
  const PlaneGrid grid = raster_of(layer, surface);
  return {sample(fill, grid, layer_mm / 2), sample(lumen, grid, layer_mm / 2)};
}

double contact_area_mm2(const Layer& layer, const BentPlane& surface, const Face& face) {
  const PlaneGrid grid = raster_of(layer, surface);
  double pixels = 0;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      pixels += coverage(layer.distance_mm(i, j), layer.pixel_mm) * coverage(face.fill_mm(i, j), layer.pixel_mm) *
                coverage(face.lumen_mm(i, j), layer.pixel_mm) * surface.bend.stretch(grid.local(i, j));
  return pixels * layer.pixel_mm * layer.pixel_mm;
}

SupportColumns support_columns(const Layer& layer, const BentPlane& surface, const Shape& crystal, const Face& at_layer,
                               double stick_mm, const Shape& lumen, const JointParams& params, Random random,
                               const Context& context) {
  const double face = params.layer_mm / 2, step = stick_mm / 8;
  const FootGrid feet = feet_of(layer, stick_mm / 4, std::min(params.column_mm, params.min_wall_mm) / 4);
  const auto rays_from = [&](const std::vector<Vec2d>& from) {
    std::vector<Ray> rays;
    for (const Vec2d foot : from) rays.push_back({foot, face});
    return rays;
  };
  std::vector<float> depth;
  std::vector<Vec3d> at_face;
  for (const Vec2d foot : feet.foot) at_face.push_back(surface.at(foot, face));
  evaluate_parallel(lumen, at_face, depth);
  const auto one_cell = climb(crystal, surface, rays_from(feet.foot), 0, face + params.reach_mm / 2, step, context);
  SupportColumns result;
  std::vector<char> below(feet.foot.size());
  for (std::size_t k = 0; k < feet.foot.size(); ++k) {
    below[k] = depth[k] < 0 && one_cell[k].has_value() && *one_cell[k] > face;
  }
  // Where the crystal stands on the layer by itself.
  const PlaneGrid grid = raster_of(layer, surface);
  std::vector<Vec2d> touching;
  for (int y = 0; y < grid.height; y += feet.stride)
    for (int x = 0; x < grid.width; x += feet.stride)
      if (layer.solid(x, y) != 0 && at_layer.fill_mm(x, y) < 0) touching.push_back(grid.local(x, y));

  std::vector<Vec2d> darts = under_crystal(feet, below, layer.pixel_mm, params.column_mm);
  for (std::size_t i = darts.size(); i > 1; --i) std::swap(darts[i - 1], darts[random.below(i)]);
  // Half a stick's radius deep: a whole radius is its axis alone, which a ray meets only by chance.
  const auto top = climb(crystal, surface, rays_from(darts), -stick_mm / 4, face + params.reach_mm, step, context);
  // Inside the shell a column would add nothing; climbing the complement finds where one would leave the lumen.
  const auto exit = climb(complement(lumen), surface, rays_from(darts), 0, face + params.reach_mm, step, context);
  std::vector<Vec2d> standing, failed;
  for (std::size_t k = 0; k < darts.size(); ++k) {
    // A column beside a stick that reaches the layer, or beside a place just tried in vain, would bring nothing.
    if (!apart(darts[k], standing, params.spacing_mm) || !apart(darts[k], touching, params.column_mm) ||
        !apart(darts[k], failed, params.spacing_mm / 2))
      continue;
    if (!top[k].has_value() || (exit[k].has_value() && *exit[k] < *top[k])) {
      ++result.dropped;
      failed.push_back(darts[k]);
      continue;
    }
    standing.push_back(darts[k]);
    result.columns.push_back({surface.at(darts[k]), surface.at(darts[k], *top[k]), params.column_mm / 2});
  }
  return result;
}

}  // namespace fibrolite
