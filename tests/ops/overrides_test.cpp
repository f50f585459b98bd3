// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/overrides.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "fibrolite/pieces.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "hybrid_runs.h"
#include "models.h"
#include "refusal.h"

namespace fibrolite {
namespace {

using testing::hybridized;
using testing::Outcome;
using testing::refusal;
using testing::sturdy;

Mesh block(Vec3d size) {
  Mesh mesh = testing::cube(1);
  for (Vec3f& v : mesh.vertices) v = to_float({v.x * size.x, v.y * size.y, v.z * size.z});
  return mesh;
}

TEST(Overrides, RecipeRoundTrip) {
  const Recipe given = parse_recipe(R"({"partition": {"overrides": {
      "parts": [{"id": 2, "infill": "solid"}, {"id": 0, "infill": "mfs"}],
      "cuts": [{"point_mm": [1, 2, 3], "normal": [0, 0, 2]},
               {"point_mm": [1, 2, 3], "normal": [0, 0, 2], "radius_mm": -20}],
      "solid": [{"box_mm": [[0, 0, 0], [1, 2, 3]]},
                {"cylinder": {"from_mm": [0, 0, 0], "to_mm": [0, 0, 9], "diameter_mm": 4}}]}}})",
                                    Recipe{}, "test");
  const Overrides& o = given.partition.overrides;
  ASSERT_EQ(o.parts.size(), 2U);
  EXPECT_EQ(o.parts[0].id, 2);
  EXPECT_EQ(o.parts[0].infill, PartInfill::Solid);
  EXPECT_EQ(o.cuts.at(0).point_mm, (Vec3d{1, 2, 3}));
  EXPECT_EQ(o.cuts.at(0).radius_mm, 0);
  EXPECT_EQ(o.cuts.at(1).radius_mm, -20);
  EXPECT_EQ(std::get<Cylinder>(o.solid.at(1)).diameter_mm, 4);
  EXPECT_EQ(to_json(parse_recipe(to_json(given), Recipe{}, "again")), to_json(given));
}

