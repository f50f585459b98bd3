// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "component_stress.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/stance.h"
#include "fibrolite/ops/tetrahedralize.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "label_field.h"
#include "load.h"
#include "locate.h"
#include "models.h"

namespace fibrolite {
namespace {

using ::testing::HasSubstr;

Proxy proxy_of(const Shape& shape, const Box3d& box, double voxel_mm) {
  Proxy proxy;
  proxy.solid = realize(shape, box, Grid{.voxel_mm = voxel_mm});
  proxy.surface = surface(proxy.solid);
  return proxy;
}

/// Candidate 0 where `side` is negative, 1 where it is positive.
Labels cut_by(const Box3d& box, const std::function<double(Vec3d)>& side) {
  const double h = box.longest_side() / 64;
  LabelSamples s{.origin = box.min, .voxel_mm = h, .size = {}, .count = 2, .clamp_mm = 6 * h, .label = {}, .near = {}};
  const auto steps = [&](double length) { return static_cast<std::int32_t>(std::ceil(length / h)) + 1; };
  s.size = {steps(box.size().x), steps(box.size().y), steps(box.size().z)};
  for (int k = 0; k < s.size.z; ++k) {
    for (int j = 0; j < s.size.y; ++j) {
      for (int i = 0; i < s.size.x; ++i) {
        const double d = side(box.min + h * Vec3d{double(i), double(j), double(k)});
        const auto sample = static_cast<std::int64_t>(s.label.size());
        s.label.push_back(d < 0 ? 0 : 1);
        if (std::abs(d) < s.clamp_mm) s.near.push_back({sample, 0, 1, static_cast<float>(std::abs(d))});
      }
    }
  }
  return make_labels(s);
}

/// The model of most tests: a box with a cylinder on it, cut apart where they meet, in any position.
struct CylinderOnBox {
  static constexpr double radius = 8, foot = 20, top = 80;
  Proxy proxy;
  Partition partition;

