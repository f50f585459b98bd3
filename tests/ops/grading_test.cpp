// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/grading.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "fibrolite/random.h"
#include "refusal.h"

namespace fibrolite {
namespace {

const Box3d bar{{0, 0, 0}, {100, 20, 20}};
constexpr StressGrade grade{.least = 1, .most = 2, .slope_mm = 10};

TEST(Grading, FollowsALinearStress) {
  // Stress grows along the bar: 95 % of the volume stays below that at x = 95.
  const Shape factor = thicker_where_stressed(grade, bar, cuboid(bar), [](Vec3d p) { return 0.3 * p.x; });
  for (const double x : {10.0, 40.0, 70.0}) EXPECT_NEAR(factor({x, 10, 10}), 1 + x / 95, 0.03);
  EXPECT_NEAR(factor({99, 10, 10}), 2, 1e-6);
  EXPECT_NEAR(factor({-50, 10, 10}), factor({0, 10, 10}), 1e-6);
}

TEST(Grading, TheSizeOfTheLoadDoesNotMatter) {
  const auto of = [&](double newton) {
    return thicker_where_stressed(grade, bar, cuboid(bar), [=](Vec3d p) { return newton * (p.x + p.y); });
  };
  for (const double x : {5.0, 33.0, 80.0}) EXPECT_NEAR(of(1)({x, 7, 9}), of(1000)({x, 7, 9}), 1e-5);
}

TEST(Grading, NeverFallsFasterThanAllowedAndNeverBelowTheNeed) {
  // A tenth of the bar carries everything.
  const auto stress = [](Vec3d p) { return std::abs(p.x - 50) < 5 ? 1.0 : 0.0; };
  const Shape factor = thicker_where_stressed(grade, bar, cuboid(bar), stress);
  EXPECT_NEAR(factor({50, 10, 10}), 2, 1e-6);
  EXPECT_NEAR(factor({60, 10, 10}), 1.5, 0.3);  // the table steps by 2.5 mm
  EXPECT_NEAR(factor({90, 10, 10}), 1, 1e-6);
  Random random(1, "grading", 0);
  const auto point = [&] { return Vec3d{100 * random.uniform(), 20 * random.uniform(), 20 * random.uniform()}; };
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p = point(), q = point();
    EXPECT_LE(std::abs(factor(p) - factor(q)), factor.lipschitz() * norm(p - q) + 1e-5);
    EXPECT_GE(factor(p), 1 - 1e-6);
    EXPECT_LE(factor(p), 2 + 1e-6);
  }
}

TEST(Grading, WithoutStressNothingIsThicker) {
  const Shape factor = thicker_where_stressed(grade, bar, cuboid(bar), [](Vec3d) { return 0.0; });
  EXPECT_EQ(factor({50, 10, 10}), 1);
}

TEST(Grading, SameBitsOnOneAndTwoThreads) {
  const auto made = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return thicker_where_stressed(grade, bar, cuboid(bar), [](Vec3d p) { return std::abs(std::sin(p.x + p.z)); });
  };
  const Shape one = made(1), two = made(2);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(one({i + 0.3, 7, 3}), two({i + 0.3, 7, 3}));
}

TEST(DepthTable, IsTheDepthInsideAndAtMostTheDistanceOutside) {
  constexpr double step = 1.25;
  const Shape ball = sphere({0, 0, 0}, 20);
  const Shape depth = depth_table(ball, {{-20, -20, -20}, {20, 20, 20}}, step);
  Random random(1, "depth", 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p{40 * random.uniform() - 20, 40 * random.uniform() - 20, 40 * random.uniform() - 20};
    if (norm(p) < 20 - 2 * step) {
      EXPECT_NEAR(depth(p), ball(p), 0.5 * step) << norm(p);
    } else {
      EXPECT_LE(depth(p), ball(p) + 0.5 * step) << norm(p);
      EXPECT_GE(depth(p), -2 * step) << norm(p);
    }
  }
  // Half way between two entries off the centre the interpolation is better by far than at the tip of the cone.
  EXPECT_NEAR(depth({0, 10, 0.3}), -9.995, 0.03);
}

TEST(DepthTable, SameBitsOnOneAndTwoThreads) {
  const auto made = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return depth_table(sphere({50, 10, 10}, 9), bar, 0.7);
  };
  const Shape one = made(1), two = made(2);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(one({i + 0.3, 7, 3}), two({i + 0.3, 7, 3}));
}

TEST(PlacesInside, GiveMeansOverTheLumen) {
  constexpr double radius = 20, shell = 2, inner = radius - shell;
  const Shape ball = sphere({1, 2, 3}, radius);
  const Box3d box{{-19, -18, -17}, {21, 22, 23}};
  const double volume = 4.0 / 3 * std::numbers::pi * radius * radius * radius;
  const auto mean = [&](const std::vector<Vec3d>& places) {
    double sum = 0;
    for (const Vec3d p : places) sum += dot(p - Vec3d{1, 2, 3}, p - Vec3d{1, 2, 3});
    return sum / static_cast<double>(places.size());
  };
  const auto whole = places_inside(ball, box, volume, shell, everything());
  EXPECT_NEAR(static_cast<double>(whole.size()) / 20000, std::pow(inner / radius, 3), 0.01);
  EXPECT_NEAR(mean(whole) / (0.6 * inner * inner), 1, 0.005);
  const auto half = places_inside(ball, box, volume, shell, half_space({1, 2, 3.1}, {0, 0, 1}));
  EXPECT_NEAR(static_cast<double>(half.size()) / static_cast<double>(whole.size()), 0.5, 0.03);
  EXPECT_TRUE(places_inside(ball, box, volume, shell, nothing()).empty());
}

TEST(Grading, RangesAreChecked) {
  const auto refused = [](StressGrade bad) {
    return testing::refusal([&] { (void)thicker_where_stressed(bad, bar, cuboid(bar), [](Vec3d) { return 1.0; }); });
  };
  EXPECT_NE(refused({.least = 0}).find("grade_least"), std::string::npos);
  EXPECT_NE(refused({.least = 2, .most = 1}).find("grade_least"), std::string::npos);
  EXPECT_NE(refused({.slope_mm = 0}).find("grade_depth_mm"), std::string::npos);
}

}  // namespace
}  // namespace fibrolite
