// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/loads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "applied_load.h"
#include "elasticity.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/tetrahedralize.h"
#include "models.h"
#include "refusal.h"
#include "solve_cases.h"

namespace fibrolite {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::refusal;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A block of bricks with a corner in the origin, six tetrahedra each.
TetMesh block(int n, Vec3d size) {
  std::vector<Vec3d> nodes;
  const auto id = [&](int x, int y, int z) { return static_cast<std::uint32_t>((x * (n + 1) + y) * (n + 1) + z); };
  for (int x = 0; x <= n; ++x)
    for (int y = 0; y <= n; ++y)
      for (int z = 0; z <= n; ++z) nodes.push_back({size.x * x / n, size.y * y / n, size.z * z / n});
  constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  std::vector<std::array<std::uint32_t, 4>> tets;
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z)
        for (std::size_t k = 0; k < 6; ++k) {
          int at[3] = {x, y, z};
          std::array<std::uint32_t, 4> tet{id(x, y, z), 0, 0, 0};
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[orders[k][step]];
            tet[step + 1] = id(at[0], at[1], at[2]);
          }
          if (k >= 3) std::swap(tet[2], tet[3]);
          tets.push_back(tet);
        }
  return ten_node(std::move(nodes), tets);
}

constexpr Vec3d size{20, 30, 40};
const TetMesh& box_mesh() {
  static const TetMesh mesh = block(4, size);
  return mesh;
}

Direction along(Vec3d v) { return {Direction::Of::World, v}; }
const Direction up{Direction::Of::Up, {}}, down{Direction::Of::Down, {}};

Selection behind(Vec3d point, Vec3d normal) {
  Selection where;
  where.half_spaces.push_back({point, normal});
  return where;
}
Selection in_box(Vec3d least, Vec3d most) {
  Selection where;
  where.box_mm = Box3d{least, most};
  return where;
}
Selection lowest(double share, Direction direction = up) {
  Selection where;
  where.lowest = EndShare{share, direction};
  return where;
}
Selection seen_from_above_alone() {
  Selection where;
  where.seen_from = up;
  return where;
}
const Selection top_face = behind({0, 0, 40}, {0, 0, -1});

LoadCase standing(Force force) { return {"test", {Support{lowest(0.05)}}, {std::move(force)}}; }
AppliedLoad applied(const LoadCase& load, const LoadSetting& setting = {}) {
  check_loads({load});
  return {{load}, 0, box_mesh(), setting};
}
std::vector<Vec3d> forces(const LoadCase& load, const LoadSetting& setting = {}) {
  return applied(load, setting).forces_n(box_mesh(), [](Vec3d, Vec3d) { return true; });
}
Vec3d sum(const std::vector<Vec3d>& forces) {
  Vec3d total{};
  for (const Vec3d& f : forces) total = total + f;
  return total;
}
/// About the origin, N mm.
Vec3d moment(const std::vector<Vec3d>& forces) {
  Vec3d total{};
  for (std::size_t i = 0; i < forces.size(); ++i) total = total + cross(box_mesh().nodes[i], forces[i]);
  return total;
}
std::size_t held_nodes(const AppliedLoad& load) {
  std::size_t count = 0;
  for (const auto& axes : load.held(box_mesh())) count += axes[0] || axes[1] || axes[2] ? 1 : 0;
  return count;
}

TEST(Loads, PressureOnAFaceIsPressureTimesAreaAgainstTheNormal) {
  const LoadCase load = standing(Pressure{.mpa = 0.7, .where = top_face});
  const auto f = forces(load);
  const double expected = 0.7 * 20 * 30;
  EXPECT_NEAR(sum(f).z / -expected, 1, 1e-9);
  EXPECT_LT(std::hypot(sum(f).x, sum(f).y), 1e-9 * expected);
  // It acts in the middle of the face.
  EXPECT_LT(norm(moment(f) - cross({10, 15, 40}, {0, 0, -expected})), 1e-9 * expected * 40);
  const AppliedLoad applied_load = applied(load);
  ASSERT_EQ(applied_load.selected().size(), 2U);
  EXPECT_NEAR(applied_load.selected()[1].area_mm2, 600, 1e-9);
  EXPECT_EQ(applied_load.selected()[1].faces, 32);
  EXPECT_EQ(applied_load.selected()[1].key, "loads[0].forces[0].where");
  EXPECT_NEAR(applied_load.magnitude_n(), expected, 1e-9);
}

