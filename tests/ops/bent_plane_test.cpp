// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/bent_plane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fibrolite/random.h"

namespace fibrolite {
namespace {

constexpr double radius = 10;  // of curvature of the bowl

BentPlane saddle() {
  return {frame_along({3, -2, 5}, {1, 2, 3}), {.slope = {0.2, -0.1}, .xx = 0.02, .xy = -0.03, .yy = -0.01}};
}
Bend bowl() { return {.slope = {}, .xx = 0.5 / radius, .xy = 0, .yy = 0.5 / radius}; }

Vec3d somewhere(const BentPlane& surface, Random& random, double sideways, double up) {
  const auto unit = [&] { return 2 * random.uniform() - 1; };
  return surface.frame.to_world({sideways * unit(), sideways * unit(), up * unit()});
}

TEST(BentPlane, AFlatOneIsTheFrameItself) {
  const BentPlane plane{frame_along({1, 2, 3}, {1, 1, 0})};
  EXPECT_EQ(plane.at({4, 5}, 6), plane.frame.to_world({4, 5, 6}));
  EXPECT_EQ(plane.normal({4, 5}), plane.frame.z);
  const Vec3d p{7, -3, 2};
  EXPECT_EQ(plane.flattened(p), plane.frame.to_local(p));
  EXPECT_EQ(plane.foot(p).above_mm, plane.frame.to_local(p).z);
  EXPECT_TRUE(plane.bend.flat());
  EXPECT_FALSE(bowl().flat());
}

TEST(BentPlane, TheFootIsTheNearestPointByBruteForce) {
  const BentPlane surface = saddle();
  Random random(1, "foot");
  for (int i = 0; i < 60; ++i) {
    const Vec3d p = somewhere(surface, random, 6, 4);
    const BentPlane::Foot foot = surface.foot(p);
    double nearest = 1e9;
    const Vec3d q = surface.frame.to_local(p);
    for (double y = -5; y <= 5; y += 0.05)
      for (double x = -5; x <= 5; x += 0.05) nearest = std::min(nearest, norm(surface.at({q.x + x, q.y + y}) - p));
    EXPECT_NEAR(std::abs(foot.above_mm), nearest, 2e-3);
    EXPECT_NEAR(norm(surface.at(foot.local, foot.above_mm) - p), 0, 1e-3) << "up the normal is where it came from";
    EXPECT_EQ(foot.above_mm < 0, surface.flattened(p).z < 0);
  }
}

TEST(BentPlane, FarOffTheFootIsNoNearerThanTheSurface) {
  const BentPlane surface{{}, bowl()};
  // Above the centre of curvature the point straight below is not the nearest; a distance is still an upper bound.
  const BentPlane::Foot foot = surface.foot({0.5, 0, 40});
  EXPECT_LE(foot.above_mm, 40);
  EXPECT_GT(foot.above_mm, 10);
}

TEST(BentPlane, SeenFromTheOtherSideItIsTheSame) {
  const BentPlane here = saddle();
  const Frame& f = here.frame;
  const BentPlane there{{f.origin, f.x, -f.y, -f.z}, here.bend.turned()};
  Random random(2, "turned");
  for (int i = 0; i < 50; ++i) {
    const Vec2d p{8 * random.uniform() - 4, 8 * random.uniform() - 4};
    EXPECT_NEAR(norm(here.at(p, 0.7) - there.at({p.x, -p.y}, -0.7)), 0, 1e-12);
    EXPECT_NEAR(norm(here.normal(p) + there.normal({p.x, -p.y})), 0, 1e-12);
  }
  EXPECT_EQ(there.bend.turned(), here.bend);
}

TEST(BentPlane, AboutAnotherOfItsPointsItIsTheSame) {
  const BentPlane here = saddle();
  const Vec2d move{2, -1.5};
  BentPlane there{here.frame, here.bend.about(move)};
  there.frame.origin = here.at(move);
  for (const Vec2d p : {Vec2d{0, 0}, Vec2d{3, 1}, Vec2d{-2, 4}})
    EXPECT_NEAR(norm(here.at(p + move, 0.4) - there.at(p, 0.4)), 0, 1e-12);
}

TEST(BentPlane, NormalsAndSlopesAreTheDerivatives) {
  const BentPlane surface = saddle();
  for (const Vec2d p : {Vec2d{0, 0}, Vec2d{3, 1}, Vec2d{-2, 4}}) {
    constexpr double h = 1e-5;
    const Vec3d x = surface.at({p.x + h, p.y}) - surface.at({p.x - h, p.y});
    const Vec3d y = surface.at({p.x, p.y + h}) - surface.at({p.x, p.y - h});
    EXPECT_NEAR(norm(normalized(cross(x, y)) - surface.normal(p)), 0, 1e-8);
    EXPECT_NEAR(norm(cross(x, y)) / (4 * h * h), surface.bend.stretch(p), 1e-8);
    EXPECT_LE(norm(surface.bend.slope_at(p)), surface.bend.steepest(norm(p)) + 1e-12);
  }
  EXPECT_NEAR(bowl().curvature(), 1 / radius, 1e-12);
}

TEST(BentPlane, TheAreaOfABowlIsThatOfAParaboloid) {
  constexpr double rim = 5, step = 0.02;
  double area = 0;
  for (double y = -rim; y <= rim; y += step)
    for (double x = -rim; x <= rim; x += step)
      if (std::hypot(x, y) <= rim) area += step * step * bowl().stretch({x, y});
  // 2 pi R^2 / 3 ((1 + r^2 / R^2)^1.5 - 1)
  const double expected =
      2 * std::numbers::pi * radius * radius / 3 * (std::pow(1 + rim * rim / radius / radius, 1.5) - 1);
  EXPECT_NEAR(area, expected, 2e-3 * expected);
}

}  // namespace
}  // namespace fibrolite