TEST(Overrides, WhatCannotBeIsRefusedByName) {
  const auto refused = [](const std::string& overrides) {
    return refusal([&] {
      (void)parse_recipe(std::string(R"({"partition": {"overrides": )").append(overrides).append("}}"), Recipe{},
                         "r.json");
    });
  };
  const auto names = [](const std::string& text, const std::string& what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  names(refused(R"({"part": []})"), "did you mean parts?");
  names(refused(R"({"parts": [{"id": 1, "infill": "gold"}]})"), "partition.overrides.parts[0].infill");
  names(refused(R"({"parts": [{"id": 1}]})"), "partition.overrides.parts[0]");
  names(refused(R"({"parts": [{"id": 1, "infill": "tcs"}, {"id": 1, "infill": "mfs"}]})"), "named twice");
  names(refused(R"({"cuts": [{"point_mm": [0, 0, 0], "normal": [0, 0, 0]}]})"), "partition.overrides.cuts[0]");
  names(refused(R"({"solid": [{"box_mm": [[0, 0, 0], [1, 0, 1]]}]})"), "partition.overrides.solid[0]");
  names(refused(R"({"solid": [{"cylinder": {"from_mm": [0, 0, 0], "to_mm": [0, 0, 0], "diameter_mm": 1}}]})"),
        "partition.overrides.solid[0]");
  names(refused(R"({"solid": [{}]})"), "partition.overrides.solid[0]");
}

TEST(Overrides, ARegionBesideTheModelIsRefused) {
  const Box3d model{{0, 0, 0}, {40, 40, 40}};
  Overrides o;
  o.solid = {Cylinder{{41, 5, 0}, {41, 5, 20}, 4}, Box3d{{30, 30, 30}, {60, 60, 60}}};
  EXPECT_EQ(refusal([&] { check_overrides(o, model); }), "");
  o.solid.emplace_back(Cylinder{{500, 5, 0}, {500, 5, 20}, 8});
  const std::string message = refusal([&] { check_overrides(o, model); });
  EXPECT_NE(message.find("partition.overrides.solid[2]"), std::string::npos) << message;
  EXPECT_NE(message.find("(40, 40, 40)"), std::string::npos) << message;
}

TEST(Overrides, KeptSolidIsTheUnionOfItsRegions) {
  Overrides o;
  EXPECT_GT(kept_solid(o)({0, 0, 0}), 1e3F);
  o.solid = {Box3d{{0, 0, 0}, {2, 2, 2}}, Cylinder{{10, 0, 0}, {10, 0, 8}, 6}};
  const Shape kept = kept_solid(o);
  EXPECT_NEAR(kept({1, 1, 1}), -1, 1e-5);
  EXPECT_NEAR(kept({10, 1, 4}), -2, 1e-5);
  EXPECT_NEAR(kept({5, 1, 1}), 2, 0.3);  // the cylinder's mantle, the box is 3 away
}

TEST(Overrides, CutsAndCoresAloneContradictEachOther) {
  Recipe recipe;
  recipe.partition.overrides.cuts = {{{20, 10, 10}, {1, 0, 0}}};
  recipe.partition.by = PartBy::Load;
  EXPECT_NE(refusal([&] { check_recipe(recipe, 0.2); }).find("partition.by=both"), std::string::npos);
  recipe.partition.by = PartBy::Both;
  EXPECT_EQ(refusal([&] { check_recipe(recipe, 0.2); }), "");
}

TEST(Overrides, AChosenGyroidMustBeTwoVoxelsThick) {
  Recipe recipe;
  recipe.gyroid.wall_mm = 0.3;
  EXPECT_EQ(refusal([&] { check_recipe(recipe, 0.2); }), "");
  recipe.partition.overrides.parts = {{0, PartInfill::Gyroid}};
  EXPECT_NE(refusal([&] { check_recipe(recipe, 0.2); }).find("gyroid.wall_mm"), std::string::npos);
}

TEST(Overrides, ACutPartsABarWhereItIsGiven) {
  Recipe recipe = sturdy();
  recipe.partition.overrides.cuts = {{{20, 10, 10}, {1, 0, 0}}};
  const testing::Outcome out = hybridized(block({60, 20, 20}), {.recipe = recipe, .voxel_mm = 0.5});
  ASSERT_EQ(out.report.parts.size(), 2U);
  EXPECT_NEAR(out.report.parts[0].volume_mm3, 40 * 400, 0.01 * 40 * 400);
  EXPECT_NEAR(out.report.parts[1].volume_mm3, 20 * 400, 0.01 * 20 * 400);
  ASSERT_EQ(out.report.interfaces.size(), 1U);
  EXPECT_NEAR(out.report.interfaces[0].area_mm2, 400, 8);
  EXPECT_EQ(out.report.solid.pieces, 1);

  recipe.partition.overrides.cuts[0].point_mm = {200, 0, 0};
  EXPECT_NE(refusal([&] {
              (void)hybridized(block({60, 20, 20}), {.recipe = recipe, .voxel_mm = 0.5});
            }).find("overrides.cuts[0]"),
            std::string::npos);
}

/// A paraboloid of radius 25 mm whose lowest point is at x = 20 and that opens towards x = 60: over a square of 20 x 20
/// mm it rises by (20^2 + 20^2) / 12 / (2 * 25) = 1.333 mm in the mean.
TEST(Overrides, ABowlPartsABarAndIsJoinedAlongItsNormals) {
  Recipe recipe = sturdy();
  recipe.partition.overrides.cuts = {{{20, 10, 10}, {1, 0, 0}, 25}};
  recipe.verify.triangles = 1000;
  const testing::Outcome out = hybridized(block({60, 20, 20}), {.recipe = recipe, .voxel_mm = 0.5});
  ASSERT_EQ(out.report.parts.size(), 2U);
  const double before = (20 + 800.0 / 12 / 50) * 400;
  EXPECT_NEAR(out.report.parts[1].volume_mm3, before, 0.01 * before);
  EXPECT_NEAR(out.report.parts[0].volume_mm3, 60 * 400 - before, 0.01 * (60 * 400 - before));
  ASSERT_EQ(out.report.interfaces.size(), 1U);
  const InterfaceReport& joint = out.report.interfaces[0];
  EXPECT_TRUE(joint.bent);
  double area = 0;
  for (double y = -9.95; y < 10; y += 0.1)
    for (double x = -9.95; x < 10; x += 0.1) area += 0.01 * std::sqrt(1 + (x * x + y * y) / 625);
  EXPECT_NEAR(joint.area_mm2, area, 0.02 * area);
  EXPECT_EQ(joint.regions_after, 1);
  EXPECT_GT(joint.contact_area_mm2, 0);
  EXPECT_GT(joint.columns, 0);
  EXPECT_EQ(out.report.solid.pieces, 1);
  EXPECT_EQ(out.report.solid.dangling, 0);
  EXPECT_EQ(out.report.solid.unreached, 0);

  recipe.partition.overrides.cuts[0].radius_mm = 10;
  EXPECT_NE(refusal([&] {
              (void)hybridized(block({60, 20, 20}), {.recipe = recipe, .voxel_mm = 0.5});
            }).find("bent too much"),
            std::string::npos);
}

/// A bar of 20 x 20 mm pressed along its length: its cut carries the force itself, by the shell's ring and by the
/// crystal.
TEST(Overrides, TheJointOfACutSaysWhatItCarriesAndIsNamedIfThatIsTooLittle) {
  const auto pressed = [](double force_n) {
    Recipe recipe = sturdy();
    recipe.partition.overrides.cuts = {{{20, 10, 10}, {1, 0, 0}}};
    const std::string loads = R"({"loads": [{"name": "pressed", "supports": [{"where": {"lowest": {"share": 0.05,
        "along": [1, 0, 0]}}}], "forces": [{"force_n": )" +
                              std::to_string(force_n) +
                              R"(, "direction": [-1, 0, 0], "where": {"seen_from": [1, 0, 0]}}]}]})";
    recipe = parse_recipe(loads, recipe, "test");
    recipe.print.check = false;
    return hybridized(block({40, 20, 20}), {.recipe = recipe, .voxel_mm = 0.5}).report;
  };
  const auto warned = [](const Report& report, const std::string& what_to_try) {
    return std::count_if(report.warnings.begin(), report.warnings.end(), [&](const std::string& w) {
      return w.find("joint between parts 0 and 1 can carry only 0.") != std::string::npos &&
             w.find(what_to_try) != std::string::npos;
    });
  };
  const Report light = pressed(2000), heavy = pressed(15000);
  ASSERT_EQ(light.interfaces.size(), 1U);
  const InterfaceReport& joint = light.interfaces[0];
  const double inner = 20 - 2 * sturdy().shell.thickness_mm, ring = 400 - inner * inner;
  EXPECT_NEAR(joint.shell_area_mm2, ring, 0.02 * ring);
  EXPECT_NEAR(joint.demand_n, 2000, 0.03 * 2000);
  const double carried = 50 * (joint.shell_area_mm2 + joint.contact_area_mm2);  // of PLA
  EXPECT_NEAR(joint.capacity_over_demand, carried / joint.demand_n, 1e-9);
  EXPECT_GT(joint.capacity_over_demand, 1);
  EXPECT_EQ(warned(light, ""), 0);
  EXPECT_NEAR(heavy.interfaces.at(0).capacity_over_demand, 2.0 / 15 * joint.capacity_over_demand, 1e-3);
  EXPECT_LT(heavy.interfaces.at(0).capacity_over_demand, 1);
  EXPECT_EQ(warned(heavy, "raise shell.thickness_mm"), 1);
  // What is more than a solid bar can carry is no matter of the joint.
  EXPECT_EQ(warned(pressed(40000), ", and solid no more than 0."), 1);
}

