// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/load_cores.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/stance.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "models.h"

namespace fibrolite {
namespace {

using ::testing::HasSubstr;

constexpr double side = 40, patch = 14;

/// A rounded box of 40 mm standing on z = 0, seen from a frame.
Proxy box(const Frame& frame = {}, Vec3d size = {side, side, side}) {
  const Box3d inner{{-0.5 * size.x + 3, -0.5 * size.y + 3, 3}, {0.5 * size.x - 3, 0.5 * size.y - 3, size.z - 3}};
  const Shape shape = placed(offset(cuboid(inner), 3), frame);
  Box3d region;
  for (unsigned i = 0; i < 8; ++i)
    region.include(
        frame.to_world(Box3d{{-0.5 * size.x, -0.5 * size.y, 0}, {0.5 * size.x, 0.5 * size.y, size.z}}.corner(i)));
  Proxy proxy;
  proxy.solid = realize(shape, region.grown(4), Grid{.voxel_mm = 0.8});
  proxy.surface = surface(proxy.solid);
  return proxy;
}

/// A force on what lies within half a patch of an axis through `point`, in front of a plane just below it.
LoadCase pressed(const std::string& name, const Frame& frame, Vec3d point, Vec3d inward, Vec3d force) {
  LoadCase load;
  load.name = name;
  Support foot;
  foot.where.half_spaces = {{frame.to_world({0, 0, 2}), frame.to_world({0, 0, 1}) - frame.origin}};
  load.supports = {foot};
  TotalForce total{.newton = 1000, .direction = {Direction::Of::World, frame.to_world(force) - frame.origin}};
  const Frame local = frame_along(point, inward);
  for (const Vec3d n : {local.x, -local.x, local.y, -local.y})
    total.where.half_spaces.push_back({frame.to_world(point + 0.5 * patch * n), frame.to_world(n) - frame.origin});
  total.where.half_spaces.push_back({frame.to_world(point + inward), frame.to_world(inward) - frame.origin});
  load.forces = {total};
  return load;
}
LoadCase on_top(const Frame& frame = {}) { return pressed("top", frame, {0, 0, side}, {0, 0, -1}, {0, 0, -1}); }
LoadCase on_side(const Frame& frame = {}) {
  return pressed("side", frame, {0.5 * side, 0, 0.5 * side}, {-1, 0, 0}, {-1, 0, 0});
}

VerifyParams loaded(std::vector<LoadCase> cases) {
  VerifyParams params{.triangles = 3000};
  params.loads = std::move(cases);
  return params;
}

Partition cores_of(const Proxy& proxy, const VerifyParams& loads) {
  return find_cores(proxy, undivided(proxy), {}, loads);
}

double degrees(Vec3d a, Vec3d b) {
  return std::acos(std::min(1.0, std::abs(dot(normalized(a), normalized(b))))) * 180 / std::numbers::pi;
}

TEST(LoadCores, APatchOnABoxHasOneCoreBelowIt) {
  const Proxy proxy = box();
  const Partition found = cores_of(proxy, loaded({on_top()}));
  ASSERT_EQ(found.cores.size(), 1U) << (found.notes.empty() ? "" : found.notes.front());
  ASSERT_EQ(found.candidates.size(), 2U);
  const Core& core = found.cores.front();
  const Candidate& c = found.candidates[1];
  EXPECT_LT(degrees(core.frame.z, {0, 0, 1}), 3);
  EXPECT_NEAR(c.centroid_mm.x, 0, 1.5);
  EXPECT_NEAR(c.centroid_mm.y, 0, 1.5);
  EXPECT_NEAR(c.length_mm, side, 1);
  // 0.7 of the patch's area, were its stress known exactly; the largest of a coarse mesh is somewhat above the mean.
  const double expected = std::sqrt(4 / std::numbers::pi * 0.7 * patch * patch);
  EXPECT_NEAR(c.diameter_mm, expected, 0.15 * expected);
  EXPECT_TRUE(c.column_like);
  EXPECT_THAT(c.reason, HasSubstr("core under load"));
  EXPECT_NEAR(c.volume_mm3, std::numbers::pi / 4 * c.diameter_mm * c.diameter_mm * side, 0.05 * c.volume_mm3);
  EXPECT_NEAR(c.volume_mm3 + found.candidates[0].volume_mm3, proxy.solid.volume_mm3(), 1e-6 * c.volume_mm3);

  // verify() judges it like any limb, on a mesh of its own.
  const Verification v = verify(proxy, found, loaded({on_top()}));
  ASSERT_EQ(v.parts.parts.size(), 2U);
  ASSERT_EQ(v.parts.cores.size(), 1U);
  const Part& part = v.parts.parts[static_cast<std::size_t>(v.parts.cores.front().id)];
  EXPECT_EQ(part.kind(), Kind::Column) << part.reason();
  EXPECT_GT(part.stress().dominance, 2);
  EXPECT_TRUE(v.notes.empty()) << v.notes.front();
}

TEST(LoadCores, TurnedModelAndLoadGiveTheTurnedCore) {
  const double s = std::sqrt(0.5);
  const Frame turned{{5, -3, 8}, {s, s, 0}, {-0.5, 0.5, s}, {0.5, -0.5, s}};
  const Proxy straight = box(), leaning = box(turned);
  const Partition a = cores_of(straight, loaded({on_top()})), b = cores_of(leaning, loaded({on_top(turned)}));
  ASSERT_EQ(a.cores.size(), 1U);
  ASSERT_EQ(b.cores.size(), 1U);
  EXPECT_LT(degrees(b.cores.front().frame.z, turned.z), 3);
  const Candidate &ca = a.candidates[1], &cb = b.candidates[1];
  EXPECT_LT(norm(turned.to_world(ca.centroid_mm) - cb.centroid_mm), 1.5);
  EXPECT_NEAR(ca.diameter_mm, cb.diameter_mm, 0.15 * ca.diameter_mm);
}

/// Turned and shifted by a hair, the body has the same surface to some hundredths of a voxel, in other triangles.
TEST(LoadCores, AHairsBreadthDecidesNothing) {
  constexpr double hair = 0.02 * 0.8;  // mm
  const double expected = std::sqrt(4 / std::numbers::pi * 0.7 * patch * patch);
  for (std::uint64_t turn = 0; turn < 4; ++turn) {
    Random random(1, "hair", turn);
    const auto some = [&](double range) { return range * (2 * random.uniform() - 1); };
    const Frame frame = frame_along({some(hair), some(hair), some(hair)}, {some(hair / side), some(hair / side), 1});
    SCOPED_TRACE(turn);
    const Partition found = cores_of(box(frame), loaded({on_top()}));
    ASSERT_EQ(found.cores.size(), 1U) << (found.notes.empty() ? "" : found.notes.front());
    const Candidate& c = found.candidates[1];
    EXPECT_LT(degrees(found.cores.front().frame.z, {0, 0, 1}), 3);
    EXPECT_LT(std::hypot(c.centroid_mm.x, c.centroid_mm.y), 1.5);
    EXPECT_NEAR(c.diameter_mm, expected, 0.15 * expected);
  }
}

/// Samples lie on a lattice, whose layers meet the ends of a box of another height elsewhere.
TEST(LoadCores, ACoreIsAsWideWhereverTheSamplesLie) {
  double least = far_mm, most = 0;
  for (int more = 0; more < 6; ++more) {
    const double height = side + 0.3 * more;
    const LoadCase top = pressed("top", {}, {0, 0, height}, {0, 0, -1}, {0, 0, -1});
    const Partition found = cores_of(box({}, {side, side, height}), loaded({top}));
    ASSERT_EQ(found.cores.size(), 1U) << height;
    least = std::min(least, found.candidates[1].diameter_mm);
    most = std::max(most, found.candidates[1].diameter_mm);
  }
  EXPECT_LT(most, 1.05 * least) << least << " to " << most;
}

TEST(LoadCores, CasesThatDisagreeHaveNoCore) {
  // Whatever is proposed, no part is a column under both.
  const Proxy proxy = box();
  const Partition found = cores_of(proxy, loaded({on_top(), on_side()}));
  const Verification v = verify(proxy, found, loaded({on_top(), on_side()}));
  for (const Part& part : v.parts.parts) EXPECT_EQ(part.kind(), Kind::Bulk) << part.reason();
  EXPECT_TRUE(v.parts.cores.empty());
  EXPECT_EQ(v.parts.labels.count(), 1);
}

TEST(LoadCores, AnUnplannedCaseDecidesNothing) {
  LoadCase side_case = on_side();
  side_case.unplanned = true;
  const Proxy proxy = box();
  const Partition alone = cores_of(proxy, loaded({on_top()})), with = cores_of(proxy, loaded({on_top(), side_case}));
  ASSERT_EQ(with.cores.size(), 1U);
  EXPECT_EQ(with.cores.front().radius_mm, alone.cores.front().radius_mm);
  EXPECT_TRUE(with.cores.front().frame.origin == alone.cores.front().frame.origin);
}

/// What bends carries at its surface, along it: that is the shell's, and no core inside.
TEST(LoadCores, ABarInBendingHasNoCore) {
  const Vec3d size{20, 20, 80};
  LoadCase bent = on_top();
  bent.forces = {TotalForce{.newton = 100,
                            .direction = {Direction::Of::World, {1, 0, 0}},
                            .where = {.half_spaces = {{{0, 0, 78}, {0, 0, -1}}}}}};
  const Partition found = cores_of(box({}, size), loaded({bent}));
  EXPECT_TRUE(found.cores.empty()) << found.candidates.back().reason;
  EXPECT_FALSE(found.notes.empty());
}

TEST(LoadCores, EveryPointHasOneOwner) {
  const Partition found = cores_of(box(), loaded({on_top()}));
  ASSERT_EQ(found.labels.count(), 2);
  const Frame world = frame_along({3, 1, 2}, {1, 2, 3});
  const Shape mantle = found.labels.region(1);
  for (const Labels& labels : {found.labels, found.labels.placed(world), found.labels.merged({1, 0})}) {
    const std::vector<Shape> region{labels.region(0), labels.region(1)};
    Random random(7, "load_cores_test");
    int inside = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vec3d p = world.to_world({60 * random.uniform() - 30, 60 * random.uniform() - 30, 60 * random.uniform()});
      const auto own = static_cast<std::size_t>(labels.label(p));
      ASSERT_LE(region[own](p), 0);
      ASSERT_GE(region[1 - own](p), 0);
      inside += own == 1 ? 1 : 0;
    }
    EXPECT_GT(inside, 20);
  }
  EXPECT_EQ(found.labels.merged({0, 0}).label({0, 0, 20}), 0);
  EXPECT_LT(found.labels.merged({0, 0}).region(0)({0, 0, 20}), 0);
}

TEST(LoadCores, BadNumbersAreRefused) {
  const Proxy proxy = box();
  EXPECT_THROW((void)find_cores(proxy, undivided(proxy), {.least_mm = 0}, loaded({on_top()})), Error);
}

Recipe patch_recipe() {
  std::ifstream file(std::filesystem::path(FIBROLITE_ASSETS) / "recipes" / "patch.json");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return parse_recipe(text, preset("default"), "patch.json");
}

TEST(LoadCores, TheBundledBoxIsOnePieceWithNothingHanging) {
  const Model model = prepare(read_mesh(testing::asset("rounded_box")), {});
  const auto made = [&](int threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    Report report;
    const Hybrid hybrid = hybridize(model, {.recipe = patch_recipe(), .voxel_mm = 0.3}, report);
    return std::pair(report, hybrid.solid.volume_mm3());
  };
  const auto [report, volume] = made(2);
  EXPECT_EQ(report.solid.pieces, 1);
  EXPECT_EQ(report.solid.dangling, 0);
  EXPECT_EQ(report.solid.unreached, 0);
  EXPECT_EQ(report.solid.ties, 0);
  ASSERT_EQ(report.parts.size(), 2U);
  EXPECT_EQ(report.parts[1].infill, "mfs");
  EXPECT_GT(report.parts[1].fibres, 4);
  EXPECT_LT(degrees(report.parts[1].axis, {0, 0, 1}), 3);
  ASSERT_EQ(report.interfaces.size(), 1U);
  EXPECT_GT(report.interfaces[0].radius_mm, 4);
  EXPECT_TRUE(std::isnan(report.interfaces[0].mst_bridge_mm3)) << "a sleeve is no bridge by any rule";
  EXPECT_TRUE(std::isnan(report.interfaces[0].bbox_bridge_mm3));
  EXPECT_EQ(report.interfaces[0].regions_after, 1);
  EXPECT_GT(report.interfaces[0].contact_area_mm2, 50);
  EXPECT_GT(report.interfaces[0].capacity_over_demand, 1);
  const auto [again, same] = made(1);
  EXPECT_EQ(volume, same);
  EXPECT_EQ(report.parts[1].volume_mm3, again.parts[1].volume_mm3);
}

TEST(LoadCores, ByBothALimbStaysAColumnAndTheBulkGetsACore) {
  // The bundled cylinder on a box, pressed from above: the post by shape; what carries it through the box by load.
  const Model model = prepare(read_mesh(testing::asset("cylinder_on_box")), {});
  Recipe recipe = set(preset("default"), "partition.by=both");
  recipe = set(recipe, "mfs.fibre_mm=3");
  Report report;
  const Hybrid hybrid = hybridize(model, {.recipe = recipe, .voxel_mm = 0.35}, report);
  EXPECT_EQ(report.solid.pieces, 1);
  EXPECT_EQ(report.solid.unreached, 0);
  int columns = 0;
  for (const PartReport& part : report.parts) columns += part.kind == "column" ? 1 : 0;
  EXPECT_GE(columns, 1);
  for (const InterfaceReport& interface : report.interfaces) EXPECT_EQ(interface.regions_after, 1);
}

}  // namespace
}  // namespace fibrolite
