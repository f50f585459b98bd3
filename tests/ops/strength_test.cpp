// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/strength.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "elasticity.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/ops/tetrahedralize.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "fibrolite/voxel_fem.h"
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

TEST(Strength, a_pressure_on_its_end_is_a_force_over_its_area) {
  Recipe recipe = pulled(500);
  Pressure pressure{.mpa = -5, .where = {}};
  pressure.where.box_mm = Box3d{{-6, -6, 39}, {6, 6, 41}};
  pressure.where.half_spaces = {{{0, 0, 39.9}, {0, 0, -1}}};
  pressure.where.label = 0;
  recipe.verify.loads[0].forces = {pressure};
  const auto s = strength(bar(), recipe).front();
  // The planes reach half a cell farther, so a brim of the sides is sucked too: 4 x 10 x 0.5 mm2 of cells half full.
  EXPECT_NEAR(s.load_n, 500, 0.06 * 500);
  EXPECT_GT(s.load_n, 500);
  EXPECT_NEAR(s.failure_load_n, 4000, 0.06 * 4000);
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
  Recipe unknown = pulled(500);
  std::get<TotalForce>(unknown.verify.loads[0].forces[0]).where.label = 3;
  EXPECT_THAT(message(unknown), HasSubstr("label 3"));
  Recipe nowhere = pulled(500);
  std::get<TotalForce>(nowhere.verify.loads[0].forces[0]).where.box_mm = Box3d{{50, 50, 50}, {60, 60, 60}};
  EXPECT_THAT(message(nowhere), HasSubstr("load case 'pull': load 1 meets no material"));
  EXPECT_THAT(message(pulled(500), {.coarsen = 3}), HasSubstr("1, 2 or 4"));
}

/// 2 x 2 x 2 cells of crystal between plates of 1 mm.
Shape sandwich() {
  const Shape crystal_block =
      intersect({crystal({.cell_mm = 6, .stick_mm = 1.2, .ball_mm = 1.8, .shift_mm = {1, 1, 1}}),
                 cuboid({{0, 0, 0}, {12, 12, 12}})});
  return unite({crystal_block, cuboid({{0, 0, -1}, {12, 12, 0.2}}), cuboid({{0, 0, 11.8}, {12, 12, 13}})});
}

/// Displacement under the load per newton, the upper plate pressed down by its weight, on tetrahedra.
double compliance_on_tets(const Material& material) {
  const Box3d box{{-1, -1, -2}, {13, 13, 14}};
  const TetMesh mesh = tetrahedralize(surface(realize(sandwich(), box, Grid{.voxel_mm = 0.25})), {.radius_edge = 2});
  std::vector<fem::Fixed> fixed;
  for (std::uint32_t n = 0; n < mesh.nodes.size(); ++n)
    for (int axis = 0; axis < 3; ++axis)
      if (mesh.nodes[n].z < -0.9) fixed.push_back({n, axis});
  fem::LoadCase load;
  load.force_n.resize(mesh.nodes.size());
  double newton = 0;
  for (const auto& tet : mesh.tets) {
    const Vec3d a = mesh.nodes[tet[0]], b = mesh.nodes[tet[1]], c = mesh.nodes[tet[2]], d = mesh.nodes[tet[3]];
    if ((a.z + b.z + c.z + d.z) / 4 < 12) continue;
    const double volume = dot(b - a, cross(c - a, d - a)) / 6;
    newton += volume;  // of a constant body force a corner takes -1/20, the middle of an edge 1/5
    for (std::size_t k = 0; k < 10; ++k) load.force_n[tet[k]].z += volume * (k < 4 ? 0.05 : -0.2);
  }
  const auto solved = fem::solve(mesh, material, fixed, {load}).front();
  double work = 0;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) work += dot(load.force_n[n], solved.displacement_mm[n]);
  return work / (newton * newton);
}

double compliance_on_voxels(const Material& material, double voxel_mm) {
  const Box3d box{{-1, -1, -2}, {13, 13, 14}};
  VoxelFemProblem problem;
  problem.solid = realize(sandwich(), box, Grid{.voxel_mm = voxel_mm});
  problem.young_mpa = material.young_mpa;
  problem.poisson = material.poisson;
  problem.supports.push_back({.where = half_space({0, 0, -0.9}, {0, 0, 1}), .displacement_mm = {}});
  problem.body_force_n_mm3 = [](Vec3d p) { return Vec3d{0, 0, p.z < 12 ? 0.0 : -1.0}; };
  const VoxelFemResult solved = solve(problem);
  return solved.compliance_n_mm / (solved.load_n.z * solved.load_n.z);
}

/// Two methods that share no line: surface, TetGen and ten-node tetrahedra; samples and cubes.
TEST(Strength, tetrahedra_and_voxels_agree_on_a_crystal) {
  const Material material{.density_g_cm3 = 1.2, .young_mpa = 2000, .poisson = 0.35, .yield_mpa = 40};
  const double tets = compliance_on_tets(material);
  const double voxels = compliance_on_voxels(material, 0.2);
  EXPECT_NEAR(voxels, tets, 0.05 * tets);
  EXPECT_LT(voxels, tets) << "six voxels to a stick: too stiff by about 1.3 / 36";
}

}  // namespace
}  // namespace fibrolite