TEST(Overrides, APartGetsTheInfillItIsGiven) {
  Recipe recipe = sturdy();
  recipe.partition.overrides.cuts = {{{20, 10, 10}, {1, 0, 0}}};
  recipe.partition.overrides.parts = {{1, PartInfill::Solid}};
  const testing::Outcome out = hybridized(block({60, 20, 20}), {.recipe = recipe, .voxel_mm = 0.5});
  const auto& parts = out.report.parts;
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[1].infill, "solid");
  EXPECT_EQ(parts[1].candidates, std::vector<int>{1});
  EXPECT_NEAR(parts[1].infill_volume_mm3, parts[1].lumen_mm3, 0.02 * parts[1].lumen_mm3);
  EXPECT_LT(parts[0].infill_volume_mm3, 0.7 * parts[0].lumen_mm3);
  EXPECT_NE(parts[1].reason.find("as the recipe says"), std::string::npos);

  recipe.partition.overrides.parts = {{7, PartInfill::Solid}};
  EXPECT_NE(refusal([&] {
              (void)hybridized(block({60, 20, 20}), {.recipe = recipe, .voxel_mm = 0.5});
            }).find("use 0 to 1"),
            std::string::npos);
}

TEST(Overrides, ARegionRoundAHoleStaysSolid) {
  Recipe recipe = sturdy();
  recipe.partition.overrides.solid = {Cylinder{{10, 10, -1}, {10, 10, 21}, 8}};
  const Mesh mesh = block({20, 20, 20});
  const Hybrid made = hybridized(mesh, {.recipe = recipe, .infill = InfillKind::Tcs, .voxel_mm = 0.5}).hybrid;
  Random random(3, "kept", 0);
  for (int i = 0; i < 300; ++i) {
    const double angle = 6.28 * random.uniform(), r = 3.6 * std::sqrt(random.uniform());
    const Vec3d p{10 + r * std::cos(angle), 10 + r * std::sin(angle), 0.5 + 19 * random.uniform()};
    EXPECT_LT(made.solid.distance(p), 0.1) << p.x << " " << p.y << " " << p.z;
  }
}