/// A box that cuts through triangles: area, force and moment are those of the rectangle, not of the triangles.
TEST(Loads, ABoxCutsTrianglesExactly) {
  const Selection patch = in_box({3.1, 4.7, 39}, {9.4, 11.9, 41});
  const auto f = forces(standing(Pressure{.mpa = 2, .where = patch}));
  const double area = 6.3 * 7.2;
  EXPECT_NEAR(sum(f).z, -2 * area, 1e-9 * area);
  EXPECT_LT(norm(moment(f) - cross({6.25, 8.3, 40}, {0, 0, -2 * area})), 1e-9 * area * 40);
}

TEST(Loads, AllOverPressureIsInBalance) {
  const auto f = forces(standing(Pressure{.mpa = 3, .where = in_box({-1, -1, -1}, {50, 50, 50})}));
  EXPECT_LT(norm(sum(f)), 1e-9);
  EXPECT_LT(norm(moment(f)), 1e-7);
}

TEST(Loads, ATotalForceIsWhatWasAskedFor) {
  const Vec3d direction{1, -2, 0.5};
  const Vec3d expected = 110 * normalized(direction);
  for (const Selection& where : {top_face, in_box({2, 3, 30}, {5, 4, 41}), lowest(0.3, along({1, 1, 0}))}) {
    const auto f = forces(standing(TotalForce{110, along(direction), where}));
    EXPECT_LT(norm(sum(f) - expected), 1e-9 * 110);
  }
  Selection seen = seen_from_above_alone();
  EXPECT_LT(norm(sum(forces(standing(TotalForce{110, along(direction), seen}))) - expected), 1e-9 * 110);
  // By projected area: in the middle of the top.
  const auto f = forces(standing(TotalForce{110, down, seen}));
  EXPECT_LT(norm(moment(f) - cross({10, 15, 40}, {0, 0, -110})), 1e-3 * 110 * 40);
  seen.box_mm = Box3d{{0, 0, 30}, {10, 30, 50}};
  EXPECT_NEAR(applied(standing(TotalForce{110, down, seen})).selected()[1].area_mm2, 300, 3);
}

TEST(Loads, WordsFollowTheStance) {
  const LoadSetting lying{.up = {1, 0, 0}, .azimuth_deg = 90};
  const double s = std::numbers::sqrt2 / 2;
  Selection seen = seen_from_above_alone();
  EXPECT_LT(norm(sum(forces(standing(TotalForce{5, down, seen}), lying)) - Vec3d{-5, 0, 0}), 1e-9);
  EXPECT_LT(
      norm(sum(forces(standing(TotalForce{5, {Direction::Of::Slanted, {}}, seen}), lying)) - 5 * Vec3d{-s, 0, -s}),
      1e-9);
}

TEST(Loads, GravityIsTheWeight) {
  LoadSetting steel;
  steel.material.density_g_cm3 = 7.85;
  // 24 cm3 of 7.85 g/cm3: 188.4 g, and 9.80665 N for 1000 g.
  const double weight = 24 * 7.85 * 9.80665 / 1000;
  const auto f = forces(standing(Gravity{}), steel);
  EXPECT_LT(norm(sum(f) - Vec3d{0, 0, -weight}), 1e-9 * weight);
  EXPECT_LT(norm(moment(f) - cross({10, 15, 20}, {0, 0, -weight})), 1e-9 * weight * 40);
  EXPECT_NEAR(applied(standing(Gravity{}), steel).magnitude_n(), weight, 1e-9 * weight);
  EXPECT_NEAR(weight_n_per_mm3(steel.material) * 1e6, 7.85 * 9.80665, 1e-9);  // a litre
}

