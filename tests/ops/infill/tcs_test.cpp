// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/tcs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "bounds.h"
#include "fibrolite/error.h"
#include "fibrolite/pieces.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr double root2 = std::numbers::sqrt2;

constexpr double pi = std::numbers::pi;

/// Turned about x, then y, then z, degrees.
Vec3d turned(Vec3d v, Vec3d deg) {
  const auto turn = [](double& a, double& b, double angle) {
    const double c = std::cos(angle * pi / 180), s = std::sin(angle * pi / 180), old = a;
    a = c * old - s * b;
    b = s * old + c * b;
  };
  turn(v.y, v.z, deg.x);
  turn(v.z, v.x, deg.y);
  turn(v.x, v.y, deg.z);
  return v;
}

/// Every stick and ball of a block of cells, as the definition of diamond cubic says.
struct BruteForce {
  explicit BruteForce(const TcsParams& p) : params(p) {
    const double nodes[4][3] = {{0, 0, 0}, {0, .5, .5}, {.5, 0, .5}, {.5, .5, 0}};
    const double bonds[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    const Vec3d cell{p.cell_mm.x, p.cell_mm.y, p.stretch_z ? root2 * p.cell_mm.z : p.cell_mm.z};
    const auto place = [&](double x, double y, double z) {
      return p.shift_mm + turned({cell.x * x, cell.y * y, cell.z * z}, p.rotate_deg);
    };
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) {
        for (int k = -2; k <= 2; ++k) {
          for (const auto& n : nodes) {
            const Vec3d a = place(i + n[0], j + n[1], k + n[2]);
            for (const auto& b : bonds) {
              const Vec3d to = place(i + n[0] + 0.25 * b[0], j + n[1] + 0.25 * b[1], k + n[2] + 0.25 * b[2]);
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
    const Vec3d p{params.cell_mm.x * (random.uniform() - 0.5), params.cell_mm.y * (random.uniform() - 0.5),
                  params.cell_mm.z * 1.4 * (random.uniform() - 0.5)};
    ASSERT_NEAR(shape(p), truth.distance(p), 2e-4) << p.x << ' ' << p.y << ' ' << p.z;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Forms, CrystalDistance,
    ::testing::Values(TcsParams{}, TcsParams{.cell_mm = 5, .stick_mm = 1, .ball_mm = 1.6},
                      TcsParams{.shift_mm = {1.1, -0.7, 2.3}}, TcsParams{.ball_mm = 0.8}, TcsParams{.stretch_z = true},
                      TcsParams{.cell_mm = 8, .ball_mm = 2.2, .shift_mm = {0.3, 0, 1}, .stretch_z = true},
                      TcsParams{.cell_mm = {6, 7, 5}}, TcsParams{.cell_mm = {12, 4, 5}, .shift_mm = {1, 2, 3}},
                      TcsParams{.cell_mm = {4, 5, 8}, .stretch_z = true}, TcsParams{.rotate_deg = {20, -35, 110}},
                      TcsParams{.cell_mm = {7, 5, 6}, .shift_mm = {1, 0, 2}, .rotate_deg = {10, 0, 80}}));

/// Share of a cell that is material, by the midpoint rule.
double share(const Shape& shape, const CellEdges& cell, int n) {
  std::vector<Vec3d> row(static_cast<std::size_t>(n));
  std::vector<float> value(row.size());
  const double step = std::cbrt(cell.x * cell.y * cell.z) / n;
  double inside = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k)
        row[static_cast<std::size_t>(k)] = {(i + .5) / n * cell.x, (j + .5) / n * cell.y, (k + .5) / n * cell.z};
      shape.evaluate(row, value);
      for (const float v : value) inside += std::clamp(0.5 - v / step, 0.0, 1.0);
    }
  }
  return inside / (1.0 * n * n * n);
}

TEST(Crystal, volume_of_one_cell_is_sticks_and_balls) {
  // Balls of the stick's diameter vanish in round joints; with large balls the sticks' overlaps with each other lie
  // inside the balls, so the cell holds 8 balls and 16 sticks shortened by the ball caps at both ends.
  const TcsParams p{.cell_mm = 10, .stick_mm = 1.0, .ball_mm = 3.0};
  const double r = 0.5 * p.stick_mm, big = 0.5 * p.ball_mm, bond = std::sqrt(3.0) / 4 * 10;
  const double depth = std::sqrt(big * big - r * r);  // where the stick's side leaves the ball
  const double cap = std::numbers::pi * (big - depth) * (big - depth) * (3 * big - (big - depth)) / 3;
  const double stick = std::numbers::pi * r * r * (bond - 2 * depth) - 2 * cap;
  const double expected = 8 * 4.0 / 3 * std::numbers::pi * big * big * big + 16 * stick;

  EXPECT_NEAR(1000 * share(crystal(p), p.cell_mm, 200) / expected, 1.0, 0.01);
  EXPECT_NEAR(1000 * density(p) / expected, 1.0, 0.005);
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

TEST(Crystal, turned_by_the_diagonal_a_bond_stands_upright) {
  const TcsParams p{.shift_mm = {1, 2, 3}, .rotate_deg = {45, -std::atan(std::sqrt(0.5)) * 180 / pi, 0}};
  const Shape shape = crystal(p);
  const double bond = std::sqrt(3.0) / 4 * 6;
  for (const double t : {0.0, 0.4, 0.5, 1.0})
    EXPECT_NEAR(shape({1, 2, 3 + t * bond}), t == 0 || t == 1 ? -0.8 : -0.4, 1e-5) << t;
  int upright = 0;
  each_stick(p, {{0, 0, 0}, {9, 9, 9}}, [&](const Capsule& s) {
    EXPECT_NEAR(shape(0.5 * (s.a + s.b)), -0.4, 1e-4);
    upright += s.b.z - s.a.z > bond - 1e-9 ? 1 : 0;
  });
  EXPECT_GT(upright, 3);
}

/// The straight lines (1/4, t, 0) and its like lie in the D surface, and its flat points are half way between the nodes
/// of the two networks.
TEST(Sheet, walls_are_equally_thick_along_the_lines_that_lie_in_it) {
  const TcsParams p{.form = TcsForm::Sheet, .cell_mm = 10, .wall_mm = 0.6};
  const Shape shape = crystal(p);
  for (int i = 0; i < 100; ++i) {
    EXPECT_NEAR(shape({2.5, 0.1 * i, 0}), -0.3, 2e-3);
    EXPECT_NEAR(shape({5, 2.5, 0.1 * i}), -0.3, 2e-3);
  }
  for (const double t : {-1.25, 3.75}) EXPECT_NEAR(shape({t, t, t}), -0.3, 2e-3);
  // Nearest to a node of the network is the membrane's flat point, an eighth of the diagonal away.
  EXPECT_NEAR(shape({0, 0, 0}), std::sqrt(3.0) * 1.25 - 0.3, 5e-3);
}

TEST(Sheet, holds_area_times_thickness_less_what_its_curvature_takes) {
  // Area 1.9189 edge^2 in a cube of half a cell (Schoen 1970), eight of them; Euler number -16 in a cell.
  const double a = 8 * 1.9189 / 4, chi = -16;
  for (const double t : {0.03, 0.06, 0.1}) {
    const TcsParams p{.form = TcsForm::Sheet, .cell_mm = 10, .wall_mm = 10 * t};
    const double expected = a * t + 2 * pi * chi * t * t * t / 12;
    EXPECT_NEAR(density(p) / expected, 1.0, 0.006) << t;
    EXPECT_NEAR(share(crystal(p), p.cell_mm, 120) / expected, 1.0, 0.006) << t;
  }
}

/// The membrane parts space into two labyrinths of equal size. Cut open, both run out through every face of a box and
/// no void is left behind. In a shell both are closed voids that reach every wall; a flat wall may also cut off the
/// tips of either, a few thousandths of the void.
TEST(Sheet, two_labyrinths_open_to_every_face) {
  constexpr double side = 24, voxel = 0.25;
  const Box3d box =
      Box3d{{0, 0, 0}, {side - voxel, side - voxel, side - voxel}}.grown(0.5 * voxel);  // walls between samples
  for (const Vec3d shift : {Vec3d{0, 0, 0}, Vec3d{1, 1, 1}, Vec3d{1.3, 0.7, 2.9}, Vec3d{3, 1, 0.4}}) {
    const TcsParams p{.form = TcsForm::Sheet, .cell_mm = 8, .wall_mm = 0.8, .shift_mm = shift};
    const Shape sheet = crystal(p);
    const Pieces open = pieces(realize(intersect({sheet, cuboid(box)}), box.grown(2), {.voxel_mm = voxel}));
    EXPECT_TRUE(open.cavities.empty());

    const Shape filled = intersect({unite({sheet, complement(cuboid(box))}), cuboid(box.grown(1))});
    const VoidMap voids(realize(filled, box.grown(3), {.voxel_mm = voxel}));
    const std::vector<Piece>& found = voids.cavities();
    ASSERT_GE(found.size(), 2U);
    const double half = 0.5 * (1 - density(p)) * side * side * side;
    EXPECT_NEAR(found[0].volume_mm3 / half, 1, 0.03);  // counted by samples, three to a wall
    EXPECT_NEAR(found[1].volume_mm3 / found[0].volume_mm3, 1, 0.005);
    double tips = 0;
    for (std::size_t i = 2; i < found.size(); ++i) tips += found[i].volume_mm3;
    EXPECT_LT(tips, 5e-3 * half);
    const int n = static_cast<int>(side / voxel);
    for (int axis = 0; axis < 3; ++axis)
      for (const int layer : {0, n - 1}) {
        std::array<int, 3> samples{};  // neither, and each labyrinth
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j) {
            const Vec3i at = axis == 0 ? Vec3i{layer, i, j} : axis == 1 ? Vec3i{j, layer, i} : Vec3i{i, j, layer};
            const int place = voids.at(at);
            ++samples.at(place == 1 || place == 2 ? static_cast<std::size_t>(place) : 0);
          }
        EXPECT_GT(samples[1], n * n / 10) << axis << ' ' << layer;
        EXPECT_GT(samples[2], n * n / 10) << axis << ' ' << layer;
      }
  }
}

TEST(Network, is_as_thick_as_asked_half_way_along_its_bonds) {
  for (const double neck : {0.5, 1.0, 2.0}) {
    const Shape shape = crystal({.form = TcsForm::Network, .cell_mm = 10, .stick_mm = neck});
    EXPECT_NEAR(shape({1.25, 1.25, 1.25}), -0.5 * neck, 0.01 * neck);  // from one node to the other
    EXPECT_NEAR(shape({1.25, -1.25, -1.25}), -0.5 * neck, 0.01 * neck);
    EXPECT_LT(shape({0, 0, 0}), -0.5 * neck);
    EXPECT_GT(shape({5, 5, 5}), 2);  // nodes of the other network
    EXPECT_GT(shape({-1.25, -1.25, -1.25}), 0);
  }
}

class Smooth : public ::testing::TestWithParam<TcsParams> {};

/// Values near the surface are distances: no steeper than 1.05, and the way they tell leads there.
TEST_P(Smooth, values_are_distances) {
  const Shape shape = crystal(GetParam());
  const double near = 0.5 * members(GetParam()).least_mm;
  Random random(5, "tcs_test");
  const auto uniform = [&](double size) { return size * (random.uniform() - 0.5); };
  int seen = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3d p{uniform(40), uniform(40), uniform(40)};
    const Vec3d d = (0.05 + 0.3 * random.uniform()) * normalized({uniform(1), uniform(1), uniform(1)});
    const double here = shape(p), there = shape(p + d);
    const bool both_near = std::abs(here) < 2 * near && std::abs(there) < 2 * near;
    ASSERT_LE(std::abs(here - there), (both_near ? 1.05 : shape.lipschitz()) * norm(d));
    if (!(here > 0 && here < near)) continue;
    const double e = 0.02;
    const Vec3d gradient{(shape(p + Vec3d{e, 0, 0}) - shape(p - Vec3d{e, 0, 0})) / (2 * e),
                         (shape(p + Vec3d{0, e, 0}) - shape(p - Vec3d{0, e, 0})) / (2 * e),
                         (shape(p + Vec3d{0, 0, e}) - shape(p - Vec3d{0, 0, e})) / (2 * e)};
    ASSERT_NEAR(shape(p - here * normalized(gradient)), 0, 0.02 * near);
    ++seen;
  }
  EXPECT_GT(seen, 500);
}

TEST_P(Smooth, bounds_hold_in_every_box) {
  const Shape shape = crystal(GetParam());
  testing::expect_bounds_hold(shape, Random(6, "tcs_test"), 300);
}

INSTANTIATE_TEST_SUITE_P(
    Forms, Smooth,
    ::testing::Values(TcsParams{.form = TcsForm::Network}, TcsParams{.form = TcsForm::Sheet, .wall_mm = 0.4},
                      TcsParams{.form = TcsForm::Sheet, .cell_mm = {6, 8, 7}, .wall_mm = 0.4},
                      TcsParams{.form = TcsForm::Sheet, .cell_mm = 9, .stretch_z = true},
                      TcsParams{.form = TcsForm::Network, .shift_mm = {1, 2, 0}, .rotate_deg = {10, 20, 30}}));

TEST(Density, is_met_by_every_form) {
  for (const TcsForm form : {TcsForm::Sticks, TcsForm::Network, TcsForm::Sheet})
    for (const CellEdges& cell : {CellEdges(6.0), CellEdges(6, 8, 7)})
      for (const double wanted : {0.12, 0.35}) {
        const TcsParams p{.form = form, .cell_mm = cell, .density = wanted};
        EXPECT_NEAR(share(crystal(p), cell, 72) / wanted, 1.0, 0.01);
        const TcsParams q = sized(p);
        EXPECT_FALSE(q.density.has_value());
        EXPECT_NEAR(q.ball_mm / q.stick_mm, 2, 1e-9);
        EXPECT_NEAR(density(q) / wanted, 1.0, 0.001);
      }
}

TEST(Density, out_of_reach_is_refused) {
  for (const TcsParams& p :
       {TcsParams{.density = 0.99}, TcsParams{.form = TcsForm::Network, .density = 0.05}, TcsParams{.density = 0.0}}) {
    try {
      (void)crystal(p);
      FAIL() << "no error";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), Code::BadRecipe);
      EXPECT_NE(std::string(e.what()).find("tcs.density"), std::string::npos);
    }
  }
}