// Crystal beside a part with nothing in it, and no joint to catch its sticks: none ends in the void, in the solid and
// in its function.
TEST(Overrides, CrystalBesideAnEmptyPartKeepsNoEndInTheVoid) {
  Recipe recipe = sturdy();
  recipe.joint.enabled = false;
  recipe.partition.overrides.cuts.push_back({{22, 18, 15}, {1, 0.3, 0.2}});
  recipe.partition.overrides.parts = {{0, PartInfill::Tcs}, {1, PartInfill::Shell}};
  const Outcome out = hybridized(block({44, 36, 30}), {.recipe = recipe, .voxel_mm = 0.5, .function = true});
  const SolidReport& solid = out.report.solid;
  EXPECT_GT(solid.tips_removed, 5);
  EXPECT_EQ(solid.dangling, 0);
  EXPECT_EQ(solid.unreached, 0);
  EXPECT_EQ(solid.pieces, 1);
  const Box3d box{{-1, -1, -1}, {45, 37, 31}};
  const Solid function = realize(out.hybrid.printed, box, out.hybrid.solid.grid());
  EXPECT_EQ(pieces(function).material.size(), 1U);
  EXPECT_NEAR(function.volume_mm3() / solid.volume_mm3, 1, 0.01);
}

/// How many pieces these planes make of a box; 0 if one is smaller than a twentieth of it.
int pieces_of_box(const std::vector<Overrides::Plane>& planes, Vec3d size) {
  constexpr int n = 16;
  std::array<int, 8> count{};
  for (int i = 0; i < n * n * n; ++i) {
    const int row = i / n % n, slice = i / n / n;
    const Vec3d at{size.x * (i % n + 0.5) / n, size.y * (row + 0.5) / n, size.z * (slice + 0.5) / n};
    std::size_t cell = 0;
    for (const Overrides::Plane& plane : planes) cell = 2 * cell + (dot(at - plane.point_mm, plane.normal) > 0 ? 1 : 0);
    ++count.at(cell);
  }
  int pieces = 0;
  for (const int points : count) {
    if (points > 0 && points < n * n * n / 20) return 0;
    pieces += points > 0 ? 1 : 0;
  }
  return pieces;
}