  explicit CylinderOnBox(const Frame& frame = {}, bool axis_across = false) {
    const Shape shape = placed(
        unite({cuboid({{-25, -25, 0}, {25, 25, foot}}), cylinder({0, 0, foot - 2}, {0, 0, top}, radius)}), frame);
    Box3d box;
    for (const double x : {-25.0, 25.0}) {
      for (const double y : {-25.0, 25.0}) {
        for (const double z : {0.0, top}) box.include(frame.to_world({x, y, z}));
      }
    }
    box = box.grown(6);
    proxy = proxy_of(shape, box, 1.37);
    partition.labels = cut_by(box, [&](Vec3d p) { return frame.to_local(p).z - foot; });
    const auto world = [&](double x, double z) { return frame.to_world({x, 0, z}); };
    const double area = std::numbers::pi * radius * radius;
    Candidate slab{.id = 0,
                   .column_like = false,
                   .volume_mm3 = 50 * 50 * foot,
                   .centroid_mm = world(0, 10),
                   .diameter_mm = 20,
                   .length_mm = foot,
                   .axis = Axis::straight(world(0, 0), world(0, foot)),
                   .reason = "thick"};
    Candidate post{.id = 1,
                   .column_like = true,
                   .volume_mm3 = area * (top - foot),
                   .centroid_mm = world(0, 50),
                   .diameter_mm = 16,
                   .length_mm = top - foot,
                   .axis = axis_across ? Axis::straight(world(-8, 50), world(8, 50))
                                       : Axis::straight(world(0, foot), world(0, top)),
                   .reason = "thin"};
    partition.candidates = {slab, post};
    Cut cut{.a = 1, .b = 0, .frame = frame_along(world(0, foot), world(0, 0) - world(0, 1)), .radius_mm = radius};
    partition.cuts = {cut};
  }
};

/// Coarser than the default, for speed.
constexpr int triangles = 3000;

/// The upright model at the default load, solved once.
const Verification& upright() {
  static const Verification result = [] {
    const CylinderOnBox model;
    return verify(model.proxy, model.partition, {.triangles = triangles});
  }();
  return result;
}

TEST(Verify, AnAxiallyLoadedCylinderIsAColumn) {
  const CylinderOnBox model;
  const Verification& v = upright();
  ASSERT_EQ(v.parts.parts.size(), 2U);
  EXPECT_EQ(v.part_of_candidate, (std::vector<int>{0, 1}));
  EXPECT_EQ(v.parts.parts[0].kind(), Kind::Bulk);
  const Part& post = v.parts.parts[1];
  EXPECT_EQ(post.kind(), Kind::Column) << post.reason();
  EXPECT_GT(post.stress().dominance, 3) << post.reason();
  EXPECT_THAT(post.reason(), HasSubstr("column"));
  EXPECT_TRUE(v.notes.empty()) << v.notes.front();
  EXPECT_LT(v.residual, 1e-9);
  EXPECT_LT(v.equilibrium, 1e-6);
  ASSERT_EQ(v.parts.cuts.size(), 1U);
  EXPECT_EQ(v.parts.cuts[0].a, 1);
  // Every part's box holds its surface, and the labels are the parts'.
  for (const Vec3f& vertex : model.proxy.surface.vertices) {
    const Vec3d p = to_double(vertex);
    const auto id = static_cast<std::size_t>(v.parts.labels.label(p));
    EXPECT_TRUE(v.parts.parts[id].bounds_mm().contains(p));
  }
  EXPECT_LT(v.parts.parts[1].region()({0, 0, 60}), 0);
  EXPECT_GT(v.parts.parts[1].region()({0, 0, 10}), 0);
}

TEST(Verify, StressOfAPressedPostIsForceOverArea) {
  // All of the load on the post's end face. Straight down it is F / A everywhere; slanting it bends the post as a
  // cantilever. Which of the two is reported (the one with the smaller dominance) depends on what little runs across.
  const CylinderOnBox model;
  VerifyParams params{.triangles = triangles};
  params.load_box_mm = Box3d{{-10, -10, 75}, {10, 10, 90}};
  const Verification verified = verify(model.proxy, model.partition, params);
  const Part& post = verified.parts.parts[1];
  const double area = std::numbers::pi * 64, length = 60;
  const double straight = 1000 / area;
  // Mean |M y / I| over a round section is 4 r / (3 pi) M / I; M falls linearly to the tip.
  const double slanting = 1000 * std::numbers::sqrt2 / 2;
  const double bending =
      slanting * length / 2 * 4 * 8 / (3 * std::numbers::pi) / (std::numbers::pi * 8 * 8 * 8 * 8 / 4);
  const double axial = post.stress().axial;
  EXPECT_LT(std::min(std::abs(axial - straight) / straight, std::abs(axial - bending) / bending), 0.05)
      << axial << " against " << straight << " or " << bending;
  // The worst case at a place, 30 mm below the end: the slanting one, which presses with F / sqrt 2 and bends.
  const auto traction = [&](double x) { return verified.traction_mpa({x, 0, 50}, {0, 0, 1}); };
  const double inertia = std::numbers::pi * 8 * 8 * 8 * 8 / 4;
  // On either side of the post; its tetrahedra are as coarse as its radius, so both sides together.
  EXPECT_NEAR(0.5 * (traction(6) + traction(-6)) / (slanting * 30 * 6 / inertia), 1, 0.1);
  // And all across: linear, not by steps as large as a tetrahedron. The load comes from x: that side is pulled.
  for (const double x : {-6.0, -4.5, -3.0, 3.0, 4.5, 6.0}) {
    const double beam = slanting * 30 * x / inertia - slanting / area;
    EXPECT_NEAR(traction(x) / std::abs(beam), 1, 0.1) << "at " << x;
  }
}

TEST(Verify, ACylinderWithoutLoadIsBulk) {
  const CylinderOnBox model;
  VerifyParams params{.triangles = triangles};
  params.load_box_mm = Box3d{{14, -30, 0}, {30, 30, 25}};  // the box's own top, beside the cylinder
  const Verification v = verify(model.proxy, model.partition, params);
  ASSERT_EQ(v.parts.parts.size(), 1U);
  EXPECT_EQ(v.parts.parts[0].kind(), Kind::Bulk);
  EXPECT_TRUE(v.parts.cuts.empty());
  EXPECT_EQ(v.part_of_candidate, (std::vector<int>{0, 0}));
  EXPECT_EQ(v.parts.labels.label({0, 0, 70}), 0);
  EXPECT_THAT(v.parts.parts[0].reason(), HasSubstr("2 touching bulk pieces"));
}

TEST(Verify, TheFemDecidesNotTheShape) {
  const CylinderOnBox model({}, true);  // the same body, but the post's axis is said to run across it
  const Verification v = verify(model.proxy, model.partition, {.triangles = triangles});
  EXPECT_EQ(v.parts.parts.size(), 1U);
  EXPECT_EQ(v.parts.parts[0].kind(), Kind::Bulk);
  VerifyParams paper{.triangles = triangles};
  paper.world_axes = true;  // x, y, z know nothing of the axis: z dominates
  EXPECT_EQ(verify(model.proxy, model.partition, paper).parts.parts.size(), 2U);
}

TEST(Verify, TheBuiltInCasesCanBeStated) {
  const CylinderOnBox model;
  Support foot;
  foot.where.lowest = EndShare{.share = 0.05};
  TotalForce force{.newton = 1000};
  force.where.seen_from = Direction{Direction::Of::Up, {}};
  TotalForce slanted = force;
  slanted.direction = {Direction::Of::Slanted, {}};
  VerifyParams params{.triangles = triangles};
  params.loads = {{"down", {foot}, {force}}, {"aslant", {foot}, {slanted}}};
  const Verification stated = verify(model.proxy, model.partition, params);
  const Verification& built_in = upright();
  ASSERT_EQ(stated.parts.parts.size(), built_in.parts.parts.size());
  for (std::size_t i = 0; i < stated.parts.parts.size(); ++i)
    EXPECT_EQ(stated.parts.parts[i].reason(), built_in.parts.parts[i].reason());
  EXPECT_EQ(stated.parts.parts[1].stress().axial, built_in.parts.parts[1].stress().axial);
  ASSERT_EQ(stated.selected.size(), 4U);
  EXPECT_EQ(stated.selected[3].load_case, "aslant");
  EXPECT_NEAR(stated.selected[3].area_mm2, 50 * 50, 30);  // the base hides nothing
}

TEST(Verify, StatedLoadsTakeThePlaceOfTheBuiltInOnes) {
  // Straight down on the end of the post: F / A along it. The built-in load_n does nothing then.
  const CylinderOnBox model;
  VerifyParams params{.load_n = 1e6, .triangles = triangles};
  Support foot;
  foot.where.half_spaces = {{{0, 0, 1}, {0, 0, 1}}};
  TotalForce force{.newton = 1000};
  force.where.half_spaces = {{{0, 0, 79}, {0, 0, -1}}};
  params.loads = {{"press", {foot}, {force}}};
  const double area = std::numbers::pi * 64;
  const Verification pressed = verify(model.proxy, model.partition, params);
  EXPECT_NEAR(pressed.parts.parts[1].stress().axial * area / 1000, 1, 0.05);
  EXPECT_LT(pressed.equilibrium, 1e-9);
  // The same as a pressure on the end alone.
  Pressure pressure{.mpa = 1000 / area};
  pressure.where.box_mm = Box3d{{-20, -20, 79.5}, {20, 20, 81}};
  params.loads[0].forces = {pressure};
  EXPECT_NEAR(verify(model.proxy, model.partition, params).parts.parts[1].stress().axial * area / 1000, 1, 0.08);
}

TEST(Verify, OwnWeightPressesWithHalfTheLengthOnAverage) {
  const CylinderOnBox model;
  VerifyParams params{.triangles = triangles};
  params.loads = load_preset("stand");
  const Verification v = verify(model.proxy, model.partition, params, material("AlSi10Mg"));
  const double mean = 2.67e-6 * 9.80665 * 60 / 2;  // MPa: N/mm3 times half the post's length
  ASSERT_EQ(v.parts.parts.size(), 2U);
  EXPECT_NEAR(v.parts.parts[1].stress().axial / mean, 1, 0.05);
  EXPECT_LT(v.equilibrium, 1e-9);
}

TEST(Verify, CasesMayStandOnDifferentSupports) {
  // Pulled apart: held at the foot in one case, slid and cornered in the other. Each is what it is alone.
  const CylinderOnBox model;
  Support foot, plane, corner;
  foot.where.lowest = plane.where.lowest = EndShare{.share = 0.05};
  plane.sliding = Direction{Direction::Of::Up, {}};
  corner.where.box_mm = Box3d{{15, 15, -2}, {30, 30, 5}};
  Selection end;
  end.highest = EndShare{.share = 0.05};
  const Direction up{Direction::Of::Up, {}}, down{Direction::Of::Down, {}};
  const LoadCase a{"pull", {foot}, {TotalForce{1000, up, end}}};
  const LoadCase b{"slide", {plane, corner}, {TotalForce{3000, down, end}}};
  const auto run = [&](std::vector<LoadCase> loads) {
    VerifyParams params{.triangles = 1500};
    params.loads = std::move(loads);
    return verify(model.proxy, model.partition, params);
  };
  const Verification both = run({a, b}), one = run({a}), other = run({b});
  const Vec3d at{0, 0, 60}, normal{0, 0, 1};
  EXPECT_NEAR(one.traction_mpa(at, normal), 1000 / (std::numbers::pi * 64), 0.5);
  EXPECT_EQ(both.traction_mpa(at, normal), other.traction_mpa(at, normal));  // the larger
  EXPECT_LT(both.equilibrium, 1e-9);
}

/// Loads are stated in the world; parts are decided in the frame in which the model stands.
TEST(Verify, LoadsAreFoundInTheFrameOfTheStance) {
  CylinderOnBox model;
  VerifyParams params{.triangles = 1500};
  Support foot;
  foot.where.half_spaces = {{{0, 0, 1}, {0, 0, 1}}};
  TotalForce force{.newton = 1000, .direction = {Direction::Of::World, {0.2, 0, -1}}};
  force.where.half_spaces = {{{0, 0, 79}, {0, 0, -1}}, {{1, 0, 0}, {1, 0, 0}}};
  params.loads = {{"press", {foot}, {force}}};
  const Verification standing = verify(model.proxy, model.partition, params);

  VerifyParams askew = params;
  askew.up = {1, 2, 3};
  askew.azimuth_deg = 33;
  const Frame stand = stance(askew);
  const auto to_world = [&](Vec3d v) { return v.x * stand.x + v.y * stand.y + v.z * stand.z; };
  for (Selection* where : {&foot.where, &force.where})
    for (HalfSpace& half : where->half_spaces) half = {to_world(half.point_mm), to_world(half.normal)};
  force.direction.vector = to_world(force.direction.vector);
  askew.loads = {{"press", {foot}, {force}}};
  model.proxy.frame = stand;
  const Verification lying = verify(model.proxy, model.partition, in_stance(askew));
  ASSERT_EQ(lying.parts.parts.size(), standing.parts.parts.size());
  for (std::size_t i = 0; i < lying.parts.parts.size(); ++i) {
    const double axial = standing.parts.parts[i].stress().axial;
    EXPECT_NEAR(lying.parts.parts[i].stress().axial, axial, 1e-9 * axial);
  }
  // A message speaks of the world.
  askew.loads[0].forces = {Pressure{.mpa = 1, .where = {.box_mm = Box3d{{500, 500, 500}, {501, 501, 501}}}}};
  try {
    static_cast<void>(verify(model.proxy, model.partition, in_stance(askew)));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::BadRecipe);
    EXPECT_THAT(error.what(), HasSubstr("load case 'press' selects nothing: 0 mm2"));
  }
}

TEST(Verify, ALabelIsACandidate) {
  const CylinderOnBox model;
  VerifyParams params{.triangles = 1500};
  Support foot;
  foot.where.lowest = EndShare{.share = 0.05};
  Pressure pressure{.mpa = 1};
  pressure.where.label = 1;  // the post: its side and its end
  params.loads = {{"squeeze", {foot}, {pressure}}};
  const Verification v = verify(model.proxy, model.partition, params);
  EXPECT_NEAR(v.selected.at(1).area_mm2 / (2 * std::numbers::pi * 8 * 60 + std::numbers::pi * 64), 1, 0.04);
}

TEST(Verify, TenTimesTheForceDecidesTheSame) {
  const CylinderOnBox model;
  VerifyParams params{.triangles = triangles};
  const Verification& one = upright();
  params.load_n *= 10;
  const Verification ten = verify(model.proxy, model.partition, params);
  ASSERT_EQ(one.parts.parts.size(), ten.parts.parts.size());
  for (std::size_t i = 0; i < one.parts.parts.size(); ++i) {
    const PartStress &a = one.parts.parts[i].stress(), &b = ten.parts.parts[i].stress();
    EXPECT_EQ(one.parts.parts[i].kind(), ten.parts.parts[i].kind());
    EXPECT_NEAR(b.axial, 10 * a.axial, 1e-6 * b.axial);
    EXPECT_NEAR(b.dominance, a.dominance, 1e-6 * a.dominance);
  }
}

TEST(Verify, ATurnedModelWithATurnedLoadDecidesTheSame) {
  const PartStress stress = upright().parts.parts[1].stress();
  VerifyParams params{.triangles = triangles};
  // x -> y -> z -> x, the turn that load_directions() follows by itself.
  const Frame turned{.origin = {3, -7, 11}, .x = {0, 1, 0}, .y = {0, 0, 1}, .z = {1, 0, 0}};
  const CylinderOnBox lying(turned);
  params.up = {1, 0, 0};
  const Verification v = verify(lying.proxy, lying.partition, params);
  ASSERT_EQ(v.parts.parts.size(), 2U);
  EXPECT_EQ(v.parts.parts[1].kind(), Kind::Column);
  // The meshes differ, so the means do a little; what runs across is next to nothing and differs more.
  EXPECT_NEAR(v.parts.parts[1].stress().axial, stress.axial, 0.08 * stress.axial);
  EXPECT_GT(v.parts.parts[1].stress().dominance, 3);
}

TEST(Verify, SameBitsOnOneAndTwoThreads) {
  const CylinderOnBox model;
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return verify(model.proxy, model.partition, {.triangles = 1000});
  };
  const Verification one = run(1), two = run(2);
  ASSERT_EQ(one.parts.parts.size(), two.parts.parts.size());
  for (std::size_t i = 0; i < one.parts.parts.size(); ++i) {
    const Part &a = one.parts.parts[i], &b = two.parts.parts[i];
    EXPECT_EQ(a.stress().axial, b.stress().axial);
    EXPECT_EQ(a.stress().von_mises, b.stress().von_mises);
    EXPECT_EQ(a.reason(), b.reason());
    EXPECT_EQ(a.bounds_mm().min, b.bounds_mm().min);
    EXPECT_EQ(a.axis().mean(), b.axis().mean());
  }
  EXPECT_EQ(one.residual, two.residual);
  EXPECT_EQ(one.tets, two.tets);
}

