// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/network.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace fibrolite {
namespace {

constexpr int tile_px = 64;

/// A corner between four pixels where a border passes, with up to four neighbours along borders.
struct Knot {
  Vec2d at;
  std::array<int, 4> next{};
  int count = 0;
};

/// Knots and their links: every pixel edge between two labels is a link.
std::vector<Knot> staircase(const LabelImage& label) {
  Image<std::int32_t> knot_at(label.width + 1, label.height + 1, -1);
  std::vector<Knot> knots;
  const auto knot = [&](int x, int y) {
    std::int32_t& id = knot_at(x, y);
    if (id < 0) {
      id = static_cast<std::int32_t>(knots.size());
      knots.push_back({{x - 0.5, y - 0.5}, {}, 0});
    }
    return id;
  };
  const auto link = [&](int p, int q) {
    Knot &a = knots[static_cast<std::size_t>(p)], &b = knots[static_cast<std::size_t>(q)];
    a.next[static_cast<std::size_t>(a.count++)] = q;
    b.next[static_cast<std::size_t>(b.count++)] = p;
  };
  for (int y = 0; y < label.height; ++y)
    for (int x = 0; x < label.width; ++x) {
      if (x + 1 < label.width && label(x, y) != label(x + 1, y)) {
        const int p = knot(x + 1, y), q = knot(x + 1, y + 1);
        link(p, q);
      }
      if (y + 1 < label.height && label(x, y) != label(x, y + 1)) {
        const int p = knot(x, y + 1), q = knot(x + 1, y + 1);
        link(p, q);
      }
    }
  return knots;
}

float squared_distance(float px, float py, const Segment2d& s) {
  const auto ax = static_cast<float>(s.a.x), ay = static_cast<float>(s.a.y);
  const float ex = static_cast<float>(s.b.x) - ax, ey = static_cast<float>(s.b.y) - ay;
  const float length2 = ex * ex + ey * ey;
  const float t = length2 > 0 ? std::clamp(((px - ax) * ex + (py - ay) * ey) / length2, 0.F, 1.F) : 0.F;
  const float dx = px - (ax + t * ex), dy = py - (ay + t * ey);
  return dx * dx + dy * dy;
}

}  // namespace

std::vector<Segment2d> smooth_borders(const LabelImage& label, int rounds) {
  std::vector<Knot> knots = staircase(label);
  std::vector<Vec2d> moved(knots.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < knots.size(); ++i) {
      const Knot& k = knots[i];
      moved[i] = k.at;
      if (k.count < 2) continue;  // a line's end at the frame
      Vec2d mean;
      for (int n = 0; n < k.count; ++n)
        mean = mean + (1.0 / k.count) * knots[static_cast<std::size_t>(k.next[static_cast<std::size_t>(n)])].at;
      moved[i] = 0.5 * (k.at + mean);
    }
    for (std::size_t i = 0; i < knots.size(); ++i) knots[i].at = moved[i];
  }
  std::vector<Segment2d> segments;
  for (std::size_t i = 0; i < knots.size(); ++i)
    for (int n = 0; n < knots[i].count; ++n) {
      const int j = knots[i].next[static_cast<std::size_t>(n)];
      if (static_cast<int>(i) < j) segments.push_back({knots[i].at, knots[static_cast<std::size_t>(j)].at});
    }
  return segments;
}

FloatImage distance_to_segments(const std::vector<Segment2d>& segments, Vec2d corner_mm, double pixel_mm, int width,
                                int height, double reach_mm) {
  const int columns = (width + tile_px - 1) / tile_px, rows = (height + tile_px - 1) / tile_px;
  // Work in pixels from here: float is exact enough for images of any size we allow.
  std::vector<Segment2d> local;
  local.reserve(segments.size());
  for (const Segment2d& s : segments)
    local.push_back({(1 / pixel_mm) * (s.a - corner_mm), (1 / pixel_mm) * (s.b - corner_mm)});
  const double reach_px = reach_mm / pixel_mm;

  struct Window {
    int x0, y0, x1, y1;
  };
  const auto window = [&](const Segment2d& s, Window clip) {
    return Window{std::max(clip.x0, static_cast<int>(std::ceil(std::min(s.a.x, s.b.x) - reach_px))),
                  std::max(clip.y0, static_cast<int>(std::ceil(std::min(s.a.y, s.b.y) - reach_px))),
                  std::min(clip.x1, static_cast<int>(std::floor(std::max(s.a.x, s.b.x) + reach_px))),
                  std::min(clip.y1, static_cast<int>(std::floor(std::max(s.a.y, s.b.y) + reach_px)))};
  };
  std::vector<std::vector<std::uint32_t>> in_tile(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (std::size_t i = 0; i < local.size(); ++i) {
    const Window w = window(local[i], {0, 0, width - 1, height - 1});
    if (w.x0 > w.x1 || w.y0 > w.y1) continue;
    for (int ty = w.y0 / tile_px; ty <= w.y1 / tile_px; ++ty)
      for (int tx = w.x0 / tile_px; tx <= w.x1 / tile_px; ++tx)
        in_tile[static_cast<std::size_t>(ty * columns + tx)].push_back(static_cast<std::uint32_t>(i));
  }

  FloatImage image(width, height, static_cast<float>(reach_px * reach_px));
  tbb::parallel_for(std::size_t{0}, in_tile.size(), [&](std::size_t tile) {
    const int tx = static_cast<int>(tile) % columns * tile_px, ty = static_cast<int>(tile) / columns * tile_px;
    const Window clip{tx, ty, std::min(tx + tile_px, width) - 1, std::min(ty + tile_px, height) - 1};
    for (const std::uint32_t i : in_tile[tile]) {
      const Window w = window(local[i], clip);
      for (int y = w.y0; y <= w.y1; ++y) {
        float* row = &image(0, y);
        for (int x = w.x0; x <= w.x1; ++x)
          row[x] = std::min(row[x], squared_distance(static_cast<float>(x), static_cast<float>(y), local[i]));
      }
    }
    for (int y = clip.y0; y <= clip.y1; ++y)
      for (int x = clip.x0; x <= clip.x1; ++x) image(x, y) = std::sqrt(image(x, y)) * static_cast<float>(pixel_mm);
  });
  return image;
}

}  // namespace fibrolite
