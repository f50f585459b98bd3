// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/joint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/ops/assemble.h"
#include "fibrolite/ops/infill/mfs.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/pieces.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "part_maker.h"

namespace fibrolite {
namespace {

using std::numbers::pi;

constexpr double radius = 10, shell = 1, pixel = 0.1;

const Shape body = cylinder({0, 0, -30}, {0, 0, 30}, radius);

Interface round_interface() {
  Interface interface;
  interface.a = 0;
  interface.b = 1;
  interface.radius_mm = radius + 0.1;
  interface.area_mm2 = pi * radius * radius;
  return interface;
}

Shape rod(double x, double y, double r) { return cylinder({x, y, -30}, {x, y, 30}, r); }
Shape wall(Vec3d across, double half_mm) {
  return intersect({half_space(half_mm * across, across), half_space(-half_mm * across, -across)});
}
Layer layer_of(const Shape& a, const Shape& b, const JointParams& params = {}) {
  return transient_layer(round_interface(), a, b, body, shell, pixel, params);
}

// --- the layer
// -----------------------------------------------------------------------------------------------------------------

TEST(Layer, UnionOfTwoPatternsAndTheShellHasTheAreaOfPaper) {
  // Ring: pi (100 - 81). A strip |x| < 1 in the disc of radius 9: 2 (sqrt(80) + 81 asin(1/9)). Two strips cross in 2
  // x 2.
  const double strip = 2 * (std::sqrt(80.0) + 81 * std::asin(1 / 9.0));
  const double expected = pi * (100 - 81) + 2 * strip - 4;
  const Layer layer = layer_of(wall({1, 0, 0}, 1), wall({0, 1, 0}, 1));
  EXPECT_NEAR(layer.union_area_mm2, expected, 0.01 * expected);
  EXPECT_EQ(layer.regions_before, 1);
  EXPECT_EQ(layer.regions_after, 1);
  EXPECT_EQ(layer.bridge_area_mm2, 0);
  EXPECT_NEAR(layer.shell_area_mm2, pi * (100 - 81), 0.005 * pi * (100 - 81));
}

TEST(Layer, BridgesFollowTheShortestGaps) {
  // Rods of radius 0.5 at x = 0 and 4, ring from 9: the tree is 0-4 (gap 3) and 4-ring (gap 4.5), each 0.8 wide. Where
  // a bridge meets a rod it also fills the sliver beside the round side, 0.048 mm2.
  const Layer layer = layer_of(unite({rod(0, 0, 0.5), rod(4, 0, 0.5)}), nothing());
  EXPECT_EQ(layer.regions_before, 3);
  EXPECT_EQ(layer.regions_after, 1);
  EXPECT_NEAR(layer.bridge_area_mm2, (3 + 4.5) * 0.8 + 3 * 0.048, 0.35);
}

TEST(Layer, TheConnectivityCheckSeesAMissingBridge) {
  Layer layer = layer_of(unite({rod(0, 0, 0.5), rod(4, 0, 0.5)}), nothing());
  ASSERT_EQ(regions(layer), 1);
  for (int y = 0; y < layer.solid.height; ++y)
    for (int x = 0; x < layer.solid.width; ++x) {
      const double px = layer.origin_mm.x + x * pixel, py = layer.origin_mm.y + y * pixel;
      if (px > 1.5 && px < 2.5 && std::abs(py) < 1) layer.solid(x, y) = 0;
    }
  EXPECT_EQ(regions(layer), 2);
}

TEST(Layer, PixelsThatTouchInACornerAreApart) {
  Layer layer;
  layer.solid = Image<std::uint8_t>(4, 4);
  layer.solid(1, 1) = layer.solid(2, 2) = 1;
  EXPECT_EQ(regions(layer), 2);
  layer.solid(1, 2) = 1;
  EXPECT_EQ(regions(layer), 1);
}

TEST(Layer, MaterialStaysWithinAQuarterOfTheMinimum) {
  // The minimum over all trees for rods on a known lattice: each is joined to its nearest neighbour or the ring.
  std::vector<Shape> rods;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j) rods.push_back(rod(4 * i, 4 * j, 0.5));
  const Layer layer = layer_of(unite(rods), nothing());
  EXPECT_EQ(layer.regions_before, 10);
  EXPECT_EQ(layer.regions_after, 1);
  // Corners to ring: gap 9 - 4 sqrt(2) - 0.5 = 2.843 (four), other five: gap 3 to a neighbour.
  const double least = 0.8 * (4 * 2.843 + 5 * 3.0);
  EXPECT_LE(layer.union_area_mm2 + layer.bridge_area_mm2, 1.25 * (layer.union_area_mm2 + least));
  EXPECT_NEAR(layer.bridge_area_mm2, least, 0.12 * least);
}

TEST(Layer, TheBoundingBoxRuleJoinsTooButTakesMore) {
  const Shape rods = unite({rod(0, 0, 0.8), rod(4, 1, 0.8), rod(-3, -4, 0.8)});
  JointParams boxes;
  boxes.bridge = Bridge::Bbox;
  const Layer ours = layer_of(rods, nothing()), paper = layer_of(rods, nothing(), boxes);
  EXPECT_EQ(paper.regions_after, 1);
  EXPECT_EQ(ours.regions_after, 1);
  EXPECT_GT(paper.bridge_area_mm2, ours.bridge_area_mm2);
}

TEST(Layer, AGrazeIsDroppedNotBridged) {
  const Layer layer = layer_of(rod(0, 0, 0.06), nothing());  // one pixel
  EXPECT_EQ(layer.regions_before, 1);
  EXPECT_EQ(layer.bridge_area_mm2, 0);
  const int middle = layer.solid.width / 2;
  EXPECT_GT(layer.distance_mm(middle, middle), 0);
}

TEST(Layer, OnlyTheOwnLimbOfThePlaneIsTaken) {
  const Shape two = unite({body, cylinder({17, 0, -30}, {17, 0, 30}, 5)});
  const Layer alone = layer_of(wall({1, 0, 0}, 1), nothing());
  Interface wide = round_interface();
  wide.radius_mm = 25;
  const Layer beside = transient_layer(wide, wall({1, 0, 0}, 1), nothing(), two, shell, pixel, {});
  EXPECT_NEAR(beside.union_area_mm2, alone.union_area_mm2, 0.005 * alone.union_area_mm2);
}

TEST(Layer, BridgesStayInsideABentSection) {
  // A C-shaped section: the straight gap between its ends lies outside the body.
  const Shape c = subtract(cylinder({0, 0, -5}, {0, 0, 5}, 10),
                           unite({cylinder({0, 0, -6}, {0, 0, 6}, 4), cuboid({{0, -2, -6}, {11, 2, 6}})}));
  const Layer layer =
      transient_layer(round_interface(), unite({rod(7, 3.6, 0.5), rod(7, -3.6, 0.5)}), nothing(), c, 0.3, pixel, {});
  EXPECT_EQ(layer.regions_after, 1);
  for (int y = 0; y < layer.solid.height; ++y)
    for (int x = 0; x < layer.solid.width; ++x)
      if (layer.solid(x, y) != 0) {
        EXPECT_LE(c({layer.origin_mm.x + x * pixel, layer.origin_mm.y + y * pixel, 0}), 1e-4);
      }
}

TEST(Layer, TheSamePatternTurnedGivesTheSameLayer) {
  const TcsParams tcs;
  const Shape crystal_b = crystal(tcs);
  const Layer straight = layer_of(nothing(), crystal_b);
  // The diamond lattice is its own picture under (x, y, z) -> (y, z, x): turn plane and body with it.
  Interface side = round_interface();
  side.frame = {{}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  const Shape turned_body = cylinder({-30, 0, 0}, {30, 0, 0}, radius);
  const Layer turned = transient_layer(side, nothing(), crystal_b, turned_body, shell, pixel, {});
  EXPECT_EQ(turned.regions_before, straight.regions_before);
  EXPECT_NEAR(turned.union_area_mm2, straight.union_area_mm2, 0.01 * straight.union_area_mm2);
  EXPECT_NEAR(turned.bridge_area_mm2, straight.bridge_area_mm2, 0.05 * straight.bridge_area_mm2 + 0.05);
}

// --- the joint
// -----------------------------------------------------------------------------------------------------------------

Joint crystal_joint(const JointParams& params = {}, std::uint64_t seed = 1) {
  return join(round_interface(), wall({1, 0, 0}, 3), crystal({}), false, true, TcsParams{}.stick_mm, body, shell, seed,
              0, params);
}

TEST(Joint, TheSlabHasItsThicknessAndThePatternOfItsSection) {
  JointParams params;
  const Shape pattern = unite({wall({1, 0, 0}, 1), wall({0, 1, 0}, 1)});
  const Joint joint = join(round_interface(), pattern, nothing(), false, false, 0, body, shell, 1, 0, params);
  EXPECT_TRUE(joint.columns.empty());
  Random random(1, "test");
  int compared = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3d p{20 * random.uniform() - 10, 20 * random.uniform() - 10, 3 * random.uniform() - 1.5};
    const double expected =
        std::max(std::abs(p.z) - 0.6, static_cast<double>(std::min(pattern(p), -(body({p.x, p.y, 0}) + 1))));
    if (body(p) > -0.05 || std::abs(expected) < 0.02) continue;
    ++compared;
    EXPECT_EQ(joint.shape(p) < 0, expected < 0) << p.x << " " << p.y << " " << p.z;
  }
  EXPECT_GT(compared, 2000);
}

TEST(Joint, TheLayerReachesBeyondTheBodySoThatClippingClosesIt) {
  const Joint joint = crystal_joint();
  for (double a = 0; a < 2 * pi; a += 0.1)
    EXPECT_LT(joint.shape({(radius + 0.1) * std::cos(a), (radius + 0.1) * std::sin(a), 0.3}), 0);
  EXPECT_GT(joint.shape({radius + 1, 0, 0}), 0);
}

TEST(Joint, ColumnsStandOnTheLayerAndEndInCrystal) {
  const Joint joint = crystal_joint();
  const Shape diamond = crystal({});
  EXPECT_GE(joint.columns.size(), 5U);
  for (const Capsule& c : joint.columns) {
    EXPECT_NEAR(c.a.z, 0, 1e-9);
    EXPECT_NEAR(c.b.x, c.a.x, 1e-9);
    EXPECT_NEAR(c.b.y, c.a.y, 1e-9);
    EXPECT_GT(c.b.z, 0.6) << "into part b";
    EXPECT_LE(c.b.z, 0.6 + 12);
    EXPECT_LE(diamond(c.b), -TcsParams{}.stick_mm / 4 + 1e-4);
    const auto foot = [&](double local, double origin) {
      return static_cast<int>(std::lround((local - origin) / pixel));
    };
    EXPECT_EQ(joint.layer.solid(foot(c.a.x, joint.layer.origin_mm.x), foot(c.a.y, joint.layer.origin_mm.y)), 1);
    EXPECT_LT(body(c.b), -shell + 1e-3);
    EXPECT_DOUBLE_EQ(c.radius_mm, 0.4);
  }
}

TEST(Joint, ColumnsKeepTheirSpacing) {
  for (const double spacing : {1.5, 3.0}) {
    JointParams params;
    params.spacing_mm = spacing;
    const Joint joint = crystal_joint(params);
    ASSERT_GE(joint.columns.size(), 2U);
    double least = 1e9;
    for (std::size_t i = 0; i < joint.columns.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) least = std::min(least, norm(joint.columns[i].a - joint.columns[j].a));
    EXPECT_GE(least, spacing);
  }
}

TEST(Joint, CloserSpacingGivesMoreColumns) {
  JointParams close;
  close.spacing_mm = 1.5;
  EXPECT_GT(crystal_joint(close).columns.size(), crystal_joint().columns.size());
}

TEST(Joint, WithoutColumnsTheSameLayerStaysAndTouchesLess) {
  JointParams alone;
  alone.columns = false;
  const Joint with = crystal_joint(), without = crystal_joint(alone);
  EXPECT_TRUE(without.columns.empty());
  EXPECT_EQ(without.columns_dropped, 0);
  EXPECT_TRUE(without.warnings.empty());
  EXPECT_EQ(without.layer.distance_mm.pixels, with.layer.distance_mm.pixels);
  EXPECT_LT(without.contact_area_mm2, with.contact_area_mm2);
}

TEST(Joint, BothSidesGetColumnsWhenBothAreCrystal) {
  TcsParams shifted;
  shifted.shift_mm = {1, 2, 0.5};
  const Joint joint = join(round_interface(), crystal(shifted), crystal({}), true, true, 0.8, body, shell, 1, 0, {});
  int up = 0, down = 0;
  for (const Capsule& c : joint.columns) {
    const bool rises = c.b.z > 0;
    (rises ? up : down) += 1;
    EXPECT_LE(crystal(rises ? TcsParams{} : shifted)(c.b), -0.2 + 1e-4);
    EXPECT_LT(joint.shape(c.a), 0);
  }
  EXPECT_GT(up, 0);
  EXPECT_GT(down, 0);
  EXPECT_EQ(joint.layer.regions_after, 1);
}

TEST(Joint, ContactIsCrystalInTheFacePlusTheColumns) {
  // Rods of radius 0.5 that stand on a full layer: each touches it with pi / 4; a lid over all makes every foot a
  // column.
  const Shape rods = unite({rod(0, 0, 0.5), rod(5, 0, 0.5)});
  const Joint joint = join(round_interface(), everything(), rods, false, true, 0.8, body, shell, 1, 0, {});
  EXPECT_NEAR(joint.contact_area_mm2, 2 * pi / 4, 0.08);
  EXPECT_TRUE(joint.columns.empty()) << "sticks that run straight up hang over nothing";
}

/// Fibres of their own for the half of the body below (id 0) or above (id 1) the joint.
Fill fibres_of_half(int id) {
  const double side = id == 0 ? -1 : 1;
  PartMaker::Fields fields;
  fields.id = id;
  fields.kind = Kind::Column;
  fields.region = half_space({}, {0, 0, -side});
  fields.bounds_mm = {{-radius, -radius, std::min(0.0, 30 * side)}, {radius, radius, std::max(0.0, 30 * side)}};
  fields.axis = Axis::straight({0, 0, std::min(0.0, 30 * side)}, {0, 0, std::max(0.0, 30 * side)});
  return generate(PartMaker::make(fields), MfsParams{}, body, shell);
}

/// Share of the lumen's section at a height where this is material.
double share_of_lumen(const Shape& shape, double z) {
  constexpr double step = 0.04;
  double inside = 0, material = 0;
  for (double x = -9; x <= 9; x += step)
    for (double y = -9; y <= 9; y += step) {
      if (std::hypot(x, y) > radius - shell) continue;
      ++inside;
      material += shape({x, y, z}) < 0 ? 1 : 0;
    }
  return material / inside;
}

// Two columns of fibres that meet at a plane. Membranes run straight on into the layer, so all of the section of the
// side that has less touches it; two patterns that know nothing of each other cover 1 - (1 - a) (1 - b) of the lumen.
TEST(Joint, FibresMeetFibres) {
  const Fill below = fibres_of_half(0), above = fibres_of_half(1);
  const double lumen = pi * (radius - shell) * (radius - shell);
  const double a = share_of_lumen(below.shape, -0.6), b = share_of_lumen(above.shape, 0.6);
  EXPECT_NEAR(a, 0.58, 0.06);  // as mfs_test counts it
  const Joint joint = join(round_interface(), below.shape, above.shape, false, false, 0, body, shell, 1, 0, {});
  EXPECT_EQ(joint.layer.regions_after, 1);
  EXPECT_TRUE(joint.columns.empty());
  EXPECT_EQ(joint.columns_dropped, 0);
  EXPECT_TRUE(joint.warnings.empty());
  EXPECT_NEAR(joint.contact_area_mm2, std::min(a, b) * lumen, 0.01 * lumen);
  const double both = 1 - (1 - a) * (1 - b), ring = pi * radius * radius - lumen;
  EXPECT_NEAR(joint.layer.union_area_mm2, ring + both * lumen, 0.05 * lumen);

  const AssembleParams params{.shell_mm = shell, .overlap_mm = 0.25};
  const Shape whole =
      assemble(body, {{half_space({}, {0, 0, 1}), below.shape}, {half_space({}, {0, 0, -1}), above.shape}},
               {joint.shape}, params);
  const Solid solid = realize(whole, {{-12, -12, -32}, {12, 12, 32}}, {.voxel_mm = 0.25});
  EXPECT_EQ(pieces(solid).material.size(), 1U);
  // Inside the shell, too: what is left of both columns hangs together by the layer.
  const Solid core = realize(intersect({whole, cylinder({0, 0, -28}, {0, 0, 28}, radius - shell - 0.3)}),
                             {{-12, -12, -32}, {12, 12, 32}}, {.voxel_mm = 0.25});
  const CleanResult left = clean(core, {.drop_below_vox = 32, .fill_below_vox = 0});
  EXPECT_EQ(left.left.material.size(), 1U);
}

TEST(Joint, CrystalTooThinToEndInIsDroppedAndCounted) {
  // Horizontal bars 0.2 thick: the projection sees them, but a column cannot end 0.2 deep in them.
  const Shape thin = capsule({-8, 0, 3}, {8, 0, 3}, 0.15);
  const Joint joint = join(round_interface(), everything(), thin, false, true, 0.8, body, shell, 1, 0, {});
  EXPECT_TRUE(joint.columns.empty());
  EXPECT_GT(joint.columns_dropped, 0);
  ASSERT_EQ(joint.warnings.size(), 1U);
  EXPECT_THAT(joint.warnings[0], ::testing::HasSubstr("parts 0 and 1"));
}

TEST(Joint, BoundsHold) {
  const Joint joint = crystal_joint();
  Random random(4, "test");
  for (int i = 0; i < 400; ++i) {
    const Vec3d low{24 * random.uniform() - 12, 24 * random.uniform() - 12, 6 * random.uniform() - 3};
    const double side = 0.1 + 3 * random.uniform();
    const Interval bound = joint.shape.bound({low, low + Vec3d{side, side, side}});
    for (int k = 0; k < 20; ++k) {
      const float value = joint.shape(low + side * Vec3d{random.uniform(), random.uniform(), random.uniform()});
      EXPECT_GE(value, bound.lo);
      EXPECT_LE(value, bound.hi);
    }
  }
}

// --- bent
// -----------------------------------------------------------------------------------------------------------------

/// The round interface as a bowl, or a saddle.
Interface bent_interface(double across = 1) {
  Interface interface = round_interface();
  interface.bend = {.slope = {0.1, 0}, .xx = 0.5 / 15, .xy = 0, .yy = across * 0.5 / 15};
  return interface;
}
Joint bent_joint(const Interface& interface) {
  return join(interface, wall({1, 0, 0}, 3), crystal({}), false, true, TcsParams{}.stick_mm, body, shell, 1, 0, {});
}

TEST(BentJoint, TheLayerHasItsThicknessAlongTheNormalsAndThePatternOfItsFeet) {
  const Shape pattern = unite({wall({1, 0, 0}, 1), wall({0, 1, 0}, 1)});
  for (const double across : {1.0, -1.0}) {
    const Interface interface = bent_interface(across);
    const Joint joint = join(interface, pattern, nothing(), false, false, 0, body, shell, 1, 0, {});
    Random random(1, "test");
    int compared = 0, inside = 0;
    for (int i = 0; i < 8000; ++i) {
      const Vec2d at{20 * random.uniform() - 10, 20 * random.uniform() - 10};
      const double above = 3 * random.uniform() - 1.5;
      const Vec3d foot = interface.surface().at(at), p = interface.surface().at(at, above);
      const double expected =
          std::max(std::abs(above) - 0.6, static_cast<double>(std::min(pattern(foot), -(body(foot) + 1))));
      if (body(p) > -0.05 || body(foot) > -0.05 || std::abs(expected) < 0.03) continue;
      ++compared;
      inside += expected < 0 ? 1 : 0;
      EXPECT_EQ(joint.shape(p) < 0, expected < 0) << p.x << " " << p.y << " " << p.z;
    }
    EXPECT_GT(compared, 3000);
    EXPECT_GT(inside, 500);
  }
}

TEST(BentJoint, NearItTheDistanceIsThatByBruteForce) {
  // All material: a bowl 1.2 mm thick, far from its rim.
  const Interface interface = bent_interface();
  const Joint joint = join(interface, everything(), everything(), false, false, 0, body, shell, 1, 0, {});
  Random random(2, "test");
  for (int i = 0; i < 200; ++i) {
    const Vec2d at{6 * random.uniform() - 3, 6 * random.uniform() - 3};
    const double above = 1.6 * random.uniform() - 0.8;
    // Inside, the image says no more than so deep.
    const double expected = std::abs(above) - 0.6;
    EXPECT_NEAR(joint.shape(interface.surface().at(at, above)), expected, 2e-3);
  }
}

TEST(BentJoint, ColumnsStandSquareOnTheLayerAndEndInCrystal) {
  const Interface interface = bent_interface();
  const Joint joint = bent_joint(interface);
  const Shape diamond = crystal({});
  EXPECT_GE(joint.columns.size(), 4U);
  for (const Capsule& c : joint.columns) {
    EXPECT_NEAR(interface.surface().flattened(c.a).z, 0, 1e-9);
    EXPECT_NEAR(dot(normalized(c.b - c.a), interface.surface().normal({c.a.x, c.a.y})), 1, 1e-9);
    EXPECT_LE(diamond(c.b), -TcsParams{}.stick_mm / 4 + 1e-4);
    EXPECT_LT(body(c.b), -shell + 1e-3);
  }
  EXPECT_EQ(joint.layer.regions_after, 1);
  EXPECT_GT(joint.contact_area_mm2, 0);
}

TEST(BentJoint, TheShellsRingHasTheAreaAlongTheSurface) {
  Interface interface = bent_interface();
  interface.bend.slope = {};
  const Layer layer = transient_layer(interface, nothing(), nothing(), body, shell, pixel, {});
  const auto cap = [](double r) { return 2 * pi * 225 / 3 * (std::pow(1 + r * r / 225, 1.5) - 1); };
  const double ring = cap(radius) - cap(radius - shell);
  EXPECT_NEAR(layer.shell_area_mm2, ring, 0.01 * ring);
}

TEST(BentJoint, BoundsHoldAndTheValueChangesNoFasterThanItSays) {
  for (const double across : {1.0, -1.0}) {
    const Joint joint = bent_joint(bent_interface(across));
    Random random(4, "test");
    double fastest = 0;
    for (int i = 0; i < 600; ++i) {
      const Vec3d low{24 * random.uniform() - 12, 24 * random.uniform() - 12, 16 * random.uniform() - 8};
      const double side = 0.1 + 3 * random.uniform();
      const Interval bound = joint.shape.bound({low, low + Vec3d{side, side, side}});
      for (int k = 0; k < 20; ++k) {
        const Vec3d p = low + side * Vec3d{random.uniform(), random.uniform(), random.uniform()};
        const float value = joint.shape(p);
        EXPECT_GE(value, bound.lo);
        EXPECT_LE(value, bound.hi);
        const Vec3d step = 0.02 * normalized({random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5});
        fastest = std::max(fastest, static_cast<double>(std::abs(joint.shape(p + step) - value)) / 0.02);
      }
    }
    EXPECT_LE(fastest, joint.shape.lipschitz());
    EXPECT_LE(joint.shape.lipschitz(), 2) << "a bound as loose as this tells next to nothing";
  }
}

TEST(BentJoint, ABendOfNextToNothingIsThePlane) {
  Interface bent = round_interface();
  bent.bend.xx = 1e-12;
  const Joint plane = bent_joint(round_interface()), other = bent_joint(bent);
  EXPECT_EQ(plane.layer.solid.pixels, other.layer.solid.pixels);
  EXPECT_EQ(plane.columns.size(), other.columns.size());
  EXPECT_NEAR(plane.contact_area_mm2, other.contact_area_mm2, 1e-6);
  Random random(5, "test");
  for (int i = 0; i < 400; ++i) {
    const Vec3d p{20 * random.uniform() - 10, 20 * random.uniform() - 10, 2 * random.uniform() - 1};
    if (std::hypot(p.x, p.y) > 9.5) continue;
    EXPECT_NEAR(plane.shape(p), other.shape(p), 1e-4);
  }
}

TEST(Joint, SameSeedSameColumnsOnAnyNumberOfThreads) {
  const Joint two = crystal_joint();
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const Joint one = crystal_joint(), other = crystal_joint({}, 2);
  ASSERT_EQ(one.columns.size(), two.columns.size());
  for (std::size_t i = 0; i < one.columns.size(); ++i) EXPECT_EQ(one.columns[i].b, two.columns[i].b);
  EXPECT_EQ(one.layer.distance_mm.pixels, two.layer.distance_mm.pixels);
  EXPECT_TRUE(other.columns.size() != one.columns.size() || !(other.columns[0].a == one.columns[0].a));
}

TEST(Joint, CanBeSwitchedOff) {
  JointParams params;
  params.enabled = false;
  const Joint joint = crystal_joint(params);
  EXPECT_GT(joint.shape({0, 0, 0}), 0);
  EXPECT_TRUE(joint.columns.empty());
}

TEST(Joint, BadNumbersAreRefused) {
  const auto code = [](auto change) {
    JointParams params;
    change(params);
    try {
      (void)crystal_joint(params);
    } catch (const Error& e) {
      return e.code();
    }
    return Code::Internal;
  };
  EXPECT_EQ(code([](JointParams& p) { p.spacing_mm = p.column_mm; }), Code::BadRecipe);
  EXPECT_EQ(code([](JointParams& p) { p.layer_mm = 0; }), Code::BadRecipe);
  EXPECT_EQ(code([](JointParams& p) { p.reach_mm = std::nan(""); }), Code::BadRecipe);
}

TEST(Joint, Cancels) {
  const Context context;
  context.cancel();
  EXPECT_THROW(
      (void)join(round_interface(), everything(), crystal({}), false, true, 0.8, body, shell, 1, 0, {}, context),
      Error);
}

}  // namespace
}  // namespace fibrolite
