// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/interfaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "fibrolite/error.h"
#include "label_field.h"
#include "part_maker.h"

namespace fibrolite {
namespace {

using std::numbers::pi;

/// Labels 0 below z = 0 and `above(x)` over it, in a box of 40 mm about the origin.
Labels halves(const std::function<int(double)>& above, int count) {
  LabelSamples samples;
  samples.origin = {-40, -40, -40};
  samples.voxel_mm = 0.8;
  samples.size = {101, 101, 101};
  samples.count = count;
  samples.clamp_mm = 3;
  for (int k = 0; k < 101; ++k)
    for (int j = 0; j < 101; ++j)
      for (int i = 0; i < 101; ++i) {
        const double x = -40 + 0.8 * i, z = -40 + 0.8 * k + 0.05;  // the cut is z = -0.05
        const int up = above(x);
        samples.label.push_back(static_cast<std::uint16_t>(z < 0 ? 0 : up));
        if (std::abs(z) < 3) {
          LabelSamples::Near near;
          near.sample = static_cast<std::int64_t>(samples.label.size()) - 1;
          near.a = 0;
          near.b = static_cast<std::uint16_t>(up);
          near.distance_mm = static_cast<float>(std::abs(z));
          samples.near.push_back(near);
        }
      }
  return make_labels(samples);
}

Parts parts_of(const std::vector<Kind>& kinds, Labels labels, std::vector<Cut> cuts) {
  Parts parts;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    PartMaker::Fields fields;
    fields.id = static_cast<int>(i);
    fields.kind = kinds[i];
    parts.parts.push_back(PartMaker::make(fields));
  }
  parts.labels = std::move(labels);
  parts.cuts = std::move(cuts);
  return parts;
}

Cut cut_at_origin(int a, int b, double radius_mm) {
  Cut cut;
  cut.a = a;
  cut.b = b;
  cut.frame.origin = {0, 0, -0.05};
  cut.radius_mm = radius_mm;
  return cut;
}

const Shape limb = cylinder({2, 1, -20}, {2, 1, 20}, 5);

TEST(Interfaces, ARoundSectionHasTheAreaOfItsCircle) {
  const Parts parts =
      parts_of({Kind::Column, Kind::Bulk}, halves([](double) { return 1; }, 2), {cut_at_origin(0, 1, 8)});
  const std::vector<Interface> found = interfaces(parts, limb, 0.1);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].a, 0);
  EXPECT_EQ(found[0].b, 1);
  EXPECT_NEAR(found[0].area_mm2, 25 * pi, 0.25 * pi);
  EXPECT_NEAR(found[0].radius_mm, 5, 0.2);
  EXPECT_NEAR(found[0].frame.origin.x, 2, 0.02);
  EXPECT_NEAR(found[0].frame.origin.y, 1, 0.02);
  EXPECT_NEAR(found[0].frame.z.z, 1, 1e-12) << "from a into b";
}

/// A bowl through a bar of 12 x 10 mm: labels 0 below, 1 above it.
TEST(Interfaces, ABentSectionHasTheAreaOfItsSurfaceAndTheTractionOfItsNormals) {
  Cut cut = cut_at_origin(0, 1, 9);
  cut.frame.origin = {};
  cut.bend = {.slope = {}, .xx = 0.03, .xy = 0, .yy = 0.03};
  const double clamp = 3;
  LabelSamples samples{.origin = {-20, -20, -20},
                       .voxel_mm = 0.8,
                       .size = {51, 51, 51},
                       .count = 2,
                       .clamp_mm = clamp,
                       .label = {},
                       .near = {}};
  for (int k = 0; k < 51; ++k)
    for (int j = 0; j < 51; ++j)
      for (int i = 0; i < 51; ++i) {
        const double above = cut.surface().foot(samples.origin + 0.8 * Vec3d{i + 0.0, j + 0.0, k + 0.0}).above_mm;
        samples.label.push_back(above < 0 ? 0 : 1);
        if (std::abs(above) < clamp)
          samples.near.push_back(
              {static_cast<std::int64_t>(samples.label.size()) - 1, 0, 1, static_cast<float>(std::abs(above))});
      }
  const Shape bar = cuboid({{-6, -5, -15}, {6, 5, 15}});
  const Parts parts = parts_of({Kind::Bulk, Kind::Bulk}, make_labels(samples), {cut});
  const std::vector<Interface> found = interfaces(parts, bar, 0.1);
  ASSERT_EQ(found.size(), 1U);
  double area = 0, upward = 0;
  for (double y = -4.99; y < 5; y += 0.02)
    for (double x = -5.99; x < 6; x += 0.02) {
      area += 4e-4 * cut.bend.stretch({x, y});
      upward += 4e-4;  // of the surface, seen along z
    }
  EXPECT_NEAR(found[0].area_mm2, area, 0.02 * area);
  EXPECT_NEAR(norm(found[0].frame.origin), 0, 0.1);
  // Pulled along z by 2 MPa: through whatever surface, the same force.
  const double force = demand_n(found[0], parts.labels, bar, [](Vec3d, Vec3d n) { return 2 * n.z; });
  EXPECT_NEAR(force, 2 * upward, 0.03 * 2 * upward);
  const std::vector<Interface> turned = interfaces(parts_of({Kind::Bulk, Kind::Column}, parts.labels, {cut}), bar, 0.1);
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_EQ(turned[0].a, 1);
  EXPECT_NEAR(turned[0].area_mm2, found[0].area_mm2, 1e-3 * area);
  EXPECT_NEAR(turned[0].bend.xx, -0.03, 1e-12);
}

