// SPDX-License-Identifier: GPL-3.0-or-later
// The bundled assets are what their generator makes, and what assets/README.md says of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "bundled_models.h"
#include "fibrolite/error.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/infill/micrograph.h"
#include "generator.h"
#include "mesh_checks.h"
#include "models.h"

namespace fibrolite {
namespace {

/// For each vertex the nearest of the other mesh must be its own, so near that only rounding can lie between.
void expect_same_vertices(const Mesh& made, const Mesh& committed) {
  constexpr double rounding_mm = 1e-4;
  const auto cell = [&](Vec3f v, int dx, int dy, int dz) {
    const auto of = [](float mm, int step) { return std::lround(mm / 0.01) + step; };
    return std::tuple(of(v.x, dx), of(v.y, dy), of(v.z, dz));
  };
  std::multimap<std::tuple<long, long, long>, std::size_t> places;
  for (std::size_t i = 0; i < committed.vertices.size(); ++i) places.emplace(cell(committed.vertices[i], 0, 0, 0), i);
  std::vector<bool> taken(committed.vertices.size(), false);
  for (const Vec3f v : made.vertices) {
    bool found = false;
    for (int n = 0; n < 27 && !found; ++n) {
      const auto [from, to] = places.equal_range(cell(v, n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
      for (auto it = from; it != to && !found; ++it) {
        if (taken[it->second] || norm(to_double(committed.vertices[it->second]) - to_double(v)) > rounding_mm) continue;
        taken[it->second] = found = true;
      }
    }
    ASSERT_TRUE(found) << v.x << " " << v.y << " " << v.z;
  }
}

class MadeAnew : public ::testing::TestWithParam<const char*> {};
TEST_P(MadeAnew, IsTheCommittedSurfaceUpToRoundingAndOrder) {
  const Mesh made = bundled_model(GetParam()), committed = read_mesh(testing::asset(GetParam())).mesh;
  ASSERT_GT(made.triangles.size(), 20000U);
  ASSERT_EQ(made.vertices.size(), committed.vertices.size());
  ASSERT_EQ(made.triangles.size(), committed.triangles.size());
  EXPECT_NEAR(signed_volume(made) / signed_volume(committed), 1, 1e-6);
  EXPECT_NEAR(area(made) / area(committed), 1, 1e-6);
  expect_same_vertices(made, committed);
}
INSTANTIATE_TEST_SUITE_P(Assets, MadeAnew, ::testing::Values("molar", "bent_tube", "cylinder_on_box"),
                         [](const auto& param) { return std::string(param.param); });

TEST(Assets, TheMicrographIsMadeAnewTheSame) {
  const GrayImage made = muscle_micrograph(muscle_seed), committed = read_gray(bundled_micrograph());
  EXPECT_EQ(made.width, committed.width);
  EXPECT_TRUE(made.pixels == committed.pixels);
}

class Committed : public ::testing::TestWithParam<std::string> {};
TEST_P(Committed, IsASoundSolidThatStandsOnTheGround) {
  const auto path = testing::asset(GetParam());
  const Mesh mesh = read_mesh(path).mesh;
  const testing::IndependentCount count = testing::count(mesh);
  EXPECT_TRUE(count.sound());
  EXPECT_GT(count.volume_mm3, 1000);
  EXPECT_EQ(check(mesh).shells, 1);
  EXPECT_GT(mesh.triangles.size(), 20000U);
  EXPECT_LT(mesh.triangles.size(), 60000U);
  EXPECT_LT(std::filesystem::file_size(path), 2U << 20);
  const Box3d box = bounds(mesh);
  EXPECT_EQ(box.min.z, 0);
  EXPECT_NEAR(box.center().x, 0, 1e-4);
  EXPECT_NEAR(box.center().y, 0, 1e-4);
}
INSTANTIATE_TEST_SUITE_P(Assets, Committed, ::testing::ValuesIn(bundled_model_names()),
                         [](const auto& param) { return param.param; });

TEST(Assets, TheMolarFillsTheBoxOfThePaper) {
  const Vec3d size = bounds(read_mesh(testing::asset("molar")).mesh).size();
  EXPECT_NEAR(size.x, 50, 1e-4);
  EXPECT_NEAR(size.y, 40, 1e-4);
  EXPECT_NEAR(size.z, 80, 1e-4);
}

TEST(Assets, ThePlainSolidsHaveTheirVolumes) {
  constexpr double pi = 3.14159265358979;
  const auto volume = [](const char* name) { return signed_volume(read_mesh(testing::asset(name)).mesh); };
  const double box_and_cylinder = 40.0 * 40 * 20 + pi * 8 * 8 * 50;
  EXPECT_NEAR(volume("cylinder_on_box"), box_and_cylinder, 0.005 * box_and_cylinder);
  const double torus = 2 * pi * pi * 36 * 9 * 9;
  EXPECT_NEAR(volume("torus"), torus, 0.005 * torus);
  const double tube = pi * 9 * 9 * (32 + 40 * pi / 3 + 32);  // by Pappus, less the soft edges
  EXPECT_NEAR(volume("bent_tube"), tube, 0.01 * tube);
}

TEST(Assets, AnUnknownNameIsSaid) { EXPECT_THROW((void)bundled_model("unicorn"), Error); }

}  // namespace
}  // namespace fibrolite
