// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <time.h>

#include <chrono>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

using nlohmann::json;

Report filled() {
  Report report;
  report.command = "fibrolite generate a.stl -o b.stl";
  report.model = {"a.stl", 12, {1, 2, 3}, 6, {"turned inside out"}};
  PartReport part;
  part.id = 3;
  part.kind = "column";
  part.infill = "mfs";
  part.volume_mm3 = 10;
  part.infill_volume_mm3 = 4;
  part.fibres = 19;
  part.section = {19, 3.5, 0.81, 0.5};
  part.micrograph = {724, 978, 5, 0.7};
  part.centroid_mm = {1, 2, 3};
  part.axis = {0, 0, 1};
  part.stress = {-5, {0.5, 0.25}, 5.5, 10, {}};
  part.reason = "carries along its axis";
  report.parts = {part};
  InterfaceReport interface;
  interface.a = 3;
  interface.b = 0;
  interface.regions_before = 12;
  interface.regions_after = 1;
  interface.columns = 4;
  report.interfaces = {interface};
  report.verification.selected = {{"loads[0].forces[0].where", "pressed", 12.5, 7}};
  report.solid.pieces = 1;
  report.solid.voxel_mm = 0.25;
  report.mesh.triangles = 99;
  report.stages = {{"read", 0.5, 0.4, 20}};
  report.warnings = {"small"};
  return report;
}

TEST(Report, HasEveryKeyOfSchemaOne) {
  const json report = json::parse(to_json(filled()));
  EXPECT_EQ(report.at("schema"), 1);
  EXPECT_EQ(report.at("version"), version());
  for (const char* key : {"command", "recipe", "model", "parts", "interfaces", "solid", "mesh", "stages", "warnings"})
    EXPECT_TRUE(report.contains(key)) << key;
  for (const char* key : {"path", "triangles", "size_mm", "volume_mm3", "repairs"})
    EXPECT_TRUE(report.at("model").contains(key)) << key;
  for (const char* key : {"id", "kind", "infill", "volume_mm3", "infill_volume_mm3", "fibres", "centroid_mm", "axis",
                          "diameter_mm", "mean_stress_mpa", "dominance", "reason"})
    EXPECT_TRUE(report.at("parts").at(0).contains(key)) << key;
  for (const char* key : {"parts", "centroid_mm", "normal", "border", "area_mm2", "regions_before", "regions_after",
                          "columns", "contact_area_mm2", "shell_area_mm2", "demand_n", "capacity_over_demand"})
    EXPECT_TRUE(report.at("interfaces").at(0).contains(key)) << key;
  for (const char* key :
       {"volume_mm3", "fill_ratio", "mass_g", "pieces", "cavities", "cavity_volume_mm3", "dangling", "unreached",
        "neck_mm", "necks_thickened", "tips_tied", "tips_removed", "active_voxels", "voxel_mm"})
    EXPECT_TRUE(report.at("solid").contains(key)) << key;
  for (const char* key : {"volume_mm3", "triangles", "vertices", "boundary_edges", "nonmanifold_edges",
                          "nonmanifold_vertices", "degenerate_triangles", "shells"})
    EXPECT_TRUE(report.at("mesh").contains(key)) << key;
  for (const char* key : {"name", "wall_s", "peak_rss_mb"}) EXPECT_TRUE(report.at("stages").at(0).contains(key)) << key;
}

