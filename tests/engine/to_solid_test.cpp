// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/to_solid.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/random.h"
#include "fibrolite/shape.h"
#include "fibrolite/vdb.h"
#include "fibrolite/winding.h"
#include "models.h"

namespace fibrolite {
namespace {

using testing::cube;

Solid solid_of(const Mesh& mesh, double voxel_mm, double inside_band_mm = 0, float band_vox = 3) {
  return to_solid(mesh, {.grid = {.voxel_mm = voxel_mm, .band_vox = band_vox}, .inside_band_mm = inside_band_mm}).solid;
}

Mesh scaled_to(Mesh mesh, double longest_mm) {
  const double scale = longest_mm / bounds(mesh).longest_side();
  for (Vec3f& v : mesh.vertices) v = to_float(scale * to_double(v));
  return mesh;
}

Vec3d random_point(Random& random, const Box3d& box) {
  const double x = random.uniform(), y = random.uniform(), z = random.uniform();
  return {box.min.x + x * box.size().x, box.min.y + y * box.size().y, box.min.z + z * box.size().z};
}

Vec3d place_of(const openvdb::Coord& c, double voxel_mm) {
  return voxel_mm * Vec3d{1.0 * c.x(), 1.0 * c.y(), 1.0 * c.z()};
}

/// Visits every sample of every leaf, active or not.
template <class Visit>
void for_samples(const Solid& solid, const Visit& visit) {
  const auto grid = to_vdb(solid);
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    for (auto value = leaf->cbeginValueAll(); value; ++value) {
      visit(place_of(value.getCoord(), solid.grid().voxel_mm), *value, value.isValueOn());
    }
  }
}

/// No two neighbouring samples, in leaves or tiles, may differ by more than
/// their spacing: then the surface has no hole that the inside could leak
/// through.
void expect_no_leak(const Solid& solid) {
  const auto grid = to_vdb(solid);
  const auto accessor = grid->getConstAccessor();
  const float most = 1.01F * static_cast<float>(solid.grid().voxel_mm);
  std::int64_t broken = 0;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    for (auto value = leaf->cbeginValueAll(); value; ++value) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const int step : {-1, 1}) {
          openvdb::Coord next = value.getCoord();
          if (step < 0 && (next[axis] & 7) != 0) continue;  // seen from there
          next[axis] += step;
          broken += std::abs(accessor.getValue(next) - *value) > most ? 1 : 0;
        }
      }
    }
  }
  EXPECT_EQ(broken, 0);
  // And along straight lines: tiles included, the side changes only through the
  // band.
  const Box3d box = solid.bounds_mm().grown(5 * solid.grid().voxel_mm);
  Random random(11, "rays");
  std::int64_t inside = 0;
  for (int ray = 0; ray < 200; ++ray) {
    const Vec3d a = random_point(random, box);
    auto at = openvdb::Coord::round(openvdb::Vec3d(a.x, a.y, a.z) / solid.grid().voxel_mm);
    const auto axis = static_cast<std::size_t>(ray % 3);
    const int end = static_cast<int>(std::lround(box.max[ray % 3] / solid.grid().voxel_mm));
    at[axis] = static_cast<int>(std::lround(box.min[ray % 3] / solid.grid().voxel_mm));
    float last = accessor.getValue(at);
    EXPECT_GT(last, 0);
    for (; at[axis] < end; ++at[axis]) {
      const float value = accessor.getValue(at);
      ASSERT_LE(std::abs(value - last), most);
      inside += value < 0 ? 1 : 0;
      last = value;
    }
    EXPECT_GT(last, 0);
  }
  EXPECT_GT(inside, 0);
}

// ---- exact distances ----

