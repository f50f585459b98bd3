// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/voxel_fem.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

/// A box of whole cells: faces half a voxel beside the samples.
Solid block(Vec3i cells, double voxel) {
  const Vec3d low{-0.5 * voxel, -0.5 * voxel, -0.5 * voxel};
  const Box3d box{low, low + voxel * Vec3d{1.0 * cells.x, 1.0 * cells.y, 1.0 * cells.z}};
  return realize(cuboid(box), box.grown(4 * voxel), {.voxel_mm = voxel});
}
/// Everything within half a voxel of the plane x = at.
Shape plane_x(double at, double voxel) {
  return cuboid({{at - 0.4 * voxel, -1e3, -1e3}, {at + 0.4 * voxel, 1e3, 1e3}});
}
template <class Call>
Code code_of(const Call& call) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.code();
  }
  ADD_FAILURE() << "nothing thrown";
  return Code::Internal;
}

TEST(VoxelFem, a_linear_displacement_field_is_exact) {
  const auto field = [](Vec3d p) {
    return Vec3d{0.001 * p.x + 0.002 * p.y - 0.003 * p.z, 0.0005 * p.x - 0.001 * p.y, 0.004 * p.z + 0.002 * p.x};
  };
  VoxelFemProblem problem;
  problem.solid = block({20, 11, 13}, 0.5);
  const Box3d inner{{0.01, 0.01, 0.01}, {9.4, 4.9, 5.9}};
  problem.supports = {{complement(cuboid(inner)), {true, true, true}, field}};
  problem.residual = 1e-10;
  const auto result = solve(problem);
  for (const Vec3d p : {Vec3d{2, 2, 2}, Vec3d{5.3, 3.1, 4.7}, Vec3d{9.1, 4.4, 0.3}}) {
    const auto u = result.displacement_mm(p);
    ASSERT_TRUE(u.has_value());
    EXPECT_LT(norm(*u - field(p)), 1e-6 * 0.04);
  }
  EXPECT_FALSE(result.displacement_mm({20, 2, 2}).has_value());
}

/// End x = 0 held, end x = L loaded: faces of cells lie on both.
struct Bar {
  double voxel;
  Vec3i cells;
  [[nodiscard]] double left() const { return -0.5 * voxel; }
  [[nodiscard]] double right() const { return (cells.x - 0.5) * voxel; }
  [[nodiscard]] VoxelFemProblem problem(Vec3d force) const {
    VoxelFemProblem p;
    p.solid = block(cells, voxel);
    p.supports = {{plane_x(left(), voxel), {true, true, true}, {}}};
    p.forces = {{plane_x(right(), voxel), force}};
    return p;
  }
};

TEST(VoxelFem, a_bar_in_tension_carries_force_by_area_everywhere) {
  const Bar bar{0.5, {40, 10, 8}};
  VoxelFemProblem problem = bar.problem({100, 0, 0});
  // Rollers on three sides: nothing hinders the bar from getting thinner.
  const auto plane = [&](int axis) {
    Box3d box{{-1e3, -1e3, -1e3}, {1e3, 1e3, 1e3}};
    (axis == 0 ? box.max.x : axis == 1 ? box.max.y : box.max.z) = -0.4 * 0.5;
    return cuboid(box);
  };
  problem.supports = {
      {plane(0), {true, false, false}, {}}, {plane(1), {false, true, false}, {}}, {plane(2), {false, false, true}, {}}};
  problem.residual = 1e-9;
  const auto result = solve(problem);
  const double area = 5.0 * 4.0, stress = 100 / area;
  EXPECT_NEAR(result.max_von_mises_mpa / stress, 1, 1e-6);
  EXPECT_NEAR(result.p99_von_mises_mpa / stress, 1, 1e-6);
  EXPECT_NEAR(result.peak_von_mises_mpa / stress, 1, 1e-6);
  EXPECT_NEAR(result.compliance_n_mm / (100 * stress / problem.young_mpa * 20), 1, 1e-6);
  EXPECT_NEAR(result.volume_mm3, area * 20, 1e-3);
  EXPECT_NEAR(norm(result.load_n + result.reaction_n), 0, 1e-6);
  const double yield = 50;
  EXPECT_NEAR(yield / result.max_von_mises_mpa * 100 / (yield * area), 1, 0.01);  // failing load / (yield * area)
}

