// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fibrolite/frame.h"
#include "fibrolite/random.h"

namespace fibrolite {
namespace {

Vec3d point(Random& random, double side) {
  return {side * (random.uniform() - 0.5), side * (random.uniform() - 0.5), side * (random.uniform() - 0.5)};
}

TEST(Primitives, distances_at_known_points) {
  EXPECT_NEAR(sphere({1, 0, 0}, 2)({4, 0, 0}), 1, 1e-6);
  EXPECT_NEAR(capsule({0, 0, 0}, {4, 0, 0}, 1)({2, 3, 0}), 2, 1e-6);
  EXPECT_NEAR(capsule({0, 0, 0}, {4, 0, 0}, 1)({7, 4, 0}), 4, 1e-6);
  EXPECT_NEAR(cuboid({{0, 0, 0}, {2, 2, 2}})({5, 6, 1}), 5, 1e-6);
  EXPECT_NEAR(cuboid({{0, 0, 0}, {2, 4, 6}})({0.5, 2, 3}), -0.5, 1e-6);
  EXPECT_NEAR(cylinder({0, 0, 0}, {0, 0, 4}, 1)({4, 0, 8}), 5, 1e-6);
  EXPECT_NEAR(cylinder({0, 0, 0}, {0, 0, 4}, 1)({0, 0, 1.5}), -1, 1e-6);
  EXPECT_NEAR(torus({}, 5, 1)({5, 0, 3}), 2, 1e-6);
  EXPECT_NEAR(half_space({0, 0, 1}, {0, 0, 2})({9, 9, 4}), 3, 1e-6);
  EXPECT_NEAR(round_cone({0, 0, 0}, 2, {10, 0, 0}, 2)({5, 5, 0}), 3, 1e-6);
  EXPECT_NEAR(round_cone({0, 0, 0}, 3, {10, 0, 0}, 1)({-5, 0, 0}), 2, 1e-6);
  EXPECT_NEAR(round_cone({0, 0, 0}, 3, {10, 0, 0}, 1)({12, 0, 0}), 1, 1e-6);
}

TEST(Primitives, a_round_cone_is_the_union_of_the_spheres_between_its_ends) {
  const Vec3d a{1, 2, 3}, b{7, -1, 2};
  const Shape cone = round_cone(a, 2.5, b, 0.7);
  Random random(3, "cone");
  for (int i = 0; i < 300; ++i) {
    const Vec3d p = point(random, 20);
    double best = 1e9;
    for (int k = 0; k <= 4000; ++k) {
      const double t = k / 4000.0;
      best = std::min(best, norm(p - a - t * (b - a)) - (2.5 + t * (0.7 - 2.5)));
    }
    if (best > 0) {
      ASSERT_NEAR(cone(p), best, 1e-3);
    }
  }
}

/// The nearest of many points on its two faces and its flank, and the sign by what it is made of: discs.
TEST(Primitives, a_frustum_is_as_near_as_its_nearest_point) {
  const Vec3d a{1, 2, 3}, b{4, -1, 5};
  const Frame frame = frame_along(a, b - a);
  const double length = norm(b - a);
  for (const auto& [radius_a, radius_b] : {std::pair(0.4, 3.0), std::pair(2.0, 2.0), std::pair(3.0, 0.0)}) {
    const Shape cone = frusta({{a, radius_a, b, radius_b}});
    Random random(4, "frustum");
    for (int i = 0; i < 200; ++i) {
      const Vec3d p = a + point(random, 10), local = frame.to_local(p);
      const double out = std::hypot(local.x, local.y);
      double best = 1e9;
      for (int k = 0; k <= 4000; ++k) {
        const double t = k / 4000.0, radius = radius_a + t * (radius_b - radius_a);
        best = std::min({best, std::hypot(out - radius, local.z - t * length), std::hypot(out - t * radius_a, local.z),
                         std::hypot(out - t * radius_b, local.z - length)});
      }
      const double t = local.z / length;
      const bool inside = t > 0 && t < 1 && out < radius_a + t * (radius_b - radius_a);
      ASSERT_NEAR(cone(p), inside ? -best : best, 2e-3);
    }
  }
}

TEST(Csg, is_min_max_and_minus) {
  const Shape a = sphere({0, 0, 0}, 3), b = cuboid({{0, 0, 0}, {4, 4, 4}});
  Random random(5, "csg");
  for (int i = 0; i < 500; ++i) {
    const Vec3d p = point(random, 12);
    EXPECT_EQ(unite({a, b})(p), std::min(a(p), b(p)));
    EXPECT_EQ(intersect({a, b})(p), std::max(a(p), b(p)));
    EXPECT_EQ(subtract(a, b)(p), std::max(a(p), -b(p)));
    EXPECT_EQ(complement(a)(p), -a(p));
    EXPECT_NEAR(offset(a, 0.5)(p), a(p) - 0.5F, 1e-6);
    const float smooth = smooth_unite(a, b, 1)(p);
    EXPECT_LE(smooth, std::min(a(p), b(p)));
    EXPECT_GE(smooth, std::min(a(p), b(p)) - 0.25F - 1e-6F);
  }
  EXPECT_GT(unite({})({0, 0, 0}), 1e5F);
  EXPECT_LT(intersect({})({0, 0, 0}), -1e5F);
}

TEST(Csg, a_block_gives_the_same_values_as_its_points) {
  // Members that cannot matter in a block are skipped; the values must not show it.
  std::vector<Shape> many;
  Random random(9, "many");
  for (int i = 0; i < 40; ++i) many.push_back(sphere(point(random, 20), 0.5 + random.uniform()));
  const Shape shape = intersect({unite(many), complement(sphere({0, 0, 0}, 4)), sphere({0, 0, 0}, 9)});
  std::vector<Vec3d> points;
  for (int i = 0; i < 512; ++i) points.push_back(point(random, 3) + Vec3d{5, 5, 0});
  std::vector<float> values(points.size());
  shape.evaluate(points, values);
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(values[i], shape(points[i]));
}

TEST(Bounds, hold_for_every_point_of_the_box) {
  const Frame frame = frame_along({1, 2, 0}, {1, 1, 1});
  const Shape shape = smooth_unite(placed(torus({}, 5, 1), frame),
                                   subtract(capsule({0, 0, 0}, {3, 4, 5}, 2), cuboid({{0, 0, 0}, {2, 2, 2}})), 1.5);
  Random random(11, "bounds");
  for (int i = 0; i < 200; ++i) {
    Box3d box;
    box.include(point(random, 20));
    box.include(point(random, 20));
    const Interval bound = shape.bound(box);
    for (int k = 0; k < 20; ++k) {
      const Vec3d s = box.size();
      const float v = shape(box.min + Vec3d{s.x * random.uniform(), s.y * random.uniform(), s.z * random.uniform()});
      ASSERT_GE(v, bound.lo - 1e-4F);
      ASSERT_LE(v, bound.hi + 1e-4F);
    }
  }
}

TEST(Capsules, near_ones_are_exact_and_far_ones_never_too_far) {
  std::vector<Capsule> list;
  std::vector<Shape> shapes;
  Random random(13, "capsules");
  for (int i = 0; i < 60; ++i) {
    const Vec3d a = point(random, 30);
    list.push_back({a, a + point(random, 8), 0.3 + 0.5 * random.uniform()});
    shapes.push_back(capsule(list.back().a, list.back().b, list.back().radius_mm));
  }
  const Shape fast = capsules(list), slow = unite(shapes);
  for (int i = 0; i < 3000; ++i) {
    const Vec3d p = point(random, 60);
    const float truth = slow(p), value = fast(p);
    if (truth < 2) {
      ASSERT_NEAR(value, truth, 1e-5);
    }
    ASSERT_LE(value, truth + 1e-5F);
    ASSERT_EQ(value < 0, truth < 0);
  }
}

}  // namespace
}  // namespace fibrolite
