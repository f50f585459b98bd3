// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/pillars.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr double voxel = 0.2;
const Box3d around{{-13, -13, -13}, {13, 13, 13}};
const Shape block = cuboid({{-11, -11, -11}, {11, 11, 11}});
const Shape lumen = cuboid({{-9.5, -9.5, -9.5}, {9.5, 9.5, 9.5}});
const PillarParams params{.print = {.wall_mm = 0.8, .gap_mm = 0.6}, .node_mm = 1.6};

Solid make(const Shape& shape) { return realize(shape, around, {.voxel_mm = voxel}); }
Solid hollow(const Shape& inside) {
  return make(unite({subtract(block, cuboid({{-9, -9, -9}, {9, 9, 9}})), intersect({block, inside})}));
}

/// Every point of a sloping ceiling lies in a head; no flank is flatter than asked for; shafts lean no more, and end in
/// material.
TEST(Pillars, bear_all_of_a_ceiling_and_stand_on_something) {
  const Shape slope = half_space({0, 0, 3}, {0.4, 0.1, -1});
  const Solid solid = hollow(slope);
  for (const double overhang_deg : {45.0, 30.0}) {
    PillarParams asked = params;
    asked.print.overhang_deg = overhang_deg;
    const std::vector<Pillar> found = pillars(solid, lumen, asked);
    ASSERT_GT(found.size(), 20U);
    std::vector<Frustum> heads;
    const double widest = std::tan(overhang_deg * std::numbers::pi / 180) + 1e-9;
    int shafts = 0;
    for (const Pillar& pillar : found) {
      const Frustum& head = pillar.head;
      heads.push_back(head);
      EXPECT_NEAR(head.a.x, head.b.x, 1e-9);
      EXPECT_LE(head.radius_b_mm - head.radius_a_mm, widest * (head.b.z - head.a.z));
      if (!pillar.shaft) continue;
      ++shafts;
      const Vec3d along = pillar.shaft->b - pillar.shaft->a;
      EXPECT_LE(std::hypot(along.x, along.y), -widest * along.z);
      EXPECT_LT(solid.distance(pillar.shaft->b), 0);
      EXPECT_GE(2 * pillar.shaft->radius_mm, std::max(0.8, (norm(along) - pillar.shaft->radius_mm) / 25));
    }
    EXPECT_GT(shafts, 5);
    const Shape heads_alone = frusta(heads);
    for (double x = -8.5; x <= 8.5; x += 0.37)
      for (double y = -8.5; y <= 8.5; y += 0.41) EXPECT_LT(heads_alone({x, y, 3 + 0.4 * x + 0.1 * y}), 0);
  }
}

TEST(Pillars, leave_nodes_and_the_lattice_alone) {
  const Shape ball = sphere({0, 0, 0}, 1), beam = capsule({-9, 0, 0}, {9, 0, 0}, 0.7);
  const Solid solid = make(unite({ball, cuboid({{-0.8, -0.8, 0}, {0.8, 0.8, 11}})}));
  EXPECT_TRUE(pillars(solid, lumen, params).empty());
  const Solid beams = make(beam);
  EXPECT_FALSE(pillars(beams, lumen, params).empty());
  PillarParams own = params;
  own.lattice = beam;
  EXPECT_TRUE(pillars(beams, lumen, own).empty());
}

/// Storeys apart get pillars of their own: the lower one stands under the lower ceiling alone.
TEST(Pillars, stand_under_every_storey) {
  const Solid solid = hollow(cuboid({{-20, -20, -1}, {20, 20, 1}}));
  double low = 0, high = 0;
  for (const Pillar& pillar : pillars(solid, lumen, params)) (pillar.head.b.z < 0 ? low : high) += 1;
  EXPECT_GT(low, 20);
  EXPECT_EQ(low, high);
}

TEST(Pillars, refuses_what_is_no_size) {
  const Solid solid = hollow(nothing());
  for (const PillarParams& bad : {PillarParams{.shaft_mm = 0.3}, PillarParams{.cell_mm = 0}})
    EXPECT_THROW(static_cast<void>(pillars(solid, lumen, bad)), Error);
}

}  // namespace
}  // namespace fibrolite
