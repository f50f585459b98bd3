// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/reach.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibrolite/frame.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr Grid grid{.voxel_mm = 0.25};
Solid make(const Shape& shape) { return realize(shape, Box3d{{-12, -12, -12}, {12, 12, 12}}, grid); }

/// Two blocks on a bar that is thick, thin, or thick again at the other end: only what hangs on the thin one is
/// unreached.
TEST(Unreached, finds_what_hangs_on_a_thin_neck) {
  const Shape anchor = cuboid({{-10, -4, -4}, {-6, 4, 4}}), block = cuboid({{4, -2, -2}, {8, 2, 2}});
  const auto bar = [](double radius) { return cylinder({-7, 0.1, 0.1}, {5, 0.1, 0.1}, radius); };
  const auto found = [&](double radius, double neck) {
    return unreached(make(unite({anchor, block, bar(radius)})), anchor, {.neck_mm = neck});
  };
  EXPECT_EQ(found(0.6, 1.2).size(), 0U);  // as thick as asked for
  EXPECT_EQ(found(0.4, 0.8).size(), 0U);
  EXPECT_EQ(found(0.4, 0.9).size(), 0U);  // no sample lies nearer its middle than 0.14
  EXPECT_EQ(found(0.4, 1.0).size(), 1U);
  const auto thin = found(0.3, 1.4);
  ASSERT_EQ(thin.size(), 1U);
  const double depth = 0.5,
               side = 4 - 2 * depth + 0.25;  // of the samples deeper than 0.7 - 0.87 voxel, with their cubes
  EXPECT_NEAR(thin[0].piece.volume_mm3 / (side * side * side), 1, 0.02);
  EXPECT_NEAR(thin[0].piece.sample_mm.x, 4 + depth, 0.3);
  EXPECT_EQ(unreached(make(unite({anchor, block})), anchor, {.neck_mm = 0.8}).size(), 1U);  // not joined at all
  EXPECT_EQ(unreached(make(unite({anchor, block})), nothing(), {.neck_mm = 0.8}).size(), 2U);
  EXPECT_EQ(unreached(make(unite({anchor, block})), everything(), {.neck_mm = 0.8}).size(), 0U);
}

/// However a bar or a plate lies on the lattice, one as thick as asked for holds and one 1.75 voxels thinner does not:
/// 2.4, 4.8 and 12 voxels thick, of which the last is thicker than twice the band. The worst are those along the
/// diagonal of a face, through samples and half a voxel above them.
TEST(Unreached, a_neck_is_judged_the_same_in_all_directions) {
  Random random(1, "necks");
  for (int n = 0; n < 36; ++n) {
    const auto unit = [&] { return 2 * random.uniform() - 1; };
    const Vec3d along = n < 3 ? Vec3d{1, 1, 0} : n < 6 ? Vec3d{1, 1, 1} : Vec3d{unit(), unit(), unit()};
    const Vec3d middle = n < 3 ? Vec3d{0, 0, 0.125} : n < 6 ? Vec3d{} : 0.125 * Vec3d{unit(), unit(), unit()};
    const Vec3d end = 6 / norm(along) * along;
    const Shape anchor = sphere(middle - end, 3), far = sphere(middle + end, 2);
    const double neck = n % 3 == 0 ? 0.6 : n % 3 == 1 ? 1.2 : 3;
    const Grid told = telling(neck, grid);
    EXPECT_EQ(told.inside_vox > told.band_vox, neck == 3);
    const Frame frame = frame_along(middle, normalized(along));
    const auto found = [&](double thick, bool plate) {
      const Shape bar = plate ? placed(cuboid({{-2, -0.5 * thick, -6}, {2, 0.5 * thick, 6}}), frame)
                              : cylinder(middle - end, middle + end, 0.5 * thick);
      const Solid solid = realize(unite({anchor, far, bar}), Box3d{{-12, -12, -12}, {12, 12, 12}}, told);
      return unreached(solid, anchor, {.neck_mm = neck}).size();
    };
    for (const bool plate : {false, true}) {
      EXPECT_EQ(found(neck, plate), 0U) << n << (plate ? " plate" : " bar");
      EXPECT_GE(found(neck - 1.75 * grid.voxel_mm, plate), 1U) << n << (plate ? " plate" : " bar");
    }
  }
}

TEST(Unreached, the_coarsest_voxel_is_the_one_that_tells_what_is_held) {
  EXPECT_NEAR(coarsest_voxel(0.8, 0.4), 0.231, 0.0005);
  EXPECT_NEAR(2 * skin_mm(0.8, {.voxel_mm = coarsest_voxel(0.8, 0.4)}), 0.4, 1e-9);
  EXPECT_LE(coarsest_voxel(0.4, 0.4), 0);
}

