// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/printable.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/ops/recipe.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "models.h"
#include "print_limits.h"

namespace fibrolite {
namespace {

constexpr double voxel = 0.2, pi = std::numbers::pi;
constexpr Vec3d z{0, 0, 1};
const PrintParams limits{.wall_mm = 0.8, .gap_mm = 0.6, .overhang_deg = 45};

Solid make(const Shape& shape) { return realize(shape, Box3d{{-12, -12, -12}, {12, 12, 12}}, {.voxel_mm = voxel}); }
Printable check(const Shape& shape, const PrintParams& params = limits) {
  return printable(make(shape), everything(), params, z, 1.6);
}
/// A plate of this thickness, turned so that no face lies along the lattice.
Shape plate(double mm) {
  return placed(cuboid({{-5, -4, -0.5 * mm}, {5, 4, 0.5 * mm}}), frame_along({0.03, 0.05, 0.07}, {0.3, 0.5, 0.8}));
}

TEST(Printable, APlateIsThinBelowTheLimitAndNotAbove) {
  EXPECT_EQ(check(plate(0.85)).thin_walls.places, 0);
  EXPECT_EQ(check(plate(0.8)).thin_walls.places, 0);
  for (const double mm : {0.7, 0.5, 0.3}) {
    const PrintFault thin = check(plate(mm)).thin_walls;
    ASSERT_EQ(thin.places, 1) << mm;
    EXPECT_NEAR(thin.area_mm2, 2 * 80, 0.06 * 160) << mm;
    EXPECT_NEAR(thin.volume_mm3, 80 * mm, 0.1 * 80 * mm) << mm;
    EXPECT_NEAR(thin.least_mm, mm, 0.3 * voxel) << mm;
  }
}

TEST(Printable, SticksAreMeasuredAcross) {
  EXPECT_EQ(check(capsule({-5, -4, -3}, {5, 3, 4}, 0.4)).thin_walls.places, 0);
  const PrintFault thin = check(capsule({-5, -4, -3}, {5, 3, 4}, 0.3)).thin_walls;
  EXPECT_EQ(thin.places, 1);
  EXPECT_NEAR(thin.least_mm, 0.6, 0.3 * voxel);
  EXPECT_NEAR(thin.area_mm2, pi * 0.6 * norm(Vec3d{10, 7, 7}), 0.1 * pi * 0.6 * 14);
}

TEST(Printable, CornersAreForgiven) {
  EXPECT_EQ(check(placed(cuboid({{-4, -4, -4}, {4, 4, 4}}), frame_along({}, {0.2, 0.4, 0.9}))).thin_walls.places, 0);
  // Wedges of 40 and 20 degrees: the second is thin where it is less than the limit.
  const auto wedge = [](double degrees) {
    const double half = degrees * pi / 360;
    return intersect({half_space({}, {-std::sin(half), 0, std::cos(half)}),
                      half_space({}, {-std::sin(half), 0, -std::cos(half)}), cuboid({{-1, -5, -6}, {6, 5, 6}})});
  };
  EXPECT_EQ(check(wedge(40)).thin_walls.places, 0);
  const PrintFault thin = check(wedge(20)).thin_walls;
  EXPECT_EQ(thin.places, 1);  // both faces, joined at the edge
  // Along a face, across to the other one; where the edge is thinner than a voxel the grid may not show it.
  const double across = std::tan(20 * pi / 180), reach = (0.8 - 0.25 * voxel) / across;
  EXPECT_LT(thin.area_mm2, 1.03 * 2 * reach * 10);
  EXPECT_GT(thin.area_mm2, 2 * (reach - voxel / across) * 10);
}

TEST(Printable, ASlotIsSmallBelowTheLimit) {
  const auto slotted = [](double mm) {
    return subtract(cuboid({{-6, -5, -4}, {6, 5, 4}}),
                    cuboid({{-4.03, -7, -0.5 * mm + 0.05}, {4.03, 7, 0.5 * mm + 0.05}}));
  };
  EXPECT_EQ(check(slotted(0.62)).small_gaps.places, 0);
  const PrintFault small = check(slotted(0.5)).small_gaps;
  EXPECT_EQ(small.places, 1);
  EXPECT_NEAR(small.least_mm, 0.5, 0.3 * voxel);
  EXPECT_NEAR(small.volume_mm3, 8.06 * 10 * 0.5, 0.06 * 40);
  EXPECT_EQ(check(slotted(0.5)).thin_walls.places, 0);
}

TEST(Printable, GapsAndOverhangsCountInTheLumenOnly) {
  const Shape forked = subtract(cuboid({{-6, -5, -4}, {6, 5, 4}}), cuboid({{-4, -7, -0.2}, {4, 7, 0.2}}));
  const Printable found = printable(make(forked), half_space({0, 0, 8}, {0, 0, -1}), limits, z, 1.6);
  EXPECT_EQ(found.small_gaps.places, 0);
  EXPECT_EQ(found.overhangs.places, 0);
  EXPECT_EQ(found.lumen_mm2, 0);
}

TEST(Printable, ACeilingOverhangsWithItsArea) {
  const Shape room = subtract(cuboid({{-8, -8, -8}, {8, 8, 8}}), cuboid({{-5.1, -4.1, -3}, {5.1, 4.1, 3.07}}));
  const Shape lumen = cuboid({{-7, -7, -7}, {7, 7, 7}});
  const Printable found = printable(make(room), lumen, limits, z, 1.6);
  ASSERT_EQ(found.overhangs.places, 1);
  EXPECT_NEAR(found.overhangs.area_mm2, 10.2 * 8.2, 0.03 * 83.6);
  EXPECT_NEAR(found.overhangs.worst[0].mm, std::hypot(10.2, 8.2), 0.6);
  EXPECT_NEAR(norm(found.overhangs.worst[0].at_mm - Vec3d{0, 0, 3.07}), 0, 0.1);
  EXPECT_NEAR(found.lumen_mm2, 2 * (10.2 * 8.2 + 6.07 * (10.2 + 8.2)), 0.03 * 390);
  // Turned upside down the floor is the ceiling.
  EXPECT_NEAR(printable(make(room), lumen, limits, {0, 0, -2}, 1.6).overhangs.worst[0].at_mm.z, -3, 0.1);
}

TEST(Printable, ASlopeIsSteepBeyondTheLimit) {
  // The underside of a slab that leans by this much from upright.
  const auto leaning = [](double degrees) {
    const double a = degrees * pi / 180;
    const Frame frame{{}, {0, 1, 0}, {std::sin(a), 0, std::cos(a)}, {std::cos(a), 0, -std::sin(a)}};
    return placed(cuboid({{-5, -6, -1.5}, {5, 6, 1.5}}), frame);
  };
  const auto faces = [&](double degrees) { return check(leaning(degrees)).overhangs; };
  // The end face at the bottom leans by 90 - degrees. The edge between them looks straight down.
  EXPECT_NEAR(faces(45).area_mm2, 0, 4);
  EXPECT_NEAR(faces(60).area_mm2, 120, 0.04 * 120);
  EXPECT_NEAR(faces(20).area_mm2, 30, 3);
  EXPECT_NEAR(check(leaning(60), {.wall_mm = 0.8, .gap_mm = 0.6, .overhang_deg = 60}).overhangs.area_mm2, 0, 4);
}

TEST(Printable, TheUndersideOfABallIsANodeUpToItsSize) {
  const Printable small = check(sphere({0.03, 0.04, 0.05}, 1)), large = check(sphere({0.03, 0.04, 0.05}, 4));
  EXPECT_EQ(small.overhangs.places, 0);
  const auto cap = [](double r) { return 2 * pi * r * r * (1 - std::sin(50 * pi / 180)); };
  EXPECT_NEAR(small.node_overhang_mm2, cap(1), 0.1 * cap(1));
  ASSERT_EQ(large.overhangs.places, 1);
  EXPECT_NEAR(large.overhangs.area_mm2, cap(4), 0.05 * cap(4));
}

/// The crystal's own faces, in a ball of 10 mm with a shell about it.
Printable crystal(const Recipe& recipe) {
  const Parts body = whole_body(testing::icosphere(12, 3), Kind::Bulk);
  const Shape ball = sphere({}, 11.5);
  const Shape whole =
      intersect({ball, unite({complement(sphere({}, 10.5)), generate(body.parts[0], recipe.tcs).shape})});
  return printable(make(whole), sphere({}, 10), recipe.print, z, recipe.tcs.ball_mm);
}
TEST(Printable, TheCrystalOfThePresetFdmIsSteepAtNodesOnly) {
  const Printable flat = crystal(preset("default")), stretched = crystal(preset("fdm"));
  EXPECT_GT(flat.overhangs.area_mm2, 0.08 * flat.lumen_mm2);
  EXPECT_EQ(stretched.overhangs.places, 0) << stretched.overhangs.area_mm2 / stretched.lumen_mm2;
  EXPECT_GT(stretched.node_overhang_mm2, 0);
  for (const Printable& p : {flat, stretched}) {
    EXPECT_EQ(p.thin_walls.places, 0);
    EXPECT_EQ(p.small_gaps.places, 0);
  }
}

TEST(Printable, SameBitsOnOneAndTwoThreads) {
  const Solid solid = make(unite({plate(0.5), sphere({3, 3, 3}, 3)}));
  std::vector<Printable> results;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(printable(solid, everything(), limits, z, 1.6));
  }
  EXPECT_EQ(results[0].thin_walls.area_mm2, results[1].thin_walls.area_mm2);
  EXPECT_EQ(results[0].thin_walls.worst[0].at_mm, results[1].thin_walls.worst[0].at_mm);
  EXPECT_EQ(results[0].overhangs.area_mm2, results[1].overhangs.area_mm2);
  EXPECT_EQ(results[0].lumen_mm2, results[1].lumen_mm2);
}

void expect_same(const PrintFault& a, const PrintFault& b) {
  EXPECT_EQ(a.places, b.places);
  EXPECT_EQ(a.area_mm2, b.area_mm2);
  EXPECT_EQ(a.volume_mm3, b.volume_mm3);
  EXPECT_EQ(a.least_mm, b.least_mm);
  ASSERT_EQ(a.worst.size(), b.worst.size());
  for (std::size_t i = 0; i < a.worst.size(); ++i) {
    EXPECT_EQ(a.worst[i].at_mm, b.worst[i].at_mm);
    EXPECT_EQ(a.worst[i].mm, b.worst[i].mm);
    EXPECT_EQ(a.worst[i].area_mm2, b.worst[i].area_mm2);
  }
}

/// Thin plates and slots, slanted and along the ranges, and a ceiling: in ranges thinner and thicker than a wall,
/// scanned in whatever order, along each axis.
TEST(Printable, the_same_in_ranges) {
  const Shape slots = unite({placed(cuboid({{-4, -7, -0.2}, {4, 7, 0.3}}), frame_along({0, 0, 3}, {0.2, 0.1, 1})),
                             placed(cuboid({{-4, -7, -0.2}, {4, 7, 0.3}}), frame_along({0, 0, -6}, {0, 0.1, 1}))});
  const Solid solid =
      make(unite({subtract(cuboid({{-7, -6, -8}, {7, 6, 6}}), unite({slots, cuboid({{-5, -4, -3}, {5, 4, 1}})})),
                  placed(cuboid({{-0.2, -9, -9}, {0.3, 9, 9}}), frame_along({8.5, 0, 0}, {0.1, 0, 1})),
                  sphere({-9, 0, -9}, 0.3), sphere({-9, 3, 5}, 0.35)}));
  const Printable whole = printable(solid, everything(), limits, z, 1.6);
  ASSERT_GE(whole.thin_walls.places, 2);
  ASSERT_GE(whole.small_gaps.places, 2);
  ASSERT_GE(whole.overhangs.places, 2);
  const PatchRules rules = patch_rules(limits, z, 1.6, voxel);
  Random random(1, "ranges");
  for (int n = 0; n < 6; ++n) {
    std::vector<SampleRange> ranges;
    const int thick = n < 3 ? 2 : 17;
    for (int at = -64; at < 64; at += thick) ranges.push_back({n % 3, at, at + thick});
    for (std::size_t i = ranges.size() - 1; i > 0; --i)
      std::swap(ranges[i],
                ranges[std::min(i, static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1)))]);
    PrintTally tally;
    for (const SampleRange& range : ranges)
      tally.add(print_tally(solid, everything(), limits, rules, range, {}), rules);
    ASSERT_EQ(tally.runs.size(), 1U);
    for (const PatchRun& kind : tally.runs[0].kinds) EXPECT_TRUE(kind.open.empty());
    const Printable found = tally.total(rules);
    expect_same(found.thin_walls, whole.thin_walls);
    expect_same(found.small_gaps, whole.small_gaps);
    expect_same(found.overhangs, whole.overhangs);
    EXPECT_EQ(found.node_overhang_mm2, whole.node_overhang_mm2);
    EXPECT_EQ(found.lumen_mm2, whole.lumen_mm2);
  }
}

/// A limit far beyond the solid: what a tile looks at ends with the solid, not with the limit. 2000 voxels around a
/// tile would be terabytes.
TEST(Printable, OfASmallSolidAllIsThin) {
  const Solid ball = realize(sphere({0.3, 0.1, -0.2}, 1), Box3d{{-2, -2, -2}, {2, 2, 2}}, {.voxel_mm = 0.1});
  const PrintParams wide{.wall_mm = 200, .gap_mm = 200};
  const PrintFault thin = printable(ball, everything(), wide, z, 1.6).thin_walls;
  ASSERT_EQ(thin.places, 1);
  EXPECT_NEAR(thin.least_mm, 2, 0.05);
  EXPECT_NEAR(thin.area_mm2, 4 * pi, 0.02 * 4 * pi);
}

TEST(Printable, RefusesWhatIsNoLimit) {
  const Solid solid = make(sphere({}, 2));
  for (const PrintParams& bad : {PrintParams{.wall_mm = 0}, PrintParams{.gap_mm = -1}, PrintParams{.overhang_deg = 91}})
    EXPECT_THROW(static_cast<void>(printable(solid, everything(), bad, z, 1)), Error);
}

}  // namespace
}  // namespace fibrolite