TEST(Loads, ABoxThatStandsIsHeldByItsWeight) {
  const AppliedLoad load{load_preset("stand"), 0, box_mesh(), {}};
  std::vector<fem::Fixed> fixed;
  const auto held = load.held(box_mesh());
  for (std::uint32_t node = 0; node < held.size(); ++node)
    for (int axis = 0; axis < 3; ++axis)
      if (held[node][static_cast<std::size_t>(axis)]) fixed.push_back({node, axis});
  const auto f = load.forces_n(box_mesh(), [](Vec3d, Vec3d) { return true; });
  const auto solution = fem::solve(box_mesh(), {}, fixed, {{f, {}}}).front();
  const double weight = 24 * 1.24 * 9.80665 / 1000;  // PLA
  Vec3d reaction{};
  for (const Vec3d& r : solution.reaction_n) reaction = reaction + r;
  EXPECT_LT(norm(reaction - Vec3d{0, 0, weight}), 1e-7 * weight);
}

TEST(Loads, TheLowestShareIsTheLowestShare) {
  // Below 2 mm of 40: the base, and a strip of 2 mm all around. Nodes lie at multiples of 5 mm in z: the base's alone.
  const AppliedLoad five = applied(standing(Gravity{}));
  EXPECT_NEAR(five.selected()[0].area_mm2, 20 * 30 + 2 * (20 + 30) * 2, 1e-9);
  EXPECT_EQ(held_nodes(five), 81U);
  for (std::size_t node = 0; node < box_mesh().nodes.size(); ++node)
    EXPECT_EQ(five.held(box_mesh())[node][0], box_mesh().nodes[node].z <= 2);
  LoadCase load = standing(Gravity{});
  load.supports[0].where = lowest(0.25);
  EXPECT_EQ(held_nodes(applied(load)), 3 * 81U);
  load.supports[0].where = {};
  load.supports[0].where.highest = EndShare{0.25, along({0, -3, 0})};
  EXPECT_NEAR(applied(load).selected()[0].area_mm2, 20 * 40 + 2 * 7.5 * (20 + 40), 1e-9);
}

TEST(Loads, SelectorsTogetherSelectWhatAllOfThemDo) {
  Selection where = top_face;
  where.half_spaces.push_back({{5, 0, 0}, {1, 0, 0}});
  where.highest = EndShare{0.5, along({0, 1, 0})};
  EXPECT_NEAR(applied(standing(Pressure{1, where})).selected()[1].area_mm2, 5 * 15, 1e-9);
}

TEST(Loads, ToleranceReachesAlongTheSurfacesNormalAlone) {
  LoadSetting setting;
  setting.tolerance_mm = 0.5;
  // Stated 0.3 mm above the face, it still means it; its sides stay where they are.
  const Selection patch = in_box({3, 4, 40.3}, {9, 11, 45});
  EXPECT_NEAR(applied(standing(Pressure{1, patch}), setting).selected()[1].area_mm2, 42, 1e-9);
  EXPECT_THAT(refusal([&] { static_cast<void>(applied(standing(Pressure{1, patch}))); }), HasSubstr("selects nothing"));
}

TEST(Loads, ASupportSmallerThanATriangleHoldsTheTrianglesItTouches) {
  LoadCase load = standing(Gravity{});
  load.supports[0].where = in_box({11, 12, -1}, {12, 13, 1});
  const AppliedLoad held = applied(load);
  EXPECT_NEAR(held.selected()[0].area_mm2, 1, 1e-9);
  EXPECT_GE(held_nodes(held), 6U);
  EXPECT_LE(held_nodes(held), 9U);
}

