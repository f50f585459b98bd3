// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/hybridize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/tools/Composite.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "fibrolite/vdb.h"
#include "hybrid_runs.h"
#include "models.h"

namespace fibrolite {
namespace {

using testing::asset;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::hybridized;
using ::testing::IsEmpty;
using testing::Outcome;
using testing::sturdy;

Mesh model(const std::string& name) { return read_mesh(asset(name)).mesh; }

std::vector<std::string> kinds(const Report& report) {
  std::vector<std::string> result;
  for (const PartReport& p : report.parts) result.push_back(p.kind);
  std::sort(result.begin(), result.end());
  return result;
}

TEST(Hybridize, every_form_of_the_crystal_gives_one_piece_of_the_wanted_density) {
  const Mesh mesh = model("molar");
  for (const TcsForm form : {TcsForm::Sticks, TcsForm::Network, TcsForm::Sheet}) {
    HybridizeParams params;
    params.infill = InfillKind::Tcs;
    params.voxel_mm = 0.3;
    params.recipe.tcs = {.form = form, .cell_mm = 12, .density = 0.2};
    const Report even = hybridized(mesh, params).report;
    EXPECT_EQ(even.solid.pieces, 1);
    const PartReport part = even.parts.at(0);
    EXPECT_NEAR(part.infill_volume_mm3 / part.lumen_mm3, 0.2, 0.03);

    params.recipe.tcs = sized(params.recipe.tcs);  // the same sizes, to be thicker than
    params.recipe.tcs.grade = TcsGrade::Surface;
    params.recipe.tcs.grade_most = 1.4;
    params.recipe.tcs.grade_depth_mm = 12;
    const Report thicker = hybridized(mesh, params).report;
    EXPECT_EQ(thicker.solid.pieces, 1);
    EXPECT_GT(thicker.parts.at(0).infill_volume_mm3, 1.15 * part.infill_volume_mm3);
  }
}

/// In a shell the sheet's two labyrinths are closed voids of half the lumen's void each: the report says so, and one
/// hole through the membrane and one through the shell drain both.
TEST(Hybridize, a_sheet_in_a_shell_has_two_voids_that_drain) {
  const Mesh box = testing::cube(26);
  HybridizeParams params{.recipe = sturdy(), .infill = InfillKind::Tcs, .voxel_mm = 0.3};
  params.recipe.tcs = {.form = TcsForm::Sheet, .cell_mm = 8, .wall_mm = 0.8, .shift_mm = {2, 2, 2}};
  const Report closed = hybridized(box, params).report;
  const PartReport& part = closed.parts.at(0);
  EXPECT_EQ(closed.solid.pieces, 1);
  EXPECT_EQ(closed.solid.cavities, 2);
  EXPECT_NEAR(closed.solid.cavity_volume_mm3 / (part.lumen_mm3 - part.infill_volume_mm3), 1, 0.02);
  params.recipe.print.drain_mm = 2;
  const Report drained = hybridized(box, params).report;
  EXPECT_EQ(drained.solid.pieces, 1);
  EXPECT_EQ(drained.solid.cavities, 0);
  ASSERT_EQ(drained.print.drains.size(), 2U);
  EXPECT_EQ(
      std::count_if(drained.print.drains.begin(), drained.print.drains.end(), [](const Drain& d) { return d.outward; }),
      1);
}

/// Counted in the finished solid at random points, not taken from the report.
double crystal_share(const Outcome& made, double shell_mm) {
  Random random(3, "hybridize_test");
  const Box3d box = made.hybrid.solid.bounds_mm();
  std::vector<Vec3d> points;
  for (int i = 0; i < 600000; ++i)
    points.push_back(box.min + Vec3d{box.size().x * random.uniform(), box.size().y * random.uniform(),
                                     box.size().z * random.uniform()});
  std::vector<float> depth(points.size());
  made.hybrid.body.evaluate(points, depth);
  int lumen = 0, material = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (static_cast<double>(depth[i]) >= -shell_mm) continue;
    ++lumen;
    material += made.hybrid.solid.distance(points[i]) < 0 ? 1 : 0;
  }
  return static_cast<double>(material) / lumen;
}

TEST(Hybridize, a_graded_crystal_has_the_wanted_density_in_the_mean) {
  const Mesh mesh = model("rounded_box");
  HybridizeParams params;
  params.infill = InfillKind::Tcs;
  params.voxel_mm = 0.23;
  for (const TcsForm form : {TcsForm::Sticks, TcsForm::Network}) {
    params.recipe.tcs = {.form = form, .density = 0.2, .grade = TcsGrade::Surface, .grade_most = 1.4};
    const Outcome made = hybridized(mesh, params);
    EXPECT_THAT(made.report.warnings, IsEmpty());
    const PartReport part = made.report.parts.at(0);
    EXPECT_NEAR(part.infill_volume_mm3 / part.lumen_mm3, 0.2, 0.01 * 0.2);
    EXPECT_NEAR(crystal_share(made, params.recipe.shell.thickness_mm), 0.2, 0.01 * 0.2);
  }
  // Thinner members than two voxels would do it.
  params.recipe.tcs.density = 0.13;
  params.recipe.tcs.grade_most = 2;
  const Report thick = hybridized(mesh, params).report;
  EXPECT_THAT(thick.warnings,
              ElementsAre(HasSubstr("tcs.density: 0.13 was asked for, 0.1"), HasSubstr("solid.neck_mm: necks were")));
  EXPECT_GT(thick.parts.at(0).infill_volume_mm3, 1.02 * 0.13 * thick.parts.at(0).lumen_mm3);
}

/// `tcs.grade=stress` in a whole run. A bar that is half as thick from its middle on is pulled: twice the stress there,
/// which is the full one (95 % of the volume stay below it), so sticks get the most; half the stress before, half of
/// the way there.
TEST(Hybridize, sticks_are_thicker_where_the_coarse_solve_carries_more) {
  const Box3d thick{{0, 0, 0}, {32, 24, 24}}, thin{{30, 0, 6}, {64, 24, 18}};
  const Mesh bar =
      surface(realize(unite({cuboid(thick), cuboid(thin)}), {{-4, -4, -4}, {68, 28, 28}}, {.voxel_mm = 1}));
  HybridizeParams params{.recipe = sturdy(), .voxel_mm = 0.5, .function = true};
  for (const char* assignment :
       {"tcs.grade=stress", "tcs.grade_depth_mm=6", R"(partition.overrides={"parts": [{"id": 0, "infill": "tcs"}]})",
        R"(loads=[{"name": "pulled", "supports": [{"where": {"lowest": {"share": 0.05, "along": [1, 0, 0]}}}],
            "forces": [{"force_n": 50, "direction": [1, 0, 0], "where": {"seen_from": [1, 0, 0], "box_mm": [[60, -1, 5], [66, 25, 19]]}}]}])"})
    params.recipe = set(params.recipe, assignment);
  params.recipe.print.check = false;
  const Outcome made = hybridized(bar, params);
  ASSERT_EQ(made.report.parts.size(), 1U);
  EXPECT_EQ(made.report.solid.pieces, 1);