TEST(ToSolid, a_cube_has_its_analytic_distances) {
  const Vec3d at{0.123, -7.31, 4.057};
  const double voxel = 0.37;
  const Solid solid = solid_of(cube(20, at), voxel, 1.5);
  const Shape truth = cuboid({at, at + Vec3d{20, 20, 20}});
  std::int64_t active = 0;
  for_samples(solid, [&](Vec3d p, float value, bool on) {
    const auto highest = static_cast<float>(3 * voxel), lowest = static_cast<float>(-1.5 - 3 * voxel);
    EXPECT_NEAR(value, std::clamp(truth(p), lowest, highest), 1e-3 * voxel);
    EXPECT_EQ(on, value < highest * (1 - 1e-6F) && value > lowest * (1 - 1e-6F));
    active += on ? 1 : 0;
  });
  EXPECT_EQ(active, solid.active_voxels());
  // Every sample whose true distance lies in the band is active, and no other.
  std::int64_t in_band = 0;
  for (int x = -4; x < 60; ++x) {
    for (int y = -24; y < 40; ++y) {
      for (int z = 6; z < 70; ++z) {
        const float d = truth(voxel * Vec3d{1.0 * x, 1.0 * y, 1.0 * z});
        in_band += d < 3 * voxel && d > -1.5 - 3 * voxel ? 1 : 0;
      }
    }
  }
  EXPECT_GT(in_band, 90000);
  EXPECT_NEAR(static_cast<double>(active), static_cast<double>(in_band), 2);  // one sample may lie on the limit
  EXPECT_NEAR(solid.volume_mm3(), 8000, 16);
  expect_no_leak(solid);
}

TEST(ToSolid, samples_on_the_surface_count_as_outside) {
  const Solid solid = solid_of(cube(10), 0.5);
  const auto accessor = to_vdb(solid)->getConstAccessor();
  EXPECT_FLOAT_EQ(accessor.getValue({20, 7, 9}), 0.5F * 1e-3F);
  EXPECT_FLOAT_EQ(accessor.getValue({0, 20, 9}), 0.5F * 1e-3F);
  EXPECT_FLOAT_EQ(accessor.getValue({19, 7, 9}), -0.5F);
  for_samples(solid, [](Vec3d, float value, bool) { EXPECT_GE(std::abs(value), 0.49F * 1e-3F); });
}

TEST(ToSolid, a_meshed_sphere_has_the_distances_of_its_triangles) {
  const Mesh mesh = testing::icosphere(8, 3, {1.01, 2.02, 3.03});
  const double voxel = 0.5;
  const WindingTree tree(mesh);  // checked against brute force in its own test
  const Solid solid = solid_of(mesh, voxel, 2.0);
  std::int64_t seen = 0;
  for_samples(solid, [&](Vec3d p, float value, bool on) {
    if (!on) return;
    const double d = tree.nearest(p).distance_mm;
    EXPECT_NEAR(std::abs(value), d, 2e-4 * voxel);
    if (d > 0.1) {
      EXPECT_EQ(value < 0, norm(p - Vec3d{1.01, 2.02, 3.03}) < 8);
    }
    ++seen;
  });
  EXPECT_GT(seen, 20000);
  EXPECT_NEAR(solid.volume_mm3(), signed_volume(mesh), 1e-3 * signed_volume(mesh));
}

TEST(ToSolid, thin_needles_and_large_triangles_are_exact_too) {
  // A long thin box far from the origin: triangles of 300 x 0.9 mm, sliced by
  // its diagonals, and a needle-shaped tetrahedron.
  Mesh mesh = testing::tube(1.3, 400, 7, {1000.2, -500.7, 300.1});
  const WindingTree tree(mesh);
  const Solid solid = solid_of(mesh, 0.25, 0.4);
  for_samples(solid, [&](Vec3d p, float value, bool on) {
    if (on) {
      ASSERT_NEAR(std::abs(value), tree.nearest(p).distance_mm, 0.25 * 1e-3);
    }
  });
  EXPECT_NEAR(solid.volume_mm3(), signed_volume(mesh), 0.01 * signed_volume(mesh));
}

TEST(ToSolid, the_inside_band_reaches_its_depth_and_the_rest_reads_minus_that) {
  const Solid solid = solid_of(cube(40), 0.5, 4, 2.5F);
  EXPECT_FLOAT_EQ(solid.distance({20, 20, 20}), -5.25F);
  EXPECT_FLOAT_EQ(solid.distance({4, 20, 20}), -4);
  EXPECT_FLOAT_EQ(solid.distance({-1, 20, 20}), 1);
  EXPECT_FLOAT_EQ(solid.distance({-30, 20, 20}), 1.25F);
  EXPECT_EQ(solid.grid(), (Grid{0.5, 2.5F}));
}

