// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/winding.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "fibrolite/mesh_io.h"
#include "fibrolite/random.h"
#include "models.h"

namespace fibrolite {
namespace {

using testing::cube;

Vec3d corner(const Mesh& mesh, const Mesh::Triangle& t, std::size_t i) { return to_double(mesh.vertices[t[i]]); }

/// The solid angle of a spherical triangle as its excess over pi: another
/// formula than the library's.
double solid_angle_by_excess(Vec3d a, Vec3d b, Vec3d c) {
  const auto angle_at = [](Vec3d apex, Vec3d u, Vec3d v) {
    const Vec3d m = cross(apex, u), n = cross(apex, v);
    return std::atan2(norm(cross(m, n)), dot(m, n));
  };
  const double excess = angle_at(a, b, c) + angle_at(b, c, a) + angle_at(c, a, b) - std::numbers::pi;
  return dot(a, cross(b, c)) >= 0 ? excess : -excess;
}

double winding_by_brute_force(const Mesh& mesh, Vec3d p) {
  double sum = 0;
  for (const Mesh::Triangle& t : mesh.triangles) {
    sum += solid_angle_by_excess(corner(mesh, t, 0) - p, corner(mesh, t, 1) - p, corner(mesh, t, 2) - p);
  }
  return sum / (4 * std::numbers::pi);
}

/// By the plane if the foot lies within the triangle (barycentric), else by its
/// three edges.
double distance_by_brute_force(const Mesh& mesh, Vec3d p) {
  double best = std::numeric_limits<double>::infinity();
  for (const Mesh::Triangle& t : mesh.triangles) {
    const std::array<Vec3d, 3> v{corner(mesh, t, 0), corner(mesh, t, 1), corner(mesh, t, 2)};
    const Vec3d n = cross(v[1] - v[0], v[2] - v[0]);
    const double n2 = dot(n, n);
    bool within = n2 > 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d edge = v[(i + 1) % 3] - v[i];
      within = within && dot(cross(edge, p - v[i]), n) >= 0;
      const double s = std::clamp(dot(p - v[i], edge) / std::max(dot(edge, edge), 1e-300), 0.0, 1.0);
      best = std::min(best, norm(p - (v[i] + s * edge)));
    }
    if (within) best = std::min(best, std::abs(dot(p - v[0], n)) / std::sqrt(n2));
  }
  return best;
}

Vec3d random_point(Random& random, const Box3d& box) {
  const double x = random.uniform(), y = random.uniform(), z = random.uniform();
  return {box.min.x + x * box.size().x, box.min.y + y * box.size().y, box.min.z + z * box.size().z};
}

TEST(Winding, of_a_cube_is_one_inside_and_zero_outside) {
  const WindingTree tree(cube(20));
  EXPECT_NEAR(tree.winding({10, 10, 10}), 1, 1e-6);
  EXPECT_NEAR(tree.winding({0.001, 10, 3}), 1, 1e-4);
  EXPECT_NEAR(tree.winding({-0.001, 10, 3}), 0, 1e-4);
  EXPECT_NEAR(tree.winding({300, -20, 7}), 0, 1e-6);
}

TEST(Winding, of_a_cube_without_a_triangle_loses_its_share_of_the_view) {
  // Seen from the centre each of the 12 triangles covers one twelfth of the
  // sphere.
  EXPECT_NEAR(WindingTree(testing::without_triangle(cube(20), 5)).winding({10, 10, 10}), 11.0 / 12, 1e-6);
}

TEST(Winding, counts_overlapping_and_reversed_surfaces) {
  const Mesh two = testing::joined(cube(20), cube(20, {10, 0, 0}));
  EXPECT_NEAR(WindingTree(two).winding({15, 10, 10}), 2, 1e-5);
  EXPECT_NEAR(WindingTree(two).winding({25, 10, 10}), 1, 1e-5);
  const Mesh hollow = testing::joined(cube(20), testing::flipped(cube(10, {5, 5, 5})));
  EXPECT_NEAR(WindingTree(hollow).winding({10, 10, 10}), 0, 1e-5);
  EXPECT_NEAR(WindingTree(testing::flipped(cube(20))).winding({10, 10, 10}), -1, 1e-5);
}

TEST(Winding, of_nothing_is_nothing) {
  const WindingTree tree(Mesh{});
  EXPECT_EQ(tree.winding({1, 2, 3}), 0);
  EXPECT_EQ(tree.nearest({1, 2, 3}).distance_mm, std::numeric_limits<double>::infinity());
}

TEST(Winding, closed_means_every_edge_runs_both_ways) {
  EXPECT_TRUE(WindingTree(cube(20)).closed());
  EXPECT_TRUE(WindingTree(testing::joined(cube(20), cube(20, {10, 0, 0}))).closed());
  EXPECT_FALSE(WindingTree(testing::without_triangle(cube(20), 0)).closed());
  Mesh one_reversed = cube(20);
  std::swap(one_reversed.triangles[3][0], one_reversed.triangles[3][1]);
  EXPECT_FALSE(WindingTree(one_reversed).closed());
}

TEST(Nearest, of_a_cube_is_the_analytic_distance) {
  const WindingTree tree(cube(20));
  const auto at = [&](Vec3d p) { return tree.nearest(p).distance_mm; };
  EXPECT_DOUBLE_EQ(at({10, 10, 13}), 7);
  EXPECT_DOUBLE_EQ(at({23, 24, 10}), 5);
  EXPECT_DOUBLE_EQ(at({-1, -2, 22}), 3);
  EXPECT_DOUBLE_EQ(at({1000, 10, 10}), 980);
  const auto nearest = tree.nearest({10, 4, 25});
  EXPECT_EQ(nearest.point, (Vec3d{10, 4, 20}));
  for (const std::uint32_t v : cube(20).triangles[nearest.triangle]) EXPECT_EQ(cube(20).vertices[v].z, 20);
}

class TreeOfModel : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string name = GetParam();
    if (name == "torus") {
      model = testing::torus_mesh(20, 7, 90, 40);
    } else if (const auto path = testing::shared_model(name)) {
      model = read_mesh(*path).mesh;
    } else {
      GTEST_SKIP() << "the folder of real models is missing";
    }
  }
  Mesh model;
};

