// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/pieces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr Grid grid{.voxel_mm = 0.25};
Solid make(const Shape& shape) { return realize(shape, Box3d{{-12, -12, -12}, {12, 12, 12}}, grid); }

TEST(Pieces, counts_material_and_cavities_with_their_volumes) {
  const Solid solid = make(unite({subtract(sphere({0, 0, 0}, 5), sphere({0, 0, 0}, 3)), sphere({8, 0, 0}, 1.5)}));
  const Pieces found = pieces(solid);
  ASSERT_EQ(found.material.size(), 2U);
  ASSERT_EQ(found.cavities.size(), 1U);
  const double ball = 4.0 / 3 * std::numbers::pi;
  EXPECT_NEAR(found.material[0].volume_mm3 / (ball * (125 - 27)), 1, 0.02);
  EXPECT_NEAR(found.material[1].volume_mm3 / (ball * 3.375), 1, 0.03);
  EXPECT_NEAR(found.cavities[0].volume_mm3 / (ball * 27), 1, 0.02);
  EXPECT_LT(solid.distance(found.material[1].sample_mm), 0);
}

TEST(VoidMap, tells_material_outside_and_each_cavity) {
  const Solid solid = make(subtract(sphere({0, 0, 0}, 9), unite({sphere({-4, 0, 0}, 2), sphere({4, 0, 0}, 3)})));
  const VoidMap voids(solid);
  ASSERT_EQ(voids.cavities().size(), 2U);
  EXPECT_GT(voids.cavities()[0].voxels, voids.cavities()[1].voxels);
  EXPECT_EQ(voids.at({16, 0, 0}), 1);  // x = 4 mm: the larger
  EXPECT_EQ(voids.at({-16, 0, 0}), 2);
  EXPECT_EQ(voids.at({0, 0, 0}), VoidMap::material);
  EXPECT_EQ(voids.at({40, 0, 0}), VoidMap::outside);
  EXPECT_EQ(voids.at({4000, 0, 0}), VoidMap::outside);
  EXPECT_EQ(VoidMap(Solid()).at({0, 0, 0}), VoidMap::outside);
}

TEST(Pieces, an_open_tube_has_no_cavity_and_a_plugged_one_has) {
  const Shape wall = subtract(cylinder({0, 0, -8}, {0, 0, 8}, 4), cylinder({0, 0, -9}, {0, 0, 9}, 3));
  EXPECT_EQ(pieces(make(wall)).cavities.size(), 0U);
  const Shape plugs = unite({cuboid({{-3.5, -3.5, -8}, {3.5, 3.5, -7}}), cuboid({{-3.5, -3.5, 7}, {3.5, 3.5, 8}})});
  EXPECT_EQ(pieces(make(unite({wall, plugs}))).cavities.size(), 1U);
}

TEST(Pieces, a_full_solid_larger_than_a_block_is_one_piece) {
  const Pieces found = pieces(make(cuboid({{-10, -10, -10}, {10, 10, 10}})));
  EXPECT_EQ(found.material.size(), 1U);
  EXPECT_EQ(found.cavities.size(), 0U);
}

TEST(Clean, drops_specks_and_fills_pores_but_keeps_the_main_piece) {
  const Shape body = subtract(sphere({0, 0, 0}, 5), unite({sphere({1, 0, 0}, 0.4), sphere({-2, 0, 0}, 1.5)}));
  const Solid solid = make(unite({body, sphere({8, 0, 0}, 0.4), sphere({0, 8, 0}, 1.5)}));
  const CleanResult result = clean(solid);
  EXPECT_EQ(result.dropped, 1);
  EXPECT_EQ(result.filled, 1);
  EXPECT_EQ(result.left.material.size(), 2U);
  EXPECT_EQ(result.left.cavities.size(), 1U);
  EXPECT_GT(result.solid.distance({8, 0, 0}), 0);
  EXPECT_LT(result.solid.distance({1, 0, 0}), 0);
  const Pieces again = pieces(result.solid);
  EXPECT_EQ(again.material.size(), 2U);
  EXPECT_EQ(again.cavities.size(), 1U);
}

TEST(Clean, pieces_that_a_filled_void_kept_apart_are_counted_as_one) {
  const Solid solid = make(unite({subtract(sphere({0, 0, 0}, 5), sphere({0, 0, 0}, 1.1)), sphere({0, 0, 0}, 0.7)}));
  ASSERT_EQ(pieces(solid).material.size(), 2U);
  const CleanResult result = clean(solid, {.fill_below_vox = 1000});
  EXPECT_EQ(result.filled, 1);
  EXPECT_EQ(pieces(result.solid).material.size(), 1U);
  EXPECT_EQ(result.left.material.size(), 1U);
  EXPECT_EQ(result.left.cavities.size(), 0U);
}

TEST(Gaps, finds_the_shortest_way_to_the_neighbour) {
  const Solid solid = make(unite({sphere({-3, 0, 0}, 4), sphere({6, 0, 0}, 2)}));
  const auto found = gaps(solid, 5);
  ASSERT_EQ(found.size(), 1U);  // the small one is loose
  EXPECT_NEAR(norm(found[0].to_mm - found[0].from_mm), 3.0, 0.75);
  EXPECT_NEAR(found[0].from_mm.x, 4.0, 0.5);
  EXPECT_TRUE(gaps(solid, 1).empty());  // out of reach
}

}  // namespace
}  // namespace fibrolite