/// A field that grows along x.
Shape ramp(double least, double most, double from, double to) {
  struct Ramp final : Shape::Function {
    void evaluate(const PointBlock& block, float* out) const override {
      for (int i = 0; i < block.count; ++i)
        out[i] = static_cast<float>(least + (most - least) * std::clamp((block.x[i] - from) / (to - from), 0.0, 1.0));
    }
    [[nodiscard]] double lipschitz() const override { return (most - least) / (to - from); }
    double least = 0, most = 0, from = 0, to = 0;
  };
  Ramp made;
  made.least = least;
  made.most = most;
  made.from = from;
  made.to = to;
  return Shape(std::make_shared<const Ramp>(made));
}

TEST(Graded, is_the_even_crystal_of_the_thickness_at_each_place) {
  for (const TcsForm form : {TcsForm::Sticks, TcsForm::Network, TcsForm::Sheet}) {
    const TcsParams p{.form = form, .wall_mm = 0.6, .grade = TcsGrade::Surface, .grade_least = 0.5, .grade_most = 1.5};
    const Shape graded = crystal(p, ramp(0.5, 1.5, 0, 30));
    Random random(9, "tcs_test");
    for (const double factor : {0.5, 0.7, 1.0, 1.3, 1.5}) {
      TcsParams even = p;
      even.grade = TcsGrade::None;
      even.stick_mm *= factor;
      even.ball_mm *= factor;
      even.wall_mm *= factor;
      const Shape same = crystal(even);
      for (int i = 0; i < 300; ++i) {
        const Vec3d at{30 * (factor - 0.5), 10 * random.uniform(), 10 * random.uniform()};
        const double expected = same(at);
        if (std::abs(expected) < 0.4) {
          ASSERT_NEAR(graded(at), expected, 0.01) << factor;
        }
      }
    }
    for (int i = 0; i < 5000; ++i) {
      const Vec3d at{30 * random.uniform(), 10 * random.uniform(), 10 * random.uniform()}, step{0.1, 0.05, -0.1};
      ASSERT_LE(std::abs(graded(at) - graded(at + step)), graded.lipschitz() * norm(step));
    }
  }
}

