// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/strength.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"
#include "models.h"

namespace fibrolite {
namespace {

using ::testing::HasSubstr;

/// A bar of 10 x 10 x 40 mm, filled, as a run would hand it over.
Hybrid bar() {
  Hybrid hybrid;
  const Box3d box{{-5, -5, 0}, {5, 5, 40}};
  hybrid.solid = realize(cuboid(box), box.grown(2), Grid{.voxel_mm = 0.5});
  Mesh mesh = testing::cube(1);
  for (Vec3f& v : mesh.vertices) v = {10 * v.x - 5, 10 * v.y - 5, 40 * v.z};
  hybrid.body = cuboid(box);
  hybrid.parts = whole_body(mesh, Kind::Bulk);
  return hybrid;
}

Support slides(Vec3d along, Vec3d point) {
  Support support;
  support.where.half_spaces = {{point, along}};
  support.sliding = Direction{Direction::Of::World, along};
  return support;
}

/// Pulled at its end, free to become thinner.
Recipe pulled(double newton) {
  Recipe recipe;
  recipe.material = {.density_g_cm3 = 1.2, .young_mpa = 2000, .poisson = 0.3, .yield_mpa = 40};
  recipe.shell.thickness_mm = 1.25;
  TotalForce pull{.newton = newton, .direction = {Direction::Of::Up, {}}, .where = {}};
  pull.where.seen_from = Direction{Direction::Of::Up, {}};
  recipe.verify.loads = {
      {"pull",
       {slides({0, 0, 1}, {0, 0, 0.2}), slides({1, 0, 0}, {-4.8, 0, 0}), slides({0, 1, 0}, {0, -4.8, 0})},
       {pull}}};
  return recipe;
}

TEST(Strength, a_bar_fails_at_yield_times_area) {
  const auto answers = strength(bar(), pulled(500));
  ASSERT_EQ(answers.size(), 1U);
  const StrengthReport& s = answers.front();
  EXPECT_EQ(s.load_case, "pull");
  EXPECT_EQ(s.load_n, 500);
  EXPECT_NEAR(s.failure_load_n, 40 * 100, 40);
  EXPECT_NEAR(s.safety_factor, 8, 0.08);
  EXPECT_NEAR(s.p99_von_mises_mpa, 5, 0.05);
  EXPECT_NEAR(s.max_displacement_mm, 5.0 / 2000 * 40, 0.02 * 5.0 / 2000 * 40);
  EXPECT_NEAR(s.compliance_n_mm, 500 * 5.0 / 2000 * 40, 0.02 * 500 * 5.0 / 2000 * 40);
  EXPECT_LT(s.residual, 1e-6);
  EXPECT_THAT(s.weakest, HasSubstr("part 0"));
  // Its skin and its inside carry the same stress.
  ASSERT_EQ(s.places.size(), 2U);
  EXPECT_EQ(s.weakest, s.places.front().name);
  for (const PlaceReport& place : s.places) {
    EXPECT_NEAR(place.failure_load_n, 4000, 40) << place.name;
    if (place.name.find("infill") == 0) {
      EXPECT_NEAR(place.volume_mm3, 7.5 * 7.5 * 37.5, 1) << "1.25 mm of shell all around";
    }
  }
}

TEST(Strength, is_linear_and_coarser_cells_agree) {
  const auto once = strength(bar(), pulled(500)).front();
  const auto twice = strength(bar(), pulled(1000)).front();
  EXPECT_NEAR(twice.failure_load_n, once.failure_load_n, 1e-4 * once.failure_load_n);
  EXPECT_NEAR(twice.compliance_n_mm, 4 * once.compliance_n_mm, 1e-3 * twice.compliance_n_mm);
  const auto coarse = strength(bar(), pulled(500), {.coarsen = 2}).front();
  EXPECT_NEAR(coarse.failure_load_n, once.failure_load_n, 0.02 * once.failure_load_n);
  EXPECT_NEAR(coarse.cell_mm, 1, 1e-12);
}

TEST(Strength, its_own_weight_stands_on_its_foot) {
  Recipe recipe;
  recipe.material = {.density_g_cm3 = 1.2, .young_mpa = 2000, .poisson = 0.3, .yield_mpa = 40};
  recipe.verify.loads = load_preset("stand");
  const auto s = strength(bar(), recipe).front();
  EXPECT_NEAR(s.load_n, 4000 * 1.2e-6 * 9.80665, 0.01 * 4000 * 1.2e-6 * 9.80665);
  // Its top sinks by rho g L^2 / 2E, of the length above the foot.
  const double sinks = 1.2e-6 * 9.80665 * 38 * 38 / (2 * 2000);
  EXPECT_NEAR(s.max_displacement_mm, sinks, 0.05 * sinks);
}

TEST(Strength, what_it_cannot_do_it_says) {
  const auto message = [](const Recipe& recipe, const StrengthParams& params = {}) -> std::string {
    try {
      (void)strength(bar(), recipe, params);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  };
  Recipe pressed = pulled(500);
  Pressure pressure{.mpa = 1, .where = {}};
  pressure.where.box_mm = Box3d{{-6, -6, 39}, {6, 6, 41}};
  pressed.verify.loads[0].forces = {pressure};
  EXPECT_THAT(message(pressed), HasSubstr("pressure"));
  Recipe nowhere = pulled(500);
  std::get<TotalForce>(nowhere.verify.loads[0].forces[0]).where.box_mm = Box3d{{50, 50, 50}, {60, 60, 60}};
  EXPECT_NE(message(nowhere), "nothing");
  EXPECT_THAT(message(pulled(500), {.coarsen = 3}), HasSubstr("1, 2 or 4"));
}

}  // namespace
}  // namespace fibrolite
