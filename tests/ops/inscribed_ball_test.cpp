// SPDX-License-Identifier: GPL-3.0-or-later
// Finished solids against the thickness their recipe promises, by the largest ball that fits into their voxels.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "hybrid_runs.h"
#include "inscribed_balls.h"
#include "models.h"

namespace fibrolite {
namespace {

using testing::hybridized;
using testing::Outcome;
using testing::thin_places;
using testing::ThinPlaces;
using testing::Voxels;

constexpr double far = std::numeric_limits<double>::infinity();

std::string text(Vec3d p) {
  return std::to_string(p.x).append(" ").append(std::to_string(p.y)).append(" ").append(std::to_string(p.z));
}

Voxels voxels_of(const Shape& shape, const Box3d& box, double voxel_mm) {
  Voxels v(box, voxel_mm);
  v.fill([&](const std::vector<Vec3d>& row, std::uint8_t* set) {
    std::vector<float> value(row.size());
    shape.evaluate(row, value);
    for (std::size_t i = 0; i < row.size(); ++i) set[i] = value[i] < 0 ? 1 : 0;
  });
  return v;
}

TEST(DistanceTransform, equals_brute_force) {
  Voxels v({{0, 0, 0}, {9, 7, 8}}, 1);
  Random random(5, "inscribed_ball_test");
  for (std::uint8_t& s : v.set) s = random.uniform() < 0.9 ? 1 : 0;
  const auto clear2 = testing::distance2(v, false), off2 = testing::distance2(v, true);
  for (int k = 0; k < v.nz; ++k)
    for (int j = 0; j < v.ny; ++j)
      for (int i = 0; i < v.nx; ++i) {
        double clear = far, off = far;
        for (int c = -1; c <= v.nz; ++c)
          for (int b = -1; b <= v.ny; ++b)
            for (int a = -1; a <= v.nx; ++a) {
              const double d = (a - i) * (a - i) + (b - j) * (b - j) + (c - k) * (c - k);
              const bool in = a >= 0 && b >= 0 && c >= 0 && a < v.nx && b < v.ny && c < v.nz;
              (in && v.set[v.at(a, b, c)] != 0 ? off : clear) =
                  std::min(in && v.set[v.at(a, b, c)] != 0 ? off : clear, d);
            }
        ASSERT_EQ(static_cast<double>(clear2[v.at(i, j, k)]), clear);
        ASSERT_EQ(static_cast<double>(off2[v.at(i, j, k)]), off);
      }
}

/// The measure itself: plates however they lie pass at their thickness and fail where it is 0.65 of it; a square bar's
/// edges are corners, a blade's is not.
TEST(InscribedBalls, tell_thin_plates_from_thick_ones_and_corners_from_blades) {
  constexpr double wall = 0.8, h = wall / 8;
  Random random(6, "inscribed_ball_test");
  const Box3d box{{-4, -4, -4}, {4, 4, 4}};
  const Shape ball = sphere({0, 0, 0}, 3.5);
  for (int turn = 0; turn < 6; ++turn) {
    const Vec3d n =
        turn == 0 ? Vec3d{0, 0, 1} : normalized({random.uniform(), random.uniform() - 0.5, random.uniform()});
    const Vec3d shift = h * Vec3d{random.uniform(), random.uniform(), random.uniform()};
    const auto plate = [&](double t) {
      return voxels_of(intersect({half_space(shift + 0.5 * t * n, n), half_space(shift - 0.5 * t * n, -1.0 * n), ball}),
                       box, h);
    };
    EXPECT_EQ(thin_places(plate(wall), wall, [](Vec3d p) { return norm(p) < 2.8; }).voxels, 0) << turn;
    EXPECT_GT(thin_places(plate(0.65 * wall), wall).voxels, 100) << turn;
    // Two plates across each other, rectangular: edges of 90 degrees.
    const Frame frame = frame_along(shift, n);
    const Shape bar = placed(cuboid({{-2, -0.5, -0.5}, {2, 0.5, 0.5}}), frame);
    EXPECT_EQ(thin_places(voxels_of(bar, box, h), wall).voxels, 0) << turn;
    const Shape wedge = placed(intersect({half_space({1, 0, 0}, {0.2, 1, 0}), half_space({1, 0, 0}, {0.2, -1, 0}),
                                          half_space({-2, 0, 0}, {-1, 0, 0}), half_space({0, 0, 2}, {0, 0, 1}),
                                          half_space({0, 0, -2}, {0, 0, -1})}),
                               frame);
    EXPECT_GT(thin_places(voxels_of(wedge, box, h), wall).voxels, 100) << turn;
  }
}

/// No material thinner than wall_mm, no void of the lumen narrower than gap_mm but for slits beside the shell.
void expect_thick(const Outcome& made, const Recipe& recipe, double wall_mm, double gap_mm, const std::string& what) {
  const double h = made.hybrid.solid.grid().voxel_mm, shell_mm = recipe.shell.thickness_mm;
  // On the solid's own samples.
  Box3d box = made.hybrid.solid.bounds_mm();
  box = {{h * std::floor(box.min.x / h - 2), h * std::floor(box.min.y / h - 2), h * std::floor(box.min.z / h - 2)},
         box.max + Vec3d{2 * h, 2 * h, 2 * h}};
  Voxels v = voxels_of(distance_to(made.hybrid.solid), box, h);
  const ThinPlaces walls = thin_places(v, wall_mm);
  EXPECT_EQ(walls.voxels, 0) << what << ": " << walls.farthest_mm << " mm off any ball at " << text(walls.where);
  if (gap_mm == 0) return;
  const Shape& body = made.hybrid.body;
  v.fill([&](const std::vector<Vec3d>& row, std::uint8_t* set) {
    std::vector<float> depth(row.size());
    body.evaluate(row, depth);
    for (std::size_t i = 0; i < row.size(); ++i) set[i] = set[i] == 0 && depth[i] < 0 ? 1 : 0;
  });
  const ThinPlaces voids = thin_places(v, gap_mm, [&](Vec3d p) { return body(p) < -(shell_mm + gap_mm + 2 * h); });
  EXPECT_EQ(voids.voxels, 0) << what << ": " << voids.farthest_mm << " mm off any ball at " << text(voids.where);
}

Recipe thick(double wall_mm) {
  Recipe recipe;
  recipe.shell.thickness_mm = 1.25 * wall_mm;
  recipe.mfs.fibre_mm = 4 * wall_mm;
  recipe.mfs.wall_mm = recipe.mfs.gap_mm = wall_mm;
  recipe.tcs = {.cell_mm = 7.5 * wall_mm, .stick_mm = wall_mm, .ball_mm = 2 * wall_mm, .wall_mm = wall_mm};
  recipe.joint.layer_mm = recipe.joint.column_mm = recipe.joint.min_wall_mm = wall_mm;
  recipe.joint.spacing_mm = 3 * wall_mm;
  return recipe;
}

/// A column of fibres alone, or of a hybrid.
Outcome column(const Mesh& mesh, InfillKind infill, double wall_mm, Walls walls) {
  HybridizeParams params{.recipe = thick(wall_mm), .infill = infill, .voxel_mm = wall_mm / 8};
  params.recipe.mfs.walls = walls;
  if (walls == Walls::Delaunay) params.recipe.mfs.fibre_mm = 4.2 * wall_mm;  // the least is four
  Outcome made = hybridized(mesh, params);
  EXPECT_EQ(made.report.parts.at(0).infill, "mfs");
  EXPECT_GT(made.report.parts.at(0).fibres, 5);
  return made;
}

TEST(InscribedBalls, fit_into_the_membranes_and_fibres_of_a_straight_column) {
  constexpr double wall = 0.8;
  for (const Walls walls : {Walls::Image, Walls::Delaunay}) {
    const Outcome made = column(testing::tube(9, 24, 128), InfillKind::Mfs, wall, walls);
    expect_thick(made, thick(wall), wall, wall, walls == Walls::Image ? "image" : "delaunay");
    // Nor are membranes thicker than asked for: larger balls do not fit.
    const double h = made.hybrid.solid.grid().voxel_mm;
    EXPECT_GT(
        thin_places(voxels_of(distance_to(made.hybrid.solid), made.hybrid.solid.bounds_mm(), h), 1.6 * wall).voxels,
        1000);
  }
}

TEST(InscribedBalls, fit_into_the_membranes_and_fibres_of_a_bent_column) {
  constexpr double wall = 1.2;
  const Mesh mesh = read_mesh(testing::asset("bent_tube")).mesh;
  for (const Walls walls : {Walls::Image, Walls::Delaunay})
    expect_thick(column(mesh, InfillKind::Hybrid, wall, walls), thick(wall), wall, wall,
                 walls == Walls::Image ? "image" : "delaunay");
}

TEST(InscribedBalls, fit_into_the_members_of_every_form_of_the_crystal) {
  constexpr double wall = 0.8;
  for (const TcsForm form : {TcsForm::Sticks, TcsForm::Network, TcsForm::Sheet}) {
    HybridizeParams params{.recipe = thick(wall), .infill = InfillKind::Tcs, .voxel_mm = wall / 8};
    params.recipe.tcs.form = form;
    const Outcome made = hybridized(testing::cube(16), params);
    expect_thick(made, params.recipe, wall, 0, std::to_string(static_cast<int>(form)).append(". form"));
  }
}

TEST(InscribedBalls, fit_into_layer_and_columns_of_a_joint) {
  constexpr double wall = 1.2;
  HybridizeParams params{.recipe = thick(wall), .voxel_mm = wall / 8};
  params.recipe.joint.spacing_mm = 2.25 * wall;  // for columns enough
  const Outcome made = hybridized(read_mesh(testing::asset("cylinder_on_box")).mesh, params);
  ASSERT_EQ(made.hybrid.joints.size(), 1U);
  ASSERT_GE(made.hybrid.joints[0].columns.size(), 3U);
  expect_thick(made, params.recipe, wall, 0, "joint");
}

}  // namespace
}  // namespace fibrolite