/// Ten cells along a ramp, and one across.
double share_along(const Shape& shape, double length, double cell) {
  constexpr double step = 0.125;
  std::vector<Vec3d> row;
  double inside = 0, all = 0;
  for (double y = step / 2; y < cell; y += step)
    for (double z = step / 2; z < cell; z += step) {
      row.clear();
      for (double x = step / 2; x < length; x += step) row.push_back({x, y, z});
      std::vector<float> value(row.size());
      shape.evaluate(row, value);
      for (const float v : value) inside += std::clamp(0.5 - v / step, 0.0, 1.0);
      all += static_cast<double>(row.size());
    }
  return inside / all;
}

TEST(Graded, follows_its_field_however_the_lattice_lies) {
  const Shape field = ramp(1, 1.5, -30, 30);
  for (const TcsParams& p :
       {TcsParams{.grade = TcsGrade::Surface, .grade_depth_mm = 60}, TcsParams{.cell_mm = 8, .stretch_z = true},
        TcsParams{.cell_mm = {7, 8, 9}}, TcsParams{.shift_mm = {1, 2, 3}, .rotate_deg = {20, -35, 110}},
        TcsParams{.cell_mm = 8, .shift_mm = {4, -2, 9}, .rotate_deg = {0, 30, 0}, .stretch_z = true}}) {
    const Shape graded = crystal(p, field);
    Random random(4, "tcs_test");
    for (int i = 0; i < 300; ++i) {
      const Vec3d at{20 * random.uniform() - 10, 20 * random.uniform() - 10, 20 * random.uniform() - 10};
      TcsParams even = p;
      even.grade = TcsGrade::None;
      const double factor = field(at);
      even.stick_mm *= factor;
      even.ball_mm *= factor;
      ASSERT_NEAR(graded(at), crystal(even)(at), 2e-4);
    }
  }
}

