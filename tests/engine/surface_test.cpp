// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/surface.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "dual_surface.h"
#include "fibrolite/ops/inspect.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "mesh_checks.h"
#include "models.h"
#include "quad_envelope.h"

namespace fibrolite {
namespace {

constexpr Box3d box{{-12, -12, -12}, {12, 12, 12}};

/// Values that cross zero anywhere, in any configuration of a cell.
struct Noise final : Shape::Function {
  void evaluate(const PointBlock& block, float* out) const override {
    for (int i = 0; i < block.count; ++i) {
      Random random(
          static_cast<std::uint64_t>(std::lround(block.x[i] * 8) * 1000003 + std::lround(block.y[i] * 8) * 1009 +
                                     std::lround(block.z[i] * 8) + 5000000),
          "noise");
      out[i] = static_cast<float>(0.8 * (random.uniform() - 0.5));
    }
  }
  [[nodiscard]] Interval bound(const Box3d&) const override { return {-0.5F, 0.5F}; }
};

TEST(Surface, keeps_the_volume_of_sticks) {
  for (const double radius : {1.0, 1.5, 2.0, 3.0, 6.0}) {
    constexpr double most = 0.003;
    for (const Vec3d to : {Vec3d{20, 0, 0}, Vec3d{12, 13, 0}, Vec3d{11, 10, 12}}) {
      const Vec3d from = Vec3d{0.13, 0.37, 0.21} - 0.5 * to;
      const Solid solid =
          realize(capsule(from, from + to, radius), Box3d{{-20, -20, -20}, {20, 20, 20}}, {.voxel_mm = 1});
      EXPECT_NEAR(signed_volume(surface(solid)) / solid.volume_mm3(), 1, most) << radius;
    }
  }
}

TEST(Surface, of_a_sphere_lies_on_the_sphere_and_faces_outward) {
  const Mesh mesh = surface(realize(sphere({0, 0, 0}, 8), box, {.voxel_mm = 0.25}));
  EXPECT_NEAR(signed_volume(mesh) / (4.0 / 3 * std::numbers::pi * 512), 1, 0.001);
  for (const Vec3f v : mesh.vertices) ASSERT_NEAR(norm(to_double(v)), 8, 0.02);
  EXPECT_TRUE(testing::count(mesh).sound());
}

TEST(Surface, flat_faces_stay_flat_and_edges_stay_within_half_a_voxel) {
  const Mesh mesh = surface(realize(cuboid({{-5.1, -5.1, -5.1}, {5.1, 5.1, 5.1}}), box, {.voxel_mm = 0.5}));
  const Shape truth = cuboid({{-5.1, -5.1, -5.1}, {5.1, 5.1, 5.1}});
  for (const Vec3f v : mesh.vertices) ASSERT_LT(std::abs(truth(to_double(v))), 0.25);
  // The mesh follows the grid's volume, which overstates a sharp edge by about a tenth of a square voxel of section.
  EXPECT_NEAR(signed_volume(mesh), 10.2 * 10.2 * 10.2, 12 * 10.2 * 0.15 * 0.25);
}

/// However the edges lie in their cells: what the mesh lacks there is not made good by a ridge beside them. The edges
/// themselves stand out by a tenth of a voxel at most, as the grid's volume has them.
TEST(Surface, a_box_has_no_ridge_beside_its_edges) {
  constexpr double voxel = 0.5;
  for (const double half : {5.0, 5.06, 5.12, 5.19, 5.25, 5.31, 5.38, 5.44, 5.5}) {
    const Shape truth = cuboid({{-half, -half, -half}, {half, half, half}});
    const Mesh mesh = surface(realize(truth, box, {.voxel_mm = voxel}));
    double faces = 0, edges = 0;
    for (const Vec3f v : mesh.vertices) {
      std::array<double, 3> from_middle{std::abs(v.x), std::abs(v.y), std::abs(v.z)};
      std::sort(from_middle.begin(), from_middle.end());
      double& out = from_middle[1] > half - 0.55 * voxel ? edges : faces;
      out = std::max(out, static_cast<double>(truth(to_double(v))));
    }
    EXPECT_LT(faces, 0.01 * voxel) << half;
    EXPECT_LT(edges, 0.12 * voxel) << half;
  }
}

TEST(Surface, of_noise_is_closed_and_manifold) {
  const Shape noise(std::make_shared<const Noise>());
  const Mesh mesh = surface(realize(intersect({noise, sphere({0, 0, 0}, 5)}), box, {.voxel_mm = 0.125}));
  ASSERT_GT(mesh.triangles.size(), 100000U);
  const auto count = testing::count(mesh);
  EXPECT_EQ(count.boundary_edges, 0);
  EXPECT_EQ(count.nonmanifold_edges, 0);
  EXPECT_EQ(count.nonmanifold_vertices, 0);
  EXPECT_EQ(count.degenerate_triangles, 0);
}

/// What a layer at a time says must be what all at once says.
std::vector<std::int64_t> counts(const MeshCheck& c) {
  return {
      c.triangles, c.vertices, c.boundary_edges, c.nonmanifold_edges, c.nonmanifold_vertices, c.degenerate_triangles,
      c.shells};
}

TEST(SurfaceLayers, of_slabs_are_the_whole_surface_vertex_for_vertex) {
  const Shape noise(std::make_shared<const Noise>());
  const Solid solid = realize(intersect({noise, sphere({0, 0, 0}, 3)}), box, {.voxel_mm = 0.125});
  const testing::TempDir folder;
  for (const bool keep_volume : {true, false}) {
    for (const int axis : {0, 1, 2}) {
      const SurfaceParams params{.keep_volume = keep_volume, .axis = axis};
      const Mesh whole = surface(solid, params);
      ASSERT_GT(whole.triangles.size(), 20000U);
      for (const int thickness : {8, 24}) {
        const auto scratch = thickness == 8 ? std::optional(folder.path()) : std::nullopt;
        SurfaceLayers layers(solid.grid(), params, scratch);
        for (int at = -40; at < 40; at += thickness) layers.add(solid, {axis, at, at + thickness});
        layers.finish(solid.volume_mm3());
        const Mesh mesh = gathered(layers);
        EXPECT_TRUE(mesh.vertices == whole.vertices) << axis << ' ' << thickness;
        EXPECT_TRUE(mesh.triangles == whole.triangles) << axis << ' ' << thickness;
        EXPECT_EQ(layers.vertices(), whole.vertices.size());
        EXPECT_EQ(layers.triangles(), whole.triangles.size());
        const MeshCheck at_once = check(whole), by_layers = check(layers);
        EXPECT_EQ(counts(by_layers), counts(at_once));
        EXPECT_NEAR(by_layers.volume_mm3, at_once.volume_mm3, 1e-9 * at_once.volume_mm3);
      }
    }
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

/// Layers with a fault in each: a hole, a triangle turned over, one there twice, a vertex at the place of one in the
/// layer before, or three at the places of a triangle's there.
class Faulty final : public MeshLayers {
 public:
  Faulty(const MeshLayers& layers, int fault) : layers_(layers), fault_(fault) {}
  [[nodiscard]] std::size_t vertices() const override { return layers_.vertices(); }
  [[nodiscard]] std::size_t triangles() const override { return layers_.triangles(); }
  void each(const std::function<void(const MeshLayer&)>& use, const Context& context) const override {
    Vec3f moved{};                   // the first vertex of the layer before
    std::vector<Vec3f> moved_three;  // its first three
    Mesh::Triangle within{};         // of the layer before alone
    layers_.each(
        [&](const MeshLayer& layer) {
          std::vector<Vec3f> vertices(layer.vertices.begin(), layer.vertices.end());
          std::vector<Mesh::Triangle> triangles(layer.triangles.begin(), layer.triangles.end());
          if (fault_ == 0 && !triangles.empty()) triangles.pop_back();
          if (fault_ == 1 && !triangles.empty()) std::swap(triangles.front()[0], triangles.front()[1]);
          if (fault_ == 2 && !triangles.empty()) triangles.push_back(triangles.front());
          if (fault_ == 3 && layer.before > 1 && layer.before < vertices.size()) {
            vertices[0] = moved;
            vertices[layer.before] = vertices[layer.before - 1];
            moved = vertices[layer.before];
          } else if (layer.before < vertices.size()) {
            moved = vertices[layer.before];
          }
          if (fault_ == 4) {
            std::copy(moved_three.begin(), moved_three.end(), vertices.begin());
            moved_three.clear();
            if (within[0] != within[1] && layer.before + 3 < vertices.size()) {
              for (std::size_t i = 0; i < 3; ++i) {
                vertices[layer.before + i] = vertices[within[i] - layer.first];
                moved_three.push_back(vertices[layer.before + i]);
              }
            }
            within = {};
            for (const Mesh::Triangle& t : triangles)  // whose places have not been moved
              if (std::min({t[0], t[1], t[2]}) >= layer.first + layer.before + 3) within = t;
          }
          use({vertices, layer.first, layer.before, triangles, {}});
        },
        context);
  }

 private:
  const MeshLayers& layers_;
  int fault_;
};

TEST(SurfaceLayers, check_finds_what_is_wrong_in_any_layers) {
  // A mesh with every fault, cut into layers anywhere.
  const Solid solid = realize(torus({}, 7, 2), box, {.voxel_mm = 0.25});
  SurfaceLayers layers(solid.grid());
  layers.add(solid);
  layers.finish(solid.volume_mm3());
  for (int fault = 0; fault < 5; ++fault) {
    const Faulty faulty(layers, fault);
    const MeshCheck by_layers = check(faulty);
    EXPECT_EQ(counts(by_layers), counts(check(gathered(faulty)))) << fault;
    EXPECT_NE(counts(by_layers), counts(check(layers))) << fault;
  }
}

/// Sticks that end in a wall whose face is a plane of the lattice, and cells of every kind.
TEST(Surface, does_not_cut_itself) {
  std::vector<Shape> parts{complement(cuboid({{-5, -5, -5}, {5, 5, 5}}))};
  Random random(3, "sticks");
  const auto anywhere = [&] { return Vec3d{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5}; };
  for (int i = 0; i < 60; ++i) parts.push_back(capsule(24 * anywhere(), 24 * anywhere(), 0.5));
  const Shape sticks = intersect({unite(parts), cuboid({{-6, -6, -6}, {6, 6, 6}})});
  const Shape noise = intersect({Shape(std::make_shared<const Noise>()), sphere({0, 0, 0}, 4)});
  for (const Shape& shape : {sticks, noise}) {
    const Mesh mesh = surface(realize(shape, box, {.voxel_mm = 0.125}));
    ASSERT_GT(mesh.triangles.size(), 100000U);
    EXPECT_EQ(inspect(mesh).self_intersections, 0);
  }
}

/// Where thin sticks meet a wall, a quad may have no diagonal that keeps to its envelope: its corners are moved then.
TEST(Surface, does_not_cut_itself_where_neither_diagonal_will_do) {
  Random random(48, "sticks");
  std::vector<Shape> parts{complement(cuboid({{-5, -5, -5}, {5, 5, 5}}))};
  const auto anywhere = [&] { return Vec3d{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5}; };
  for (int i = 0; i < 60; ++i) parts.push_back(capsule(24 * anywhere(), 24 * anywhere(), 0.2 + 0.4 * random.uniform()));
  const Shape sticks = intersect({unite(parts), cuboid({{-6, -6, -6}, {6, 6, 6}})});
  const Mesh mesh = surface(realize(sticks, box, {.voxel_mm = 0.1 + 0.15 * random.uniform()}));
  ASSERT_GT(mesh.triangles.size(), 100000U);
  EXPECT_EQ(inspect(mesh).self_intersections, 0);
}

/// Is a point in the tetrahedron, or on it?
bool in_tetrahedron(Vec3d p, Vec3d a, Vec3d b, Vec3d c, Vec3d d) {
  const auto volume = [](Vec3d i, Vec3d j, Vec3d k, Vec3d l) { return dot(j - i, cross(k - i, l - i)); };
  const double whole = volume(a, b, c, d), slack = 1e-9;
  return volume(p, b, c, d) / whole > -slack && volume(a, p, c, d) / whole > -slack &&
         volume(a, b, p, d) / whole > -slack && volume(a, b, c, p) / whole > -slack;
}

/// Of random quads around the edge from (3, 5, 7) to (4, 5, 7), by points along the diagonals.
TEST(QuadEnvelope, tells_the_wrong_diagonal) {
  Random random(1, "quads");
  const Vec3d from{3, 5, 7}, to{4, 5, 7};
  int wrong = 0;
  for (int round = 0; round < 20000; ++round) {
    // Often close to the lattice's planes, where it matters.
    const auto in_cell = [&] { return std::pow(random.uniform(), 3.0); };
    const auto along = [&] { return random.uniform() < 0.5 ? in_cell() : 1 - in_cell(); };
    const std::array<Vec3d, 4> corners{
        Vec3d{3 + along(), 5 + in_cell(), 7 + in_cell()}, Vec3d{3 + along(), 5 - in_cell(), 7 + in_cell()},
        Vec3d{3 + along(), 5 - in_cell(), 7 - in_cell()}, Vec3d{3 + along(), 5 + in_cell(), 7 - in_cell()}};
    const auto inside = [&](std::size_t k) {
      bool all = true;
      for (int i = 1; i < 200; ++i) {
        const Vec3d p = corners[k] + i / 200.0 * (corners[k + 2] - corners[k]);
        bool any = false;
        for (std::size_t n = 0; n < 4; ++n) any = any || in_tetrahedron(p, from, to, corners[n], corners[(n + 1) & 3]);
        all = all && any;
      }
      return all;
    };
    for (const bool first : {true, false}) {
      if (!wrong_diagonal(corners, 1, first)) continue;
      ++wrong;
      EXPECT_FALSE(inside(first ? 0 : 1)) << round;
      EXPECT_TRUE(inside(first ? 1 : 0)) << round;
      // In other units, and along another axis.
      std::array<Vec3d, 4> turned;
      for (std::size_t k = 0; k < 4; ++k) turned[k] = 0.1 * Vec3d{corners[k].y, corners[k].z, corners[k].x};
      EXPECT_TRUE(wrong_diagonal(turned, 0.1, first)) << round;
    }
  }
  EXPECT_GT(wrong, 1000);
}

/// A quad of a bracket with gyroid walls, whose shorter diagonal ran through its neighbour.
TEST(QuadEnvelope, knows_a_quad_that_was_wrong) {
  const std::array<Vec3d, 4> corners{Vec3d{-94.636, -62.051, 154.453}, Vec3d{-95.042, -62.030, 154.033},
                                     Vec3d{-95.012, -62.028, 153.500}, Vec3d{-94.997, -62.004, 153.495}};
  EXPECT_TRUE(wrong_diagonal(corners, 1, false));
  EXPECT_FALSE(wrong_diagonal(corners, 1, true));
}

TEST(Surface, of_touching_planes_on_the_lattice_has_no_degenerate_triangle) {
  const Shape shape =
      unite({cuboid({{-5, -5, -5}, {0, 5, 5}}), cuboid({{0, -3, -3}, {5, 3, 3}}), cuboid({{5, 3, 3}, {8, 6, 6}})});
  const auto count = testing::count(surface(realize(shape, box, {.voxel_mm = 0.5})));
  EXPECT_TRUE(count.sound()) << count.degenerate_triangles << ' ' << count.nonmanifold_edges << ' '
                             << count.nonmanifold_vertices;
}

TEST(Surface, same_bits_on_one_and_two_threads) {
  const Solid solid = realize(torus({}, 7, 2), box, {.voxel_mm = 0.2});
  Mesh meshes[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    meshes[threads - 1] = surface(solid);
  }
  EXPECT_TRUE(meshes[0].vertices == meshes[1].vertices);
  EXPECT_TRUE(meshes[0].triangles == meshes[1].triangles);
}

}  // namespace
}  // namespace fibrolite
