// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/gyroid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "bounds.h"
#include "fibrolite/error.h"
#include "fibrolite/random.h"

namespace fibrolite {
namespace {

constexpr double pi = std::numbers::pi;

/// Share of a cell inside, at the midpoints of n^3 boxes.
double share(const Shape& shape, double cell, int n) {
  std::vector<Vec3d> row(static_cast<std::size_t>(n));
  std::vector<float> value(row.size());
  double inside = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) row[static_cast<std::size_t>(k)] = (cell / n) * Vec3d{i + 0.5, j + 0.5, k + 0.5};
      shape.evaluate(row, value);
      for (const float v : value) inside += v < 0 ? 1 : 0;
    }
  return inside / (static_cast<double>(n) * n * n);
}

/// The gyroid holds the points (1/4, 1/8, 0) and its like, where it is one of its lines of symmetry; and by inversion
/// the origin.
TEST(Gyroid, walls_are_equally_thick_where_symmetry_says_the_surface_is) {
  const Shape shape = gyroid({.cell_mm = 8, .wall_mm = 0.6});
  for (const Vec3d p : {Vec3d{0, 0, 0}, Vec3d{4, 4, 4}, Vec3d{2, 2, 2}, Vec3d{8, 16, -24}, Vec3d{4, 0, 4}})
    EXPECT_NEAR(shape(p), -0.3, 2e-3) << p.x;
  // sin X cos Y + sin Y cos Z + sin Z cos X is 1 at X = 90 degrees, Y = Z = 0: outside.
  EXPECT_GT(shape({2, 0, 0}), 0);
}

TEST(Gyroid, holds_area_times_thickness_less_what_its_curvature_takes) {
  // Area 3.0915 edge^2 in a cell (Schoen 1970; of the nodal approximation 3.0968); genus 3 in half a cell: chi = -8.
  for (const double t : {0.03, 0.06, 0.1}) {
    const GyroidParams p{.cell_mm = 10, .wall_mm = 10 * t};
    const double expected = 3.0915 * t + 2 * pi * -8 * t * t * t / 12;
    EXPECT_NEAR(density(p) / expected, 1.0, 0.006) << t;
    EXPECT_NEAR(share(gyroid(p), p.cell_mm, 120) / expected, 1.0, 0.006) << t;
  }
}

/// Distance by brute force: to the nearest of many points of the surface, put there by Newton steps from a lattice.
TEST(Gyroid, distance_is_that_to_the_nearest_point_of_the_surface) {
  const double cell = 6, wave = 2 * pi / cell;
  const auto value = [&](Vec3d p) {
    return std::sin(wave * p.x) * std::cos(wave * p.y) + std::sin(wave * p.y) * std::cos(wave * p.z) +
           std::sin(wave * p.z) * std::cos(wave * p.x);
  };
  std::vector<Vec3d> surface;
  const double step = 0.08;
  for (double x = -2.5; x < 2.5; x += step)
    for (double y = -2.5; y < 2.5; y += step)
      for (double z = -2.5; z < 2.5; z += step) {
        Vec3d p{x, y, z};
        if (std::abs(value(p)) > 0.15) continue;
        for (int turn = 0; turn < 4; ++turn) {
          const double e = 1e-4, v = value(p);
          const Vec3d g{(value(p + Vec3d{e, 0, 0}) - v) / e, (value(p + Vec3d{0, e, 0}) - v) / e,
                        (value(p + Vec3d{0, 0, e}) - v) / e};
          p = p - (v / dot(g, g)) * g;
        }
        surface.push_back(p);
      }
  ASSERT_GT(surface.size(), 10000U);
  const double wall = 0.4;
  const Shape shape = gyroid({.cell_mm = cell, .wall_mm = wall});
  Random random(3, "gyroid_test");
  for (int i = 0; i < 200; ++i) {
    const Vec3d p{2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1};
    double nearest = 1e9;
    for (const Vec3d q : surface) nearest = std::min(nearest, norm(p - q));
    const double distance = shape(p) + 0.5 * wall;
    EXPECT_GT(nearest, distance - 0.005);
    EXPECT_LT(nearest, std::hypot(distance, 0.06) + 0.005);  // the points lie that far apart
  }
}

TEST(Gyroid, is_no_steeper_than_it_says_and_a_distance_near_its_walls) {
  const Shape shape = gyroid({.cell_mm = 7, .wall_mm = 0.5});
  Random random(5, "gyroid_test");
  const auto uniform = [&](double size) { return size * (random.uniform() - 0.5); };
  for (int i = 0; i < 20000; ++i) {
    const Vec3d p{uniform(40), uniform(40), uniform(40)};
    const Vec3d d = (0.05 + 0.3 * random.uniform()) * normalized({uniform(1), uniform(1), uniform(1)});
    const double here = shape(p), there = shape(p + d);
    const bool near = std::abs(here) < 0.5 && std::abs(there) < 0.5;
    ASSERT_LE(std::abs(here - there), (near ? 1.05 : shape.lipschitz()) * norm(d));
  }
  testing::expect_bounds_hold(shape, random, 200);
}

TEST(Gyroid, a_wanted_density_is_met) {
  for (const double wanted : {0.1, 0.2, 0.3}) {
    const GyroidParams p{.cell_mm = 9, .density = wanted};
    EXPECT_NEAR(share(gyroid(p), 9, 150) / wanted, 1.0, 0.01);
    EXPECT_FALSE(sized(p).density.has_value());
    EXPECT_NEAR(density(sized(p)) / wanted, 1.0, 0.001);
  }
}

TEST(Gyroid, bad_sizes_are_refused) {
  EXPECT_THROW((void)gyroid({.cell_mm = 3, .wall_mm = 0.8}), Error);
  EXPECT_THROW((void)gyroid({.wall_mm = 0}), Error);
  EXPECT_THROW((void)gyroid({.cell_mm = 10, .density = 0.9}), Error);
  EXPECT_THROW((void)gyroid({.cell_mm = -1, .density = 0.2}), Error);
}

}  // namespace
}  // namespace fibrolite
