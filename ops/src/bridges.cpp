// SPDX-License-Identifier: GPL-3.0-or-later
#include "bridges.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "plane_image.h"

namespace fibrolite {
namespace {

struct Pixel {
  int x = 0, y = 0;
};
double length(Pixel a, Pixel b) { return std::hypot(a.x - b.x, a.y - b.y); }

/// Unite a 2-D shape with the layer where its distance (in pixels, at pixel coordinates) can matter.
template <class Distance>
void unite_into(Layer& layer, const Image<std::uint8_t>& section, Pixel from, Pixel to, double reach_px,
                Distance&& distance_px) {
  const int reach = static_cast<int>(std::ceil(reach_px)) + Layer::cap_px;
  const int x0 = std::max(0, std::min(from.x, to.x) - reach),
            x1 = std::min(layer.solid.width - 1, std::max(from.x, to.x) + reach);
  const int y0 = std::max(0, std::min(from.y, to.y) - reach),
            y1 = std::min(layer.solid.height - 1, std::max(from.y, to.y) + reach);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const double d = distance_px(x, y);
      float& value = layer.distance_mm(x, y);
      value = std::min(value, static_cast<float>(d * layer.pixel_mm));
      if (d < 0 && section(x, y) != 0) layer.solid(x, y) = 1;
    }
}

void add_bar(Layer& layer, const Image<std::uint8_t>& section, Pixel a, Pixel b, double half_width_px) {
  const Vec2d start{a.x + 0.0, a.y + 0.0}, edge{b.x - a.x + 0.0, b.y - a.y + 0.0};
  const double length2 = std::max(1e-12, dot(edge, edge));
  unite_into(layer, section, a, b, half_width_px, [&](int x, int y) {
    const Vec2d d = Vec2d{x + 0.0, y + 0.0} - start;
    return norm(d - std::clamp(dot(d, edge) / length2, 0.0, 1.0) * edge) - half_width_px;
  });
}

void add_rectangle(Layer& layer, const Image<std::uint8_t>& section, Pixel low, Pixel high) {
  unite_into(layer, section, low, high, 1, [&](int x, int y) {
    const double dx = std::max(low.x - x, x - high.x) - 0.5, dy = std::max(low.y - y, y - high.y) - 0.5;
    return std::max(dx, dy) <= 0 ? std::max(dx, dy) : std::hypot(std::max(dx, 0.0), std::max(dy, 0.0));
  });
}

/// For every pixel the nearest pixel of material.
std::vector<Pixel> nearest_material(const Image<std::uint8_t>& solid) {
  cv::Mat empty(solid.height, solid.width, CV_8U), depth, label;
  for (int y = 0; y < solid.height; ++y)
    for (int x = 0; x < solid.width; ++x) empty.at<std::uint8_t>(y, x) = solid(x, y) != 0 ? 0 : 255;
  cv::distanceTransform(empty, depth, label, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  std::vector<Pixel> of_label(1);
  for (int y = 0; y < solid.height; ++y)
    for (int x = 0; x < solid.width; ++x) {
      if (solid(x, y) == 0) continue;
      const auto id = static_cast<std::size_t>(label.at<int>(y, x));
      if (of_label.size() <= id) of_label.resize(id + 1);
      of_label[id] = {x, y};
    }
  std::vector<Pixel> nearest(solid.pixels.size());
  for (int y = 0; y < solid.height; ++y)
    for (int x = 0; x < solid.width; ++x)
      nearest[static_cast<std::size_t>(y) * static_cast<std::size_t>(solid.width) + static_cast<std::size_t>(x)] =
          of_label[static_cast<std::size_t>(label.at<int>(y, x))];
  return nearest;
}

struct Gap2d {
  double length;
  int region_a, region_b;
  Pixel a, via, b;
};

/// The shortest gap of every pair of regions whose nearest-pixel territories touch inside the section, shortest first.
/// The minimum spanning tree of these is the one of all pairs.
std::vector<Gap2d> shortest_gaps(const Layer& layer, const Image<std::uint8_t>& section, const Regions& regions) {
  const std::vector<Pixel> nearest = nearest_material(layer.solid);
  std::map<std::pair<int, int>, Gap2d> best;
  const auto meet = [&](Pixel p, Pixel q) {
    if (section(p.x, p.y) == 0 || section(q.x, q.y) == 0) return;
    const auto at = [&](Pixel s) {
      return nearest[static_cast<std::size_t>(s.y) * static_cast<std::size_t>(section.width) +
                     static_cast<std::size_t>(s.x)];
    };
    Pixel a = at(p), b = at(q);
    int region_a = regions.label(a.x, a.y), region_b = regions.label(b.x, b.y);
    if (region_a == region_b) return;
    if (region_a > region_b) {
      std::swap(region_a, region_b);
      std::swap(a, b);
    }
    const Gap2d gap{length(a, b), region_a, region_b, a, p, b};
    const auto [place, fresh] = best.try_emplace({region_a, region_b}, gap);
    if (!fresh && gap.length < place->second.length) place->second = gap;
  };
  for (int y = 0; y < section.height; ++y)
    for (int x = 0; x < section.width; ++x) {
      if (x + 1 < section.width) meet({x, y}, {x + 1, y});
      if (y + 1 < section.height) meet({x, y}, {x, y + 1});
    }
  std::vector<Gap2d> gaps;
  for (const auto& [pair, gap] : best) gaps.push_back(gap);
  std::sort(gaps.begin(), gaps.end(), [](const Gap2d& p, const Gap2d& q) {
    return std::tuple(p.length, p.region_a, p.region_b) < std::tuple(q.length, q.region_a, q.region_b);
  });
  return gaps;
}

/// Kruskal. With `around`, bars turn a corner at the pixel where the territories meet: for gaps that would leave the
/// section.
void add_spanning_tree(Layer& layer, const Image<std::uint8_t>& section, double half_width_px, bool around) {
  const Regions regions = regions_of(layer.solid);
  std::vector<int> owner(static_cast<std::size_t>(regions.count) + 1);
  std::iota(owner.begin(), owner.end(), 0);
  const auto root = [&](int i) {
    while (owner[static_cast<std::size_t>(i)] != i) i = owner[static_cast<std::size_t>(i)];
    return i;
  };
  for (const Gap2d& gap : shortest_gaps(layer, section, regions)) {
    const int a = root(gap.region_a), b = root(gap.region_b);
    if (a == b) continue;
    owner[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    if (around) {
      add_bar(layer, section, gap.a, gap.via, half_width_px);
      add_bar(layer, section, gap.via, gap.b, half_width_px);
    } else {
      add_bar(layer, section, gap.a, gap.b, half_width_px);
    }
  }
}

struct Bounds {
  Pixel low{1 << 30, 1 << 30}, high{-1, -1};
};

void add_boxes(Layer& layer, const Image<std::uint8_t>& section, double half_width_px) {
  const Regions regions = regions_of(layer.solid);
  std::vector<Bounds> box(static_cast<std::size_t>(regions.count));
  for (int y = 0; y < layer.solid.height; ++y)
    for (int x = 0; x < layer.solid.width; ++x) {
      const int r = regions.label(x, y);
      if (r == 0) continue;
      Bounds& b = box[static_cast<std::size_t>(r - 1)];
      b.low = {std::min(b.low.x, x), std::min(b.low.y, y)};
      b.high = {std::max(b.high.x, x), std::max(b.high.y, y)};
    }
  const auto largest = std::max_element(regions.pixels.begin(), regions.pixels.end()) - regions.pixels.begin();
  const int half = static_cast<int>(std::ceil(half_width_px));
  for (int r = 0; r < regions.count; ++r) {
    if (r == largest) continue;
    Bounds b = box[static_cast<std::size_t>(r)];
    const Pixel center{(b.low.x + b.high.x) / 2, (b.low.y + b.high.y) / 2};
    b.low = {std::max(0, std::min(b.low.x, center.x - half)), std::max(0, std::min(b.low.y, center.y - half))};
    b.high = {std::min(section.width - 1, std::max(b.high.x, center.x + half)),
              std::min(section.height - 1, std::max(b.high.y, center.y + half))};
    const auto foreign = [&](int x, int y) { return regions.label(x, y) > 0 && regions.label(x, y) != r + 1; };
    // How far the box must grow in each direction until it meets another region.
    std::optional<std::pair<int, Bounds>> shortest;
    for (const Pixel way : {Pixel{1, 0}, Pixel{-1, 0}, Pixel{0, 1}, Pixel{0, -1}}) {
      Bounds grown = b;
      for (int step = 0;; ++step) {
        bool met = false;
        for (int y = grown.low.y; y <= grown.high.y && !met; ++y)
          for (int x = grown.low.x; x <= grown.high.x && !met; ++x)
            if ((step == 0) || (way.x > 0 && x == grown.high.x) || (way.x < 0 && x == grown.low.x) ||
                (way.y > 0 && y == grown.high.y) || (way.y < 0 && y == grown.low.y))
              met = foreign(x, y);
        if (met) {
          if (!shortest || step < shortest->first) shortest = {step, grown};
          break;
        }
        (way.x + way.y > 0 ? grown.high : grown.low).x += way.x;
        (way.x + way.y > 0 ? grown.high : grown.low).y += way.y;
        if (grown.low.x < 0 || grown.low.y < 0 || grown.high.x >= section.width || grown.high.y >= section.height)
          break;
      }
    }
    if (shortest) add_rectangle(layer, section, shortest->second.low, shortest->second.high);
  }
}

}  // namespace

void join_regions(Layer& layer, const Image<std::uint8_t>& section, Bridge bridge, double min_wall_mm) {
  const double half_width_px = std::max(1.0, min_wall_mm / 2 / layer.pixel_mm);
  if (regions(layer) <= 1) return;
  if (bridge == Bridge::Bbox) add_boxes(layer, section, half_width_px);
  // A bar may be cut where it leaves the section; then the next round goes around the corner.
  for (const bool around : {false, false, true, true}) {
    if (regions(layer) <= 1) return;
    add_spanning_tree(layer, section, half_width_px, around);
  }
}

}  // namespace fibrolite
