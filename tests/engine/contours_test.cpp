// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/contours.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

constexpr double pi = std::numbers::pi;

SliceGrid around(double half, double pixel) {
  return slice_grid({}, {{-half, -half, -1}, {half, half, 1}}, {pixel, pixel}, 2);
}
/// Bars upright through the layer, so that a section is what it looks like.
Shape bar(double x, double y, double radius) { return cylinder({x, y, -9}, {x, y, 9}, radius); }

double total(const std::vector<Contour>& list) {
  double sum = 0;
  for (const Contour& c : list) sum += c.area_mm2;
  return sum;
}

double turn(Vec2d a, Vec2d b, Vec2d c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// Pairs of pieces, of one outline or of two, that cross. Every pair is looked at.
int crossings(const std::vector<Contour>& list) {
  struct Piece {
    Vec2d a, b;
  };
  std::vector<Piece> pieces;
  for (const Contour& c : list) {
    for (std::size_t i = 0; i < c.points.size(); ++i)
      pieces.push_back({c.points[i], c.points[(i + 1) % c.points.size()]});
  }
  int found = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (std::size_t j = i + 1; j < pieces.size(); ++j) {
      const auto [a, b] = pieces[i];
      const auto [c, d] = pieces[j];
      if (turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0) ++found;
    }
  }
  return found;
}

bool contains(const Contour& outline, Vec2d p) {
  bool inside = false;
  for (std::size_t i = 0, last = outline.points.size() - 1; i < outline.points.size(); last = i++) {
    const Vec2d a = outline.points[last], b = outline.points[i];
    if ((a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)) inside = !inside;
  }
  return inside;
}

TEST(Contours, ARingWithAnIslandIsNested) {
  // Ring, island in its hole, and a speck beside it all.
  const Shape ring = subtract(bar(0, 0, 8), bar(0.5, 0, 5));
  const SliceGrid grid = around(12, 0.1);
  const auto list = contours(unite({ring, bar(1, 1, 2), bar(10, 10, 1)}), grid, 0);
  ASSERT_EQ(list.size(), 4U);
  auto by_area = list;
  std::sort(by_area.begin(), by_area.end(),
            [](auto& a, auto& b) { return std::abs(a.area_mm2) > std::abs(b.area_mm2); });
  const double truth[] = {64 * pi, -25 * pi, 4 * pi, pi};
  const int depth[] = {0, 1, 2, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(by_area[i].area_mm2, truth[i], 2e-3 * std::abs(truth[i]));
    EXPECT_EQ(by_area[i].depth, depth[i]);
    EXPECT_EQ(by_area[i].parent < 0, depth[i] == 0);
    if (depth[i] == 0) continue;
    EXPECT_EQ(list[static_cast<std::size_t>(by_area[i].parent)].area_mm2, by_area[i - 1].area_mm2);
  }
  const double pixels = slice(unite({ring, bar(1, 1, 2), bar(10, 10, 1)}), grid, 0).area_mm2;
  EXPECT_NEAR(total(list), pixels, 2e-3 * pixels);
  EXPECT_EQ(crossings(list), 0);
}

/// Waves in a disc: sections that touch, nearly touch and part again, over and over.
struct Waves final : Shape::Function {
  void evaluate(const PointBlock& block, float* out) const override {
    for (int i = 0; i < block.count; ++i) {
      const float x = block.x[i], y = block.y[i];
      out[i] = std::sin(3 * x) * std::sin(3 * y) * 0.3F + 0.05F * std::sin(17 * x + 5 * y) + 0.02F * std::cos(31 * y);
    }
  }
  [[nodiscard]] double lipschitz() const override { return 3; }
};

TEST(Contours, NeverCrossAndKeepTheirAreaInAThicket) {
  const Shape thicket = intersect({bar(0, 0, 5), Shape(std::make_shared<const Waves>())});
  for (const double pixel : {0.05, 0.11, 0.3}) {
    const SliceGrid grid = around(6, pixel);
    const auto list = contours(thicket, grid, 0);
    EXPECT_GT(list.size(), 10U);
    EXPECT_EQ(crossings(list), 0) << pixel;
    const double pixels = slice(thicket, grid, 0).area_mm2;
    EXPECT_NEAR(total(list), pixels, 2e-3 * pixels) << pixel;
    // What a point is in, counted outline by outline, is what depth and sign say.
    for (const Contour& c : list) {
      const int around = static_cast<int>(std::count_if(list.begin(), list.end(), [&](const Contour& o) {
        return &o != &c && std::abs(o.area_mm2) > std::abs(c.area_mm2) && contains(o, c.points[0]);
      }));
      EXPECT_EQ(c.depth, around);
      EXPECT_EQ(c.depth % 2 == 0, c.area_mm2 > 0);
    }
  }
}

TEST(Contours, ABoxHasFewPoints) {
  const auto list = contours(cuboid({{-5, -4, -3}, {5, 4, 3}}), around(6, 0.07), 0);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_NEAR(list[0].area_mm2, 80, 0.01);
  EXPECT_LT(list[0].points.size(), 700U);  // of 2058 crossings, those near a corner of a triangle stay
}

TEST(Contours, WhatReachesTheRimIsClosedThere) {
  const SliceGrid grid = around(6, 0.1);
  const auto all = contours(everything(), grid, 0);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_NEAR(all[0].area_mm2, 144, 0.01);
  const auto list = contours(subtract(half_space({}, {1, 0, 0}), bar(-6, 0, 1)), grid, 0);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_NEAR(list[0].area_mm2, 72 - 0.5 * pi, 0.02);
  EXPECT_TRUE(contours(nothing(), grid, 0).empty());
}

TEST(Contours, SameBitsOnOneAndTwoThreads) {
  const Shape thicket = intersect({bar(0, 0, 5), Shape(std::make_shared<const Waves>())});
  std::vector<Contour> lists[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    lists[threads - 1] = contours(thicket, around(6, 0.02), 0);
  }
  ASSERT_EQ(lists[0].size(), lists[1].size());
  for (std::size_t i = 0; i < lists[0].size(); ++i) {
    EXPECT_EQ(lists[0][i].points, lists[1][i].points);
    EXPECT_EQ(lists[0][i].parent, lists[1][i].parent);
  }
}

TEST(Contours, RefusesAToleranceThatCouldCross) {
  for (const double bad : {-0.01, 0.2, std::nan("")})
    EXPECT_THROW((void)contours(sphere({}, 1), around(2, 0.1), 0, {.tolerance_px = bad}), Error);
}

}  // namespace
}  // namespace fibrolite
