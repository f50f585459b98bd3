// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/dangling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <tuple>

#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr TcsParams params{.cell_mm = 6, .stick_mm = 0.8, .ball_mm = 1.6};
constexpr Box3d box{{-9, -9, -9}, {9, 9, 9}};
constexpr double shell_mm = 1;

Sticks crystal_sticks(const Shape& region) {
  return {
      [](const Box3d& where, const std::function<void(const Capsule&)>& visit) { each_stick(params, where, visit); },
      params.ball_mm, box, region};
}

/// A body to the depth that the shell needs, 0.2 mm a voxel.
Solid full() { return realize(cuboid(box), box.grown(1), {.voxel_mm = 0.2, .band_vox = 6}); }

/// A cube with a shell; crystal below the plane, nothing above it, and between them a layer or none.
std::size_t count(double plane_mm, bool layer) {
  const Shape body = cuboid(box), low = half_space({0, 0, plane_mm}, {0, 0, 1});
  std::vector<Shape> material{subtract(body, offset(body, -shell_mm)), intersect({crystal(params), low})};
  if (layer) material.push_back(cuboid({{-9, -9, plane_mm - 0.4}, {9, 9, plane_mm + 0.8}}));
  const Solid solid = realize(intersect({body, unite(material)}), box.grown(1), {.voxel_mm = 0.2});
  return loose_ends(crystal_sticks(low), full(), shell_mm, solid).size();
}

TEST(Sticks, each_once_four_to_a_node) {
  std::set<std::tuple<long, long, long, long, long, long>> seen;
  double nearest = 1e9;
  const Shape lattice = crystal(params);
  each_stick(params, {{0, 0, 0}, {12, 12, 12}}, [&](const Capsule& s) {
    const auto key = [](double v) { return std::lround(v * 1000); };
    EXPECT_TRUE(seen.insert({key(s.a.x), key(s.a.y), key(s.a.z), key(s.b.x), key(s.b.y), key(s.b.z)}).second);
    EXPECT_NEAR(norm(s.b - s.a), std::sqrt(3.0) / 4 * 6, 1e-9);
    for (const double t : {0.4, 0.5, 0.6}) EXPECT_NEAR(lattice(s.a + t * (s.b - s.a)), -0.4, 1e-4);
    nearest = std::min(nearest, norm(0.5 * (s.a + s.b) - Vec3d{6, 6, 6}));
  });
  EXPECT_GE(seen.size(), 8U * 16U);  // sixteen to a cell
  EXPECT_LT(nearest, 1.5);
}

TEST(Dangling, none_where_every_stick_ends_in_the_shell) {
  const Solid solid =
      realize(intersect({cuboid(box), unite({subtract(cuboid(box), offset(cuboid(box), -shell_mm)), crystal(params)})}),
              box.grown(1), {.voxel_mm = 0.2});
  EXPECT_TRUE(loose_ends(crystal_sticks(everything()), full(), shell_mm, solid).empty());
}

/// A plane half way up the sticks leaves one free end for each stick it cuts inside the shell; a layer there takes
/// them all. Between two levels of nodes of the cubic lattice, 1.5 mm apart, every stick crosses.
TEST(Dangling, counts_the_sticks_that_a_plane_leaves_hanging) {
  const double plane = 0.75;
  std::int64_t cut = 0;
  each_stick(params, box, [&](const Capsule& s) {
    const double t = (plane - s.a.z) / (s.b.z - s.a.z);
    const Vec3d at = s.a + t * (s.b - s.a);
    cut += t > 0 && t < 1 && std::abs(at.x) < 8 && std::abs(at.y) < 8 ? 1 : 0;
  });
  ASSERT_GT(cut, 20);
  const std::int64_t found = count(plane, false);
  EXPECT_LE(found, cut);
  EXPECT_GE(found, cut - 2 * 11);  // those that also touch the shell hang on that: at most along its four sides
  EXPECT_EQ(count(plane, true), 0);
}

/// A plane just above a level of nodes: each node there keeps its two sticks from below, and stubs within the balls.
TEST(Dangling, a_node_at_the_border_holds_by_its_other_sticks) { EXPECT_EQ(count(0.1, false), 0); }

/// As parts are cut: at a slant to all sticks, and with an overlap of a voxel. What an end has beyond the cut on one
/// side is its own, and holds nothing.
TEST(Dangling, ends_cut_at_a_slant_are_not_held_by_their_own_tips) {
  const Vec3d normal = normalized({0.3, 0.2, 1});
  const Shape body = cuboid(box), low = half_space({0, 0, 0.75}, normal);
  std::set<std::tuple<long, long, long>> cut;
  each_stick(params, box, [&](const Capsule& s) {
    const double a = dot(s.a - Vec3d{0, 0, 0.75}, normal), b = dot(s.b - Vec3d{0, 0, 0.75}, normal);
    const Vec3d at = s.a + (a / (a - b)) * (s.b - s.a);
    const double stub = std::min(a, b) < 0 ? norm(at - (a < 0 ? s.a : s.b)) : 0;
    if (a * b < 0 && stub > 1.25 && stub < 1.75 && std::abs(at.x) < 7 && std::abs(at.y) < 7)
      cut.insert({std::lround(1e4 * at.x), std::lround(1e4 * at.y), std::lround(1e4 * at.z)});
  });
  ASSERT_GE(cut.size(), 3U);
  const Solid solid = realize(intersect({body, unite({subtract(body, offset(body, -shell_mm)),
                                                      intersect({crystal(params), offset(low, 0.2)})})}),
                              box.grown(1), {.voxel_mm = 0.2});
  EXPECT_GE(loose_ends(crystal_sticks(low), full(), shell_mm, solid).size(), cut.size());
}

