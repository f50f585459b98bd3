// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/measure.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numbers>

#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr Box3d box{{-12, -12, -12}, {12, 12, 12}};
constexpr double ball = 4.0 / 3 * std::numbers::pi;

TEST(Measure, parts_share_a_sphere) {
  const Solid body = realize(sphere({0, 0, 0}, 10), box, {.voxel_mm = 0.25, .band_vox = 8});
  const Shape low = half_space({0, 0, 0.03}, {0, 0, 1});
  const Solid solid = realize(subtract(sphere({0, 0, 0}, 10), sphere({0, 0, 0}, 6)), body);
  const Volumes all = measure(body, solid, {low, complement(low)}, 1);
  const auto& parts = all.parts;
  ASSERT_EQ(parts.size(), 2U);
  for (const PartVolumes& p : parts) {
    EXPECT_NEAR(p.part_mm3 / (0.5 * ball * 1000), 1, 0.01);
    EXPECT_NEAR(p.lumen_mm3 / (0.5 * ball * 729), 1, 0.01);
    EXPECT_NEAR(p.infill_mm3 / (0.5 * ball * (729 - 216)), 1, 0.02);
  }
  EXPECT_EQ(all.body_mm3, body.volume_mm3());
  EXPECT_EQ(all.solid_mm3, solid.volume_mm3());
  EXPECT_NEAR(parts[0].centroid_mm.z, -3.0 / 8 * 10, 0.05);
  EXPECT_NEAR(parts[1].centroid_mm.z, 3.0 / 8 * 10, 0.05);
}

/// Wherever the shell's inner face runs through its voxels.
TEST(Measure, a_shell_alone_is_no_infill) {
  for (const double inner : {8.9, 9.0, 9.05}) {
    const Solid body = realize(cuboid({{-10, -10, -10}, {10, 10, 10}}), box, {.voxel_mm = 0.25, .band_vox = 8});
    const Solid solid = realize(
        subtract(cuboid({{-10, -10, -10}, {10, 10, 10}}), cuboid({{-inner, -inner, -inner}, {inner, inner, inner}})),
        body);
    for (const Shape& region : {everything(), half_space({0, 0, 0.03}, {0, 0, 1})}) {
      const auto parts = measure(body, solid, {region, complement(region)}, 10 - inner).parts;
      EXPECT_LT(parts[0].infill_mm3 / parts[0].lumen_mm3, 0.001) << inner;
    }
    EXPECT_LT(measure(body, solid, {everything()}, 10 - inner).parts[0].infill_mm3, 6) << inner;
  }
}

TEST(Measure, same_bits_on_one_and_two_threads) {
  const Solid body = realize(sphere({0, 0, 0}, 10), box, {.voxel_mm = 0.3, .band_vox = 6});
  double part[2], moment[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    const auto parts =
        measure(body, body, {half_space({1, 2, 3}, {1, 1, 1}), half_space({1, 2, 3}, {-1, -1, -1})}, 1).parts;
    part[threads - 1] = parts[0].infill_mm3;
    moment[threads - 1] = parts[1].centroid_mm.x;
  }
  EXPECT_EQ(part[0], part[1]);
  EXPECT_EQ(moment[0], moment[1]);
}

}  // namespace
}  // namespace fibrolite
