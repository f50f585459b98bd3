// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/solid_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "fibrolite/blocks.h"
#include "fibrolite/kept_work.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/random.h"
#include "hybrid_runs.h"
#include "models.h"

namespace fibrolite {
namespace {

using testing::asset;
using testing::hybridized;
using testing::Outcome;
using testing::sturdy;

SlabPlan slabs_of(const Mesh& mesh, double voxel_mm, int axis, int thickness) {
  const Box3d box = bounds(mesh).grown(4 * voxel_mm);
  SlabPlan plan{.axis = axis};
  for (int at = static_cast<int>(std::floor(box.min[axis] / voxel_mm)) & ~7;; at += thickness) {
    plan.borders.push_back(at);
    if (at > box.max[axis] / voxel_mm) return plan;
  }
}

HybridizeParams params_of(InfillKind infill, double voxel_mm) {
  HybridizeParams params;
  params.recipe = sturdy();
  params.infill = infill;
  params.voxel_mm = voxel_mm;
  params.function = true;
  return params;
}

/// Every sample of the blocks in the slab's own range.
void expect_same_samples(const SolidStream::Slab& slab, const Solid& whole) {
  const std::vector<Vec3i> wanted = blocks(whole, slab.range), got = blocks(slab.solid, slab.range);
  ASSERT_EQ(wanted.size(), got.size());
  for (const Vec3i origin : wanted) {
    std::array<float, 512> a, b;
    copy_samples(whole, origin, {8, 8, 8}, a.data());
    copy_samples(slab.solid, origin, {8, 8, 8}, b.data());
    ASSERT_EQ(a, b) << origin.x << " " << origin.y << " " << origin.z;
  }
}

void expect_same_function(const SolidStream::Slab& slab, const Shape& printed, const Shape& whole, const Box3d& box,
                          double voxel_mm) {
  Random random(slab.range.low, "points");
  Vec3d low = box.min, high = box.max;
  (slab.range.axis == 0 ? low.x : slab.range.axis == 1 ? low.y : low.z) = slab.range.low * voxel_mm;
  (slab.range.axis == 0 ? high.x : slab.range.axis == 1 ? high.y : high.z) = slab.range.high * voxel_mm;
  for (int i = 0; i < 300; ++i) {
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    const Vec3d p = low + Vec3d{x * (high.x - low.x), y * (high.y - low.y), z * (high.z - low.z)};
    ASSERT_EQ(printed(p), whole(p)) << p.x << " " << p.y << " " << p.z;
  }
}

void expect_same(const PrintFault& a, const PrintFault& b) {
  EXPECT_EQ(a.places, b.places);
  EXPECT_EQ(a.area_mm2, b.area_mm2);
  EXPECT_EQ(a.volume_mm3, b.volume_mm3);
  EXPECT_EQ(a.least_mm, b.least_mm);
}

void expect_same_report(const Report& a, const Report& b) {
  EXPECT_EQ(a.model.volume_mm3, b.model.volume_mm3);
  EXPECT_EQ(a.model.repairs, b.model.repairs);
  EXPECT_EQ(a.solid.volume_mm3, b.solid.volume_mm3);
  EXPECT_EQ(a.solid.fill_ratio, b.solid.fill_ratio);
  EXPECT_EQ(a.solid.mass_g, b.solid.mass_g);
  EXPECT_EQ(a.solid.pieces, b.solid.pieces);
  EXPECT_EQ(a.solid.cavities, b.solid.cavities);
  EXPECT_EQ(a.solid.cavity_volume_mm3, b.solid.cavity_volume_mm3);
  EXPECT_EQ(a.solid.ties, b.solid.ties);
  EXPECT_EQ(a.solid.specks_removed, b.solid.specks_removed);
  EXPECT_EQ(a.solid.voids_filled, b.solid.voids_filled);
  EXPECT_EQ(a.solid.active_voxels, b.solid.active_voxels);
  EXPECT_EQ(a.solid.necks_thickened, b.solid.necks_thickened);
  EXPECT_EQ(a.solid.tips_tied, b.solid.tips_tied);
  EXPECT_EQ(a.solid.tips_removed, b.solid.tips_removed);
  EXPECT_EQ(a.solid.dangling, b.solid.dangling);
  EXPECT_EQ(a.warnings, b.warnings);
  EXPECT_EQ(a.solid.unreached, b.solid.unreached);
  EXPECT_EQ(a.print.checked, b.print.checked);
  expect_same(a.print.found.thin_walls, b.print.found.thin_walls);
  expect_same(a.print.found.small_gaps, b.print.found.small_gaps);
  expect_same(a.print.found.overhangs, b.print.found.overhangs);
  EXPECT_EQ(a.print.found.lumen_mm2, b.print.found.lumen_mm2);
  EXPECT_EQ(a.print.found.node_overhang_mm2, b.print.found.node_overhang_mm2);
  ASSERT_EQ(a.parts.size(), b.parts.size());
  for (std::size_t i = 0; i < a.parts.size(); ++i) {
    EXPECT_EQ(a.parts[i].volume_mm3, b.parts[i].volume_mm3);
    EXPECT_EQ(a.parts[i].lumen_mm3, b.parts[i].lumen_mm3);
    EXPECT_EQ(a.parts[i].infill_volume_mm3, b.parts[i].infill_volume_mm3);
    EXPECT_EQ(a.parts[i].centroid_mm, b.parts[i].centroid_mm);
  }
  EXPECT_EQ(a.interfaces.size(), b.interfaces.size());
}

void expect_same_in_slabs(const Outcome& whole, const Mesh& mesh, const HybridizeParams& params, int axis,
                          int thickness, bool falling) {
  SCOPED_TRACE("axis " + std::to_string(axis) + ", slabs of " + std::to_string(thickness));
  HybridizeParams cut = params;
  cut.slabs = slabs_of(mesh, *params.voxel_mm, axis, thickness);
  Outcome streamed = hybridized(mesh, cut);
  EXPECT_TRUE(streamed.hybrid.solid.empty());
  SolidStream& stream = streamed.hybrid.stream.value();
  for (std::size_t i = 0; i < stream.slabs(); ++i) {
    const SolidStream::Slab slab = stream.slab(falling ? stream.slabs() - 1 - i : i);
    expect_same_samples(slab, whole.hybrid.solid);
    expect_same_function(slab, stream.printed(slab), whole.hybrid.printed, bounds(mesh), *params.voxel_mm);
  }
  stream.finish(streamed.report);
  expect_same_report(streamed.report, whole.report);
}

/// Returns the report of the whole.
Report expect_same_in_slabs(const Mesh& mesh, const HybridizeParams& params, int axis, int thickness, bool falling) {
  const Outcome whole = hybridized(mesh, params);
  expect_same_in_slabs(whole, mesh, params, axis, thickness, falling);
  return whole.report;
}

TEST(SolidStream, slabs_of_a_hybrid_are_the_whole_sample_for_sample) {
  const Mesh mesh = read_mesh(asset("cylinder_on_box")).mesh;
  const Report report = expect_same_in_slabs(mesh, params_of(InfillKind::Hybrid, 0.5), 2, 40, false);
  EXPECT_GE(report.parts.size(), 2U);
  EXPECT_EQ(report.solid.pieces, 1);
}

TEST(SolidStream, along_any_axis_and_from_the_top) {
  const Mesh mesh = read_mesh(asset("molar")).mesh;
  const HybridizeParams params = params_of(InfillKind::Tcs, 0.5);
  for (int axis = 0; axis < 3; ++axis) expect_same_in_slabs(mesh, params, axis, 24, axis == 1);
}

TEST(SolidStream, ties_what_is_loose_as_the_whole_does) {
  // Blocks that stay filled hang on nothing in an empty shell.
  const Mesh mesh = testing::cube(40);
  HybridizeParams params = params_of(InfillKind::Shell, 0.5);
  params.recipe.partition.overrides.solid = {Box3d{{6, 10, 10}, {16, 30, 30}}, Box3d{{19, 10, 10}, {26, 18, 18}}};
  const Report report = expect_same_in_slabs(mesh, params, 0, 16, false);
  EXPECT_GE(report.solid.ties, 2);
  EXPECT_EQ(report.solid.pieces, 1);
}

TEST(SolidStream, ties_and_removes_what_hangs_free_as_the_whole_does) {
  // Crystal above a slanted plane, nothing below it and no joint between: sticks end in the void there.
  const Mesh mesh = read_mesh(asset("rounded_box")).mesh;
  HybridizeParams params = params_of(InfillKind::Hybrid, 0.5);
  params.recipe.joint.enabled = false;
  params.recipe.tcs.cell_mm = 7;
  params.recipe.partition.overrides.cuts.push_back({{0, 0, 20}, {0.1, 0.05, 1}});
  params.recipe.partition.overrides.parts = {{0, PartInfill::Shell}, {1, PartInfill::Tcs}};
  const Outcome whole = hybridized(mesh, params);
  ASSERT_GE(whole.report.solid.tips_tied, 5);
  ASSERT_GE(whole.report.solid.tips_removed, 10);
  EXPECT_EQ(whole.report.solid.dangling, 0);
  EXPECT_EQ(whole.report.solid.pieces, 1);
  expect_same_in_slabs(whole, mesh, params, 2, 16, false);  // a border through the ends, others through their sticks
  expect_same_in_slabs(whole, mesh, params, 0, 40, true);
}

TEST(SolidStream, goes_on_with_what_a_run_before_has_found) {
  const testing::TempDir folder;
  const Mesh mesh = testing::cube(40);
  HybridizeParams params = params_of(InfillKind::Shell, 0.5);
  params.recipe.partition.overrides.solid = {Box3d{{6, 10, 10}, {16, 30, 30}}, Box3d{{19, 10, 10}, {26, 18, 18}}};
  const Outcome whole = hybridized(mesh, params);
  std::string said;
  const auto go_on = [&](int thickness) {
    HybridizeParams cut = params;
    cut.slabs = slabs_of(mesh, *params.voxel_mm, 0, thickness);
    cut.kept = std::make_shared<KeptWork>(folder / "kept", "this very cube\n");
    said.clear();
    Report report;
    const Context context({}, [&](std::string_view line) { said.append(line).append("\n"); });
    Hybrid hybrid = hybridize(prepare({mesh, 1.0, {}}, {}), cut, report, context);
    return Outcome{std::move(hybrid), std::move(report)};
  };
  {
    Outcome first = go_on(16);
    EXPECT_EQ(said, "");
    for (const std::size_t slab : {0, 1, 3}) (void)first.hybrid.stream->slab(slab);
  }
  {
    Outcome second = go_on(16);
    EXPECT_EQ(said, "resumed the first pass and what was measured of 3 of " +
                        std::to_string(second.hybrid.stream->slabs()) + " slabs\n");
    for (const std::size_t number : {1, 2}) {
      const SolidStream::Slab slab = second.hybrid.stream->slab(number);
      expect_same_samples(slab, whole.hybrid.solid);
      expect_same_function(slab, second.hybrid.stream->printed(slab), whole.hybrid.printed, bounds(mesh),
                           *params.voxel_mm);
    }
  }
  {
    Outcome third = go_on(16);
    third.hybrid.stream->finish(third.report);  // makes the slabs that nobody has asked for in any of the runs
    expect_same_report(third.report, whole.report);
    EXPECT_GE(third.report.solid.ties, 2);
  }
  // Slabs may be others by then.
  Outcome fourth = go_on(24);
  EXPECT_EQ(said.substr(0, 24), "resumed the first pass a");
  fourth.hybrid.stream->finish(fourth.report);
  expect_same_report(fourth.report, whole.report);
}

TEST(SolidStream, more_memory_makes_fewer_slabs_and_all_are_covered) {
  const Mesh mesh = read_mesh(asset("molar")).mesh;
  const Recipe recipe;
  const double h = 0.1;
  std::size_t last = 1000000;
  for (const double bytes : {250e6, 400e6, 3000e6}) {
    const SlabPlan plan = plan_slabs(mesh, h, recipe, InfillKind::Tcs, {2, 1.0}, bytes);
    EXPECT_LE(plan.memory_bytes, bytes);
    EXPECT_LT(plan.borders.size(), last);
    last = plan.borders.size();
    EXPECT_EQ(plan.margin_vox, 16);  // 1 mm
    EXPECT_LT(plan.borders.front() * h, bounds(mesh).min.z - 3 * h);
    EXPECT_GT(plan.borders.back() * h, bounds(mesh).max.z + 3 * h);
    EXPECT_TRUE(std::is_sorted(plan.borders.begin(), plan.borders.end()));
    for (const int border : plan.borders) EXPECT_EQ(border % 8, 0);
  }
  EXPECT_GT(plan_slabs(mesh, h, recipe, InfillKind::Tcs, {2, 1.0}, 80e6).memory_bytes, 80e6);
}

}  // namespace
}  // namespace fibrolite