  // Half way along each stick inside the lumen: how thick it is made, over how thick the recipe says.
  const TcsParams& tcs = params.recipe.tcs;
  const auto factors = [&](const Box3d& where) {
    std::vector<double> found;
    each_stick(tcs, where, [&](const Capsule& stick) {
      const Vec3d middle = 0.5 * (stick.a + stick.b);
      if (where.contains(middle)) found.push_back(-made.hybrid.printed(middle) / (0.5 * tcs.stick_mm));
    });
    std::sort(found.begin(), found.end());
    return found;
  };
  const auto median = [](const std::vector<double>& sorted) { return sorted.at(sorted.size() / 2); };
  // Clear of shell, clamp, step and the face that is pulled.
  const std::vector<double> before = factors({{9, 3, 3}, {18, 21, 21}}), after = factors({{42, 3, 9}, {58, 21, 15}});
  ASSERT_GT(before.size(), 100U);
  ASSERT_GT(after.size(), 50U);
  EXPECT_NEAR(median(before), 0.5 * (tcs.grade_least + tcs.grade_most), 0.04);
  EXPECT_NEAR(median(after), tcs.grade_most, 0.04);
  EXPECT_LT(before.back(), after.front());
}

TEST(Hybridize, print_checks_can_be_left_out) {
  HybridizeParams params;
  params.infill = InfillKind::Tcs;
  params.voxel_mm = 0.4;
  const Mesh mesh = model("molar");
  EXPECT_TRUE(hybridized(mesh, params).report.print.checked);
  params.recipe.print.check = false;
  const Report without = hybridized(mesh, params).report;
  EXPECT_FALSE(without.print.checked);
  EXPECT_EQ(to_json(without).find("thin_walls"), std::string::npos);
  // What is mended is told whatever the recipe says.
  params.recipe.print.drain_mm = 2;
  EXPECT_TRUE(hybridized(mesh, params).report.print.checked);
}

