// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/realize.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/random.h"

namespace fibrolite {
namespace {

constexpr double pi = std::numbers::pi;
constexpr Box3d box{{-12, -12, -12}, {12, 12, 12}};

TEST(Realize, volumes_are_analytic) {
  EXPECT_NEAR(realize(sphere({0.1, 0.2, 0.3}, 8), box, {.voxel_mm = 0.5}).volume_mm3(), 4.0 / 3 * pi * 512, 2);
  EXPECT_NEAR(realize(torus(frame_along({}, {1, 2, 3}), 6, 2), box, {.voxel_mm = 0.4}).volume_mm3(),
              2 * pi * pi * 6 * 4, 2);
  EXPECT_NEAR(realize(cuboid({{-5.03, -4, -3}, {5, 4.11, 3}}), box, {.voxel_mm = 0.25}).volume_mm3(), 10.03 * 8.11 * 6,
              2);
}

TEST(Realize, samples_are_the_distance_in_the_band_and_signed_beyond) {
  const Shape shape = capsule({-5, 0, 0}, {5, 3, 1}, 4);
  const Solid solid = realize(shape, box, {.voxel_mm = 0.5});
  Random random(1, "realize");
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p{0.5 * (static_cast<int>(random.below(41)) - 20), 0.5 * (static_cast<int>(random.below(41)) - 20),
                  0.5 * (static_cast<int>(random.below(41)) - 20)};
    const float truth = shape(p);
    if (std::abs(truth) < 1.4F) {
      ASSERT_NEAR(solid.distance(p), truth, 1e-3);
    } else {
      ASSERT_EQ(solid.distance(p) < 0, truth < 0);
    }
  }
}

TEST(Realize, inside_a_body_gives_the_same_as_in_its_box) {
  const Shape body = sphere({0, 0, 0}, 10), inner = subtract(body, sphere({2, 0, 0}, 5));
  const Grid grid{.voxel_mm = 0.5};
  const Solid a = realize(inner, box, grid), b = realize(inner, realize(body, box, grid));
  EXPECT_EQ(a.active_voxels(), b.active_voxels());
  EXPECT_EQ(a.volume_mm3(), b.volume_mm3());
}

TEST(Realize, what_leaves_the_region_is_cut_flat_and_closed) {
  const Solid solid = realize(sphere({0, 0, 0}, 8), Box3d{{-12, -12, 0}, {12, 12, 12}}, {.voxel_mm = 0.5});
  EXPECT_NEAR(solid.volume_mm3() / (2.0 / 3 * pi * 512), 1, 0.01);
}

TEST(Realize, same_values_on_one_and_two_threads) {
  const Shape shape = unite({torus({}, 7, 2), capsule({0, 0, -9}, {0, 0, 9}, 1.5)});
  double volume[2];
  std::int64_t active[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    const Solid solid = realize(shape, box, {.voxel_mm = 0.3});
    volume[threads - 1] = solid.volume_mm3();
    active[threads - 1] = solid.active_voxels();
  }
  EXPECT_EQ(volume[0], volume[1]);
  EXPECT_EQ(active[0], active[1]);
}

TEST(Realize, a_zero_on_the_lattice_is_nudged_off) {
  const Solid solid = realize(cuboid({{-5, -5, -5}, {5, 5, 5}}), box, {.voxel_mm = 0.5});
  EXPECT_GT(std::abs(solid.distance({5, 0, 0})), 1e-4F);
}

TEST(Realize, refuses_a_voxel_that_is_no_length) {
  for (const double voxel : {0.0, -1.0, std::nan("")}) {
    EXPECT_THROW((void)realize(sphere({}, 1), box, {.voxel_mm = voxel}), Error);
  }
}

TEST(Realize, stops_when_cancelled) {
  const Context context;
  context.cancel();
  try {
    (void)realize(sphere({}, 8), box, {.voxel_mm = 0.2}, context);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), Code::Cancelled);
  }
}

}  // namespace
}  // namespace fibrolite