/// The top of the box, the half with x below 10 in red; its sides are left out.
Mesh painted_top() {
  Mesh mesh;
  mesh.vertices = {{0, 0, 40}, {10, 0, 40}, {20, 0, 40}, {0, 30, 40}, {10, 30, 40}, {20, 30, 40}};
  mesh.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
  const Rgb red{255, 0, 0}, gray{128, 128, 128};
  mesh.triangle_colors = {red, red, gray, gray};
  return mesh;
}

TEST(Loads, PaintSelectsTheTrianglesOfItsColour) {
  Selection red;
  red.painted = Paint{{255, 0, 0}, {}};
  const std::vector<LoadCase> asked{standing(Pressure{2, red})};
  const std::vector<LoadCase> found = with_paint(asked, painted_top());
  EXPECT_NEAR(norm(sum(forces(found[0])) - Vec3d{0, 0, -2 * 10 * 30.0}), 0, 1e-6);
  // Seen from another frame it is the same surface.
  const Frame frame{{3, 4, 5}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  const Shape& world = std::get<Pressure>(found[0].forces[0]).where.painted->distance;
  const Shape local = std::get<Pressure>(in_frame(frame, found)[0].forces[0]).where.painted->distance;
  for (const Vec3d p : {Vec3d{5, 5, 40}, Vec3d{15, 7, 38}, Vec3d{-4, 2, 60}})
    EXPECT_NEAR(world(p), local(frame.to_local(p)), 1e-4);
  // Without the model there is nothing, and a colour that is not there is named with those that are.
  EXPECT_THAT(refusal([&] { static_cast<void>(forces(asked[0])); }), HasSubstr("selects nothing"));
  red.painted->color = {0, 0, 255};
  EXPECT_THAT(refusal([&] {
                static_cast<void>(with_paint({standing(Pressure{2, red})}, painted_top()));
              }),
              AllOf(HasSubstr("#0000ff"), HasSubstr("'test'"), HasSubstr("#808080 #ff0000")));
  EXPECT_THAT(refusal([&] {
                static_cast<void>(with_paint({standing(Pressure{2, red})}, Mesh{}));
              }),
              HasSubstr("no colours"));
}

TEST(Loads, WhatSelectsNothingSaysHowLittle) {
  const Selection nowhere = in_box({100, 100, 100}, {110, 110, 110});
  const auto message = [&](const LoadCase& load) { return refusal([&] { static_cast<void>(applied(load)); }); };
  const auto all = AllOf(HasSubstr("load case 'test' selects nothing: 0 mm2 on 0 of 192 faces, of 5200 mm2"),
                         HasSubstr("from (0, 0, 0) to (20, 30, 40) mm"));
  EXPECT_THAT(message(standing(Pressure{1, nowhere})), AllOf(all, HasSubstr("loads[0].forces[0].where")));
  EXPECT_THAT(message(standing(TotalForce{1, down, nowhere})), AllOf(all, HasSubstr("loads[0].forces[0].where")));
  LoadCase load = standing(Gravity{});
  load.supports[0].where = nowhere;
  EXPECT_THAT(message(load), AllOf(all, HasSubstr("loads[0].supports[0].where")));
  Selection unseen = seen_from_above_alone();
  unseen.lowest = EndShare{0.04, up};  // seen, but held
  EXPECT_THAT(message(standing(TotalForce{1, down, unseen})), HasSubstr("selects nothing: 0 mm2"));
  unseen = {};
  unseen.label = 1;  // a body of one piece has label 0 alone
  EXPECT_THAT(message(standing(Pressure{1, unseen})), AllOf(HasSubstr("wants label 1"), HasSubstr("has 1")));
}

TEST(Loads, WhatLeavesTheBodyFreeSaysSo) {
  LoadCase load = standing(Gravity{});
  load.supports[0].sliding = up;
  EXPECT_THAT(refusal([&] { static_cast<void>(applied(load)); }),
              AllOf(HasSubstr("load case 'test' leaves the body free to move"), HasSubstr("loads[0].supports")));
  // Three planes that cross hold it.
  load.supports.push_back({lowest(0.05, along({1, 0, 0})), along({2, 0, 0})});
  EXPECT_THAT(refusal([&] { static_cast<void>(applied(load)); }), HasSubstr("free to move"));
  load.supports.push_back({lowest(0.05, along({0, 1, 0})), along({0, -1, 0})});
  const auto held = applied(load).held(box_mesh());
  for (std::size_t node = 0; node < held.size(); ++node) {
    const Vec3d p = box_mesh().nodes[node];
    EXPECT_EQ(held[node], (std::array{p.x <= 1, p.y <= 1.5, p.z <= 2}));
  }
  load.supports[2].sliding = along({1, 2, 0});
  EXPECT_THAT(refusal([&] { static_cast<void>(applied(load)); }), HasSubstr("supports[2].sliding"));
}

/// A block on a wedge: held across planes that lie askew to its mesh, it is compressed as if it stood on a table.
TEST(Loads, SupportsSlideOnPlanesThatLieAskew) {
  const Frame frame = frame_along({1, 2, 3}, {2, -1, 4});
  const auto world = [&](Vec3d v) { return v.x * frame.x + v.y * frame.y + v.z * frame.z; };
  TetMesh mesh = box_mesh();
  for (Vec3d& p : mesh.nodes) p = frame.to_world(p);
  LoadCase load{"askew", {}, {}};
  for (const Vec3d axis : {Vec3d{0, 0, 1}, Vec3d{1, 0, 0}, Vec3d{0, 1, 0}})
    load.supports.push_back({lowest(0.01, along(world(axis))), along(world(axis))});
  Pressure pressure{.mpa = 5};
  pressure.where.highest = EndShare{1e-6, along(frame.z)};
  load.forces = {pressure};
  const AppliedLoad found{{load}, 0, mesh, {}};
  HeldCase held{found.held_in(), {}, {found.forces_n(mesh, [](Vec3d, Vec3d) { return true; }), {}}};
  const auto axes = found.held(mesh);
  for (std::uint32_t node = 0; node < axes.size(); ++node)
    for (int axis = 0; axis < 3; ++axis)
      if (axes[node][static_cast<std::size_t>(axis)]) held.fixed.push_back({node, axis});
  const Material pla;
  const auto solution = solve_cases(mesh, pla, {held}, {}).front();
  // Uniform: -5 MPa along the block's height, free to widen.
  for (const fem::Stress& s : solution.centroid_stress) {
    EXPECT_NEAR(fem::normal_stress(s, frame.z), -5, 1e-4);
    EXPECT_NEAR(von_mises(s), 5, 1e-4);
  }
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    const Vec3d p = box_mesh().nodes[node];
    const Vec3d u = 5 / pla.young_mpa * Vec3d{pla.poisson * p.x, pla.poisson * p.y, -p.z};
    EXPECT_LT(norm(solution.displacement_mm[node] - world(u)), 1e-5);
  }
  EXPECT_LT(norm(solution.imbalance_n), 1e-6);
}