TEST(Hybridize, quadruped_has_fibres_in_its_legs_and_crystal_in_its_body_at_every_voxel) {
  const Mesh mesh = model("quadruped");
  const Outcome coarse = hybridized(mesh, {.recipe = sturdy(), .voxel_mm = 0.5}),
                fine = hybridized(mesh, {.recipe = sturdy(), .voxel_mm = 0.25});

  EXPECT_EQ(coarse.report.solid.pieces, 1);
  EXPECT_GT(coarse.report.solid.fill_ratio, 0.1);
  EXPECT_LT(coarse.report.solid.fill_ratio, 0.8);
  int columns = 0;
  for (const PartReport& p : coarse.report.parts) {
    EXPECT_EQ(p.infill, p.kind == "column" ? "mfs" : "tcs");
    EXPECT_GT(p.infill_volume_mm3, 0.05 * p.lumen_mm3);
    if (p.kind != "column") continue;
    ++columns;
    EXPECT_GT(p.infill_volume_mm3, 0.15 * p.lumen_mm3);
    EXPECT_GT(p.stress.dominance, 2);
    EXPECT_TRUE(std::any_of(coarse.report.interfaces.begin(), coarse.report.interfaces.end(),
                            [&](const InterfaceReport& i) { return i.a == p.id || i.b == p.id; }));
  }
  EXPECT_GE(columns, 4);
  for (const InterfaceReport& i : coarse.report.interfaces) {
    EXPECT_EQ(i.regions_after, 1);
    EXPECT_LE(i.layer_area_mm2, 1.25 * (i.union_area_mm2 + i.bridge_area_mm2));
  }

  ASSERT_EQ(fine.report.parts.size(), coarse.report.parts.size());
  for (std::size_t i = 0; i < fine.report.parts.size(); ++i) {
    const PartReport &a = coarse.report.parts[i], &b = fine.report.parts[i];
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_NEAR(a.volume_mm3 / b.volume_mm3, 1, 0.01);
    EXPECT_LT(norm(a.centroid_mm - b.centroid_mm), 0.5);
    EXPECT_EQ(a.fibres, b.fibres);
  }
  ASSERT_EQ(fine.hybrid.joints.size(), coarse.hybrid.joints.size());
  for (std::size_t i = 0; i < fine.hybrid.joints.size(); ++i) {
    const auto &a = coarse.hybrid.joints[i].columns, &b = fine.hybrid.joints[i].columns;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) EXPECT_LT(norm(a[k].a - b[k].a), 1e-6);
  }
}

TEST(Hybridize, a_turned_model_gives_the_same_parts) {
  const Mesh mesh = model("cylinder_on_box");
  const HybridizeParams upright{.recipe = sturdy(), .voxel_mm = 0.5};
  const Outcome straight = hybridized(mesh, upright);
  for (const int axis : {0, 1, 2}) {
    HybridizeParams turned = upright;
    turned.recipe.verify.up = axis == 0 ? Vec3d{0, -1, 0} : axis == 1 ? Vec3d{1, 0, 0} : Vec3d{0, 0, 1};
    turned.recipe.verify.azimuth_deg = 0;
    const Outcome out = hybridized(testing::turned(mesh, axis, 1), turned);
    EXPECT_EQ(kinds(out.report), kinds(straight.report));
    EXPECT_NEAR(out.report.solid.volume_mm3 / straight.report.solid.volume_mm3, 1, 0.01);
  }
}

/// A rounded cube is the same whichever way is up: so is what leans over in it.
TEST(Hybridize, the_crystal_of_the_preset_fdm_stands_the_way_it_is_printed) {
  const Mesh mesh = model("rounded_box");
  const auto crystal = [&](Vec3d up) {
    HybridizeParams params{.recipe = preset("fdm"), .infill = InfillKind::Tcs, .voxel_mm = 0.4};
    params.recipe.verify.up = up;
    return hybridized(mesh, params).report;
  };
  const Report upright = crystal({0, 0, 1}), across = crystal({0, 1, 0});
  EXPECT_NEAR(across.print.found.overhangs.area_mm2 / upright.print.found.overhangs.area_mm2, 1, 0.05);
  EXPECT_NEAR(across.print.found.node_overhang_mm2 / upright.print.found.node_overhang_mm2, 1, 0.25);
  EXPECT_NEAR(across.solid.volume_mm3 / upright.solid.volume_mm3, 1, 0.02);
}