TEST(GradedDensity, is_met_in_the_mean_by_every_form) {
  constexpr double length = 60;
  for (const auto& [form, cell] :
       {std::pair(TcsForm::Sticks, 6.0), std::pair(TcsForm::Network, 6.0), std::pair(TcsForm::Sheet, 12.0)})
    for (const double wanted : {0.12, 0.2}) {
      const TcsParams p{.form = form,
                        .cell_mm = cell,
                        .density = wanted,
                        .grade = TcsGrade::Surface,
                        .grade_least = 0.8,
                        .grade_most = 1.6,
                        .grade_depth_mm = length};
      const Shape field = ramp(0.8, 1.6, 0, length);
      std::vector<float> factors;
      for (int i = 0; i < 1000; ++i) factors.push_back(field({(i + 0.5) * length / 1000, 0, 0}));
      const GradedSizes found = sized(p, factors, 0);
      EXPECT_NEAR(found.density / wanted, 1, 0.005);
      EXPECT_FALSE(found.params.density.has_value());
      EXPECT_NEAR(share_along(crystal(found.params, field), length, cell) / wanted, 1, 0.01);
      EXPECT_NEAR(members(found.params).most_mm / members(found.params).least_mm, 2, 1e-9);
    }
}

TEST(GradedDensity, stops_at_the_limits_and_says_what_is_reached) {
  const std::vector<float> factors{1, 1.2F, 1.5F};
  const TcsParams p{.density = 0.2, .grade = TcsGrade::Surface};
  const GradedSizes thick = sized(p, factors, 0.95);
  EXPECT_NEAR(members(thick.params).least_mm, 0.95, 1e-4);
  EXPECT_GT(thick.density, 1.01 * 0.2);
  TcsParams dense = p;
  dense.density = 0.4;
  const GradedSizes full = sized(dense, factors, 0);
  EXPECT_NEAR(members(full.params).most_mm, 6.0 / 4, 1e-4);
  EXPECT_LT(full.density, 0.99 * 0.4);
  EXPECT_THROW((void)sized(p, factors, 1.1), Error);  // 1.65 mm next to it is too thick for the cell
  // What has sizes keeps them, graded or not.
  EXPECT_EQ(sized({.stick_mm = 0.7, .grade = TcsGrade::Surface}).stick_mm, 0.7);
}

