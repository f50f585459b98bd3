// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/sleeve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

constexpr double pi = std::numbers::pi, radius = 6, shell = 1, wall = 0.8, pixel = 0.1;

/// A slanting core through a cube of 30 mm.
struct Model {
  Frame frame = frame_along({0, 0, 0}, {0, 0, 1});
  Shape body = cuboid({{-15, -15, 0}, {15, 15, 30}});
  Core core;
  Labels labels;
  Interface mantle;
  Model() {
    core = {.id = 1, .host = 0, .frame = frame, .radius_mm = radius, .length_mm = 50};
    core.frame.origin = {1, 2, -10};
    labels = Labels().carved({core});
    mantle = mantle_of(core, labels, body, pixel);
  }
  [[nodiscard]] Joint joint(const Shape& a, const Shape& b) const {
    return sleeve(mantle, a, b, everything(), body, shell, wall, pixel);
  }
};

TEST(Mantle, is_as_long_as_the_body_and_as_large_as_the_cylinder) {
  const Model m;
  EXPECT_EQ(m.mantle.a, 1);
  EXPECT_EQ(m.mantle.b, 0);
  EXPECT_NEAR(m.mantle.length_mm, 30, 2 * pixel);
  EXPECT_NEAR(m.mantle.frame.origin.z, 0, 2 * pixel);
  EXPECT_NEAR(m.mantle.area_mm2, 2 * pi * radius * 30, 0.01 * 2 * pi * radius * 30);
}

TEST(Mantle, demand_is_the_integral_of_the_traction) {
  const Model m;
  const auto one = [](Vec3d, Vec3d n) { return n.x > 0 ? 2.0 : 0.0; };
  const double expected = pi * radius * m.mantle.length_mm * 2;
  EXPECT_NEAR(mantle_demand_n(m.mantle, m.labels, m.body, one), expected, 0.05 * expected);
  EXPECT_EQ(demand_n(m.mantle, m.labels, m.body, one), mantle_demand_n(m.mantle, m.labels, m.body, one));
}

TEST(Sleeve, is_a_tube_of_the_wanted_wall) {
  const Model m;
  const Shape tube = m.joint(nothing(), nothing()).shape;
  for (int k = 0; k < 12; ++k) {
    const Vec3d out{std::cos(k * 0.5), std::sin(k * 0.5), 0};
    const Vec3d middle{1, 2, 15};
    EXPECT_NEAR(tube(middle + radius * out), -0.5 * wall, 1e-4);
    EXPECT_NEAR(tube(middle + (radius + 1) * out), 1 - 0.5 * wall, 1e-4);
    EXPECT_NEAR(tube(middle + (radius - 1) * out), 1 - 0.5 * wall, 1e-4);
  }
}

/// Plates across the axis, half of the height: each is a ring on the mantle, which the sleeve makes one region of.
TEST(Sleeve, joins_what_ends_on_it_and_says_where_it_touches) {
  const Model m;
  std::vector<Shape> plates;
  for (double z = 4; z < 27; z += 4) plates.push_back(cuboid({{-20, -20, z}, {20, 20, z + 2}}));
  const Shape crystal = unite(plates);
  const Joint joint = m.joint(nothing(), crystal);
  EXPECT_EQ(joint.layer.regions_before, 8);  // six rings, and the shell at either end
  EXPECT_EQ(joint.layer.regions_after, 1);
  const double touched = 2 * pi * radius * 6 * 2;
  EXPECT_NEAR(joint.contact_area_mm2, touched, 0.02 * touched);
  EXPECT_NEAR(joint.layer.shell_area_mm2, 2 * pi * radius * 2 * shell, 2 * pi * radius * pixel);  // either end
  EXPECT_TRUE(joint.warnings.empty());
  // Half planes through the axis: strips all along, joined at both ends by the shell.
  const Joint strips = m.joint(cuboid({{-20, 1.8, -5}, {20, 2.2, 35}}), crystal);
  EXPECT_EQ(strips.layer.regions_before, 1);
}

TEST(Sleeve, without_crystal_there_is_a_warning_and_a_bad_wall_is_refused) {
  const Model m;
  EXPECT_FALSE(m.joint(everything(), nothing()).warnings.empty());
  EXPECT_THROW((void)sleeve(m.mantle, nothing(), nothing(), everything(), m.body, shell, 0, pixel), Error);
}

}  // namespace
}  // namespace fibrolite