/// Random planes, drawn again until they make so many pieces of the box.
std::vector<Overrides::Plane> planes_for(int pieces, Vec3d size, Random& random) {
  const auto unit = [&] { return 2 * random.uniform() - 1; };
  for (int draw = 0; draw < 100000; ++draw) {
    std::vector<Overrides::Plane> planes;
    while (static_cast<int>(planes.size()) < (pieces < 3 ? 1 : pieces < 5 ? 2 : 3)) {
      const Vec3d normal{unit(), unit(), unit()};
      const Vec3d point{size.x * (0.5 + 0.35 * unit()), size.y * (0.5 + 0.35 * unit()), size.z * (0.5 + 0.35 * unit())};
      if (norm(normal) > 0.1) planes.push_back({point, normal});
    }
    if (pieces_of_box(planes, size) == pieces) return planes;
  }
  return {};
}

// Whatever planes part a box into two to eight, and whatever fills the parts, in each form of crystal: one piece,
// joined at every border.
class RandomParts : public ::testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(RandomParts, OfABoxAreAlwaysOnePiece) {
  const auto [wanted, seed] = GetParam();
  const Vec3d size{36, 30, 26};
  Random random(static_cast<std::uint64_t>(wanted), "planes", static_cast<std::uint64_t>(seed));
  Recipe recipe = sturdy();
  recipe.seed = static_cast<std::uint64_t>(wanted);
  recipe.tcs.form = static_cast<TcsForm>(seed % 3);
  recipe.tcs.wall_mm = recipe.gyroid.wall_mm = 1.2;
  recipe.verify.triangles = 1000;  // what fills a part is given, not decided by its stresses
  recipe.partition.overrides.cuts = planes_for(wanted, size, random);
  ASSERT_FALSE(recipe.partition.overrides.cuts.empty());
  for (int id = 0; id < wanted; ++id)
    recipe.partition.overrides.parts.push_back({id, static_cast<PartInfill>(random.below(4))});
  const Report report = hybridized(block(size), {.recipe = recipe, .voxel_mm = 0.5}).report;
  EXPECT_EQ(static_cast<int>(report.parts.size()), wanted);
  EXPECT_EQ(report.solid.pieces, 1);
  EXPECT_EQ(report.solid.dangling, 0);
  EXPECT_EQ(report.solid.unreached, 0);
  EXPECT_GE(static_cast<int>(report.interfaces.size()), wanted - 1);
  for (const InterfaceReport& i : report.interfaces) {
    EXPECT_EQ(i.regions_after, 1) << "parts " << i.a << " and " << i.b;
    EXPECT_GT(i.contact_area_mm2, 0) << "parts " << i.a << " and " << i.b << ", " << i.area_mm2 << " mm2";
  }
}

INSTANTIATE_TEST_SUITE_P(TwoToEight, RandomParts, ::testing::Combine(::testing::Range(2, 9), ::testing::Range(1, 4)));

/// Bowls that open to either side cross each other and a plane.
TEST(Overrides, BowlsThatCrossAreJoinedAtEveryBorder) {
  Recipe recipe = sturdy();
  recipe.verify.triangles = 1000;
  recipe.partition.overrides.cuts = {
      {{18, 15, 13}, {1, 0.3, 0}, 40}, {{18, 15, 13}, {0, 1, 0.2}, -35}, {{18, 15, 17}, {0, 0.1, 1}}};
  const Report report = hybridized(block({36, 30, 26}), {.recipe = recipe, .voxel_mm = 0.5}).report;
  EXPECT_EQ(report.parts.size(), 8U);
  EXPECT_EQ(report.solid.pieces, 1);
  EXPECT_EQ(report.solid.dangling, 0);
  EXPECT_EQ(report.solid.unreached, 0);
  EXPECT_GE(report.interfaces.size(), 12U) << "of a box cut three times";
  for (const InterfaceReport& i : report.interfaces) {
    EXPECT_EQ(i.regions_after, 1) << "parts " << i.a << " and " << i.b;
    EXPECT_GT(i.contact_area_mm2, 0) << "parts " << i.a << " and " << i.b << ", " << i.area_mm2 << " mm2";
  }
}

}  // namespace
}  // namespace fibrolite
