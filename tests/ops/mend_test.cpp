// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/mend.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "fibrolite/ops/infill/tcs.h"
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
const PrintParams print{.wall_mm = 0.8, .gap_mm = 0.6, .overhang_deg = 90};  // ceilings may stay
MendParams params(bool faults, double drain_mm) { return {.print = print, .faults = faults, .drain_mm = drain_mm}; }

TEST(Mend, AThinWallGetsAsThickAsAsked) {
  const Case thin(placed(cuboid({{-20, -20, -0.25}, {20, 20, 0.25}}), frame_along({}, {0.3, 0, 1})));
  const double before = thin.tied.solid.volume_mm3();
  const Mended made = mend(thin.tied, thin.body, params(true, 0));
  EXPECT_EQ(thin.checked(Mended{thin.tied}, print).thin_walls.places, 1);
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
  ASSERT_GT(split.checked(Mended{split.tied}, print).small_gaps.places, 0);
  const Mended made = mend(split.tied, split.body, params(true, 0));
  EXPECT_EQ(split.checked(made, print).small_gaps.places, 0);
  EXPECT_NEAR(made.tied.solid.volume_mm3(), 16 * 16 * 16, 0.002 * 4096);
}

/// The ceiling of a room, level and sloping; what bears it is steep enough itself, and one piece with it.
TEST(Mend, ACeilingGetsPillars) {
  for (const double slope : {0.0, 0.5}) {
    const Shape ceiling = half_space({0, 0, slope == 0 ? 20.0 : 2.0}, {-slope, 0, 1});
    const Case chamber(complement(ceiling));
    PrintParams steep = print;
    steep.overhang_deg = 45;
    const auto checked = [&](const Mended& made) { return chamber.checked(made, steep); };
    const PrintFault before = checked(Mended{chamber.tied}).overhangs;
    ASSERT_EQ(before.places, 1);
    EXPECT_NEAR(before.area_mm2, 14 * 14 * std::hypot(1, slope), 14);
    MendParams asked = params(true, 0);
    asked.print = steep;
    asked.node_mm = 1.6;
    std::vector<Mended> results;
    for (const std::size_t threads : {1U, 2U}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      results.push_back(mend(chamber.tied, chamber.body, asked));
    }
    const Mended& made = results[0];
    const Printable after = checked(made);
    EXPECT_EQ(after.overhangs.places, 0) << after.overhangs.area_mm2;
    EXPECT_LT(after.node_overhang_mm2, 0.05 * before.area_mm2);
    EXPECT_EQ(after.thin_walls.places, 0);
    EXPECT_EQ(after.small_gaps.places, 0);
    EXPECT_EQ(made.tied.left.material.size(), 1U);
    EXPECT_EQ(made.tied.left.cavities.size(), 1U);
    EXPECT_EQ(made.tied.solid.volume_mm3(), results[1].tied.solid.volume_mm3());
    // A pillar per cell of 2 mm radius that the ceiling reaches into; heads that widen from the shaft's 0.4 mm to the
    // cell's rim by 45 degrees, all of the slope's rise within a cell higher; the last on shafts of at most 14 mm.
    const double added = made.tied.solid.volume_mm3() - chamber.tied.solid.volume_mm3();
    const auto pillars = static_cast<double>(made.pillars.size());
    EXPECT_LE(pillars, 18 * 18 / (1.5 * std::sqrt(3.0) * 2 * 2));
    const double wide = 2 * (1 + slope) + 2 * voxel, high = wide - 0.4, pi = std::numbers::pi;
    EXPECT_LT(added, pillars * pi * (high / 3 * (0.16 + 0.4 * wide + wide * wide) + 0.16 * 14));
    EXPECT_GT(added, 0.5 * 14 * 14);
    const Solid again = realize(with_mends(chamber.whole, distance_to(chamber.body), made), chamber.body);
    EXPECT_NEAR(again.volume_mm3(), made.tied.solid.volume_mm3(), 1e-3 * again.volume_mm3());
  }
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

/// A sheet of crystal parts its room in two voids; a hole through it left two slivers beside it.
TEST(Mend, AHoleLeavesNothingOnTooThinANeck) {
  const Solid body = realize(block, room, {.voxel_mm = voxel, .inside_vox = 8});
  const Shape sheet = crystal({.form = TcsForm::Sheet, .cell_mm = 5.6, .wall_mm = 0.6, .shift_mm = {2.22, 4.44, 0}});
  const Shape shell = subtract(block, lumen), whole = unite({shell, intersect({block, sheet})});
  MendParams around = params(false, 2);
  around.tie = {.neck_mm = 0.5, .anchor = shell};
  const Tied tied = tie(realize(whole, body), whole, body, around.tie);
  ASSERT_GE(tied.left.cavities.size(), 2U);
  ASSERT_EQ(tied.unreached.size(), 0U);
  const Mended made = mend(tied, body, around);
  EXPECT_EQ(made.tied.left.cavities.size(), 0U);
  EXPECT_EQ(made.tied.left.material.size(), 1U);
  EXPECT_EQ(made.tied.unreached.size(), 0U);
  ASSERT_GT(made.shaved.size(), 0U);
  const Solid again = realize(with_mends(whole, distance_to(body), made), body);
  EXPECT_NEAR(again.volume_mm3(), made.tied.solid.volume_mm3(), 1e-3 * again.volume_mm3());
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