TEST_P(TreeOfModel, agrees_with_brute_force) {
  const WindingTree tree(model);
  const Box3d box = bounds(model);
  const double size = box.longest_side();
  Random random(1, GetParam());
  const std::size_t points = model.triangles.size() < 20000 ? 200 : 30;
  for (std::size_t i = 0; i < points; ++i) {
    Vec3d p = random_point(random, box.grown(0.2 * size));
    if (i % 2 == 0) {  // half of them near the surface
      const auto v = static_cast<std::size_t>(random.below(model.vertices.size()));
      p = to_double(model.vertices[v]) + 0.01 * size * (random_point(random, {{-1, -1, -1}, {1, 1, 1}}));
    }
    EXPECT_NEAR(tree.winding(p), winding_by_brute_force(model, p), 0.01);
    const auto nearest = tree.nearest(p);
    EXPECT_NEAR(nearest.distance_mm, distance_by_brute_force(model, p), 1e-9 * size);
    EXPECT_NEAR(norm(nearest.point - p), nearest.distance_mm, 1e-12 * size);
  }
}
INSTANTIATE_TEST_SUITE_P(Models, TreeOfModel,
                         ::testing::Values("torus", "horse.ply", "monkey.obj", "bunny-open.obj",
                                           "teapot-nonmanifold.obj", "cow-nonmanifold.obj",
                                           "falcon-open-nonmanifold.obj"));

TEST(Winding, same_bits_on_one_and_two_threads) {
  const Mesh mesh = testing::icosphere(10, 5);
  const auto answers = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const WindingTree tree(mesh);
    Random random(7, "threads");
    std::vector<double> result;
    for (int i = 0; i < 500; ++i) {
      const Vec3d p = random_point(random, {{-15, -15, -15}, {15, 15, 15}});
      const auto nearest = tree.nearest(p);
      result.insert(result.end(), {tree.winding(p), nearest.distance_mm, nearest.point.x, 1.0 * nearest.triangle});
    }
    return result;
  };
  EXPECT_EQ(answers(1), answers(2));
}

TEST(MeshDistance, of_a_sphere_is_its_radius_less_the_facets) {
  const Shape shape = distance_to(WindingTree(testing::icosphere(10, 5)));
  // The facets lie at most edge^2 / (8 r) below the sphere: 20 * 4^5 triangles,
  // edges near 0.4 mm.
  for (const double r : {0.5, 7.0, 9.9, 10.1, 14.0, 60.0}) {
    EXPECT_NEAR(shape({r * 0.6, 0, -r * 0.8}), r - 10, 0.005) << r;
  }
}

TEST(MeshDistance, a_bound_holds_all_values_of_its_box) {
  for (const Mesh& mesh : {cube(20), testing::without_triangle(cube(20), 2)}) {
    const Shape shape = distance_to(WindingTree(mesh));
    Random random(3, "bound");
    for (int i = 0; i < 200; ++i) {
      Box3d box;
      box.include(random_point(random, {{-10, -10, -10}, {30, 30, 30}}));
      box.include(random_point(random, {{-10, -10, -10}, {30, 30, 30}}));
      const Interval bound = shape.bound(box);
      for (int k = 0; k < 20; ++k) {
        const float d = shape(random_point(random, box));
        EXPECT_LE(bound.lo, d + 1e-5F);
        EXPECT_GE(bound.hi, d - 1e-5F);
      }
    }
  }
}

TEST(MeshDistance, a_row_of_points_reads_as_each_point_alone) {
  // Neighbouring points share their side when nothing can lie between them:
  // that must not show.
  const Mesh hollow = testing::joined(cube(20), testing::flipped(cube(10, {5, 5, 5})));
  const Shape shape = distance_to(WindingTree(hollow));
  std::vector<Vec3d> points;
  for (int i = 0; i < 3000; ++i) points.push_back({-5 + 0.01 * i, 7.3, 8.1});
  std::vector<float> together(points.size());
  shape.evaluate(points, together);
  for (std::size_t i = 0; i < points.size(); i += 7) EXPECT_EQ(together[i], shape(points[i])) << i;
  EXPECT_GT(shape({10, 10, 10}), 4.9);
  EXPECT_LT(shape({2, 10, 10}), -1.9);
}

}  // namespace
}  // namespace fibrolite
