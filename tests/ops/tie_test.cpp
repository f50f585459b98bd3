// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/tie.h"

#include <gtest/gtest.h>

#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr Box3d box{{-12, -12, -12}, {12, 12, 12}};
constexpr Grid grid{.voxel_mm = 0.25};

TEST(Tie, a_loose_ball_in_a_hollow_body_is_tied_to_the_wall_by_the_shortest_strut) {
  const Shape body = sphere({0, 0, 0}, 10);
  const Shape whole = unite({subtract(body, sphere({0, 0, 0}, 8)), sphere({4, 0, 0}, 2)});
  const Solid full = realize(body, box, grid);
  const Tied tied = tie(realize(whole, full), whole, full, {.strut_mm = 1, .reach_mm = 5});
  EXPECT_EQ(tied.left.material.size(), 1U);
  ASSERT_EQ(tied.struts.size(), 1U);
  EXPECT_NEAR(norm(tied.struts[0].b - tied.struts[0].a), 2 + 1, 0.8);  // gap of 2 mm, grown by a radius at both ends
  const Vec3d middle = 0.5 * (tied.struts[0].a + tied.struts[0].b);
  EXPECT_LT(norm(middle - Vec3d{7, 0, 0}), 1.2);  // ways within a voxel of the shortest are as good
  EXPECT_LT(tied.solid.distance(middle), 0);
  EXPECT_GT(tied.solid.distance({0, 0, 0}), 0);
}

TEST(Tie, chains_of_loose_pieces_are_tied_round_by_round) {
  const Shape body = sphere({0, 0, 0}, 10);
  const Shape whole =
      unite({subtract(body, sphere({0, 0, 0}, 8)), sphere({5, 0, 0}, 1), sphere({2, 0, 0}, 1), sphere({-1, 0, 0}, 1)});
  const Solid full = realize(body, box, grid);
  const Tied tied = tie(realize(whole, full), whole, full, {.strut_mm = 1, .reach_mm = 3});
  EXPECT_EQ(tied.left.material.size(), 1U);
}

TEST(Tie, specks_go_and_are_counted) {
  const Shape body = sphere({0, 0, 0}, 10);
  const Shape whole = unite({subtract(body, sphere({0, 0, 0}, 8)), sphere({0, 0, 0}, 0.35)});
  const Solid full = realize(body, box, grid);
  const Tied tied = tie(realize(whole, full), whole, full, {});
  EXPECT_EQ(tied.dropped, 1);
  EXPECT_TRUE(tied.struts.empty());
  EXPECT_EQ(tied.left.material.size(), 1U);
  EXPECT_GT(tied.solid.distance({0, 0, 0}), 0);
}

TEST(Tie, pieces_of_the_model_itself_stay_apart_and_are_counted) {
  const Shape body = unite({sphere({-6, 0, 0}, 4), sphere({6, 0, 0}, 4)});
  const Solid full = realize(body, box, grid);
  EXPECT_EQ(tie(full, body, full, {.strut_mm = 1, .reach_mm = 2}).left.material.size(), 2U);
}

}  // namespace
}  // namespace fibrolite
