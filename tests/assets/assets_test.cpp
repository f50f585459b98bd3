// SPDX-License-Identifier: GPL-3.0-or-later
// The bundled assets are what their generator makes, and what assets/README.md says of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "bundled_models.h"
#include "fibrolite/error.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/infill/micrograph.h"
#include "generator.h"
#include "mesh_checks.h"
#include "models.h"

namespace fibrolite {
namespace {

std::string bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class MadeAnew : public ::testing::TestWithParam<const char*> {};
TEST_P(MadeAnew, IsTheCommittedFileByteForByte) {
  const testing::TempDir dir;
  const auto path = dir / "model.ply";
  write_mesh(path, bundled_model(GetParam()));
  ASSERT_GT(std::filesystem::file_size(path), 100000U);
  EXPECT_TRUE(bytes(path) == bytes(testing::asset(GetParam())))
      << "run fibrolite-assets assets docs/pictures/assets.png and look at the picture before committing";
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