TEST(Unreached, values_told_deeper_than_the_band_are_no_more_once_narrowed) {
  const Shape ball = sphere({0.1, 0.1, 0.1}, 4);
  const Solid deep = realize(ball, Box3d{{-5, -5, -5}, {5, 5, 5}}, telling(3, grid)), plain = make(ball);
  EXPECT_NEAR(deep.grid().inside_vox, 5.634, 1e-3);
  EXPECT_EQ(deep.active_voxels(), plain.active_voxels());
  const Vec3d at{2.75, 0, 0};
  EXPECT_NEAR(deep.distance(at), ball(at), 1e-5);
  const Solid narrow = narrowed(deep);
  EXPECT_EQ(narrow.grid(), grid);
  EXPECT_NEAR(deep.distance(at), ball(at), 1e-5);  // its own grid was not touched
  for (double x = 0; x < 5; x += 0.25) EXPECT_EQ(narrow.distance({x, 0, 0}), plain.distance({x, 0, 0})) << x;
}

/// A neck of 12 voxels, more than twice the band, is judged as well as a thin one.
TEST(Unreached, a_neck_thicker_than_twice_the_band_is_judged) {
  const Shape anchor = sphere({-6, 0, 0}, 4), far = sphere({6, 0, 0}, 3);
  const auto found = [&](double radius, Grid told) {
    const Shape bar = cylinder({-6, 0.1, 0.05}, {6, 0.1, 0.05}, radius);
    const Solid solid = realize(unite({anchor, far, bar}), Box3d{{-12, -12, -12}, {12, 12, 12}}, told);
    return unreached(solid, anchor, {.neck_mm = 3}).size();
  };
  EXPECT_EQ(found(1.5, telling(3, grid)), 0U);
  EXPECT_EQ(found(1.25, telling(3, grid)), 1U);
  EXPECT_EQ(found(1.25, grid), 0U);  // values that end at the band cannot tell
}

/// A bar of 1.2 mm made of two halves that touch: the values of their union are 0 in its middle, and at most 0.3 mm
/// deep in all of it, though it is 0.6 mm deep. Its depth is measured from its surface.
TEST(Unreached, values_of_a_union_that_understate_its_depth_cut_nothing_off) {
  const Shape anchor = cuboid({{-10, -4, -4}, {-6, 4, 4}}), block = cuboid({{4, -2, -2}, {8, 2, 2}});
  const auto found = [&](double half, double neck) {
    const Shape bar = unite({cuboid({{-7, 0.1 - half, 0.1 - half}, {5, 0.1, 0.1 + half}}),
                             cuboid({{-7, 0.1, 0.1 - half}, {5, 0.1 + half, 0.1 + half}})});
    return unreached(make(unite({anchor, block, bar})), anchor, {.neck_mm = neck}).size();
  };
  EXPECT_EQ(found(0.6, 1.2), 0U);
  EXPECT_EQ(found(0.3, 1.4), 1U);  // thin, however it is made
}

TEST(Unreached, gives_the_way_through_the_neck_and_not_the_shorter_one_through_void) {
  // An arm parallel to the anchor, 2 mm away from it, which hangs on a thin bar 6 mm long at its end.
  const Shape anchor = cuboid({{-10, -10, -4}, {10, -6, 4}}), arm = cuboid({{-10, -4, -2}, {4, -1, 2}});
  const Shape bar = cylinder({3, -2.4, 0.1}, {10, -2.4, 0.1}, 0.3), post = cuboid({{9, -7, -2}, {11, -1, 2}});
  const Solid solid = make(unite({anchor, arm, bar, post}));
  const auto found = unreached(solid, anchor, {.neck_mm = 1.4, .way_mm = 8});
  ASSERT_EQ(found.size(), 1U);
  ASSERT_TRUE(found[0].way);
  EXPECT_NEAR(found[0].way->from_mm.x, 4 - 0.45, 0.3);
  EXPECT_NEAR(found[0].way->to_mm.x, 9 + 0.45, 0.3);
  EXPECT_FALSE(unreached(solid, anchor, {.neck_mm = 1.4, .way_mm = 1}).at(0).way);
  // With something in the way it goes through void.
  const auto around = unreached(solid, anchor, {.neck_mm = 1.4, .way_mm = 8, .keep_out = sphere({6.5, -2.4, 0.1}, 1)});
  ASSERT_TRUE(around.at(0).way);
  EXPECT_NEAR(around[0].way->to_mm.y, -6 - 0.45, 0.3);
}

TEST(Unreached, a_chain_is_told_link_by_link) {
  const Shape anchor = cuboid({{-10, -4, -4}, {-6, 4, 4}});
  const Shape first = cuboid({{-3, -2, -2}, {0, 2, 2}}), second = cuboid({{3, -1, -1}, {5, 1, 1}});
  const Shape bar = cylinder({-7, 0.1, 0.1}, {4, 0.1, 0.1}, 0.3);
  const auto found = unreached(make(unite({anchor, first, second, bar})), anchor, {.neck_mm = 1.4, .way_mm = 8});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(norm(found[0].way->to_mm - found[0].way->from_mm), 3 + 2 * 0.45, 0.5);
  EXPECT_NEAR(norm(found[1].way->to_mm - found[1].way->from_mm), 3 + 2 * 0.45, 0.5);
}

}  // namespace
}  // namespace fibrolite