TEST(Verify, BadNumbersAreRefusedByName) {
  const CylinderOnBox model;
  const auto refused = [&](const VerifyParams& params, const char* key) {
    try {
      static_cast<void>(verify(model.proxy, model.partition, params));
      ADD_FAILURE() << key << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::BadRecipe);
      EXPECT_THAT(error.what(), HasSubstr(key));
    }
  };
  refused({.dominance = 1}, "dominance");
  refused({.dominance = NAN}, "dominance");
  refused({.unloaded = 1}, "unloaded");
  refused({.load_n = 0}, "load_n");
  refused({.azimuth_deg = INFINITY}, "azimuth_deg");
  refused({.support_share = 0.5}, "support_share");
  refused({.up = {0, 0, 0}}, "up");
  refused({.triangles = 10}, "triangles");
  refused({.triangles = 1000, .load_box_mm = Box3d{{100, 100, 100}, {110, 110, 110}}}, "load_box_mm");
}

TEST(Verify, CancelIsHeard) {
  const CylinderOnBox model;
  const Context context;
  context.cancel();
  try {
    static_cast<void>(verify(model.proxy, model.partition, {}, {}, context));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::Cancelled);
  }
}

TEST(WholeBody, LiesAlongItsLongestAxis) {
  const Vec3d along = normalized({1, 2, 3});
  const Proxy proxy = proxy_of(capsule(-30 * along, 30 * along, 6), Box3d{{-30, -35, -40}, {30, 35, 40}}, 1);
  const Parts parts = whole_body(proxy.surface, Kind::Column);
  ASSERT_EQ(parts.parts.size(), 1U);
  const Part& part = parts.parts[0];
  EXPECT_EQ(part.kind(), Kind::Column);
  EXPECT_GT(std::abs(dot(part.axis().mean(), along)), 0.9999);
  EXPECT_NEAR(part.axis().length_mm(), 72, 0.5);
  EXPECT_LT(norm(part.centroid_mm()), 0.1);
  const double volume = std::numbers::pi * 36 * (60 + 8);
  EXPECT_NEAR(part.volume_mm3(), volume, 0.02 * volume);
  EXPECT_NEAR(part.diameter_mm(), std::sqrt(4 * volume / (std::numbers::pi * 72)), 0.2);
  EXPECT_LT(part.region()({100, 100, 100}), 0);  // the whole of space
}