TEST(VoxelFem, a_pressure_acts_against_the_normal_of_any_surface) {
  // A ball under pressure from all sides: p everywhere, no von Mises stress, no net force.
  const double voxel = 0.5, radius = 6;
  VoxelFemProblem problem;
  problem.solid = realize(sphere({}, radius), {{-7, -7, -7}, {7, 7, 7}}, {.voxel_mm = voxel});
  problem.poisson = 0.3;
  problem.supports = {{sphere({}, 0.6), {true, true, true}, {}}};
  problem.pressures = {{everything(), 2.0}};
  const auto result = solve(problem);
  const double area = 4 * std::numbers::pi * radius * radius;
  EXPECT_NEAR(result.pressed_n, 2 * area, 0.03 * 2 * area);
  EXPECT_LT(norm(result.load_n), 1e-6 * result.pressed_n);
  // It shrinks by p (1 - 2 nu) / E.
  const double shrinks = 2.0 * (1 - 2 * 0.3) / problem.young_mpa * 4;
  const auto at = result.displacement_mm({4, 0, 0});
  ASSERT_TRUE(at.has_value());
  EXPECT_NEAR(at->x, -shrinks, 0.03 * shrinks);
}

/// The sides lie between samples: partly filled cells carry their share, and no more.
TEST(VoxelFem, partly_filled_cells_carry_their_share) {
  const double voxel = 0.5;
  const Box3d box{{-0.25, -0.25, -0.25}, {19.75, 4.4, 3.6}};
  VoxelFemProblem problem;
  problem.solid = realize(cuboid(box), box.grown(2), {.voxel_mm = voxel});
  problem.supports = {{plane_x(-0.25, voxel), {true, true, true}, {}}};
  problem.forces = {{plane_x(19.75, voxel), {100, 0, 0}}};
  const auto result = solve(problem);
  const double area = 4.65 * 3.85;
  const auto middle = result.von_mises_mpa({9.9, 2.1, 1.6});
  ASSERT_TRUE(middle.has_value());
  EXPECT_NEAR(*middle / (100 / area), 1, 0.005);
}

TEST(VoxelFem, a_cantilever_bends_as_timoshenko_says) {
  const Bar bar{0.5, {160, 16, 8}};
  VoxelFemProblem problem = bar.problem({0, 10, 0});
  problem.poisson = 0.3;
  const auto result = solve(problem);
  const double length = 80, depth = 8, width = 4, e = problem.young_mpa, g = e / 2.6;
  const double area = depth * width, inertia = width * depth * depth * depth / 12, shear = 10 * 1.3 / (12 + 11 * 0.3);
  const double expected = 10 * length * length * length / (3 * e * inertia) + 10 * length / (shear * g * area);
  const auto tip = result.displacement_mm({bar.right() - 0.01, 3.75, 1.75});
  ASSERT_TRUE(tip.has_value());
  EXPECT_NEAR(tip->y / expected, 1, 0.03);
  EXPECT_NEAR(norm(result.load_n + result.reaction_n), 0, 1e-3);
  // The strip two voxels thick: the cells bend without locking.
  const Bar strip{0.5, {60, 2, 4}};
  VoxelFemProblem thin = strip.problem({0, 0.1, 0});
  thin.poisson = 0;
  const double thin_inertia = 2.0 * 1 / 12;
  const double thin_expected = 0.1 * 30 * 30 * 30 / (3 * e * thin_inertia) + 0.1 * 30 / (5.0 / 6 * e / 2 * 2.0);
  const auto end = solve(thin).displacement_mm({strip.right() - 0.01, 0.25, 0.75});
  ASSERT_TRUE(end.has_value());
  EXPECT_NEAR(end->y / thin_expected, 1, 0.03);
}