TEST(Graded, is_thickest_under_the_shell_and_thinnest_deep_inside) {
  const TcsParams p{.grade = TcsGrade::Surface, .grade_least = 0.8, .grade_most = 1.6, .grade_depth_mm = 8};
  const Shape factor = thicker_at_surface(p, sphere({0, 0, 0}, 20), 1);
  EXPECT_NEAR(factor({19, 0, 0}), 1.6, 1e-6);
  EXPECT_NEAR(factor({0, 15, 0}), 1.2, 1e-6);  // half way
  EXPECT_NEAR(factor({0, 0, 11}), 0.8, 1e-6);
  EXPECT_NEAR(factor({0, 0, 0}), 0.8, 1e-6);
  EXPECT_NEAR(members(p).least_mm, 0.64, 1e-12);
  EXPECT_NEAR(members(p).most_mm, 1.28, 1e-12);
}

/// How far the surface leans over, as its normal's part against `p.up`, worst over points farther than `from_node` from
/// nodes.
double worst_overhang(const TcsParams& p, double from_node) {
  const Shape shape = crystal(p);
  std::vector<Vec3d> nodes;
  each_stick(p, {{-2, -2, -2}, {12, 12, 12}}, [&](const Capsule& s) {
    nodes.push_back(s.a);
    nodes.push_back(s.b);
  });
  Random random(8, "tcs_test");
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    Vec3d at{10 * random.uniform(), 10 * random.uniform(), 10 * random.uniform()}, normal;
    for (int turn = 0; turn < 3; ++turn) {
      const double e = 0.005;
      normal = normalized({shape(at + Vec3d{e, 0, 0}) - shape(at - Vec3d{e, 0, 0}),
                           shape(at + Vec3d{0, e, 0}) - shape(at - Vec3d{0, e, 0}),
                           shape(at + Vec3d{0, 0, e}) - shape(at - Vec3d{0, 0, e})});
      at = at - shape(at) * normal;
    }
    if (std::abs(shape(at)) > 1e-3) continue;
    if (std::none_of(nodes.begin(), nodes.end(), [&](Vec3d n) { return norm(n - at) < from_node; }))
      worst = std::max(worst, -dot(normal, normalized(p.up)));
  }
  return worst;
}