TEST(Report, ShapesOfValues) {
  const json report = json::parse(to_json(filled()));
  EXPECT_EQ(report["model"]["size_mm"], json({1.0, 2.0, 3.0}));
  EXPECT_EQ(report["model"]["repairs"], json({"turned inside out"}));
  EXPECT_EQ(report["parts"][0]["mean_stress_mpa"]["axial"], -5.0);
  EXPECT_EQ(report["parts"][0]["mean_stress_mpa"]["transverse"], json({0.5, 0.25}));
  EXPECT_EQ(report["parts"][0]["mfs"]["section"],
            json({{"fibres", 19}, {"mean_area_mm2", 3.5}, {"membrane_mm", 0.81}, {"porosity", 0.5}}));
  EXPECT_EQ(report["parts"][0]["mfs"]["template"],
            json({{"fibres", 724}, {"mean_area_px2", 978.0}, {"membrane_px", 5.0}, {"porosity", 0.7}}));
  EXPECT_TRUE(report["parts"][0]["color"].is_null()) << "there is no picture";
  Report drawn = filled();
  drawn.parts[0].color_name = "sky blue";
  drawn.parts[0].color_hex = "#56b4e9";
  EXPECT_EQ(json::parse(to_json(drawn))["parts"][0]["color"], json({{"name", "sky blue"}, {"hex", "#56b4e9"}}));
  EXPECT_EQ(report["interfaces"][0]["parts"], json({3, 0}));
  EXPECT_EQ(report["verification"]["selected"][0]["case"], "pressed");
  EXPECT_EQ(report["verification"]["selected"][0]["area_mm2"], 12.5);
  EXPECT_EQ(report["solid"]["voxel_mm"], 0.25);
  EXPECT_EQ(json::parse(to_json(Report{}))["parts"], json::array());
}

TEST(Report, AMantleHasNoBridges) {
  Report report = filled();
  InterfaceReport& interface = report.interfaces.at(0);
  interface.mst_bridge_mm3 = 1.5;
  interface.bbox_bridge_mm3 = 4;
  const json plane = json::parse(to_json(report))["interfaces"][0];
  EXPECT_EQ(plane["border"], "plane");
  EXPECT_EQ(plane["bridge_mm3"], json({{"mst", 1.5}, {"bbox", 4.0}}));
  interface.bent = true;
  EXPECT_EQ(json::parse(to_json(report))["interfaces"][0]["border"], "bent");
  interface.bent = false;
  interface.radius_mm = 6;
  interface.mst_bridge_mm3 = interface.bbox_bridge_mm3 = std::numeric_limits<double>::quiet_NaN();
  const json mantle = json::parse(to_json(report))["interfaces"][0];
  EXPECT_EQ(mantle["border"], "mantle");
  EXPECT_EQ(mantle["bridge_mm3"], json({{"mst", nullptr}, {"bbox", nullptr}}));
}

TEST(Report, PrintChecksAreThereIfTheyWereMade) {
  Report report;
  EXPECT_FALSE(json::parse(to_json(report)).contains("print"));
  report.print.checked = true;
  report.print.found.thin_walls = {1, 2, 0.5, 0.25, {{{1, 2, 3}, 0.25, 2}}};
  report.print.found.node_overhang_mm2 = 7;
  report.print.drains = {{{4, 5, 6}, {0, 0, -1}, 1.5, true, {{4, 5, 7.5}, {4, 5, 6}, 1}}};
  const json print = json::parse(to_json(report))["print"];
  EXPECT_EQ(print["thin_walls"]["worst"][0]["at_mm"], json({1.0, 2.0, 3.0}));
  EXPECT_EQ(print["thin_walls"]["least_mm"], 0.25);
  EXPECT_EQ(print["small_gaps"]["places"], 0);
  EXPECT_EQ(print["overhangs"]["nodes_mm2"], 7);
  EXPECT_EQ(print["drains"][0]["place_mm"], json({4.0, 5.0, 6.0}));
  EXPECT_EQ(print["drains"][0]["diameter_mm"], 2);
}

TEST(Report, LayersAreThereIfSomethingWasSliced) {
  Report report;
  EXPECT_FALSE(json::parse(to_json(report)).contains("slices"));
  report.slices = {{"left", 2, 0.5, {0.1, 0.2}, 30, 40, 3, {4, 2}}, {"right", 1, 0.5, {0.1, 0.2}, 30, 40, 0.25, {0.5}}};
  const json slices = json::parse(to_json(report))["slices"];
  EXPECT_EQ(slices["volume_mm3"], 3.25);
  EXPECT_EQ(slices["plates"][0].dump(),
            R"({"area_mm2":[4.0,2.0],"layer_mm":0.5,"layers":2,"name":"left","pixel_mm":[0.1,0.2],"size_px":[30,40],)"
            R"("volume_mm3":3.0})");
}

TEST(Report, TheRecipeInItIsARecipe) {
  Report report;
  report.recipe = preset("paper");
  const std::string recipe = json::parse(to_json(report)).at("recipe").dump();
  EXPECT_EQ(to_json(parse_recipe(recipe, Recipe{}, "report")), to_json(with_joint_lengths(preset("paper"))));
}

