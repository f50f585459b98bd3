// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/mend.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr double voxel = 0.2;
const Box3d room{{-13, -13, -13}, {13, 13, 13}};
const Shape block = cuboid({{-8, -8, -8}, {8, 8, 8}});
const Shape lumen = cuboid({{-7, -7, -7}, {7, 7, 7}});

/// A shell of 1 mm about a block with this inside.
struct Case {
  explicit Case(const Shape& inside)
      : whole(unite({subtract(block, lumen), intersect({block, inside})})),
        body(realize(block, room, {.voxel_mm = voxel})),
        tied(tie(realize(whole, body), whole, body)) {}
  [[nodiscard]] Printable checked(const Mended& made, const PrintParams& print) const {
    return printable(made.tied.solid, offset(distance_to(body), -0.5), print, {0, 0, 1}, 1.6);
  }
  Shape whole;
  Solid body;
  Tied tied;
};
const PrintParams print{.wall_mm = 0.8, .gap_mm = 0.6};
MendParams params(bool walls_and_gaps, double drain_mm) {
  return {.print = print, .walls_and_gaps = walls_and_gaps, .drain_mm = drain_mm};
}

TEST(Mend, AThinWallGetsAsThickAsAsked) {
  const Case thin(placed(cuboid({{-20, -20, -0.25}, {20, 20, 0.25}}), frame_along({}, {0.3, 0, 1})));
  const double before = thin.tied.solid.volume_mm3();
  const Mended made = mend(thin.tied, thin.body, params(true, 0));
  EXPECT_EQ(thin.checked(Mended{thin.tied, {}, {}, 0}, print).thin_walls.places, 1);
  EXPECT_EQ(thin.checked(made, print).thin_walls.places, 0);
  // 0.3 mm more over the section of the lumen.
  const double section = 14 * 14 * std::sqrt(1 + 0.09);
  EXPECT_NEAR(made.tied.solid.volume_mm3() - before, 0.3 * section, 0.12 * 0.3 * section);
  EXPECT_EQ(made.tied.left.material.size(), 1U);
  EXPECT_EQ(made.tied.left.cavities.size(), 2U);
  // The function says the same as the grid.
  const Solid again = realize(with_mends(thin.whole, distance_to(thin.body), made), thin.body);
  EXPECT_NEAR(again.volume_mm3(), made.tied.solid.volume_mm3(), 1e-3 * again.volume_mm3());
}

TEST(Mend, ASmallGapIsClosed) {
  const Case split(subtract(everything(), cuboid({{-5, -20, -0.2}, {5, 20, 0.25}})));
  ASSERT_GT(split.checked(Mended{split.tied, {}, {}, 0}, print).small_gaps.places, 0);
  const Mended made = mend(split.tied, split.body, params(true, 0));
  EXPECT_EQ(split.checked(made, print).small_gaps.places, 0);
  EXPECT_NEAR(made.tied.solid.volume_mm3(), 16 * 16 * 16, 0.002 * 4096);
}

TEST(Mend, WhatTheModelMakesThinStays) {
  const Shape fin = unite({block, cuboid({{-0.25, -0.3, 5}, {0.25, 0.3, 12}})});
  const Solid body = realize(fin, room, {.voxel_mm = voxel});
  const Mended made = mend(tie(body, fin, body), body, params(true, 0));
  EXPECT_NEAR(made.tied.solid.volume_mm3(), body.volume_mm3(), 1e-4 * body.volume_mm3());
  EXPECT_GT(printable(made.tied.solid, nothing(), print, {0, 0, 1}, 1.6).thin_walls.places, 0);
}

TEST(Mend, EveryVoidDrainsOrIsFilled) {
  // Four rooms and a bubble of 1 mm in the wall between two of them.
  const Case rooms(
      unite({subtract(unite({cuboid({{-0.8, -20, -20}, {0.8, 20, 20}}), cuboid({{-20, -0.8, -20}, {20, 0.8, 20}})}),
                      sphere({0, 4, 0}, 0.5))}));
  ASSERT_EQ(rooms.tied.left.cavities.size(), 5U);
  std::vector<Mended> results;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(mend(rooms.tied, rooms.body, params(false, 1.5)));
  }
  const Mended& made = results[0];
  EXPECT_EQ(made.voids_filled, 1);
  EXPECT_EQ(made.drains.size(), 4U);
  EXPECT_EQ(made.tied.left.cavities.size(), 0U);
  EXPECT_EQ(made.tied.left.material.size(), 1U);
  EXPECT_EQ(made.tied.solid.volume_mm3(), results[1].tied.solid.volume_mm3());
  for (std::size_t i = 0; i < made.drains.size(); ++i)
    EXPECT_EQ(made.drains[i].place_mm, results[1].drains[i].place_mm);
}

TEST(Mend, NothingToMendNothingChanged) {
  const Case good(sphere({}, 3));
  const Mended made = mend(good.tied, good.body, params(true, 0));
  EXPECT_TRUE(made.thickened.empty());
  EXPECT_TRUE(made.drains.empty());
  EXPECT_EQ(made.tied.solid.share(), good.tied.solid.share());
}

}  // namespace
}  // namespace fibrolite
