// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/interfaces.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/sleeve.h"
#include "plane_image.h"

namespace fibrolite {
namespace {

constexpr double disc_margin =
    1.3;  // a cut's disc covers the section on the coarse proxy; the true one may be a little wider
constexpr int max_half_side_px = 1500;
constexpr int least_px = 16;  // smaller sections are slits between sampling and the surface
constexpr double least_share =
    0.03;  // of the cut's largest section: slivers where the plane leaves the border of the parts

constexpr double least_shared = 0.01;  // of the body's whole section

bool column_first(const Parts& parts, const Cut& cut) {
  const auto kind = [&](int id) { return parts.parts[static_cast<std::size_t>(id)].kind(); };
  if (kind(cut.a) != kind(cut.b)) return kind(cut.a) == Kind::Column;
  return cut.a < cut.b;
}

/// The same plane seen from the other side.
Cut turned(const Cut& cut) {
  Cut other = cut;
  std::swap(other.a, other.b);
  other.frame.y = -cut.frame.y;
  other.frame.z = -cut.frame.z;
  other.bend = cut.bend.turned();
  return other;
}

}  // namespace

bool Interface::parts_here(const Labels& labels, Vec2d local, double step_mm) const {
  const BentPlane here = surface();
  return labels.label(here.at(local, -step_mm)) == a && labels.label(here.at(local, step_mm)) == b;
}

std::vector<Interface> sections_of(const Cut& cut, const Labels& labels, const Shape& body, double pixel_mm) {
  const double radius = disc_margin * cut.radius_mm;
  const double pixel = std::max(pixel_mm, radius / max_half_side_px);
  const PlaneGrid grid = PlaneGrid::about(cut.surface(), radius, pixel, 1);
  const FloatImage depth = sample(body, grid);
  const Interface whole{.a = cut.a, .b = cut.b, .frame = cut.frame, .bend = cut.bend};
  Image<std::uint8_t> mask(grid.width, grid.height);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      if (depth(i, j) >= 0 || norm(grid.local(i, j)) > radius) continue;
      // The disc may also cross other limbs, or run inside one part: only where it parts a from b it is an interface.
      mask(i, j) = whole.parts_here(labels, grid.local(i, j), pixel);
    }
  const Regions found = regions_of(mask);
  const auto count = static_cast<std::size_t>(found.count);
  std::vector<Vec2d> center(count);
  std::vector<double> reach(count, 0), area(count, 0);
  const auto each = [&](auto&& visit) {
    for (int j = 0; j < grid.height; ++j)
      for (int i = 0; i < grid.width; ++i)
        if (found.label(i, j) > 0) visit(static_cast<std::size_t>(found.label(i, j) - 1), grid.local(i, j));
  };
  each([&](std::size_t r, Vec2d p) { center[r] = center[r] + (1.0 / static_cast<double>(found.pixels[r])) * p; });
  each([&](std::size_t r, Vec2d p) {
    reach[r] = std::max(reach[r], norm(p - center[r]));
    area[r] += cut.bend.stretch(p);
  });
  const std::int64_t largest = count == 0 ? 0 : *std::max_element(found.pixels.begin(), found.pixels.end());
  // Where other pairs meet in the same section too, there may be nothing but a sliver of this one.
  const auto of_body = std::count_if(depth.pixels.begin(), depth.pixels.end(), [](float d) { return d < 0; });
  const double least = std::max({static_cast<double>(least_px), least_share * static_cast<double>(largest),
                                 cut.shared ? least_shared * static_cast<double>(of_body) : 0.0});
  std::vector<Interface> result;
  for (std::size_t r = 0; r < count; ++r) {
    if (static_cast<double>(found.pixels[r]) < least) continue;
    Interface section;
    section.a = cut.a;
    section.b = cut.b;
    section.frame = cut.frame;
    section.frame.origin = cut.surface().at(center[r]);
    section.bend = cut.bend.about(center[r]);
    section.radius_mm = reach[r] + pixel;
    section.area_mm2 = area[r] * pixel * pixel;
    if (cut.shared) section.within = labels;
    result.push_back(section);
  }
  return result;
}

double demand_n(const Interface& section, const Labels& labels, const Shape& body,
                const std::function<double(Vec3d, Vec3d)>& traction_mpa) {
  if (section.length_mm > 0) return mantle_demand_n(section, labels, body, traction_mpa);
  constexpr int across = 36;  // a disc of this many pixels has about a thousand
  const double pixel = 2 * section.radius_mm / across;
  const PlaneGrid grid = PlaneGrid::about(section.surface(), section.radius_mm, pixel, 1);
  const FloatImage depth = sample(body, grid);
  double sum = 0, weights = 0;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      if (depth(i, j) >= 0 || norm(grid.local(i, j)) > section.radius_mm) continue;
      if (!section.parts_here(labels, grid.local(i, j), pixel)) continue;
      const Vec2d at = grid.local(i, j);
      const double weight = section.bend.stretch(at);
      sum += weight * traction_mpa(grid.world(i, j, 0), section.surface().normal(at));
      weights += weight;
    }
  return weights > 0 ? sum / weights * section.area_mm2 : 0;
}

std::vector<Interface> interfaces(const Parts& parts, const Shape& body, double pixel_mm, const Context& context) {
  if (!(pixel_mm > 0)) throw Error(Code::BadRecipe, "the pixel must be above zero", "interfaces", "use 0.1 mm");
  std::vector<Interface> all;
  for (std::size_t i = 0; i < parts.cuts.size(); ++i) {
    context.check();
    context.progress(static_cast<double>(i) / static_cast<double>(parts.cuts.size()));
    const Cut& cut = parts.cuts[i];
    if (cut.a == cut.b) continue;
    for (Interface& section : sections_of(column_first(parts, cut) ? cut : turned(cut), parts.labels, body, pixel_mm))
      all.push_back(section);
  }
  for (const Core& core : parts.cores) all.push_back(mantle_of(core, parts.labels, body, pixel_mm));
  std::sort(all.begin(), all.end(), [](const Interface& p, const Interface& q) {
    const auto key = [](const Interface& s) {
      return std::tuple(s.a, s.b, s.frame.origin.x, s.frame.origin.y, s.frame.origin.z);
    };
    return key(p) < key(q);
  });
  context.progress(1);
  return all;
}

}  // namespace fibrolite