/// Searching each triangle's surroundings 10000 voxels deep would take more memory than there is.
TEST(ToSolid, a_band_deeper_than_the_model_is_no_more_than_the_model) {
  const Mesh mesh = testing::icosphere(10, 5, {0.3, 0.2, 0.1});
  const Solid deep = solid_of(mesh, 0.1, 1000), whole = solid_of(mesh, 0.1, 11);
  EXPECT_NEAR(deep.distance({0.3, 0.2, 0.1}), -10, 0.1);
  EXPECT_EQ(deep.active_voxels(), whole.active_voxels());
  const auto accessor = to_vdb(whole)->getConstAccessor();
  const auto grid = to_vdb(deep);
  std::int64_t different = 0;
  for (auto value = grid->cbeginValueOn(); value; ++value) different += *value != accessor.getValue(value.getCoord());
  EXPECT_EQ(different, 0);
}

TEST(ToSolid, a_turned_model_gives_the_turned_solid) {
  const Mesh mesh = testing::torus_mesh(9, 3, 40, 20);
  const Solid upright = solid_of(mesh, 0.4, 1);
  const Solid turned = solid_of(testing::turned(mesh, 0, 1), 0.4, 1);  // (x, y, z) -> (x, -z, y)
  EXPECT_NEAR(upright.volume_mm3(), turned.volume_mm3(), 1e-6 * upright.volume_mm3());
  const auto accessor = to_vdb(turned)->getConstAccessor();
  const auto grid = to_vdb(upright);
  std::int64_t different = 0, same = 0;
  for (auto value = grid->cbeginValueOn(); value; ++value) {
    const openvdb::Coord c = value.getCoord();
    const float other = accessor.getValue({c.x(), -c.z(), c.y()});
    (std::abs(*value - other) < 1e-4F ? same : different) += 1;
  }
  EXPECT_EQ(different, 0);
  EXPECT_GT(same, 10000);
}

std::vector<float> bits_of(const Solid& solid) {
  std::vector<float> values;
  for_samples(solid, [&](Vec3d p, float value, bool on) {
    values.insert(values.end(),
                  {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), value, on ? 1.0F : 0.0F});
  });
  return values;
}

TEST(ToSolid, same_bits_on_one_and_two_threads) {
  const Mesh overlapping = testing::joined(testing::torus_mesh(9, 3, 60, 30), testing::icosphere(4, 4, {9, 0, 0}));
  for (const Mesh& mesh : {testing::torus_mesh(9, 3, 60, 30), overlapping, testing::without_triangle(cube(15), 3)}) {
    const auto on = [&](std::size_t threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      return bits_of(solid_of(mesh, 0.3, 0.6));
    };
    EXPECT_TRUE(on(1) == on(2));
  }
}

// ---- what is inside ----

TEST(ToSolid, an_inside_out_model_is_turned_and_that_is_said) {
  const ToSolidResult result = to_solid(testing::flipped(cube(20)), {.grid = {.voxel_mm = 0.5}});
  EXPECT_NEAR(result.solid.volume_mm3(), 8000, 16);
  ASSERT_EQ(result.repairs.size(), 1U);
  EXPECT_NE(result.repairs[0].find("inside out"), std::string::npos);
  EXPECT_TRUE(to_solid(cube(20), {.grid = {.voxel_mm = 0.5}}).repairs.empty());
}

TEST(ToSolid, a_hollow_cube_stays_hollow) {
  const Mesh hollow = testing::joined(cube(20), testing::flipped(cube(10, {5, 5, 5})));
  const Solid solid = solid_of(hollow, 0.4, 1);
  EXPECT_NEAR(solid.volume_mm3(), 7000, 14);
  EXPECT_GT(solid.distance({10, 10, 10}), 0);
  EXPECT_LT(solid.distance({2.5, 10, 10}), 0);
  expect_no_leak(solid);
}

