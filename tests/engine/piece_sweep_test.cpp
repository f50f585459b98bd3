// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/piece_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "fibrolite/random.h"
#include "fibrolite/reach.h"
#include "fibrolite/realize.h"
#include "fibrolite/vdb.h"

namespace fibrolite {
namespace {

constexpr Grid grid{.voxel_mm = 0.25};
constexpr int low = -56, high = 56;  // samples: 14 mm
Solid make(const Shape& shape) { return realize(shape, Box3d{{-12, -12, -12}, {12, 12, 12}}, grid); }

PieceSweep::Result swept(const Solid& solid, int axis, int thickness, const PieceSweep::Params& params = {},
                         const Shape& anchor = nothing()) {
  PieceSweep::Params p = params;
  p.axis = axis;
  PieceSweep sweep(grid, p);
  for (int at = high; p.falling && at > low; at -= thickness)
    sweep.add(solid, std::max(at - thickness, low), at, anchor);
  for (int at = low; !p.falling && at < high; at += thickness)
    sweep.add(solid, at, std::min(at + thickness, high), anchor);
  return sweep.finish();
}

void expect_same(const std::vector<Piece>& a, const std::vector<Piece>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].voxels, b[i].voxels);
    EXPECT_EQ(a[i].sample_mm, b[i].sample_mm);
  }
}

template <class Check>
void for_cuts(const Check& check) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int thickness : {8, 24, 112}) {
      SCOPED_TRACE("axis " + std::to_string(axis) + ", slabs of " + std::to_string(thickness));
      check(axis, thickness);
    }
  }
}

/// Balls, and holes in them, anywhere: many pieces and voids, cut by every border.
Shape clutter(std::uint64_t seed) {
  Random random(seed, "clutter");
  std::vector<Shape> balls, holes;
  for (int i = 0; i < 40; ++i) {
    const auto place = [&] { return 20 * random.uniform() - 10; };
    const double x = place(), y = place(), z = place(), radius = 0.3 + 2 * random.uniform();
    balls.push_back(sphere({x, y, z}, radius));
    holes.push_back(sphere({x, y, z + 0.1}, 0.7 * radius));
  }
  return subtract(unite(balls), unite(holes));
}

TEST(PieceSweep, finds_what_the_whole_solid_has) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Solid solid = make(clutter(seed));
    const Pieces whole = pieces(solid);
    ASSERT_GT(whole.material.size(), 5U);
    ASSERT_GT(whole.cavities.size(), 5U);
    for_cuts([&](int axis, int thickness) {
      const PieceSweep::Result got = swept(solid, axis, thickness);
      expect_same(got.left.material, whole.material);
      expect_same(got.left.cavities, whole.cavities);
      const PieceSweep::Result falling = swept(solid, axis, thickness, {.falling = true});
      expect_same(falling.left.material, whole.material);
      expect_same(falling.left.cavities, whole.cavities);
      EXPECT_TRUE(got.flips.blocks.empty());
    });
  }
}

TEST(PieceSweep, prongs_that_meet_in_a_later_slab_are_one) {
  const Shape comb = unite({cuboid({{-10, -1, -10}, {10, 1, -9}}), cuboid({{-10, -1, -9.5}, {-9, 1, 10}}),
                            cuboid({{9, -1, -9.5}, {10, 1, 10}}), cuboid({{-1, -1, -9.5}, {1, 1, 10}})});
  const Solid solid = make(comb);
  for_cuts([&](int axis, int thickness) { EXPECT_EQ(swept(solid, axis, thickness).left.material.size(), 1U); });
}

TEST(PieceSweep, a_long_void_is_one_and_a_tube_has_none) {
  const Shape bar = cuboid({{-2, -2, -11}, {2, 2, 11}});
  const Solid closed = make(subtract(bar, cuboid({{-1, -1, -10}, {1, 1, 10}})));
  const Solid open = make(subtract(bar, cuboid({{-1, -1, -10}, {1, 1, 12}})));
  for_cuts([&](int axis, int thickness) {
    EXPECT_EQ(swept(closed, axis, thickness).left.cavities.size(), 1U);
    EXPECT_EQ(swept(open, axis, thickness).left.cavities.size(), 0U);
  });
}

TEST(PieceSweep, a_full_solid_of_tiles_is_one_piece) {
  const Solid solid = make(cuboid({{-11, -11, -11}, {11, 11, 11}}));
  for_cuts([&](int axis, int thickness) {
    const PieceSweep::Result got = swept(solid, axis, thickness);
    ASSERT_EQ(got.left.material.size(), 1U);
    expect_same(got.left.material, pieces(solid).material);
    EXPECT_TRUE(got.left.cavities.empty());
  });
}

