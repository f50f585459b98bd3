// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/tcs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr double root2 = std::numbers::sqrt2;

/// Every stick and ball of a block of cells, as the definition of diamond cubic says.
struct BruteForce {
  explicit BruteForce(const TcsParams& p) : params(p) {
    const double nodes[4][3] = {{0, 0, 0}, {0, .5, .5}, {.5, 0, .5}, {.5, .5, 0}};
    const double bonds[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    const Vec3d cell{p.cell_mm, p.cell_mm, p.stretch_z ? root2 * p.cell_mm : p.cell_mm};
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) {
        for (int k = -2; k <= 2; ++k) {
          for (const auto& n : nodes) {
            const Vec3d a{cell.x * (i + n[0]) + p.shift_mm.x, cell.y * (j + n[1]) + p.shift_mm.y,
                          cell.z * (k + n[2]) + p.shift_mm.z};
            for (const auto& b : bonds) {
              const Vec3d to = a + Vec3d{0.25 * cell.x * b[0], 0.25 * cell.y * b[1], 0.25 * cell.z * b[2]};
              sticks.push_back({a, to, 0.5 * p.stick_mm});
              balls.push_back(a);
              balls.push_back(to);
            }
          }
        }
      }
    }
  }
  [[nodiscard]] double distance(Vec3d p) const {
    double best = 1e9;
    for (const Capsule& s : sticks) {
      const Vec3d ab = s.b - s.a;
      const double t = std::clamp(dot(p - s.a, ab) / dot(ab, ab), 0.0, 1.0);
      best = std::min(best, norm(p - s.a - t * ab) - s.radius_mm);
    }
    for (const Vec3d b : balls) best = std::min(best, norm(p - b) - 0.5 * params.ball_mm);
    return best;
  }
  TcsParams params;
  std::vector<Capsule> sticks;
  std::vector<Vec3d> balls;
};

class CrystalDistance : public ::testing::TestWithParam<TcsParams> {};

TEST_P(CrystalDistance, equals_brute_force) {
  const TcsParams params = GetParam();
  const BruteForce truth(params);
  const Shape shape = crystal(params);
  Random random(7, "tcs_test");
  for (int i = 0; i < 4000; ++i) {
    const double side = params.cell_mm;
    const Vec3d p{side * (random.uniform() - 0.5), side * (random.uniform() - 0.5),
                  side * 1.4 * (random.uniform() - 0.5)};
    ASSERT_NEAR(shape(p), truth.distance(p), 2e-4) << p.x << ' ' << p.y << ' ' << p.z;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Forms, CrystalDistance,
    ::testing::Values(TcsParams{}, TcsParams{.cell_mm = 5, .stick_mm = 1, .ball_mm = 1.6},
                      TcsParams{.shift_mm = {1.1, -0.7, 2.3}}, TcsParams{.ball_mm = 0.8}, TcsParams{.stretch_z = true},
                      TcsParams{.cell_mm = 8, .ball_mm = 2.2, .shift_mm = {0.3, 0, 1}, .stretch_z = true}));

TEST(Crystal, volume_of_one_cell_is_sticks_and_balls) {
  // Balls of the stick's diameter vanish in round joints; with large balls the sticks' overlaps with each other lie
  // inside the balls, so the cell holds 8 balls and 16 sticks shortened by the ball caps at both ends.
  const TcsParams p{.cell_mm = 10, .stick_mm = 1.0, .ball_mm = 3.0};
  const double r = 0.5 * p.stick_mm, big = 0.5 * p.ball_mm, bond = std::sqrt(3.0) / 4 * p.cell_mm;
  const double depth = std::sqrt(big * big - r * r);  // where the stick's side leaves the ball
  const double cap = std::numbers::pi * (big - depth) * (big - depth) * (3 * big - (big - depth)) / 3;
  const double stick = std::numbers::pi * r * r * (bond - 2 * depth) - 2 * cap;
  const double expected = 8 * 4.0 / 3 * std::numbers::pi * big * big * big + 16 * stick;

  const Shape shape = crystal(p);
  const int n = 200;  // midpoint rule over one cell
  std::vector<Vec3d> row(n);
  std::vector<float> value(n);
  double inside = 0;
  const double step = p.cell_mm / n;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k)
        row[static_cast<std::size_t>(k)] = {(i + .5) * step, (j + .5) * step, (k + .5) * step};
      shape.evaluate(row, value);
      for (const float v : value) inside += std::clamp(0.5 - v / step, 0.0, 1.0);
    }
  }
  EXPECT_NEAR(inside * step * step * step / expected, 1.0, 0.01);
}

TEST(Crystal, shifting_changes_the_volume_in_a_ball_by_less_than_the_paper_saw) {
  const auto volume = [](Vec3d shift) {
    const Shape body = sphere({0, 0, 0}, 32);  // eleven cells across: what the rim cuts off weighs little
    return realize(intersect({body, crystal({.shift_mm = shift})}), Box3d{{-33, -33, -33}, {33, 33, 33}},
                   {.voxel_mm = 0.35})
        .volume_mm3();
  };
  const double still = volume({});
  for (const Vec3d shift : {Vec3d{1.5, 0, 0}, Vec3d{0, 2.2, 0}, Vec3d{0, 0, -1.1}, Vec3d{1, 1, 2}}) {
    EXPECT_NEAR(volume(shift) / still, 1.0, 0.017);
  }
}

TEST(Crystal, bad_sizes_are_refused) {
  for (const TcsParams& p : {TcsParams{.stick_mm = 0}, TcsParams{.ball_mm = 0.5}, TcsParams{.cell_mm = 3}}) {
    try {
      (void)crystal(p);
      FAIL() << "no error";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), Code::BadRecipe);
    }
  }
}

}  // namespace
}  // namespace fibrolite