TEST(Loads, BadCasesAreRefusedBeforeThereIsABody) {
  const auto message = [](const std::vector<LoadCase>& cases) { return refusal([&] { check_loads(cases); }); };
  const LoadCase good = standing(Gravity{});
  EXPECT_EQ(message({good}), "");
  EXPECT_EQ(message({}), "");
  LoadCase bad = good;
  bad.supports.clear();
  EXPECT_THAT(message({bad}), AllOf(HasSubstr("load case 'test' has no support"), HasSubstr("loads[0].supports")));
  bad = good;
  bad.forces.clear();
  EXPECT_THAT(message({bad}), AllOf(HasSubstr("load case 'test' has no force"), HasSubstr("loads[0].forces")));
  EXPECT_THAT(message({good, good}), AllOf(HasSubstr("twice"), HasSubstr("loads[1].name")));
  bad = good;
  bad.name.clear();
  EXPECT_THAT(message({bad}), HasSubstr("no name"));
  const auto where = [&](const Selection& s) { return message({standing(Pressure{1, s})}); };
  EXPECT_THAT(where({}), HasSubstr("selects by nothing"));
  EXPECT_THAT(where(in_box({1, 0, 0}, {0, 1, 1})), HasSubstr("box_mm"));
  EXPECT_THAT(where(behind({0, 0, 0}, {0, 0, 0})), HasSubstr("half_space"));
  EXPECT_THAT(where(lowest(0)), HasSubstr("lowest.share"));
  EXPECT_THAT(where(lowest(1.5)), HasSubstr("share of 1.5"));
  EXPECT_THAT(where(lowest(0.5, along({}))), HasSubstr("lowest.along"));
  EXPECT_THAT(where(lowest(NAN)), HasSubstr("share"));
  EXPECT_THAT(where(seen_from_above_alone()), HasSubstr("seen_from"));
  EXPECT_THAT(message({standing(TotalForce{-1, down, top_face})}), HasSubstr("force_n"));
  EXPECT_THAT(message({standing(TotalForce{infinity, down, top_face})}), HasSubstr("force_n"));
  EXPECT_THAT(message({standing(TotalForce{1, along({}), top_face})}), HasSubstr("direction"));
  EXPECT_THAT(message({standing(Pressure{0, top_face})}), HasSubstr("pressure_mpa"));
  EXPECT_THAT(message({standing(Gravity{along({NAN, 0, 0})})}), HasSubstr("gravity"));
  bad = good;
  bad.supports[0].where = seen_from_above_alone();
  EXPECT_THAT(message({bad}), HasSubstr("seen_from is for forces"));
}