/// u = (sin cos cos, 2 cos sin cos, - cos cos sin) of pi p / L: no normal displacement and no shear on any face, so
/// rollers all around hold it; its body force follows from the equations of elasticity.
double manufactured_error(int cells) {
  constexpr double length = 8, k = std::numbers::pi / length, a = 1e-3, e = 1000, nu = 0.3;
  constexpr double lambda = e * nu / ((1 + nu) * (1 - 2 * nu)), mu = e / (2 * (1 + nu));
  const double voxel = length / cells;
  const auto local = [=](Vec3d p) { return k * (p + Vec3d{0.5 * voxel, 0.5 * voxel, 0.5 * voxel}); };
  const auto field = [=](Vec3d p) {
    const Vec3d q = local(p);
    return a * Vec3d{std::sin(q.x) * std::cos(q.y) * std::cos(q.z), 2 * std::cos(q.x) * std::sin(q.y) * std::cos(q.z),
                     -std::cos(q.x) * std::cos(q.y) * std::sin(q.z)};
  };
  VoxelFemProblem problem;
  problem.solid = block({cells, cells, cells}, voxel);
  problem.young_mpa = e;
  problem.poisson = nu;
  problem.residual = 1e-9;
  problem.body_force_n_mm3 = [=](Vec3d p) {
    const Vec3d q = local(p), u = field(p);
    // div u = 2 a k cos cos cos; its gradient is - 2 a k^2 (sin cos cos, ...).
    const Vec3d gradient =
        -2 * a * k * k *
        Vec3d{std::sin(q.x) * std::cos(q.y) * std::cos(q.z), std::cos(q.x) * std::sin(q.y) * std::cos(q.z),
              std::cos(q.x) * std::cos(q.y) * std::sin(q.z)};
    return -(lambda + mu) * gradient + 3 * mu * k * k * u;
  };
  const double low = -0.5 * voxel + 0.1 * voxel, high = length - 0.5 * voxel - 0.1 * voxel;
  problem.supports = {{complement(cuboid({{low, -1e3, -1e3}, {high, 1e3, 1e3}})), {true, false, false}, {}},
                      {complement(cuboid({{-1e3, low, -1e3}, {1e3, high, 1e3}})), {false, true, false}, {}},
                      {complement(cuboid({{-1e3, -1e3, low}, {1e3, 1e3, high}})), {false, false, true}, {}}};
  const auto result = solve(problem);
  double sum = 0;
  int count = 0;
  const int points = 37;  // between the nodes of either lattice
  for (int i = 0; i < points; ++i) {
    for (int j = 0; j < points; ++j) {
      for (int l = 0; l < points; ++l) {
        const Vec3d p = (length / points) * Vec3d{i + 0.5, j + 0.5, l + 0.5} - 0.5 * Vec3d{voxel, voxel, voxel};
        const auto u = result.displacement_mm(p);
        if (!u) continue;
        const double d = norm(*u - field(p));
        sum += d * d;
        ++count;
      }
    }
  }
  EXPECT_EQ(count, points * points * points);
  return std::sqrt(sum / count);
}

TEST(VoxelFem, displacement_converges_with_the_square_of_the_voxel) {
  const double coarse = manufactured_error(8), fine = manufactured_error(16);
  EXPECT_LT(fine, 2e-5);
  EXPECT_GT(std::log2(coarse / fine), 1.8);
}

/// Diamond: sticks from each node of two face-centred lattices to its four neighbours, between two plates.
VoxelFemProblem diamond(double size, double cell, double stick, double voxel) {
  std::vector<Capsule> sticks;
  const int n = static_cast<int>(size / cell) + 1;
  for (int x = -1; x <= n; ++x) {
    for (int y = -1; y <= n; ++y) {
      for (int z = -1; z <= n; ++z) {
        for (int f = 0; f < 4; ++f) {
          const Vec3d a = cell * Vec3d{x + (f == 1 || f == 2 ? 0.5 : 0), y + (f == 1 || f == 3 ? 0.5 : 0),
                                       z + (f == 2 || f == 3 ? 0.5 : 0)};
          const Vec3d c = a + 0.25 * cell * Vec3d{1, 1, 1};
          for (const Vec3d d : {Vec3d{1, 1, 1}, Vec3d{-1, -1, 1}, Vec3d{-1, 1, -1}, Vec3d{1, -1, -1}}) {
            sticks.push_back({c, c - 0.25 * cell * d, 0.5 * stick});
          }
        }
      }
    }
  }
  const Box3d box{{0, 0, 0}, {size, size, size}};
  const Shape plates = unite({cuboid({{0, 0, 0}, {size, size, 1}}), cuboid({{0, 0, size - 1}, {size, size, size}})});
  VoxelFemProblem problem;
  problem.solid = realize(unite({capsules(sticks), plates}), box, {.voxel_mm = voxel});
  problem.supports = {{cuboid({{-1, -1, -1}, {size + 1, size + 1, 0.3}}), {true, true, true}, {}}};
  problem.forces = {{cuboid({{-1, -1, size - 0.3}, {size + 1, size + 1, size + 1}}), {0, 30, -100}}};
  return problem;
}

