// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/prepare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "mesh_checks.h"
#include "models.h"

namespace fibrolite {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Model prepared(const Mesh& mesh, const PrepareParams& params = {}, double unit_mm = 1) {
  return prepare({.mesh = mesh, .unit_mm = unit_mm, .notes = {}}, params);
}
Code refusal(const Mesh& mesh, const PrepareParams& params = {}) {
  try {
    (void)prepared(mesh, params);
  } catch (const Error& error) {
    return error.code();
  }
  return Code::Internal;
}

TEST(Prepare, a_sound_model_stays_as_it_is) {
  const Mesh mesh = icosphere(20, 3);
  const Model model = prepared(mesh);
  EXPECT_EQ(model.mesh.vertices, mesh.vertices);
  EXPECT_EQ(model.mesh.triangles, mesh.triangles);
  EXPECT_THAT(model.repairs, IsEmpty());
  EXPECT_THAT(model.warnings, IsEmpty());
}

TEST(Prepare, size_and_unit) {
  const Mesh mesh = tube(1, 5, 24);
  EXPECT_NEAR(bounds(prepared(mesh, {.size_mm = 80}).mesh).longest_side(), 80, 1e-5);
  EXPECT_NEAR(bounds(prepared(mesh, {.unit_mm = 10}).mesh).longest_side(), 50, 1e-5);
  EXPECT_NEAR(bounds(prepared(mesh, {}, 25.4).mesh).longest_side(), 127, 1e-5);              // the file's own unit
  EXPECT_NEAR(bounds(prepared(mesh, {.unit_mm = 10}, 25.4).mesh).longest_side(), 50, 1e-5);  // the caller knows better
  EXPECT_NEAR(signed_volume(prepared(mesh, {.unit_mm = 10}).mesh), 1000 * signed_volume(mesh), 1);
}

TEST(Prepare, vertices_that_nothing_uses_do_not_count_for_the_size) {
  Mesh mesh = cube(1);
  mesh.vertices.push_back({1000, 0, 0});
  EXPECT_NEAR(bounds(prepared(mesh, {.size_mm = 50}).mesh).longest_side(), 50, 1e-5);
}

TEST(Prepare, warns_about_units) {
  EXPECT_THAT(prepared(cube(0.18)).warnings, ElementsAre(HasSubstr("0.18 mm")));
  EXPECT_THAT(prepared(cube(3000)).warnings, ElementsAre(HasSubstr("3000 mm")));
  EXPECT_THAT(prepared(cube(5.1)).warnings, IsEmpty());
  EXPECT_THAT(prepared(cube(1999)).warnings, IsEmpty());
}

/// Floats of 24 bits: 100 m from the origin their steps are 2^-7 mm, a 2560th of 20 mm; 60 m from it half of that.
TEST(Prepare, refuses_models_too_far_from_the_origin_for_their_coordinates) {
  const auto at = [](float mm) {
    Mesh mesh = cube(20);
    for (Vec3f& v : mesh.vertices) v.y += mm;
    return mesh;
  };
  EXPECT_EQ(refusal(at(1e5F)), Code::BadInput);
  EXPECT_EQ(refusal(at(-1e8F)), Code::BadInput);
  EXPECT_NO_THROW((void)prepared(at(6e4F)));
  EXPECT_NO_THROW((void)prepared(at(-6e4F), {.unit_mm = 1000}));  // in metres it is the same model
}

TEST(Prepare, refuses_models_too_small_for_voxels) {
  EXPECT_EQ(refusal(cube(20), {.size_mm = 1e-9}), Code::BadInput);
  EXPECT_EQ(refusal(cube(1e-30)), Code::BadInput);
  EXPECT_NO_THROW((void)prepared(cube(20), {.size_mm = 0.011}));
}

TEST(Prepare, inside_out_models_are_turned_and_both_sides_give_the_same) {
  const Mesh mesh = torus_mesh(30, 10, 40, 20);
  const Model model = prepared(flipped(mesh));
  EXPECT_THAT(model.repairs, ElementsAre("turned inside out"));
  EXPECT_EQ(model.mesh.triangles, prepared(mesh).mesh.triangles);
  EXPECT_GT(signed_volume(model.mesh), 0);
}

TEST(Prepare, turned_triangles_are_turned_back_and_counted) {
  const Mesh ball = icosphere(20, 3);
  Mesh mesh = ball;
  Random random(5, "prepare_test");
  std::int64_t turned_count = 0;
  for (auto& t : mesh.triangles)
    if (random.below(4) == 0) {
      std::swap(t[1], t[2]);
      ++turned_count;
    }
  for (const Mesh& given : {mesh, flipped(mesh)}) {
    const Model model = prepared(given);
    EXPECT_TRUE(count(model.mesh).sound());
    EXPECT_NEAR(signed_volume(model.mesh), signed_volume(ball), 1e-6);
    EXPECT_THAT(model.repairs, Contains(std::to_string(turned_count) + " triangles turned to match their neighbours"));
  }
}

TEST(Prepare, a_cavity_keeps_its_side) {
  const double solid = 8000 - 1000;
  const Mesh hollow = joined(cube(20), flipped(cube(10, {5, 5, 5})));
  EXPECT_NEAR(signed_volume(prepared(hollow).mesh), solid, 1e-6);
  EXPECT_NEAR(signed_volume(prepared(flipped(hollow)).mesh), solid, 1e-6);
  EXPECT_THAT(prepared(hollow).repairs, IsEmpty());
}

TEST(Prepare, a_lone_shell_inside_out_is_turned) {
  const Mesh mesh = joined(cube(20), flipped(cube(10, {50, 0, 0})));
  const Model model = prepared(mesh);
  EXPECT_NEAR(signed_volume(model.mesh), 9000, 1e-6);
  EXPECT_THAT(model.repairs, ElementsAre("1 closed shell turned outward"));
  EXPECT_NEAR(signed_volume(prepared(flipped(mesh)).mesh), 9000, 1e-6);
}

TEST(Prepare, bad_triangles_go_and_are_counted) {
  Mesh mesh = cube(20);
  mesh.triangles.push_back(mesh.triangles[3]);  // a copy
  mesh.triangles.push_back(
      {mesh.triangles[4][1], mesh.triangles[4][2], mesh.triangles[4][0]});  // a copy, started elsewhere
  mesh.triangles.push_back({0, 0, 1});
  mesh.vertices.push_back({10, 0, 0});  // on the edge from vertex 0 to 1
  mesh.triangles.push_back({0, 8, 1});
  const Model model = prepared(mesh);
  EXPECT_TRUE(count(model.mesh).sound());
  EXPECT_EQ(model.mesh.triangles, cube(20).triangles);
  EXPECT_THAT(model.repairs, ElementsAre("2 triangles without area dropped", "2 duplicate triangles dropped"));
}

TEST(Prepare, the_wall_between_touching_bodies_goes) {
  // Two cubes with a common face, cut along the same diagonal.
  const Mesh mesh = joined(cube(20), cube(20, {20, 0, 0}));
  const Model model = prepared(mesh);
  EXPECT_TRUE(count(model.mesh).sound());
  EXPECT_NEAR(signed_volume(model.mesh), 16000, 1e-6);
}

TEST(Prepare, a_double_sided_model_keeps_one_side) {
  const Mesh ball = icosphere(20, 2);
  const Model model = prepared(joined(ball, flipped(ball)));
  EXPECT_EQ(model.mesh.triangles.size(), ball.triangles.size());
  EXPECT_TRUE(count(model.mesh).sound());
  EXPECT_NEAR(signed_volume(model.mesh), signed_volume(ball), 1e-6);
}

TEST(Prepare, one_sided_bands_are_said_and_left) {
  Mesh band;
  constexpr int n = 24;
  for (int i = 0; i < n; ++i)
    for (const double side : {-5.0, 5.0}) {
      const double u = 2 * 3.14159265358979 * i / n, r = 30 + side * std::cos(u / 2);
      band.vertices.push_back(to_float({r * std::cos(u), r * std::sin(u), side * std::sin(u / 2)}));
    }
  for (std::uint32_t i = 0; i < n; ++i) {
    const bool last = i + 1 == n;
    const std::uint32_t a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    band.triangles.insert(band.triangles.end(), {{a, c, b}, {b, c, d}});
  }
  const Model model = prepared(band);
  EXPECT_EQ(model.mesh.triangles.size(), band.triangles.size());
  EXPECT_THAT(model.warnings, Contains(HasSubstr("no inside and outside")));
}

TEST(Prepare, refuses_what_encloses_nothing) {
  Mesh flat = without_triangle(cube(20), 0);
  flat.triangles.resize(1);
  EXPECT_EQ(refusal(flat), Code::BadInput);
  Mesh tilted;  // x + 2y + 3z = 0, up to the rounding of floats
  for (int i = 0; i < 30; ++i) {
    const double x = std::sin(i * 1.7) * 40, y = std::cos(i * 2.9) * 40;
    tilted.vertices.push_back(to_float({x, y, -(x + 2 * y) / 3}));
    if (i > 1)
      tilted.triangles.push_back(
          {static_cast<std::uint32_t>(i - 2), static_cast<std::uint32_t>(i - 1), static_cast<std::uint32_t>(i)});
  }
  EXPECT_EQ(refusal(tilted), Code::BadInput);
  Mesh lines;
  lines.vertices = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
  lines.triangles = {{0, 1, 2}};
  EXPECT_EQ(refusal(lines), Code::BadInput);
  EXPECT_EQ(refusal(Mesh{}), Code::BadInput);
}

TEST(Prepare, refuses_bad_sizes_and_units) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, inf}) {
    EXPECT_EQ(refusal(cube(20), {.size_mm = bad}), Code::BadRecipe);
    EXPECT_EQ(refusal(cube(20), {.unit_mm = bad}), Code::BadRecipe);
  }
  EXPECT_EQ(refusal(cube(20), {.unit_mm = 1e38}), Code::BadInput);
}

TEST(Prepare, the_file_notes_are_kept) {
  EXPECT_THAT(prepare({.mesh = cube(20), .unit_mm = 1, .notes = {"a note"}}, {}).repairs, ElementsAre("a note"));
}

TEST(Prepare, a_turned_model_gives_the_turned_result) {
  Mesh mesh = joined(flipped(icosphere(20, 2)), cube(3, {40, 0, 0}));
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_EQ(prepared(turned(mesh, axis, 1)).mesh.triangles, prepared(mesh).mesh.triangles);
}

TEST(Prepare, the_horse_is_inside_out) {
  const auto path = shared_model("horse.ply");
  if (!path) GTEST_SKIP() << "the shared models are not here";
  const MeshFile file = read_mesh(*path);
  const Model model = prepare(file, {.size_mm = 100});
  EXPECT_THAT(model.repairs, ElementsAre("turned inside out"));
  EXPECT_TRUE(count(model.mesh).sound());
  EXPECT_GT(signed_volume(model.mesh), 0);
  MeshFile other = file;
  other.mesh = flipped(file.mesh);
  EXPECT_EQ(prepare(other, {.size_mm = 100}).mesh.triangles, model.mesh.triangles);
}

}  // namespace
}  // namespace fibrolite
