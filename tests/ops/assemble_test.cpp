// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/assemble.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/pieces.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/to_solid.h"
#include "models.h"

namespace fibrolite {
namespace {

constexpr Box3d box{{-12, -12, -12}, {12, 12, 12}};

Vec3d point(Random& random) {
  return {24 * (random.uniform() - 0.5), 24 * (random.uniform() - 0.5), 24 * (random.uniform() - 0.5)};
}

TEST(Assemble, has_the_sign_of_the_formula_everywhere) {
  const Shape body = sphere({0, 0, 0}, 10);
  const Shape low = half_space({0, 0, 1}, {0, 0, 1}), high = complement(low);
  const Shape a = crystal({.cell_mm = 5}), b = capsules({{{-9, 0, 4}, {9, 1, 4}, 1}, {{0, -9, 6}, {0, 9, 6}, 1}});
  const Shape joint = cuboid({{-20, -20, 0.5}, {20, 20, 1.5}});
  const double t = 1, overlap = 0.25;
  const Shape made = assemble(body, {{low, a}, {high, b}}, {joint}, {.shell_mm = t, .overlap_mm = overlap});
  Random random(2, "assemble");
  std::vector<Vec3d> points(512);
  std::vector<float> values(512);
  for (int round = 0; round < 40; ++round) {
    const Vec3d near = point(random);
    for (Vec3d& p : points) p = round % 2 == 0 ? point(random) : near + (1.0 / 12) * point(random);
    made.evaluate(points, values);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3d p = points[i];
      const double fill = std::min(std::max<double>(a(p), low(p) - overlap), std::max<double>(b(p), high(p) - overlap));
      const double truth = std::max<double>(body(p), std::min({-(body(p) + t), fill, static_cast<double>(joint(p))}));
      if (std::abs(truth) > 1e-4) {
        ASSERT_EQ(values[i] < 0, truth < 0) << p.x << " " << p.y << " " << p.z;
      }
    }
  }
}

TEST(Assemble, a_sphere_without_fill_is_its_shell) {
  const Shape hollow = shell(sphere({0, 0, 0}, 10), 1);
  const Solid solid = realize(hollow, box, {.voxel_mm = 0.3});
  EXPECT_NEAR(solid.volume_mm3() / (4.0 / 3 * std::numbers::pi * (1000 - 729)), 1, 0.003);
  const Pieces found = pieces(solid);
  EXPECT_EQ(found.material.size(), 1U);
  EXPECT_EQ(found.cavities.size(), 1U);
}

/// At every voxel, also where rounding would have what is deeper than the shell by the band a little less deep.
TEST(Assemble, what_is_far_from_a_face_is_no_active_voxel) {
  const double edge = 8, shell_mm = 1;
  const Mesh mesh = testing::cube(edge);
  for (const double voxel : {0.1, 0.0875, 0.075, 0.0625, 0.05, 0.04}) {
    const Solid body =
        to_solid(mesh, {.grid = {.voxel_mm = voxel}, .inside_band_mm = depth_for_shell(shell_mm, voxel)}).solid;
    const Solid solid = realize(shell(distance_to(body), shell_mm), body);
    const double faces = 6 * (edge * edge + (edge - 2) * (edge - 2)) / (voxel * voxel), band = 6;
    const double share = static_cast<double>(solid.active_voxels()) / (band * faces);
    EXPECT_GT(share, 0.8) << voxel;  // five samples of six where faces lie on samples
    EXPECT_LT(share, 1.05) << voxel;
  }
}

TEST(Assemble, no_sheet_or_pinhole_where_a_fill_meets_the_shell) {
  // A fill that is everything must give the full body, whatever the part borders are.
  const Shape body = sphere({0.1, 0.2, 0.3}, 9);
  const Shape low = half_space({0, 0, 0.05}, {0, 0, 1});
  const Solid solid = realize(
      assemble(body, {{low, everything()}, {complement(low), everything()}}, {}, {.shell_mm = 1, .overlap_mm = 0.3}),
      box, {.voxel_mm = 0.3});
  EXPECT_NEAR(solid.volume_mm3() / (4.0 / 3 * std::numbers::pi * 729), 1, 0.001);
  EXPECT_TRUE(pieces(solid).cavities.empty());
}

TEST(Assemble, bound_holds) {
  const Shape body = sphere({0, 0, 0}, 10), low = half_space({0, 0, 1}, {0, 0, 1});
  const Shape made = assemble(body, {{low, crystal({})}, {complement(low), nothing()}}, {}, {});
  Random random(8, "bound");
  for (int i = 0; i < 300; ++i) {
    const Vec3d corner = point(random);
    const Box3d b{corner, corner + Vec3d{2, 2, 2}};
    const Interval bound = made.bound(b);
    for (int k = 0; k < 20; ++k) {
      const float v = made(corner + 2 * Vec3d{random.uniform(), random.uniform(), random.uniform()});
      ASSERT_GE(v, bound.lo - 1e-4F);
      ASSERT_LE(v, bound.hi + 1e-4F);
    }
  }
}

}  // namespace
}  // namespace fibrolite