TEST(Dangling, a_node_on_one_stick_is_an_end) {
  // One stick alone, from the floor's shell up into the void; another was not realized: it is no material.
  const Capsule stick{{0, 0, -9}, {0, 0, 0}, 0.4}, absent{{4, 0, -9}, {4, 0, 0}, 0.4};
  const Shape body = cuboid(box);
  const auto solid = [&](const Shape& more) {
    const Shape whole = unite({subtract(body, offset(body, -shell_mm)), capsules({stick}), more});
    return realize(intersect({body, whole}), box.grown(1), {.voxel_mm = 0.2});
  };
  const auto found = [&](const std::vector<Capsule>& list, const Shape& more) {
    const Sticks sticks{[list](const Box3d&, const std::function<void(const Capsule&)>& visit) {
                          for (const Capsule& s : list) visit(s);
                        },
                        0.8, box, everything()};
    return loose_ends(sticks, full(), shell_mm, solid(more));
  };
  const auto free = found({stick, absent}, nothing());
  ASSERT_EQ(free.size(), 1U);
  EXPECT_EQ(norm(free[0].end_mm - stick.b), 0);
  EXPECT_EQ(free[0].knob_mm, 0.4);
  EXPECT_NEAR(free[0].held_mm.z, -8, 0.7);                     // the shell's inner face
  const Shape beam = capsule({-9, 0, 0.5}, {9, 0, 0.5}, 0.4);  // carries its head
  EXPECT_TRUE(found({stick}, beam).empty());
}

void expect_same(const std::vector<LooseEnd>& a, const std::vector<LooseEnd>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].end_mm, b[i].end_mm);
    EXPECT_EQ(a[i].held_mm, b[i].held_mm);
    EXPECT_EQ(a[i].radius_mm, b[i].radius_mm);
    EXPECT_EQ(a[i].knob_mm, b[i].knob_mm);
  }
}

/// Sticks over many borders, in a part that ends at a slant; a speck before one of its ends and pores in the middle of
/// sticks, which cleaning takes away and fills.
TEST(StickSweep, finds_in_slabs_what_it_finds_in_the_whole) {
  const Shape low = half_space({0, 0, 0.75}, {0.3, 0.2, 1}), body = cuboid(box);
  const Solid known = full();
  const Solid raw = realize(intersect({body, unite({subtract(body, offset(body, -shell_mm)),
                                                    intersect({crystal(params), offset(low, 0.2)})})}),
                            known);
  const auto before = loose_ends(crystal_sticks(low), known, shell_mm, raw);
  ASSERT_GE(before.size(), 5U);
  // The first end hides behind a speck.
  const Vec3d out = normalized(before[0].end_mm - before[0].held_mm);
  const Shape speck = sphere(before[0].end_mm + (before[0].radius_mm + 0.4) * out, 0.25);
  std::vector<Capsule> pores;
  each_stick(params, box, [&](const Capsule& s) {
    const Vec3d middle = 0.5 * (s.a + s.b);
    if (low(middle) < -1 && body(middle) < -3) pores.push_back({middle, middle, 0.2});
  });
  ASSERT_GE(pores.size(), 20U);
  const Solid raw_here = realize(unite({subtract(distance_to(raw), capsules(pores)), speck}), known);
  PieceSweep pieces(raw.grid(), {.clean = {}});
  pieces.add(raw_here, -56, 56);
  const Flips flips = pieces.finish().flips;
  const Vec3d pore = (1 / 0.2) * pores[0].a;
  ASSERT_TRUE(flips.holds({static_cast<int>(std::lround(pore.x)), static_cast<int>(std::lround(pore.y)),
                           static_cast<int>(std::lround(pore.z))}));
  const Solid clean = flipped(raw_here, flips);
  const auto whole = loose_ends(crystal_sticks(low), known, shell_mm, clean);
  ASSERT_GE(whole.size(), 5U);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int thickness : {8, 24, 40}) {
      SCOPED_TRACE("axis " + std::to_string(axis) + ", slabs of " + std::to_string(thickness));
      StickSweep sweep(crystal_sticks(low), shell_mm, raw.grid().voxel_mm);
      for (int at = -56; at < 56; at += thickness) sweep.add(known, raw_here, {axis, at, at + thickness});
      expect_same(sweep.finish(flips, surroundings(clean)), whole);
    }
  }
}

}  // namespace
}  // namespace fibrolite
