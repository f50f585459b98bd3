// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/inspect.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "fibrolite/error.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/solid_io.h"
#include "models.h"

namespace fibrolite {
namespace {

using namespace testing;

std::int64_t crossings(const Mesh& mesh) { return inspect(mesh).self_intersections; }

Mesh two_triangles(std::vector<Vec3f> corners, Mesh::Triangle second) {
  Mesh mesh;
  mesh.vertices = std::move(corners);
  mesh.triangles = {{0, 1, 2}, second};
  return mesh;
}

TEST(Inspect, clean_surfaces_have_no_crossings) {
  EXPECT_EQ(crossings(cube(1)), 0);
  EXPECT_EQ(crossings(icosphere(1, 4)), 0);
  EXPECT_EQ(crossings(torus_mesh(3, 1, 60, 30)), 0);
  EXPECT_EQ(crossings(tube(1, 3, 200)), 0);  // fans of 200 triangles in one plane
}

TEST(Inspect, pairs_of_triangles) {
  const Vec3f a{0, 0, 0}, b{4, 0, 0}, c{0, 4, 0};
  // Apart, crossing through, touching with a corner, in the same plane.
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 1}, {1, 2, 1}, {2, 1, 1}}, {3, 4, 5})), 0);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, -1}, {1, 1, 1}, {9, 9, 1}}, {3, 4, 5})), 1);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 0}, {1, 1, 1}, {9, 9, 1}}, {3, 4, 5})), 1);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 0}, {2, 1, 0}, {1, 2, 0}}, {3, 4, 5})), 1);
  // A shared corner: leaning away, passing through, lying on.
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 1}, {2, 1, 1}}, {0, 3, 4})), 0);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 1}, {1, 1, -1}}, {0, 3, 4})), 1);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 0}, {1, 2, 0}}, {0, 3, 4})), 1);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {-1, -1, 0}, {-1, -2, 0}}, {0, 3, 4})), 0);
  // A shared edge: folded up, flat, folded onto.
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 1}}, {1, 0, 3})), 0);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, -1, 0}}, {1, 0, 3})), 0);
  EXPECT_EQ(crossings(two_triangles({a, b, c, {1, 1, 0}}, {1, 0, 3})), 1);
  // Three shared corners.
  EXPECT_EQ(crossings(two_triangles({a, b, c}, {0, 2, 1})), 1);
}

TEST(Inspect, a_tent_pole_through_a_sheet) {
  // A thin four-sided needle through the middle of one large triangle: its four sides are cut as eight triangles at
  // most; each side is two triangles, and the cut at a quarter of the height runs through both of them.
  Mesh needle = cube(1);
  for (Vec3f& p : needle.vertices) p = {p.x * 0.1F + 1, p.y * 0.1F + 1, p.z * 4 - 1};
  Mesh sheet;
  sheet.vertices = {{-10, -10, 0}, {20, -10, 0}, {-10, 20, 0}};
  sheet.triangles = {{0, 1, 2}};
  EXPECT_EQ(crossings(joined(needle, sheet)), 8);
}

TEST(Inspect, counts_every_pair_once_as_brute_force_does) {
  // Long thin triangles around random lines; the truth from a plain segment-triangle test on doubles, valid as nothing
  // touches.
  Random random(6, "inspect_test");
  Mesh mesh;
  const auto any = [&] {
    return Vec3f{static_cast<float>(random.uniform()), static_cast<float>(random.uniform()),
                 static_cast<float>(random.uniform())};
  };
  for (std::uint32_t t = 0; t < 150; ++t) {
    const Vec3f a = any(), b = any(), c = any();
    mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  const auto volume = [](Vec3d a, Vec3d b, Vec3d c, Vec3d d) { return dot(cross(b - a, c - a), d - a) > 0; };
  const auto pierces = [&](Vec3d p, Vec3d q, const std::array<Vec3d, 3>& t) {
    return volume(t[0], t[1], t[2], p) != volume(t[0], t[1], t[2], q) &&
           volume(p, q, t[0], t[1]) == volume(p, q, t[1], t[2]) && volume(p, q, t[1], t[2]) == volume(p, q, t[2], t[0]);
  };
  const auto corners = [&](std::size_t t) {
    return std::array{to_double(mesh.vertices[3 * t]), to_double(mesh.vertices[3 * t + 1]),
                      to_double(mesh.vertices[3 * t + 2])};
  };
  std::int64_t truth = 0;
  for (std::size_t t = 0; t < 150; ++t)
    for (std::size_t u = t + 1; u < 150; ++u) {
      const auto a = corners(t), b = corners(u);
      bool meet = false;
      for (std::size_t i = 0; i < 3; ++i)
        meet = meet || pierces(a[i], a[(i + 1) % 3], b) || pierces(b[i], b[(i + 1) % 3], a);
      truth += meet ? 1 : 0;
    }
  ASSERT_GT(truth, 100);
  EXPECT_EQ(crossings(mesh), truth);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(crossings(mesh), truth);
}

TEST(Inspect, degenerate_triangles_are_counted_not_crossed) {
  Mesh mesh = cube(2);
  mesh.vertices.push_back({1, 0, 0});
  mesh.triangles.push_back({0, 8, 1});
  const Inspection found = inspect(mesh);
  EXPECT_EQ(found.mesh.degenerate_triangles, 1);
  EXPECT_EQ(found.self_intersections, 0);
}

TEST(Inspect, a_file_as_json) {
  const TempDir dir;
  write_mesh(dir / "open.stl", without_triangle(cube(2), 0));
  const auto json = nlohmann::json::parse(inspect_file(dir / "open.stl"));
  EXPECT_EQ(json["closed"], false);
  EXPECT_EQ(json["self_intersections"], 0);
  EXPECT_EQ(json["size_mm"], (std::vector<double>{2, 2, 2}));
  EXPECT_EQ(json["mesh"]["triangles"], 11);
  EXPECT_EQ(json["mesh"]["vertices"], 8);
  EXPECT_EQ(json["mesh"]["boundary_edges"], 3);
  EXPECT_EQ(json["mesh"]["shells"], 1);
  EXPECT_EQ(json["volume_mm3"], json["mesh"]["volume_mm3"]);
}

TEST(Inspect, a_solid_by_its_surface) {
  const TempDir dir;
  write_vdb(dir / "ball.vdb", {{"ball", realize(sphere({}, 5), {{-7, -7, -7}, {7, 7, 7}}, {.voxel_mm = 0.25})}});
  const auto json = nlohmann::json::parse(inspect_file(dir / "ball.vdb"));
  EXPECT_EQ(json["closed"], true);
  EXPECT_EQ(json["self_intersections"], 0);
  EXPECT_NEAR(json["volume_mm3"], 4.0 / 3 * 3.14159265 * 125, 3);
}

TEST(Inspect, known_models) {
  struct Known {
    const char* file;
    bool closed, crosses;
  };
  for (const Known& known : {Known{"hand.obj", true, false}, Known{"monkey.obj", false, true},
                             Known{"bunny-open.obj", false, false}, Known{"cow-nonmanifold.obj", true, true}}) {
    const auto path = shared_model(known.file);
    if (!path) GTEST_SKIP() << "the shared models are not here";
    const Inspection found = inspect(read_mesh(*path).mesh);
    EXPECT_EQ(found.mesh.closed(), known.closed) << known.file;
    EXPECT_EQ(found.self_intersections > 0, known.crosses) << known.file;
  }
}

TEST(Inspect, can_be_cancelled) {
  const Context context;
  context.cancel();
  EXPECT_THROW((void)inspect(cube(1), context), Error);
}

}  // namespace
}  // namespace fibrolite