TEST(ToSolid, a_cube_without_a_triangle_keeps_its_volume) {
  for (std::size_t i = 0; i < 12; i += 5) {
    const ToSolidResult result = to_solid(testing::without_triangle(cube(20), i), {.grid = {.voxel_mm = 0.5}});
    EXPECT_NEAR(result.solid.volume_mm3(), 8000, 80) << i;
    EXPECT_FALSE(result.repairs.empty());
    expect_no_leak(result.solid);
  }
}

TEST(ToSolid, walls_inside_overlapping_bodies_vanish) {
  // The bar B runs through the face x = 20 of the cube A.
  Mesh bar = cube(20);
  for (Vec3f& v : bar.vertices) v = {v.x + 10, 2 + 0.8F * v.y, 2 + 0.8F * v.z};
  const Solid solid = solid_of(testing::joined(cube(20), bar), 0.5, 10);
  EXPECT_NEAR(solid.volume_mm3(), 8000 + 10 * 16 * 16, 40);
  // Inside both: the walls at x = 20 and x = 10 are 5 mm away; the outer
  // surface begins at the edge (20, 2, z), which the second pass rounds by less
  // than a voxel.
  EXPECT_NEAR(solid.distance({15, 10, 10}), -std::hypot(5, 8), 0.5);
  EXPECT_NEAR(solid.distance({20, 10, 10}), -8, 0.05);
  EXPECT_NEAR(solid.distance({10, 10, 10}), -10, 0.05);
  EXPECT_NEAR(solid.distance({25, 10, 10}), -5, 0.05);
  EXPECT_NEAR(solid.distance({20.5, 1, 10}), 0.5, 0.05);
  expect_no_leak(solid);
}

TEST(ToSolid, bodies_that_touch_or_share_an_edge_are_sound) {
  const Solid touching = solid_of(testing::joined(cube(10), cube(10, {10, 10, 0})), 0.5);
  EXPECT_NEAR(touching.volume_mm3(), 2000, 20);
  const Solid apart = solid_of(testing::joined(cube(10), cube(10, {30, 3, 2})), 0.5);
  EXPECT_NEAR(apart.volume_mm3(), 2000, 16);
  expect_no_leak(apart);
}

TEST(ToSolid, triangles_without_area_do_no_harm) {
  Mesh mesh = cube(20);
  mesh.triangles.push_back({0, 1, 1});
  mesh.triangles.push_back({2, 2, 2});
  const Solid solid = solid_of(mesh, 0.5);
  EXPECT_NEAR(solid.volume_mm3(), 8000, 16);
  expect_no_leak(solid);
}

// ---- real models ----

class RealModel : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const auto path = testing::shared_model(GetParam());
    if (!path) GTEST_SKIP() << "the folder of real models is missing";
    model = scaled_to(read_mesh(*path).mesh, 100);
    if (signed_volume(model) < 0) model = testing::flipped(model);
  }
  Mesh model;
};