/// Lengths that follow others in the recipe are numbers in the report: those of the run.
TEST(Report, RecordsTheLengthsOfJointsThatFollowedTheWall) {
  Report report;
  report.recipe.print.wall_mm = 1.0;
  const json joint = json::parse(to_json(report)).at("recipe").at("joint");
  EXPECT_EQ(joint.at("layer_mm"), 1.2);
  EXPECT_EQ(joint.at("column_mm"), 1.0);
  EXPECT_EQ(joint.at("spacing_mm"), 3.0);
  EXPECT_EQ(joint.at("min_wall_mm"), 1.0);
}

TEST(Report, WhatIsNoNumberIsNull) {
  Report report = filled();
  report.solid.fill_ratio = std::numeric_limits<double>::quiet_NaN();
  report.parts[0].stress.dominance = std::numeric_limits<double>::infinity();
  const std::string text = to_json(report);
  EXPECT_TRUE(json::parse(text)["solid"]["fill_ratio"].is_null());
  EXPECT_TRUE(json::parse(text)["parts"][0]["dominance"].is_null());
}

TEST(Report, NumbersKeepTheirBits) {
  Report report;
  report.solid.volume_mm3 = 1.0 / 3.0;
  report.solid.mass_g = 1e-300;
  report.solid.active_voxels = std::numeric_limits<std::int64_t>::max();
  const json solid = json::parse(to_json(report))["solid"];
  EXPECT_EQ(solid["volume_mm3"].get<double>(), 1.0 / 3.0);
  EXPECT_EQ(solid["mass_g"].get<double>(), 1e-300);
  EXPECT_EQ(solid["active_voxels"].get<std::int64_t>(), std::numeric_limits<std::int64_t>::max());
}

TEST(Report, APathThatIsNotUtf8DoesNotBreakIt) {
  Report report;
  report.model.path = "b\xff.stl";
  EXPECT_TRUE(json::accept(to_json(report)));
}

TEST(Report, SameReportSameText) { EXPECT_EQ(to_json(filled()), to_json(filled())); }

TEST(Stopwatch, WallCountsWaitingCpuDoesNot) {
  std::vector<StageReport> stages;
  Stopwatch stage(stages);
  const int answer = stage("wait", [] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return 42;
  });
  EXPECT_EQ(answer, 42);
  ASSERT_EQ(stages.size(), 1U);
  EXPECT_EQ(stages[0].name, "wait");
  EXPECT_GE(stages[0].wall_s, 0.05);
  EXPECT_LT(stages[0].cpu_s, 0.04);
}

TEST(Stopwatch, CpuIsThatOfTheProcess) {
  const auto cpu_now = [] {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  std::vector<StageReport> stages;
  const double start = cpu_now();
  Stopwatch{stages}("spin", [&] {
    while (cpu_now() - start < 0.1) {
    }
  });
  EXPECT_NEAR(stages.at(0).cpu_s, 0.1, 0.03);
}

TEST(Stopwatch, PeakMemoryHoldsWhatWasTouched) {
  constexpr std::size_t bytes = 64'000'000;
  std::vector<StageReport> stages;
  Stopwatch stage(stages);
  stage("before", [] {});
  stage("touch", [] {
    std::vector<char> memory(bytes);
    for (std::size_t i = 0; i < bytes; i += 4096) static_cast<volatile char&>(memory[i]) = 1;
  });
  stage("after", [] {});
  EXPECT_GE(stages[1].peak_rss_mb - stages[0].peak_rss_mb, 60);
  EXPECT_LE(stages[1].peak_rss_mb - stages[0].peak_rss_mb, 80);
  EXPECT_GE(stages[2].peak_rss_mb, stages[1].peak_rss_mb);
}

TEST(Stopwatch, AStageThatThrowsIsNoted) {
  std::vector<StageReport> stages;
  EXPECT_THROW(Stopwatch{stages}("fails", []() -> int { throw Error(Code::SolverFailed, "x"); }), Error);
  EXPECT_EQ(stages.at(0).name, "fails");
}

}  // namespace
}  // namespace fibrolite
