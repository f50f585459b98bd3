// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/trim.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "fibrolite/blocks.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr Box3d box{{-9, -9, -9}, {9, 9, 9}};
constexpr double shell_mm = 1, voxel = 0.2;
const TieParams ties{.strut_mm = 0.8, .reach_mm = 12};

const Shape body = cuboid(box);
const Shape hull = subtract(body, offset(body, -shell_mm));

struct Made {
  Shape whole;
  Solid full, solid;
  Tied tied;
};
Made made(const Shape& inside) {
  Made m;
  m.full = realize(body, box.grown(1), {.voxel_mm = voxel, .band_vox = 6});  // deeper than the shell
  m.whole = intersect({body, unite({hull, inside})});
  m.solid = realize(m.whole, m.full);
  m.tied = tie(m.solid, m.whole, m.full, ties);
  return m;
}
Sticks listed(const std::vector<Capsule>& list, double ball_mm) {
  return {[list](const Box3d&, const std::function<void(const Capsule&)>& visit) {
            for (const Capsule& s : list) visit(s);
          },
          ball_mm, box, everything()};
}

TEST(Trim, a_stick_that_ends_in_the_void_is_removed_and_nothing_else) {
  const Capsule stick{{0, 0, -9}, {0, 0, 0}, 0.4};
  const Made m = made(capsules({stick}));
  const Tied trimmed = trim(m.tied, m.whole, m.full, {listed({stick}, 0.8)}, shell_mm, ties);
  EXPECT_EQ(trimmed.tips_removed, 1);
  EXPECT_EQ(trimmed.tips_tied, 0);
  EXPECT_EQ(trimmed.dangling, 0);
  EXPECT_EQ(trimmed.left.material.size(), 1U);
  for (double z = -7.2; z < 1; z += 0.2) EXPECT_GT(trimmed.solid.distance({0.01, 0.01, z}), 0) << z;
  const double gone = m.solid.volume_mm3() - trimmed.solid.volume_mm3();
  EXPECT_NEAR(gone, std::numbers::pi * 0.16 * (8 + 2.0 / 3 * 0.4), 0.3);  // a stick of 8 mm and its round head
}

TEST(Trim, a_chain_of_sticks_goes_back_to_where_it_is_held) {
  const std::vector<Capsule> chain{
      {{0, 0, -9}, {0, 0, -5}, 0.4}, {{0, 0, -5}, {3, 0, -3}, 0.4}, {{3, 0, -3}, {3, 0, 1}, 0.4}};
  const Shape shelf = capsule({-9, 0, -5}, {9, 0, -5}, 0.6);  // holds the first node
  const Made m = made(unite({capsules(chain), shelf}));
  const Tied trimmed = trim(m.tied, m.whole, m.full, {listed(chain, 0.8)}, shell_mm, ties);
  EXPECT_EQ(trimmed.tips_removed, 2);
  EXPECT_EQ(trimmed.dangling, 0);
  EXPECT_GT(trimmed.solid.distance({3, 0, -3}), 0);
  EXPECT_LT(trimmed.solid.distance({0, 0, -7}), 0);
  EXPECT_LT(trimmed.solid.distance({5, 0, -5}), 0);
}

TEST(Trim, a_stick_near_other_material_is_tied_to_it) {
  const Capsule stick{{0, 0, -9}, {0, 0, 0}, 0.4};
  const Made m = made(unite({capsules({stick}), cuboid({{-9, -9, 2}, {9, 9, 3}})}));
  const Tied trimmed = trim(m.tied, m.whole, m.full, {listed({stick}, 0.8)}, shell_mm, ties);
  EXPECT_EQ(trimmed.tips_tied, 1);
  EXPECT_EQ(trimmed.tips_removed, 0);
  EXPECT_EQ(trimmed.dangling, 0);
  for (double z = -8; z < 3; z += 0.2) EXPECT_LT(trimmed.solid.distance({0.01, 0.01, z}), 0) << z;
  // Not through a hole.
  TieParams around = ties;
  around.keep_out = cuboid({{-9, -9, 0.8}, {9, 9, 2.6}});
  const Tied other = trim(m.tied, m.whole, m.full, {listed({stick}, 0.8)}, shell_mm, around);
  EXPECT_EQ(other.tips_tied, 0);
  EXPECT_EQ(other.tips_removed, 1);
}