TEST(Load, FallsOnWhatIsSeenFirst) {
  // A table: the plate hides the floor block from above but for the block's rim.
  const TetMesh mesh =
      tetrahedralize(testing::joined(testing::icosphere(10, 3, {0, 0, 30}), testing::icosphere(20, 3, {0, 0, -20})));
  const Vec3d up{0, 0, 1};
  const Footprint footprint = seen_from_above(mesh, up, [](Vec3d p) { return p.z > -36; });
  double above = 0;
  for (const auto& point : footprint.points) {
    const Vec3d p = footprint.at(point);
    EXPECT_GT(p.z, -20.5);  // the lower halves are not seen
    if (p.z > 10) {
      ++above;
    } else {
      EXPECT_GT(std::hypot(p.x, p.y), 9.7);  // nor is what lies in the small ball's shadow
    }
  }
  EXPECT_NEAR(above / static_cast<double>(footprint.points.size()), 0.25, 0.01);  // by projected area

  const auto shares = nodal_shares(mesh, footprint, 0.1, [](Vec3d) { return true; });
  const auto small = nodal_shares(mesh, footprint, 0.1, [](Vec3d p) { return p.z > 10; });
  double sum = 0, small_sum = 0;
  Vec3d centre{};
  for (std::size_t node = 0; node < shares.size(); ++node) {
    sum += shares[node];
    small_sum += small[node];
    centre = centre + shares[node] * mesh.nodes[node];
    if (mesh.nodes[node].z < 10) {
      EXPECT_EQ(small[node], 0);
    }
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_NEAR(small_sum, above / static_cast<double>(footprint.points.size()), 1e-12);
  EXPECT_LT(std::hypot(centre.x, centre.y), 0.1);
}

TEST(Load, DirectionsFollowUpAndAzimuth) {
  const double s = std::numbers::sqrt2 / 2;
  const auto near = [](Vec3d a, Vec3d b) { EXPECT_LT(norm(a - b), 1e-12); };
  near(load_directions({0, 0, 1}, 0)[0], {0, 0, -1});
  near(load_directions({0, 0, 1}, 0)[1], {-s, 0, -s});
  near(load_directions({0, 0, 1}, 90)[1], {0, -s, -s});
  near(load_directions({1, 0, 0}, 0)[1], {-s, -s, 0});
  near(load_directions({0, 1, 0}, 0)[1], {0, -s, -s});
  near(load_directions({0, 0, -1}, 90)[1], {0, s, s});
}

TEST(Locator, GivesQuadraticFieldsBackExactly) {
  const TetMesh mesh = tetrahedralize(testing::icosphere(10, 3));
  const auto field = [](Vec3d p) {
    return Vec3d{p.x * p.x - p.y * p.z, 3 + p.y - p.x * p.z, p.z * p.z + 2 * p.x * p.y};
  };
  std::vector<Vec3d> nodal;
  for (const Vec3d& p : mesh.nodes) nodal.push_back(field(p));
  const fem::Locator locator(mesh);
  Random random(1, "locator");
  const auto at = [&] { return 18 * random.uniform() - 9; };
  int inside = 0;
  while (inside < 500) {
    const Vec3d p{at(), at(), at()};
    if (norm(p) > 9) continue;
    ++inside;
    EXPECT_LT(norm(locator.interpolate(nodal, p) - field(p)), 1e-9);
  }
  // Outside, the nearest of the surface answers.
  const Vec3d out = normalized({1, -2, 0.5});
  EXPECT_LT(norm(locator.interpolate(nodal, 10.2 * out) - field(9.95 * out)), 4);
}

TEST(MeanStress, OfAUniformStateIsThatState) {
  const TetMesh mesh = tetrahedralize(testing::icosphere(10, 2));
  std::vector<std::uint32_t> all(mesh.tets.size());
  for (std::uint32_t t = 0; t < all.size(); ++t) all[t] = t;
  // Along z: 10; across: principal -3 and 1, at 30 degrees from x.
  const double c = std::cos(std::numbers::pi / 6), s = std::sin(std::numbers::pi / 6);
  const fem::Stress state{-3 * c * c + s * s, -3 * s * s + c * c, 10, -4 * c * s, 0, 0};
  const MeanStress mean =
      mean_in_axis(mesh, std::vector(mesh.tets.size(), state), all, Axis::straight({0, 0, 0}, {0, 0, 1}));
  EXPECT_NEAR(mean.axial, 10, 1e-12);
  EXPECT_NEAR(mean.transverse[0], 3, 0.05);  // directions are 11 degrees apart
  EXPECT_NEAR(mean.transverse[1], 1, 0.05);
  EXPECT_NEAR(mean.von_mises, std::sqrt(0.5 * (13 * 13 + 4 * 4 + 9 * 9)), 1e-9);
  EXPECT_NEAR(mean.volume_mm3, volume_mm3(mesh), 1e-9);
  const MeanStress world = mean_in_world(mesh, std::vector(mesh.tets.size(), state), all);
  EXPECT_NEAR(world.axial, 10, 1e-12);
  EXPECT_NEAR(world.transverse[0], 2, 1e-12);
  EXPECT_NEAR(world.transverse[1], 0, 1e-12);
}

TEST(MeanStress, DirectionsAcrossTurnWithABentAxis) {
  // A ring under pure hoop stress: all of it is along the circular axis, nothing across.
  const TetMesh mesh = tetrahedralize(testing::torus_mesh(20, 4, 48, 16));
  std::vector<Vec3d> circle;
  for (int k = 0; k < 120; ++k) circle.push_back(20 * Vec3d{std::cos(k * 0.05), std::sin(k * 0.05), 0});
  std::vector<fem::Stress> stress;
  std::vector<std::uint32_t> half;
  for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
    Vec3d p{};
    for (std::size_t k = 0; k < 4; ++k) p = p + 0.25 * mesh.nodes[mesh.tets[t][k]];
    const Vec3d h = normalized({-p.y, p.x, 0});
    stress.push_back({5 * h.x * h.x, 5 * h.y * h.y, 0, 5 * h.x * h.y, 0, 0});
    if (p.y > 0) half.push_back(t);
  }
  const MeanStress mean = mean_in_axis(mesh, stress, half, Axis::along(circle));
  EXPECT_NEAR(mean.axial, 5, 0.05);
  EXPECT_LT(mean.transverse[0], 0.05);
  EXPECT_GT(mean.dominance(), 100);
}

}  // namespace
}  // namespace fibrolite
