// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/tie.h"

#include <gtest/gtest.h>

#include "fibrolite/reach.h"
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
  ASSERT_EQ(tied.struts().size(), 1U);
  EXPECT_NEAR(norm(tied.struts()[0].b - tied.struts()[0].a), 2 + 1,
              0.8);  // gap of 2 mm, grown by a radius at both ends
  const Vec3d middle = 0.5 * (tied.struts()[0].a + tied.struts()[0].b);
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
  EXPECT_TRUE(tied.struts().empty());
  EXPECT_EQ(tied.left.material.size(), 1U);
  EXPECT_GT(tied.solid.distance({0, 0, 0}), 0);
}

TEST(Tie, pieces_of_the_model_itself_stay_apart_and_are_counted) {
  const Shape body = unite({sphere({-6, 0, 0}, 4), sphere({6, 0, 0}, 4)});
  const Solid full = realize(body, box, grid);
  EXPECT_EQ(tie(full, body, full, {.strut_mm = 1, .reach_mm = 2}).left.material.size(), 2U);
}

/// A hollow ball with a lump in it that hangs on three threads: one piece, but on necks that are too thin.
struct Hanging {
  Shape body = sphere({0, 0, 0}, 10);
  Shape wall = subtract(body, sphere({0, 0, 0}, 8));
  Shape whole = unite({wall, sphere({1, 0.5, 0}, 2.5), capsule({1, 0.1, 0.1}, {9, 0.1, 0.1}, 0.3),
                       capsule({1, 0.1, 0.1}, {0.1, 9, 0.1}, 0.3), capsule({1, 0.1, 0.1}, {0.1, 0.1, -9}, 0.3)});
  Solid full = realize(body, box, grid);
  TieParams params{.strut_mm = 1.4, .reach_mm = 8, .neck_mm = 1.4, .anchor = wall};
};

TEST(Tie, what_hangs_on_thin_necks_gets_one_as_thick_as_asked_for) {
  Hanging h;
  const Solid raw = realize(h.whole, h.full);
  ASSERT_EQ(unreached(raw, h.wall, {.neck_mm = 1.4}).size(), 1U);
  const Tied tied = tie(raw, h.whole, h.full, h.params);
  EXPECT_EQ(tied.necks, 1);
  ASSERT_EQ(tied.struts().size(), 1U);
  EXPECT_EQ(tied.unreached.size(), 0U);
  EXPECT_EQ(tied.left.material.size(), 1U);
  EXPECT_EQ(unreached(tied.solid, h.wall, {.neck_mm = 1.4}).size(), 0U);
  // Beside one of the threads.
  const Vec3d middle = 0.5 * (tied.struts()[0].a + tied.struts()[0].b);
  EXPECT_LT(h.whole(middle), 0.7);
  const double strut_mm3 = 4.5 * 3.14159265 * (0.7 * 0.7 - 0.3 * 0.3);
  EXPECT_NEAR(tied.solid.volume_mm3() - raw.volume_mm3(), strut_mm3, 0.35 * strut_mm3);
}

TEST(Tie, necks_that_are_thick_enough_stay_as_they_are) {
  Hanging h;
  const Solid raw = realize(h.whole, h.full);
  h.params.neck_mm = 0.6;
  const Tied tied = tie(raw, h.whole, h.full, h.params);
  EXPECT_EQ(tied.necks, 0);
  EXPECT_EQ(tied.solid.volume_mm3(), raw.volume_mm3());
}

TEST(Tie, keeps_out_of_a_hole) {
  Hanging h;
  const Shape hole = cylinder({4.5, -20, 0}, {4.5, 20, 0}, 0.6);  // through one of the threads
  const Shape drilled = subtract(h.whole, hole);
  h.params.keep_out = hole;
  const Tied tied = tie(realize(drilled, h.full), drilled, h.full, h.params);
  EXPECT_EQ(tied.unreached.size(), 0U);
  for (double y = -8; y < 8; y += 0.25) EXPECT_GT(tied.solid.distance({4.5, y, 0}), 0) << y;
}

}  // namespace
}  // namespace fibrolite