TEST(Interfaces, TheDemandIsTheIntegralOfTheTraction) {
  const Parts parts =
      parts_of({Kind::Column, Kind::Bulk}, halves([](double) { return 1; }, 2), {cut_at_origin(0, 1, 8)});
  const Interface section = interfaces(parts, limb, 0.1).at(0);
  EXPECT_NEAR(demand_n(section, parts.labels, limb, [](Vec3d, Vec3d) { return 2; }), 50 * pi, 0.5 * pi);
  // Rising linearly across the section, 0 at one rim: half of the largest on average.
  const double rising = demand_n(section, parts.labels, limb, [](Vec3d p, Vec3d n) { return (p.x + 3) * n.z; });
  EXPECT_NEAR(rising, 25 * pi * 5, 0.03 * 25 * pi * 5);
}

TEST(Interfaces, TheColumnComesFirstAndTheFrameTurns) {
  const Parts parts =
      parts_of({Kind::Bulk, Kind::Column}, halves([](double) { return 1; }, 2), {cut_at_origin(0, 1, 8)});
  const std::vector<Interface> found = interfaces(parts, limb, 0.1);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].a, 1);
  EXPECT_EQ(found[0].b, 0);
  EXPECT_NEAR(found[0].frame.z.z, -1, 1e-12);
  const Frame& f = found[0].frame;
  EXPECT_NEAR(dot(cross(f.x, f.y), f.z), 1, 1e-12) << "right-handed";
  EXPECT_NEAR(f.origin.x, 2, 0.02);
  EXPECT_NEAR(f.origin.y, 1, 0.02);
}

TEST(Interfaces, TwoLegsThroughOneDiscAreTwoSections) {
  const Shape legs = unite({cylinder({-6, 0, -20}, {-6, 0, 20}, 3), cylinder({6, 0, -20}, {6, 0, 20}, 4)});
  const Parts parts =
      parts_of({Kind::Bulk, Kind::Bulk}, halves([](double) { return 1; }, 2), {cut_at_origin(0, 1, 11)});
  const std::vector<Interface> found = interfaces(parts, legs, 0.1);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0].area_mm2, 9 * pi, 0.3);
  EXPECT_NEAR(found[1].area_mm2, 16 * pi, 0.4);
  EXPECT_LT(found[0].frame.origin.x, found[1].frame.origin.x) << "sorted by centroid";
}

TEST(Interfaces, ASliverBesideTheLimbIsNoInterface) {
  const Shape legs = unite({limb, cylinder({-8, 0, -20}, {-8, 0, 20}, 0.5)});
  const Parts parts =
      parts_of({Kind::Column, Kind::Bulk}, halves([](double) { return 1; }, 2), {cut_at_origin(0, 1, 9)});
  EXPECT_EQ(interfaces(parts, legs, 0.1).size(), 1U);
}

TEST(Interfaces, ALegOfAnotherPartInTheDiscIsNotTaken) {
  const Shape legs = unite({cylinder({-6, 0, -20}, {-6, 0, 20}, 3), cylinder({6, 0, -20}, {6, 0, 20}, 4)});
  const Labels labels = halves([](double x) { return x < 0 ? 1 : 2; }, 3);
  const Parts parts =
      parts_of({Kind::Bulk, Kind::Column, Kind::Column}, labels, {cut_at_origin(0, 1, 11), cut_at_origin(0, 2, 11)});
  const std::vector<Interface> found = interfaces(parts, legs, 0.1);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].a, 1);
  EXPECT_NEAR(found[0].frame.origin.x, -6, 0.05);
  EXPECT_EQ(found[1].a, 2);
  EXPECT_NEAR(found[1].frame.origin.x, 6, 0.05);
}

TEST(Interfaces, MergedPartsHaveNone) {
  const Parts parts = parts_of({Kind::Bulk}, Labels(), {cut_at_origin(0, 0, 8)});
  EXPECT_TRUE(interfaces(parts, limb, 0.1).empty());
}

TEST(Interfaces, ThePixelHardlyMatters) {
  const Parts parts =
      parts_of({Kind::Column, Kind::Bulk}, halves([](double) { return 1; }, 2), {cut_at_origin(0, 1, 8)});
  const double fine = interfaces(parts, limb, 0.05).at(0).area_mm2,
               coarse = interfaces(parts, limb, 0.2).at(0).area_mm2;
  EXPECT_NEAR(fine, coarse, 0.01 * fine);
}

TEST(Interfaces, APixelOfZeroIsRefused) { EXPECT_THROW((void)interfaces(Parts{}, limb, 0), Error); }

}  // namespace
}  // namespace fibrolite
