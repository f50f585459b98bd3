// SPDX-License-Identifier: GPL-3.0-or-later
#include "micrographs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "fibrolite/random.h"
#include "fibrolite/vec.h"

namespace fibrolite {
namespace {

struct Nearest {
  std::size_t cell;
  double border;  // distance to the border with the next cell
};
/// Of the cells listed.
Nearest nearest_cell(const std::vector<Vec2d>& middles, const std::vector<std::size_t>& list, Vec2d p) {
  std::size_t first = list.front();
  for (const std::size_t i : list)
    if (norm(p - middles[i]) < norm(p - middles[first])) first = i;
  double border = std::numeric_limits<double>::infinity();
  for (const std::size_t i : list) {
    if (i == first) continue;
    const Vec2d across = middles[i] - middles[first];
    const Vec2d to_middle = 0.5 * (middles[i] + middles[first]) - p;
    border = std::min(border, (to_middle.x * across.x + to_middle.y * across.y) / norm(across));
  }
  return {first, border};
}

/// visit(x, y, nearest) for each pixel; no cell is more than three pitches from where it counts.
template <class Visit>
void each_pixel(const std::vector<Vec2d>& middles, double pitch, int width, int height, Visit&& visit) {
  constexpr int tile = 16;
  for (int ty = 0; ty < height; ty += tile)
    for (int tx = 0; tx < width; tx += tile) {
      std::vector<std::size_t> list;
      for (std::size_t i = 0; i < middles.size(); ++i)
        if (norm(middles[i] - Vec2d{tx + 0.5 * tile, ty + 0.5 * tile}) < 3 * pitch + tile) list.push_back(i);
      for (int y = ty; y < std::min(height, ty + tile); ++y)
        for (int x = tx; x < std::min(width, tx + tile); ++x)
          visit(x, y, nearest_cell(middles, list, {x + 0.0, y + 0.0}));
    }
}

double normal(Random& random) {
  const double u = 1 - random.uniform();
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * random.uniform());
}

std::uint8_t grey(double value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))); }

}  // namespace

GrayImage honeycomb(int columns, int rows, double pitch, double wall) {
  const double row_mm = pitch * std::sqrt(0.75);
  std::vector<Vec2d> middles;
  // One ring more than is drawn: it bounds the outer hexagons.
  for (int row = -1; row <= rows; ++row)
    for (int column = -1; column <= columns; ++column)
      middles.push_back({(column + 1 + 0.5 * (row & 1)) * pitch, (row + 1) * row_mm});
  const auto inner = [&](std::size_t i) {
    const int row = static_cast<int>(i) / (columns + 2) - 1, column = static_cast<int>(i) % (columns + 2) - 1;
    return row >= 0 && row < rows && column >= 0 && column < columns;
  };
  GrayImage image(static_cast<int>((columns + 1.5) * pitch), static_cast<int>((rows + 1) * row_mm), 60);
  each_pixel(middles, pitch, image.width, image.height, [&](int x, int y, const Nearest& at) {
    if (inner(at.cell)) image(x, y) = grey(60 + 120 * std::clamp(at.border - wall / 2 + 0.5, 0.0, 1.0));
  });
  return image;
}

GrayImage photograph(std::uint64_t seed, double pitch, int side, double noise, int* truth) {
  Random random(seed, "photograph");
  const int cells = static_cast<int>(side / pitch) + 2;
  std::vector<Vec2d> middles;
  for (int j = -1; j < cells; ++j)
    for (int i = -1; i < cells; ++i) {
      const double x = (i + 0.25 + 0.5 * random.uniform()) * pitch;
      middles.push_back({x, (j + 0.25 + 0.5 * random.uniform()) * pitch});
    }
  GrayImage image(side, side);
  std::vector<int> pixels(middles.size(), 0);
  each_pixel(middles, pitch, side, side, [&](int x, int y, const Nearest& at) {
    ++pixels[at.cell];
    const double across = static_cast<double>(x) / side, off = std::hypot(x - 0.5 * side, y - 0.5 * side) / side;
    const double light = (1 - 0.55 * across) * (1 - off * off);
    const double tone = 80 + 140 * std::clamp(at.border - 1.5, 0.0, 1.0);
    image(x, y) = grey(tone * light + noise * normal(random));
  });
  if (truth != nullptr)
    *truth =
        static_cast<int>(std::count_if(pixels.begin(), pixels.end(), [&](int n) { return n > pitch * pitch / 10; }));
  return image;
}

GrayImage pure_noise(std::uint64_t seed, int side, double mean, double sd, int grain) {
  Random random(seed, "noise");
  FloatImage field(side, side);
  for (float& v : field.pixels) v = static_cast<float>(normal(random));
  for (int round = 0; round < grain; ++round) {  // wraps around: the grain is even
    FloatImage soft(side, side);
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x)
        soft(x, y) = 0.25F * (field((x + 1) % side, y) + field((x + side - 1) % side, y) + field(x, (y + 1) % side) +
                              field(x, (y + side - 1) % side));
    field = soft;
  }
  double square = 0;
  for (const float v : field.pixels) square += static_cast<double>(v) * static_cast<double>(v);
  const double scale = sd / std::sqrt(square / static_cast<double>(field.pixels.size()));
  GrayImage image(side, side);
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = grey(mean + scale * static_cast<double>(field.pixels[i]));
  return image;
}

}  // namespace fibrolite