std::vector<float> values(const Solid& solid) {
  std::vector<float> all;
  const auto tree = to_vdb(solid);
  for (auto leaf = tree->tree().cbeginLeaf(); leaf; ++leaf)
    all.insert(all.end(), leaf->buffer().data(), leaf->buffer().data() + 512);
  return all;
}

TEST(PieceSweep, cleans_as_the_whole_is_cleaned) {
  const CleanParams limits{.drop_below_vox = 300, .fill_below_vox = 200};
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Solid solid = make(clutter(seed));
    const CleanResult whole = clean(solid, limits);
    ASSERT_GT(whole.dropped, 0);
    ASSERT_GT(whole.filled, 0);
    for_cuts([&](int axis, int thickness) {
      const PieceSweep::Result got = swept(solid, axis, thickness, {.clean = limits});
      EXPECT_EQ(got.dropped, whole.dropped);
      EXPECT_EQ(got.filled, whole.filled);
      const Solid cleaned = flipped(solid, got.flips);
      EXPECT_EQ(values(cleaned), values(whole.solid));
      expect_same(swept(cleaned, axis, thickness).left.material, whole.left.material);
    });
  }
}

TEST(PieceSweep, tells_what_hangs_on_nothing) {
  // A shell, a ball on a thick neck, a ball on a thin one, and one that floats.
  const Shape wall = subtract(sphere({}, 11), sphere({}, 9));
  const Shape inner = unite({sphere({-5, 0, 0}, 2), capsule({-5, 0, 0}, {-10, 0, 0}, 1.2), sphere({5, 0, 0}, 2),
                             capsule({5, 0, 0}, {10, 0, 0}, 0.4), sphere({0, 0, 0}, 1)});
  const Solid solid = make(unite({wall, inner}));
  const std::vector<Unreached> whole = unreached(solid, wall, {.neck_mm = 1.6});
  ASSERT_EQ(whole.size(), 2U);
  for_cuts([&](int axis, int thickness) {
    const PieceSweep::Result got = swept(solid, axis, thickness, {.skin_mm = skin_mm(1.6, grid)}, wall);
    std::vector<Vec3d> loose;
    for (std::size_t i = 0; i < got.held.size(); ++i)
      if (!got.held[i]) loose.push_back(got.left.material[i].sample_mm);
    EXPECT_EQ(loose, (std::vector<Vec3d>{whole[0].piece.sample_mm, whole[1].piece.sample_mm}));
  });
}

/// As reach_test's: a bar of two halves, whose values say nothing of its depth. Well within a slab it is measured.
TEST(PieceSweep, what_values_of_a_union_understate_is_held) {
  const Shape wall = cuboid({{-10, -4, -4}, {-6, 4, 4}}), block = cuboid({{4, -2, -2}, {8, 2, 2}});
  const auto loose = [&](double half, int axis) {
    const Shape bar = unite({cuboid({{-7, 0.1 - half, 0.1 - half}, {5, 0.1, 0.1 + half}}),
                             cuboid({{-7, 0.1, 0.1 - half}, {5, 0.1 + half, 0.1 + half}})});
    const PieceSweep::Result got =
        swept(make(unite({wall, block, bar})), axis, high - low, {.skin_mm = skin_mm(1.2, grid)}, wall);
    return std::count(got.held.begin(), got.held.end(), false);
  };
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(loose(0.6, axis), 0);
    EXPECT_EQ(loose(0.3, axis), 1);
  }
}

TEST(PieceSweep, boxes_hold_their_pieces) {
  const Solid solid = make(unite({sphere({-5, 1, 2}, 3), sphere({6, 0, 0}, 2)}));
  for_cuts([&](int axis, int thickness) {
    const PieceSweep::Result got = swept(solid, axis, thickness);
    ASSERT_EQ(got.boxes.size(), 2U);
    EXPECT_EQ(got.boxes[0], (SampleBox{{-32, -8, -8}, {-8, 16, 24}}));
    EXPECT_EQ(got.boxes[1], (SampleBox{{16, -8, -8}, {32, 8, 8}}));
  });
}

TEST(Flips, hold_the_samples_that_change) {
  const Solid solid = make(clutter(5));
  const Flips flips = swept(solid, 2, 24, {.clean = {.drop_below_vox = 400, .fill_below_vox = 400}}).flips;
  ASSERT_FALSE(flips.blocks.empty());
  const Solid changed = flipped(solid, flips);
  int held = 0;
  for (int x = low; x < high; ++x)
    for (int y = low; y < high; ++y)
      for (int z = low; z < high; ++z) {
        const bool differs = (solid.at({x, y, z}) < 0) != (changed.at({x, y, z}) < 0);
        ASSERT_EQ(flips.holds({x, y, z}), differs) << x << " " << y << " " << z;
        held += differs ? 1 : 0;
      }
  EXPECT_GT(held, 50);
}

}  // namespace
}  // namespace fibrolite
