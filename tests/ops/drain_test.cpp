// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/drain.h"

#include <gtest/gtest.h>

#include "fibrolite/error.h"
#include "fibrolite/pieces.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

Solid make(const Shape& shape) { return realize(shape, Box3d{{-14, -14, -14}, {14, 14, 14}}, {.voxel_mm = 0.25}); }
Pieces drilled(const Solid& solid, const std::vector<Drain>& holes) {
  return pieces(make(subtract(distance_to(solid), capsules(shapes(holes)))));
}
void expect_drained(const Solid& solid, const std::vector<Drain>& holes) {
  const Pieces left = drilled(solid, holes);
  EXPECT_EQ(left.cavities.size(), 0U);
  EXPECT_EQ(left.material.size(), 1U);
}

TEST(Drain, AHollowBallDrainsAtItsLowestPoint) {
  const Solid solid = make(subtract(sphere({1, 2, 0}, 8), sphere({1, 2, 0}, 7)));
  for (const Vec3d up : {Vec3d{0, 0, 1}, Vec3d{-2, 0, 0}, Vec3d{0, 3, 4}}) {
    const auto holes = drains(solid, {.hole_mm = 1.5, .up = up});
    ASSERT_EQ(holes.size(), 1U);
    EXPECT_TRUE(holes[0].outward);
    EXPECT_LT(norm(holes[0].place_mm - (Vec3d{1, 2, 0} - 8 * normalized(up))), 1.2);
    EXPECT_GT(dot(holes[0].direction, -normalized(up)), 0.98);
    EXPECT_NEAR(holes[0].length_mm, 1, 0.1);
    EXPECT_EQ(holes[0].shape.radius_mm, 0.75);
    expect_drained(solid, holes);
  }
}

TEST(Drain, NothingClosedNoHole) {
  EXPECT_TRUE(drains(make(sphere({}, 5))).empty());
  EXPECT_TRUE(drains(make(subtract(sphere({}, 5), cylinder({-9, 0, 0}, {9, 0, 0}, 2)))).empty());
  EXPECT_TRUE(drains(Solid()).empty());
}

TEST(Drain, RoomsThatShareWallsNeedOneHoleToTheOutside) {
  // Eight rooms in a block: seven holes between them, one down and out.
  std::vector<Shape> rooms;
  for (const double x : {-5.5, 0.5}) {
    for (const double y : {-5.5, 0.5}) {
      for (const double z : {-5.5, 0.5}) rooms.push_back(cuboid({{x, y, z}, {x + 5, y + 5, z + 5}}));
    }
  }
  const Solid solid = make(subtract(cuboid({{-6.5, -6.5, -6.5}, {6.5, 6.5, 6.5}}), unite(rooms)));
  ASSERT_EQ(pieces(solid).cavities.size(), 8U);
  const auto holes = drains(solid, {.hole_mm = 1.5});
  EXPECT_EQ(holes.size(), 8U);
  int outward = 0;
  for (const Drain& hole : holes) {
    if (!hole.outward) continue;
    ++outward;
    EXPECT_NEAR(hole.place_mm.z, -6.5, 0.2);
    EXPECT_LT(hole.direction.z, -0.98);
  }
  EXPECT_EQ(outward, 1);
  expect_drained(solid, holes);
}

TEST(Drain, BehindAThickWallItGoesStraightDown) {
  const Solid solid = make(subtract(cuboid({{-10, -10, -10}, {10, 10, 10}}), sphere({2, 1, 2}, 3)));
  const auto holes = drains(solid, {.hole_mm = 1, .reach_mm = 2});
  ASSERT_EQ(holes.size(), 1U);
  EXPECT_NEAR(holes[0].place_mm.z, -10, 0.5);
  EXPECT_EQ(holes[0].direction, (Vec3d{0, 0, -1}));
  expect_drained(solid, holes);
}

TEST(Drain, TheFlatPlaceIsTaken) {
  // A trough with a round bottom and a foot with a flat one, equally low.
  const Shape outside = unite({cylinder({-6, -9, -4}, {-6, 9, -4}, 4), cuboid({{-6, -8, -8}, {10, 8, -2}})});
  const Solid solid = make(subtract(outside, offset(outside, -1)));
  const auto holes = drains(solid, {.hole_mm = 3});
  ASSERT_EQ(holes.size(), 1U);
  EXPECT_GT(holes[0].place_mm.x, -5.5);
  EXPECT_NEAR(holes[0].place_mm.z, -8, 0.1);
  expect_drained(solid, holes);
}

TEST(Drain, RefusesAHoleTheGridCannotShow) {
  const Solid solid = make(sphere({}, 5));
  EXPECT_THROW(static_cast<void>(drains(solid, {.hole_mm = 0.3})), Error);
  EXPECT_THROW(static_cast<void>(drains(solid, {.reach_mm = 0})), Error);
}

}  // namespace
}  // namespace fibrolite