TEST(Overhang, stretched_sticks_lean_45_degrees_and_no_more_but_at_nodes) {
  const TcsParams cubic{}, tall{.stretch_z = true};
  const double near = 0.5 * cubic.ball_mm + 0.1;
  EXPECT_NEAR(worst_overhang(tall, near), std::cos(pi / 4), 0.01);       // the underside of a stick at 45 degrees
  EXPECT_NEAR(worst_overhang(cubic, near), std::sqrt(2.0 / 3.0), 0.01);  // at 35.3 degrees
  for (const Vec3d up : {Vec3d{1, 0, 0}, Vec3d{0, -1, 0}, Vec3d{0, 0, -1}, Vec3d{1, -2, 3}})
    EXPECT_NEAR(worst_overhang({.stretch_z = true, .up = up}, near), std::cos(pi / 4), 0.01);
}

TEST(Overhang, is_that_of_the_flattest_bond_as_printed) {
  const double magic = std::acos(1 / std::sqrt(3.0)) * 180 / std::numbers::pi;
  TcsParams params;
  EXPECT_NEAR(steepest_overhang_deg(params), magic, 1e-9);
  params.up = {0, -1, 0};
  EXPECT_NEAR(steepest_overhang_deg(params), magic, 1e-9);
  params.stretch_z = true;
  EXPECT_NEAR(steepest_overhang_deg(params), 45, 1e-9) << "stands along up";
  // Turned by 45 degrees about x, two bonds lie in the plate, stretched or not: (0, 1, 1) and (0, 1, -1) to the axes.
  params = {.rotate_deg = {45, 0, 0}};
  EXPECT_NEAR(steepest_overhang_deg(params), 90, 1e-9);
  params = {.cell_mm = {6, 6, 18}};
  EXPECT_NEAR(steepest_overhang_deg(params), std::atan(std::sqrt(2.0) / 3) * 180 / std::numbers::pi, 1e-9);
}

TEST(Crystal, bad_sizes_are_refused) {
  for (const TcsParams& p :
       {TcsParams{.stick_mm = 0}, TcsParams{.ball_mm = 0.5}, TcsParams{.cell_mm = 3}, TcsParams{.cell_mm = {6, 6, 19}},
        TcsParams{.cell_mm = {-6, 6, 6}}, TcsParams{.stretch_z = true, .up = {}},
        TcsParams{.form = TcsForm::Sheet, .wall_mm = 1.6}, TcsParams{.grade = TcsGrade::Surface, .grade_depth_mm = 5},
        TcsParams{.grade = TcsGrade::Surface, .grade_least = 3}}) {
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
