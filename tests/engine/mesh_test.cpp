// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/mesh.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "fibrolite/random.h"
#include "mesh_checks.h"
#include "models.h"

namespace fibrolite {
namespace {

using namespace testing;

// Every triangle with corners of its own, as in an STL file.
Mesh soup(const Mesh& mesh) {
  Mesh result;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(result.vertices.size());
    for (const std::uint32_t v : t) result.vertices.push_back(mesh.vertices[v]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

void expect_agreement(const Mesh& mesh) {
  const MeshCheck ours = check(mesh);
  const IndependentCount theirs = count(mesh);
  EXPECT_EQ(ours.boundary_edges, theirs.boundary_edges);
  EXPECT_EQ(ours.nonmanifold_edges, theirs.nonmanifold_edges);
  EXPECT_EQ(ours.nonmanifold_vertices, theirs.nonmanifold_vertices);
  EXPECT_EQ(ours.degenerate_triangles, theirs.degenerate_triangles);
  if (ours.closed()) {  // else the volume depends on the point it is measured from
    EXPECT_NEAR(ours.volume_mm3, theirs.volume_mm3, 1e-6 * std::abs(theirs.volume_mm3) + 1e-12);
  }
}

TEST(Mesh, measures_of_a_cube) {
  const Mesh mesh = cube(2, {10, 20, 30});
  EXPECT_EQ(bounds(mesh).min, (Vec3d{10, 20, 30}));
  EXPECT_EQ(bounds(mesh).max, (Vec3d{12, 22, 32}));
  EXPECT_DOUBLE_EQ(signed_volume(mesh), 8);
  EXPECT_DOUBLE_EQ(signed_volume(flipped(mesh)), -8);
  EXPECT_DOUBLE_EQ(area(mesh), 24);
}

TEST(Mesh, measures_of_nothing) {
  const Mesh mesh;
  EXPECT_TRUE(bounds(mesh).empty());
  EXPECT_EQ(signed_volume(mesh), 0);
  EXPECT_EQ(area(mesh), 0);
  EXPECT_EQ(check(mesh).triangles, 0);
}

TEST(Mesh, a_torus_approaches_its_formula) {
  // Guldin: volume 2 pi^2 R r^2, area 4 pi^2 R r; a fine inscribed mesh is below by O(1/n^2).
  const double pi = std::numbers::pi;
  const Mesh mesh = torus_mesh(10, 3, 400, 200);
  EXPECT_NEAR(signed_volume(mesh) / (2 * pi * pi * 10 * 9), 1, 3e-4);
  EXPECT_NEAR(area(mesh) / (4 * pi * pi * 10 * 3), 1, 3e-4);
}

TEST(Mesh, volume_does_not_lose_digits_far_from_the_origin) {
  EXPECT_DOUBLE_EQ(signed_volume(cube(2, {1'000'000, 1'000'000, 1'000'000})), 8);
}

TEST(Mesh, zero_area_is_exact) {
  // Collinear, but no coordinate says so: (1, 2, 3) / 10 times 1, 2 and 4 are exact multiples in floats.
  const auto at = [](float s) { return Vec3f{s * 0.1F, s * 0.2F, s * 0.3F}; };
  EXPECT_TRUE(zero_area(at(1), at(2), at(4)));
  EXPECT_TRUE(zero_area(at(1), at(1), at(4)));
  Vec3f off = at(4);
  off.z = std::nextafter(off.z, 2.0F);
  EXPECT_FALSE(zero_area(at(1), at(2), off));
  // ab * cd = ac * bd, so these are collinear with the origin; seen from (e, e) twice the area is e * 1, far below the
  // rounding of the products (2^46).
  const float ab = 2900 * 2800, ac = 2900 * 2801, bd = 2800 * 2901, cd = 2801 * 2901, e = 0x1p-20F;
  EXPECT_TRUE(zero_area({0, 0, 0}, {ab, ac, 0}, {bd, cd, 0}));
  EXPECT_FALSE(zero_area({e, e, 0}, {ab, ac, 0}, {bd, cd, 0}));
}

TEST(Mesh, welding_leaves_one_vertex_per_place_and_every_triangle) {
  const Mesh ball = icosphere(5, 3);
  Mesh unwelded = soup(ball);
  unwelded.vertices.push_back({99, 99, 99});  // used by nothing
  const Mesh mesh = welded(unwelded);
  EXPECT_EQ(mesh.vertices.size(), ball.vertices.size());
  ASSERT_EQ(mesh.triangles.size(), ball.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_EQ(mesh.vertices[mesh.triangles[t][i]], ball.vertices[ball.triangles[t][i]]);
}

TEST(Mesh, minus_zero_is_zero) {
  Mesh mesh = soup(moved(cube(2), {-1, -1, -1}));
  for (Vec3f& p : mesh.vertices) p = {p.x * 0.0F, p.y, p.z};  // half of the x become -0
  EXPECT_EQ(welded(mesh).vertices.size(), 4U);
}

TEST(MeshCheck, euler_characteristic_of_sphere_and_torus) {
  for (const auto& [mesh, euler] : {std::pair{icosphere(1, 3), 2}, std::pair{torus_mesh(3, 1, 40, 20), 0}}) {
    const MeshCheck c = check(soup(mesh));
    EXPECT_TRUE(c.closed());
    EXPECT_EQ(c.nonmanifold_vertices, 0);
    EXPECT_EQ(c.degenerate_triangles, 0);
    EXPECT_EQ(c.shells, 1);
    EXPECT_EQ(c.vertices - c.triangles * 3 / 2 + c.triangles, euler);
  }
}

TEST(MeshCheck, counts_known_faults) {
  EXPECT_EQ(check(without_triangle(cube(1), 5)).boundary_edges, 3);
  EXPECT_EQ(check(joined(cube(1), cube(1, {1, 1, 0}))).nonmanifold_edges, 1);     // four triangles on one edge
  EXPECT_EQ(check(joined(cube(1), cube(1, {1, 1, 1}))).nonmanifold_vertices, 1);  // two fans on one vertex
  EXPECT_EQ(check(joined(cube(1), cube(1, {1, 1, 1}))).shells, 2);
  EXPECT_EQ(check(joined(cube(1), cube(1, {1, 1, 0}))).shells, 1);
  Mesh turned_one = cube(1);
  std::swap(turned_one.triangles[0][0], turned_one.triangles[0][1]);
  EXPECT_EQ(check(turned_one).nonmanifold_edges, 3);  // its three edges run the same way as their neighbours'
  Mesh collapsed = cube(1);
  collapsed.triangles.push_back({0, 0, 1});
  EXPECT_EQ(check(collapsed).degenerate_triangles, 1);
  EXPECT_TRUE(check(collapsed).closed());
}

TEST(MeshCheck, four_triangles_on_an_edge_in_any_order) {
  Mesh mesh = joined(cube(1), cube(1, {1, 1, 0}));
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed, "order");
    for (std::size_t i = mesh.triangles.size(); i > 1; --i)
      std::swap(mesh.triangles[i - 1], mesh.triangles[random.below(i)]);
    const MeshCheck found = check(mesh);
    ASSERT_EQ(found.nonmanifold_edges, 1) << seed;
    ASSERT_EQ(found.nonmanifold_vertices, 0) << seed;
    ASSERT_EQ(found.shells, 1) << seed;
  }
}

TEST(MeshCheck, agrees_with_an_independent_count_on_random_soups) {
  Random random(1, "mesh_test");
  for (int round = 0; round < 50; ++round) {
    // Few places and many triangles: every fault occurs.
    Mesh mesh;
    for (int v = 0; v < 40; ++v)
      mesh.vertices.push_back({static_cast<float>(random.below(3)), static_cast<float>(random.below(3)),
                               static_cast<float>(random.below(3))});
    for (std::uint64_t t = 0, n = 5 + random.below(60); t < n; ++t) {
      const auto any = [&] { return static_cast<std::uint32_t>(random.below(40)); };
      mesh.triangles.push_back({any(), any(), any()});
    }
    expect_agreement(mesh);
  }
}

TEST(MeshCheck, agrees_with_an_independent_count_on_a_torn_torus) {
  Random random(2, "mesh_test");
  Mesh mesh = torus_mesh(30, 10, 200, 100);
  for (auto& t : mesh.triangles)
    if (random.below(20) == 0) std::swap(t[1], t[2]);
  std::erase_if(mesh.triangles, [&](const Mesh::Triangle&) { return random.below(50) == 0; });
  expect_agreement(mesh);
  expect_agreement(soup(mesh));
}

TEST(MeshCheck, same_bits_on_one_and_two_threads) {
  const Mesh mesh = soup(torus_mesh(30, 10, 300, 150));
  const auto with_threads = [&](std::size_t n) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, n);
    return std::tuple{signed_volume(mesh), area(mesh), check(mesh).vertices, check(mesh).shells};
  };
  EXPECT_EQ(with_threads(1), with_threads(2));
}

}  // namespace
}  // namespace fibrolite