TEST(Hybridize, fix_stretches_a_crystal_that_leans_too_far) {
  const Mesh mesh = model("rounded_box");
  const auto made = [&](bool fix, double overhang_deg) {
    HybridizeParams params{.recipe = sturdy(), .infill = InfillKind::Tcs, .voxel_mm = 0.4, .fix = fix};
    params.recipe.print.overhang_deg = overhang_deg;
    return hybridized(mesh, params).report;
  };
  const auto share = [](const Report& report) {
    return report.print.found.overhangs.area_mm2 / report.print.found.lumen_mm2;
  };
  const Report left = made(false, 45), fixed = made(true, 45), patient = made(true, 60);
  EXPECT_FALSE(left.print.stretched);
  EXPECT_GT(share(left), 0.05);
  EXPECT_TRUE(fixed.print.stretched);
  EXPECT_LT(share(fixed), 0.01);
  EXPECT_FALSE(fixed.recipe.tcs.stretch_z) << "the recipe stays what was asked for";
  EXPECT_FALSE(patient.print.stretched) << "as it stands it can be printed";
  EXPECT_EQ(fixed.solid.pieces, 1);
  EXPECT_EQ(fixed.solid.dangling, 0);
}

TEST(Hybridize, what_fix_leaves_is_said) {
  const auto made = [](TcsForm form) {
    HybridizeParams params{.recipe = sturdy(), .infill = InfillKind::Tcs, .voxel_mm = 0.4, .fix = true};
    params.recipe.tcs.form = form;
    params.recipe.tcs.cell_mm = 12;
    return hybridized(testing::cube(26), params).report;
  };
  const auto said = [](const Report& report, const std::string& what) {
    return std::any_of(report.warnings.begin(), report.warnings.end(),
                       [&](const std::string& text) { return text.find(what) != std::string::npos; });
  };
  const Report sheet = made(TcsForm::Sheet), sticks = made(TcsForm::Sticks);
  EXPECT_GT(sheet.print.found.overhangs.area_mm2, 0.01 * sheet.print.found.lumen_mm2);
  EXPECT_TRUE(said(sheet, "faces every way"));
  EXPECT_LT(sticks.print.found.overhangs.area_mm2, 0.01 * sticks.print.found.lumen_mm2);
  EXPECT_FALSE(said(sticks, "--fix leaves"));
}

TEST(Hybridize, the_steps_united_by_openvdb_are_the_fused_solid) {
  const Outcome out = hybridized(model("cylinder_on_box"), {.recipe = sturdy(), .voxel_mm = 0.5, .steps = true});
  std::map<std::string, Solid> step;
  for (const NamedSolid& s : out.hybrid.steps) step.emplace(s.name, s.solid);
  ASSERT_TRUE(step.contains("body") && step.contains("shell") && step.contains("fill_0") && step.contains("solid"));
  ASSERT_TRUE(step.contains("joint_0"));
  const auto united = to_vdb(step.at("shell"))->deepCopy();
  for (const auto& [name, solid] : step) {
    if (name == "body" || name == "shell" || name == "solid" || name == "specks") continue;
    const auto operand = to_vdb(solid)->deepCopy();
    openvdb::tools::csgUnion(*united, *operand);
  }
  if (step.contains("specks")) {
    const auto operand = to_vdb(step.at("specks"))->deepCopy();
    openvdb::tools::csgDifference(*united, *operand);
  }
  const auto fused = to_vdb(out.hybrid.solid);
  const auto access = united->getConstAccessor();
  const float near = 0.1F * 0.5F;
  std::int64_t compared = 0, differ = 0;
  for (auto value = fused->cbeginValueOn(); value; ++value) {
    if (std::abs(*value) < near) continue;
    ++compared;
    differ += (access.getValue(value.getCoord()) < 0) != (*value < 0) ? 1 : 0;
  }
  EXPECT_GT(compared, 100000);
  EXPECT_EQ(differ, 0);
}

TEST(Hybridize, the_molar_weighs_what_the_paper_says) {
  const Mesh mesh = model("molar");
  const auto mass = [&](InfillKind kind) {
    return hybridized(mesh, {.recipe = {}, .infill = kind, .voxel_mm = 0.4}).report.solid.mass_g;
  };
  const double tcs = mass(InfillKind::Tcs), hybrid = mass(InfillKind::Hybrid), mfs = mass(InfillKind::Mfs),
               full = mass(InfillKind::Solid);
  EXPECT_LT(tcs, hybrid);
  EXPECT_LT(hybrid, mfs);
  EXPECT_LT(mfs, full);
  EXPECT_GT(hybrid / full, 0.30);  // the paper: 41.86 %
  EXPECT_LT(hybrid / full, 0.55);
}

TEST(Hybridize, a_filled_body_is_the_model) {
  const Mesh mesh = model("bracket");
  const Outcome out = hybridized(mesh, {.recipe = {}, .infill = InfillKind::Solid, .voxel_mm = 0.4});
  EXPECT_NEAR(out.report.solid.volume_mm3 / signed_volume(mesh), 1, 0.005);
  EXPECT_NEAR(out.report.solid.fill_ratio, 1, 1e-3);
}

}  // namespace
}  // namespace fibrolite
