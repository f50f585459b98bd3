// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/diameter.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "models.h"

namespace fibrolite {
namespace {

Mesh surface_of(const Shape& shape, const Box3d& box, double voxel_mm) {
  return surface(realize(shape, box, Grid{voxel_mm, 3}));
}

Vec3d centroid(const Mesh& mesh, std::size_t face) {
  const auto& t = mesh.triangles[face];
  return (to_double(mesh.vertices[t[0]]) + to_double(mesh.vertices[t[1]]) + to_double(mesh.vertices[t[2]])) / 3;
}

double median_where(const Mesh& mesh, const std::vector<double>& value, bool (*where)(Vec3d)) {
  std::vector<double> found;
  for (std::size_t f = 0; f < value.size(); ++f)
    if (where(centroid(mesh, f))) found.push_back(value[f]);
  EXPECT_FALSE(found.empty());
  std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2), found.end());
  return found[found.size() / 2];
}

// A chord of a sphere at angle a from the normal is 2 r cos a. Rays lie at tan a = rho tan 60, rho even in [0, 1): the
// mean is 2 r asinh(sqrt 3) / sqrt 3 = 0.760 * 2 r. The rays beyond 1.5 median deviations, both the longest and the
// shortest, do not count, so the mean of the rest lies between the chords of the quartiles: 2 r / sqrt(1 + 3 / 16) =
// 0.918 and 2 r / sqrt(1 + 27 / 16) = 0.610.
TEST(Diameter, OfABallIsTheSameEverywhereAndBetweenTheChordsOfTheCone) {
  const Mesh ball = surface_of(sphere({1, 2, 3}, 10), Box3d{{-10, -9, -8}, {12, 13, 14}}, 0.8);
  const DiameterField field = diameter(ball);
  const auto [least, most] = std::minmax_element(field.diameter_mm.begin(), field.diameter_mm.end());
  EXPECT_GT(*least, 0.61 * 20);
  EXPECT_LT(*most, 0.918 * 20);
  EXPECT_LT(*most / *least, 1.06);
}

TEST(Diameter, ABarTwiceAsThickHasTwiceTheDiameter) {
  const Shape two = unite({cylinder({-60, 0, 0}, {0, 0, 0}, 4), cylinder({0, 0, 0}, {60, 0, 0}, 8)});
  const Mesh mesh = surface_of(two, Box3d{{-62, -10, -10}, {62, 10, 10}}, 0.8);
  const DiameterField field = diameter(mesh);
  const double thin = median_where(mesh, field.diameter_mm, [](Vec3d p) { return p.x > -45 && p.x < -15; });
  const double thick = median_where(mesh, field.diameter_mm, [](Vec3d p) { return p.x > 15 && p.x < 45; });
  EXPECT_NEAR(thick / thin, 2, 0.06);
  EXPECT_NEAR(thin, 8, 0.8);
}

// Between two plates t apart a ray at angle a is t / cos a long: t at least, 2 t at 60 degrees.
TEST(Diameter, OfAPlateIsItsThicknessOnItsFaces) {
  const Mesh mesh = surface_of(cuboid({{-20, -20, -2}, {20, 20, 2}}), Box3d{{-22, -22, -4}, {22, 22, 4}}, 0.7);
  const DiameterField field = diameter(mesh);
  const double middle = median_where(mesh, field.diameter_mm, [](Vec3d p) { return std::hypot(p.x, p.y) < 12; });
  EXPECT_GT(middle, 4);
  EXPECT_LT(middle, 1.5 * 4);
}

TEST(Diameter, AFewSliversDoNotMoveTheScale) {
  const Shape shape = unite({sphere({}, 10), capsule({}, {30, 0, 0}, 3)});
  Mesh mesh = surface_of(shape, Box3d{{-12, -12, -12}, {35, 12, 12}}, 0.6);
  const DiameterField clean = diameter(mesh);
  ASSERT_GT(mesh.triangles.size(), 4000U);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Vec3f corner : {Vec3f{20, 0, 20}, Vec3f{20.1F, 0, 20}, Vec3f{20, 0.1F, 20}, Vec3f{20, 0, 20.1F}})
    mesh.vertices.push_back(corner);
  for (const Mesh::Triangle t : {Mesh::Triangle{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}})
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  const DiameterField with_sliver = diameter(mesh);
  EXPECT_LT(with_sliver.diameter_mm.back(), 0.2);
  EXPECT_EQ(with_sliver.normalized.back(), 0);
  for (std::size_t f = 0; f < clean.normalized.size(); f += 7)
    EXPECT_NEAR(with_sliver.normalized[f], clean.normalized[f], 0.01);
}