TEST_P(RealModel, has_the_sides_of_its_winding_number_and_does_not_leak) {
  const double voxel = 0.5;
  const Solid solid = solid_of(model, voxel, 1);
  expect_no_leak(solid);
  const WindingTree tree(model);
  Random random(5, GetParam());
  int wrong = 0, checked = 0, inside = 0;
  for (int i = 0; i < 20000; ++i) {
    Vec3d p = random_point(random, bounds(model).grown(2));
    if (i % 2 == 0) {
      const auto v = static_cast<std::size_t>(random.below(model.vertices.size()));
      p = to_double(model.vertices[v]) + 3 * voxel * random_point(random, {{-1, -1, -1}, {1, 1, 1}});
    }
    const double w = tree.winding(p), d = tree.nearest(p).distance_mm;
    if (std::abs(w - 0.5) < 0.25 || d < 1.5 * voxel) continue;
    ++checked;
    inside += w > 0.5 ? 1 : 0;
    const float value = solid.distance(p);
    wrong += (w > 0.5) != (value < 0) ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(checked, 3000);
  EXPECT_GT(inside, 100);
}
INSTANTIATE_TEST_SUITE_P(Models, RealModel,
                         ::testing::Values("horse.ply", "spot.obj", "fertility.off", "monkey.obj", "bunny-open.obj",
                                           "teapot-nonmanifold.obj", "cow-nonmanifold.obj",
                                           "falcon-open-nonmanifold.obj"));

TEST(ToSolid, horse_is_the_same_either_way_round_and_keeps_its_volume) {
  const auto path = testing::shared_model("horse.ply");
  if (!path) GTEST_SKIP() << "the folder of real models is missing";
  const Mesh inside_out = scaled_to(read_mesh(*path).mesh, 100), outward = testing::flipped(inside_out);
  ASSERT_GT(signed_volume(outward), 0);
  const Solid solid = solid_of(outward, 0.3);
  EXPECT_NEAR(solid.volume_mm3(), signed_volume(outward), 5e-4 * signed_volume(outward));
  EXPECT_NEAR(solid_of(inside_out, 0.3).volume_mm3(), solid.volume_mm3(), 1e-6 * solid.volume_mm3());
}

// ---- errors ----

/// One block of 8 of a solid: its values, or the one that stands for all.
std::vector<float> block_of(const openvdb::FloatTree& tree, const openvdb::Coord& origin) {
  if (const auto* leaf = tree.probeConstLeaf(origin)) return {leaf->buffer().data(), leaf->buffer().data() + 512};
  return {tree.getValue(origin)};
}

/// Cut into slabs along an axis, the mesh gives the same samples as whole, and none beyond each slab.
void expect_same_in_slabs(const Mesh& mesh, const ToSolidParams& params, std::size_t axis, int thickness) {
  const ToSolidResult whole = to_solid(mesh, params);
  const MeshVoxels voxels(mesh, params);
  EXPECT_EQ(voxels.repairs(), whole.repairs);
  const SampleBox all = voxels.samples();
  const openvdb::Coord low(all.min.x, all.min.y, all.min.z), high(all.max.x, all.max.y, all.max.z);
  const auto wanted = to_vdb(whole.solid);
  openvdb::Index64 leaves = 0;
  for (int at = low[axis]; at < high[axis]; at += thickness) {
    openvdb::Coord from = low, to = high;
    from[axis] = at;
    to[axis] = std::min(at + thickness, high[axis]);
    const Solid slab = voxels.within({{from.x(), from.y(), from.z()}, {to.x(), to.y(), to.z()}});
    const auto got = to_vdb(slab);
    leaves += got->tree().leafCount();
    for (int x = from.x(); x < to.x(); x += 8) {
      for (int y = from.y(); y < to.y(); y += 8) {
        for (int z = from.z(); z < to.z(); z += 8) {
          const openvdb::Coord origin(x, y, z);
          ASSERT_EQ(block_of(got->tree(), origin), block_of(wanted->tree(), origin)) << origin;
        }
      }
    }
    openvdb::Coord beyond = from;
    const std::size_t across = (axis + 1) % 3;
    beyond[axis] = to[axis];
    for (; beyond[across] < high[across]; beyond[across] += 8)
      ASSERT_EQ(got->tree().getValue(beyond), got->background());
  }
  EXPECT_EQ(leaves, wanted->tree().leafCount());
}

TEST(MeshVoxels, slabs_of_any_thickness_add_up_to_the_whole_bit_for_bit) {
  const ToSolidParams params{.grid = {.voxel_mm = 0.2}, .inside_band_mm = 1.1};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const int thickness : {8, 40, 128}) expect_same_in_slabs(testing::icosphere(15, 3), params, axis, thickness);
  }
}

TEST(MeshVoxels, wide_tiles_are_cut_where_a_slab_ends) {
  expect_same_in_slabs(cube(70, {1.3, 2.1, 3.7}), {.grid = {.voxel_mm = 0.25}}, 2, 56);
}