TEST(VoxelFem, a_lattice_of_thin_sticks_converges_at_any_resolution) {
  const auto coarse = solve(diamond(12, 6, 1, 0.4)), fine = solve(diamond(12, 6, 1, 0.2));
  for (const auto& result : {coarse, fine}) {
    EXPECT_LE(result.residual, 1e-6);
    EXPECT_LE(result.iterations, 60);
    EXPECT_NEAR(norm(result.load_n + result.reaction_n), 0, 1e-3);
    EXPECT_GT(result.max_von_mises_mpa, result.p99_von_mises_mpa);
    EXPECT_GT(result.peak_von_mises_mpa, result.p99_von_mises_mpa);
  }
  EXPECT_LT(fine.iterations, 1.5 * coarse.iterations);
  // Material smeared over a cell adds h^2 / 12 to the d^2 / 16 of a round stick: 2.5 voxels thick it bends 21 % less,
  // 5 voxels thick 5 % less.
  EXPECT_NEAR(coarse.compliance_n_mm / fine.compliance_n_mm, 1, 0.3);
  // Cells of two samples are as good as samples twice as far apart.
  VoxelFemProblem twice = diamond(12, 6, 1, 0.2);
  twice.coarsen = 2;
  EXPECT_NEAR(solve(twice).compliance_n_mm / coarse.compliance_n_mm, 1, 0.02);
}

TEST(VoxelFem, one_thread_and_two_give_the_same_bits) {
  const auto run = [](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return solve(diamond(10, 5, 1, 0.4));
  };
  const auto one = run(1), two = run(2);
  EXPECT_EQ(one.iterations, two.iterations);
  EXPECT_EQ(one.residual, two.residual);
  EXPECT_EQ(one.compliance_n_mm, two.compliance_n_mm);
  EXPECT_EQ(one.max_von_mises_mpa, two.max_von_mises_mpa);
  EXPECT_EQ(one.peak_von_mises_mpa, two.peak_von_mises_mpa);
  EXPECT_EQ(one.weakest_mm, two.weakest_mm);
  EXPECT_EQ(one.reaction_n, two.reaction_n);
}

TEST(VoxelFem, what_cannot_be_solved_is_refused) {
  const Bar bar{0.5, {20, 6, 6}};
  const VoxelFemProblem good = bar.problem({1, 0, 0});
  const auto refused = [&](const auto& spoil) {
    VoxelFemProblem bad = good;
    spoil(bad);
    return code_of([&] { (void)solve(bad); });
  };
  EXPECT_EQ(refused([](auto& p) { p.poisson = 0.5; }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.poisson = -0.1; }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.young_mpa = 0; }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.young_mpa = std::nan(""); }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.coarsen = 3; }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.solid = Solid(); }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.supports.clear(); }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.supports[0].where = sphere({50, 0, 0}, 1); }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.forces[0].where = sphere({50, 0, 0}, 1); }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.forces[0].total_n.y = std::nan(""); }), Code::BadRecipe);
  EXPECT_EQ(refused([](auto& p) { p.supports[0].axes = {true, true, false}; }), Code::SolverFailed);
  EXPECT_EQ(refused([](auto& p) { p.max_iterations = 1; }), Code::SolverFailed);
  EXPECT_EQ(refused([](auto& p) {
              const Shape two = unite({cuboid({{0, 0, 0}, {10, 3, 3}}), sphere({5, 8, 2}, 1.5)});
              p.solid = realize(two, Box3d{{-2, -2, -2}, {12, 12, 12}}, {.voxel_mm = 0.5});
            }),
            Code::SolverFailed);
  const Context stopped;
  stopped.cancel();
  EXPECT_EQ(code_of([&] { (void)solve(good, stopped); }), Code::Cancelled);
}

TEST(VoxelFem, a_loose_piece_is_named_with_its_place) {
  VoxelFemProblem problem = Bar{0.5, {20, 6, 6}}.problem({1, 0, 0});
  const Shape two = unite({cuboid({{0, 0, 0}, {10, 3, 3}}), cuboid({{4, 8, 2}, {6, 9, 4}})});
  problem.solid = realize(two, Box3d{{-2, -2, -2}, {12, 12, 12}}, {.voxel_mm = 0.5});
  try {
    (void)solve(problem);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("at 4.00 8.00 2.00 mm"), std::string::npos) << e.what();
  }
}

TEST(VoxelFem, without_a_load_nothing_moves) {
  VoxelFemProblem problem = Bar{0.5, {10, 4, 4}}.problem({0, 0, 0});
  const auto result = solve(problem);
  EXPECT_EQ(result.max_displacement_mm, 0);
  EXPECT_EQ(result.max_von_mises_mpa, 0);
}

}  // namespace
}  // namespace fibrolite