TEST(Diameter, NormalisesByTheFormulaOfThePaper) {
  const Shape shape = unite({sphere({}, 10), capsule({}, {30, 0, 0}, 3)});
  const Mesh mesh = surface_of(shape, Box3d{{-12, -12, -12}, {35, 12, 12}}, 0.9);
  for (const double alpha : {4.0, 1.0}) {
    const DiameterField field = diameter(mesh, {.alpha = alpha});
    // One face in a thousand is left out at either end.
    std::vector<double> sorted = field.diameter_mm;
    std::sort(sorted.begin(), sorted.end());
    const double least = sorted[sorted.size() / 1000], most = sorted[sorted.size() - 1 - sorted.size() / 1000];
    for (std::size_t f = 0; f < field.normalized.size(); f += 7) {
      const double linear = std::clamp((field.diameter_mm[f] - least) / (most - least), 0.0, 1.0);
      EXPECT_NEAR(field.normalized[f], std::log(linear * alpha + 1) / std::log(alpha + 1), 1e-12);
    }
  }
}

TEST(Diameter, OfATurnedModelIsTheSame) {
  const Mesh mesh =
      surface_of(unite({sphere({}, 10), capsule({}, {30, 0, 0}, 3)}), Box3d{{-12, -12, -12}, {35, 12, 12}}, 0.9);
  const DiameterField field = diameter(mesh);
  const DiameterField other = diameter(testing::turned(mesh, 1, 1));
  double worst = 0;
  for (std::size_t f = 0; f < field.diameter_mm.size(); ++f)
    worst = std::max(worst, std::abs(field.diameter_mm[f] - other.diameter_mm[f]));
  EXPECT_LT(worst, 1e-2) << "the rays turn with the triangle";
}

TEST(Diameter, SameBitsOnOneAndTwoThreads) {
  const Mesh mesh =
      surface_of(unite({sphere({}, 10), capsule({}, {30, 0, 0}, 3)}), Box3d{{-12, -12, -12}, {35, 12, 12}}, 1.2);
  std::vector<DiameterField> fields;
  for (const std::size_t threads : {1, 2}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    fields.push_back(diameter(mesh));
  }
  EXPECT_EQ(fields[0].diameter_mm, fields[1].diameter_mm);
  EXPECT_EQ(fields[0].normalized, fields[1].normalized);
}

TEST(Diameter, RefusesAnOpenAnEmptyAndAnInsideOutSurface) {
  const Mesh ball = testing::icosphere(5, 2);
  for (const Mesh& bad : {Mesh{}, testing::without_triangle(ball, 7), testing::flipped(ball)}) {
    try {
      (void)diameter(bad);
      FAIL() << "a bad surface was measured";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::BadInput) << error.what();
    }
  }
  try {
    (void)diameter(ball, {.rays = 0});
    FAIL() << "no rays";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::BadRecipe) << error.what();
  }
}

TEST(Proxy, HasAboutTheTrianglesAskedForAndTheModelsVolume) {
  const Mesh ball = testing::icosphere(20, 5);
  const Proxy proxy = make_proxy(ball, {.triangles = 8000});
  EXPECT_GT(proxy.surface.triangles.size(), 6500U);
  EXPECT_LT(proxy.surface.triangles.size(), 9500U);
  EXPECT_NEAR(signed_volume(proxy.surface), signed_volume(ball), 0.01 * signed_volume(ball));
}

TEST(Proxy, VoxelFollowsTheAreaNotTheTriangulation) {
  const Proxy coarse = make_proxy(testing::tube(10, 40, 48), {.triangles = 4000});
  const Proxy turned = make_proxy(testing::turned(testing::tube(10, 40, 48), 0, 1), {.triangles = 4000});
  EXPECT_NEAR(coarse.solid.grid().voxel_mm, turned.solid.grid().voxel_mm, 1e-4 * coarse.solid.grid().voxel_mm);
  EXPECT_NEAR(coarse.solid.volume_mm3(), turned.solid.volume_mm3(), 1e-3 * coarse.solid.volume_mm3());
}

// At 1000 triangles the ball alone asks for a voxel of about 4 mm, in which a rod of 2.4 mm would be lost.
TEST(Proxy, ThinLimbsDoNotVanish) {
  const Mesh mesh = testing::joined(testing::icosphere(20, 4), testing::tube(1.2, 80, 24, {0, 0, 19}));
  const Proxy proxy = make_proxy(mesh, {.triangles = 1000});
  EXPECT_GT(proxy.solid.bounds_mm().max.z, 96);
  EXPECT_LT(proxy.surface.triangles.size(), 6000U);
}

TEST(Proxy, RefusesAnEmptyModelAndASenselessSize) {
  EXPECT_THROW((void)make_proxy(Mesh{}), Error);
  EXPECT_THROW((void)make_proxy(testing::cube(10), {.triangles = 10}), Error);
}

}  // namespace
}  // namespace fibrolite