TEST(MeshVoxels, surfaces_that_cut_themselves_get_the_same_sides_in_slabs) {
  // Tubes that cross: their walls inside the other body contradict each other there.
  const Mesh upright = testing::tube(4, 30, 40, {0, 0, -15}), lying = testing::turned(upright, 0, 1);
  expect_same_in_slabs(testing::joined(upright, lying), {.grid = {.voxel_mm = 0.25}, .inside_band_mm = 1}, 0, 24);
  // Cubes that share an edge, and one that is open.
  const Mesh touching = testing::joined(cube(10, {0.1, 0.1, 0.1}), cube(10, {10.1, 10.1, 0.1}));
  expect_same_in_slabs(touching, {.grid = {.voxel_mm = 0.25}}, 1, 16);
  expect_same_in_slabs(testing::without_triangle(cube(10), 3), {.grid = {.voxel_mm = 0.25}}, 2, 16);
}

TEST(MeshVoxels, real_models_in_slabs) {
  int found = 0;
  for (const char* file : {"horse.ply", "monkey.obj", "armadillo.obj", "bunny-open.obj"}) {
    const auto path = testing::shared_model(file);
    if (!path) continue;
    ++found;
    expect_same_in_slabs(scaled_to(read_mesh(*path).mesh, 60), {.grid = {.voxel_mm = 0.4}, .inside_band_mm = 1}, 2, 64);
  }
  if (found == 0) GTEST_SKIP() << "the folder of real meshes is missing";
}

Code code_of(const Mesh& mesh, const ToSolidParams& params) {
  try {
    (void)to_solid(mesh, params);
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "no error";
  return Code::Internal;
}

TEST(ToSolid, refuses_what_is_no_solid) {
  const ToSolidParams fine{.grid = {.voxel_mm = 0.5}};
  EXPECT_EQ(code_of({}, fine), Code::BadInput);
  Mesh sheet;  // a wavy open sheet
  for (std::uint32_t i = 0; i < 21; ++i) {
    for (std::uint32_t j = 0; j < 21; ++j) {
      const auto x = static_cast<float>(i), y = static_cast<float>(j);
      sheet.vertices.push_back({x, y, 1.5F * std::sin(0.5F * x) * std::cos(0.4F * y)});
      if (i == 0 || j == 0) continue;
      const std::uint32_t a = (i - 1) * 21 + j - 1, b = a + 1, c = a + 21, d = c + 1;
      sheet.triangles.push_back({a, c, d});
      sheet.triangles.push_back({a, d, b});
    }
  }
  EXPECT_EQ(code_of(sheet, fine), Code::BadInput);
  Mesh plane = sheet;
  for (Vec3f& v : plane.vertices) v.z = 0.25F;
  EXPECT_EQ(code_of(plane, fine), Code::BadInput);
  EXPECT_EQ(code_of(testing::joined(plane, testing::flipped(plane)), fine),
            Code::BadInput);  // closed, without volume
  EXPECT_EQ(code_of(cube(0.1, {0.2, 0.2, 0.2}), fine),
            Code::BadInput);  // between the samples
  Mesh not_a_number = cube(20);
  not_a_number.vertices[3].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(code_of(not_a_number, fine), Code::BadInput);
}

TEST(ToSolid, refuses_grids_that_make_no_sense) {
  for (const double voxel : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(code_of(cube(20), {.grid = {.voxel_mm = voxel}}), Code::BadRecipe);
  }
  EXPECT_EQ(code_of(cube(0.002), {.grid = {.voxel_mm = 1.4e-5}}), Code::BadRecipe);  // OpenVDB would throw its own
  EXPECT_EQ(code_of(cube(20), {.grid = {.voxel_mm = 0.5, .band_vox = 1}}), Code::BadRecipe);
  EXPECT_EQ(code_of(cube(20), {.grid = {.voxel_mm = 0.5}, .inside_band_mm = -1}), Code::BadRecipe);
  EXPECT_EQ(code_of(cube(20), {.grid = {.voxel_mm = 1e-9}}), Code::TooLarge);
}

TEST(ToSolid, stops_when_asked) {
  const Context context;
  context.cancel();
  try {
    (void)to_solid(testing::icosphere(20, 5), {.grid = {.voxel_mm = 0.2}}, context);
    FAIL() << "not stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::Cancelled);
  }
}

}  // namespace
}  // namespace fibrolite
