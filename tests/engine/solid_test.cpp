// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/vdb.h"

namespace fibrolite {
namespace {

constexpr Box3d box{{-12, -12, -12}, {12, 12, 12}};

TEST(Solid, an_empty_one_has_no_volume) {
  const Solid solid;
  EXPECT_TRUE(solid.empty());
  EXPECT_EQ(solid.volume_mm3(), 0);
  EXPECT_TRUE(solid.bounds_mm().empty());
}

TEST(Solid, bounds_are_the_inside_samples) {
  const Solid solid = realize(cuboid({{-3.1, -4.1, -5.1}, {6.1, 7.1, 8.1}}), box, {.voxel_mm = 0.5});
  EXPECT_EQ(solid.bounds_mm().min, (Vec3d{-3, -4, -5}));
  EXPECT_EQ(solid.bounds_mm().max, (Vec3d{6, 7, 8}));
}

class StickVolume : public ::testing::TestWithParam<double> {};
TEST_P(StickVolume, is_within_a_percent_from_three_voxels_up) {
  const double radius = GetParam();
  for (const Vec3d to : {Vec3d{20, 0, 0}, Vec3d{12, 13, 0}, Vec3d{11, 10, 12}}) {
    const Vec3d from = Vec3d{0.13, 0.37, 0.21} - 0.5 * to;
    const double truth = std::numbers::pi * radius * radius * (norm(to) + 4.0 / 3 * radius);
    const Solid solid =
        realize(capsule(from, from + to, radius), Box3d{{-20, -20, -20}, {20, 20, 20}}, {.voxel_mm = 1});
    EXPECT_NEAR(solid.volume_mm3() / truth, 1, 0.01) << radius;
  }
}
INSTANTIATE_TEST_SUITE_P(Radii, StickVolume, ::testing::Values(1.5, 2.0, 3.0, 5.0));

TEST(Solid, a_sample_is_the_distance_there) {
  const Solid solid = realize(sphere({0, 0, 0}, 8), box, {.voxel_mm = 0.25});
  EXPECT_NEAR(solid.at({33, 0, 0}), 0.25, 1e-6);
  EXPECT_NEAR(solid.at({0, -31, 0}), -0.25, 1e-6);
  EXPECT_EQ(solid.at({0, 0, 0}), -0.75F);  // the band
  EXPECT_EQ(solid.at({1000, 0, 0}), 0.75F);
}

TEST(SolidDistance, agrees_with_its_shape_between_samples) {
  const Shape truth = sphere({0, 0, 0}, 8);
  const Shape shape = distance_to(realize(truth, box, {.voxel_mm = 0.25}));
  Random random(4, "solid");
  for (int i = 0; i < 1000; ++i) {
    const Vec3d p{24 * (random.uniform() - 0.5), 24 * (random.uniform() - 0.5), 24 * (random.uniform() - 0.5)};
    const float d = truth(p);
    if (std::abs(d) < 0.4F) {
      ASSERT_NEAR(shape(p), d, 0.01);
    } else {
      ASSERT_EQ(shape(p) < 0, d < 0);
    }
  }
}

TEST(SolidDistance, bound_holds_on_blocks_and_on_large_boxes) {
  const Solid solid = realize(torus({}, 7, 2), box, {.voxel_mm = 0.25});
  const Shape shape = distance_to(solid);
  Random random(6, "bound");
  for (int i = 0; i < 200; ++i) {
    const double side = i % 2 == 0 ? 1.75 : 9;
    const Vec3d low{24 * (random.uniform() - 0.5), 24 * (random.uniform() - 0.5), 24 * (random.uniform() - 0.5)};
    const Box3d b{low, low + Vec3d{side, side, side}};
    const Interval bound = shape.bound(b);
    for (int k = 0; k < 20; ++k) {
      const float v = shape(low + side * Vec3d{random.uniform(), random.uniform(), random.uniform()});
      ASSERT_GE(v, bound.lo - 1e-5F);
      ASSERT_LE(v, bound.hi + 1e-5F);
    }
  }
}

TEST(Vdb, a_solid_crosses_the_bridge_and_back) {
  const Solid solid = realize(sphere({0, 0, 0}, 8), box, {.voxel_mm = 0.5});
  const auto grid = to_vdb(solid);
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
  const Solid back = from_vdb(grid);
  EXPECT_EQ(back.grid(), solid.grid());
  EXPECT_EQ(back.volume_mm3(), solid.volume_mm3());
  auto moved = grid->deepCopy();
  moved->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  moved->transform().postTranslate(openvdb::Vec3d(0.1, 0, 0));
  EXPECT_THROW((void)from_vdb(moved), Error);
}

}  // namespace
}  // namespace fibrolite