/// Crystal below a slanted plane, nothing above it: all its ends go or are tied, and what is left is one piece.
TEST(Trim, a_crystal_beside_an_empty_part_keeps_no_end_in_the_void) {
  constexpr TcsParams params{.cell_mm = 6, .stick_mm = 0.8, .ball_mm = 1.6};
  const Shape low = half_space({0, 0, 0.75}, {0.3, 0.2, 1});
  const Made m = made(intersect({crystal(params), offset(low, voxel)}));
  const Sticks sticks{
      [&](const Box3d& where, const std::function<void(const Capsule&)>& visit) { each_stick(params, where, visit); },
      params.ball_mm, box, low};
  const std::size_t before = loose_ends(sticks, m.full, shell_mm, m.tied.solid).size();
  ASSERT_GE(before, 5U);
  const Tied trimmed = trim(m.tied, m.whole, m.full, {sticks}, shell_mm, ties);
  EXPECT_GE(trimmed.tips_tied + trimmed.tips_removed, static_cast<std::int64_t>(before));
  EXPECT_EQ(trimmed.dangling, 0);
  EXPECT_TRUE(loose_ends(sticks, m.full, shell_mm, trimmed.solid).empty());
  EXPECT_EQ(trimmed.left.material.size(), 1U);
  EXPECT_GT(trimmed.solid.volume_mm3(), 0.9 * m.tied.solid.volume_mm3());
}

/// Several rounds, struts of one beside what the next removes: done to the function one after the other, they give the
/// solid, sample for sample.
TEST(Trim, the_solid_is_the_function_with_its_changes) {
  constexpr TcsParams params{.cell_mm = 6, .stick_mm = 0.8, .ball_mm = 1.6};
  const Shape low = half_space({0, 0, 0.75}, {0.3, 0.2, 1}), plate = cuboid({{-9, -9, 2.6}, {0, 9, 3.4}});
  const Made m = made(unite({intersect({crystal(params), offset(low, voxel)}), plate}));
  const Sticks sticks{
      [&](const Box3d& where, const std::function<void(const Capsule&)>& visit) { each_stick(params, where, visit); },
      params.ball_mm, box, low};
  const Tied trimmed = trim(m.tied, m.whole, m.full, {sticks}, shell_mm, ties);
  EXPECT_GT(trimmed.tips_tied, 0);
  EXPECT_GT(trimmed.tips_removed, 0);
  EXPECT_GE(trimmed.changes.size(), 2U);
  const Solid again = clean(realize(with_ties(m.whole, distance_to(m.full), trimmed.changes), m.full)).solid;
  EXPECT_EQ(again.volume_mm3(), trimmed.solid.volume_mm3());
  EXPECT_EQ(again.active_voxels(), trimmed.solid.active_voxels());
  for (const Vec3i origin : blocks(trimmed.solid)) {
    std::array<float, 512> a, b;
    copy_samples(again, origin, {8, 8, 8}, a.data());
    copy_samples(trimmed.solid, origin, {8, 8, 8}, b.data());
    ASSERT_EQ(a, b) << origin.x << " " << origin.y << " " << origin.z;
  }
}

TEST(Trim, what_ends_nowhere_in_the_void_stays_as_it_is) {
  const Capsule stick{{0, 0, -9}, {0, 0, 9}, 0.4};
  const Made m = made(capsules({stick}));
  const Tied trimmed = trim(m.tied, m.whole, m.full, {listed({stick}, 0.8)}, shell_mm, ties);
  EXPECT_EQ(trimmed.tips_removed + trimmed.tips_tied, 0);
  EXPECT_EQ(trimmed.solid.volume_mm3(), m.tied.solid.volume_mm3());
}

}  // namespace
}  // namespace fibrolite