TEST(Loads, OneCaseAtLeastDecides) {
  std::vector<LoadCase> cases = load_preset("stand");
  EXPECT_NO_THROW(check_loads(cases));
  cases.front().unplanned = true;
  EXPECT_THROW(check_loads(cases), Error);
}

TEST(Loads, PresetsAreWhatTheirNamesSay) {
  EXPECT_EQ(load_preset_names(), (std::vector<std::string>{"paper-verify", "paper-compare", "stand"}));
  EXPECT_TRUE(load_preset("paper-verify").empty());
  EXPECT_EQ(load_preset("stand").size(), 1U);
  const auto f = forces(load_preset("paper-compare").front());
  EXPECT_LT(norm(sum(f) - Vec3d{0, 0, -110}), 1e-7);
  EXPECT_THAT(refusal([] { static_cast<void>(load_preset("stnd")); }), HasSubstr("did you mean stand?"));
}

/// A box stays a box in a frame that lies askew to it, and so do the forces.
TEST(Loads, InAnotherFrameTheyAreTheSame) {
  const Frame frame = frame_along({3, -2, 7}, {1, 2, 3});
  TetMesh mesh = box_mesh();
  for (Vec3d& p : mesh.nodes) p = frame.to_local(p);
  LoadCase load = standing(Pressure{2, in_box({3, 4, 39}, {9, 11, 41})});
  load.supports[0].where = lowest(0.05, along({0, 0, 1}));
  load.forces.push_back(TotalForce{7, along({1, 0, 0}), top_face});
  load.forces.push_back(Gravity{along({0, 0, -1})});
  const AppliedLoad turned{in_frame(frame, {load}), 0, mesh, {}};
  const auto f = forces(load), g = turned.forces_n(mesh, [](Vec3d, Vec3d) { return true; });
  for (std::size_t node = 0; node < f.size(); ++node)
    EXPECT_LT(norm(g[node].x * frame.x + g[node].y * frame.y + g[node].z * frame.z - f[node]), 1e-9);
  EXPECT_EQ(turned.held(mesh), applied(load).held(box_mesh()));
}

}  // namespace
}  // namespace fibrolite
