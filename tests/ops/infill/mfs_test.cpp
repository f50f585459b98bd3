// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/mfs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <vector>

#include "discs.h"
#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "infill/census.h"
#include "micrographs.h"
#include "models.h"
#include "part_maker.h"
#include "plane_image.h"

namespace fibrolite {
namespace {

Part column(const Box3d& bounds, const Axis& axis, int id = 4) {
  PartMaker::Fields fields;
  fields.id = id;
  fields.kind = Kind::Column;
  fields.region = everything();
  fields.bounds_mm = bounds;
  fields.axis = axis;
  return PartMaker::make(fields);
}

Part straight_column(double radius_mm) {
  return column({{-radius_mm, -radius_mm, 0}, {radius_mm, radius_mm, 40}}, Axis::straight({0, 0, 0}, {0, 0, 40}));
}

TEST(Mfs, ALumenOfTenMillimetresHoldsAtLeastSevenFibres) {
  const Shape body = cylinder({0, 0, 0}, {0, 0, 40}, 6);
  const Fill fill = generate(straight_column(6), MfsParams{}, body, 1.0);
  EXPECT_GE(fill.fibres, 7);
  // 78.5 mm2 of lumen, 5 mm2 a cell: 16 whole ones if they fitted; cells cut by the shell count as well.
  EXPECT_LE(fill.fibres, 30);
  EXPECT_TRUE(fill.warnings.empty());
}

TEST(Mfs, MembranesFillAReasonableShareOfTheLumen) {
  const Shape body = cylinder({0, 0, 0}, {0, 0, 40}, 12);
  const Fill fill = generate(straight_column(12), MfsParams{}, body, 1.0);
  int inside = 0, solid = 0;
  Random random(2, "test");
  while (inside < 20000) {
    const Vec3d p{24 * random.uniform() - 12, 24 * random.uniform() - 12, 40 * random.uniform()};
    if (body(p) > -1) continue;
    ++inside;
    solid += fill.shape(p) < 0;
  }
  // Hexagons of pitch 2.4 with walls of 0.8: 1 - (1.6 / 2.4)^2 = 0.56; uneven cells have more border.
  EXPECT_NEAR(static_cast<double>(solid) / inside, 0.58, 0.06);
}

/// From the image of a honeycomb: hexagons of pitch p with walls w hold (p - w)^2 sqrt(3) / 2 of void each, and
/// 1 - that over p^2 sqrt(3) / 2 of membrane.
TEST(Mfs, TheCensusOfAHoneycombIsThatOfHexagons) {
  const testing::TempDir folder;
  write_gray(folder / "comb.png", honeycomb(14, 12, 24, 4));
  MfsParams params;
  params.fibre_mm = 3;
  params.wall_mm = 0.6;
  params.micrograph = folder / "comb.png";
  const Fill fill = generate(straight_column(15), params, cylinder({0, 0, 0}, {0, 0, 40}, 15), 1.0);
  EXPECT_EQ(fill.micrograph.fibres, 14 * 12);
  EXPECT_NEAR(fill.micrograph.membrane, 4, 0.5);
  EXPECT_EQ(fill.fibres, fill.section.fibres);
  EXPECT_NEAR(fill.section.membrane, 0.6, 0.03);
  const double area = (3 - 0.6) * (3 - 0.6) * std::sqrt(0.75), porosity = (1 - 0.6 / 3) * (1 - 0.6 / 3);
  EXPECT_NEAR(fill.section.mean_area, area, 0.1 * area);
  EXPECT_NEAR(fill.section.porosity, porosity, 0.05);
}

/// A limb from a radius of 9 to one of 6: fibres converge by the taper's most, 1.25 each way at most; as many at either
/// end as in the middle, where without a taper the narrow end has cut off half of them.
TEST(Mfs, ATaperKeepsFibresInANarrowingLimb) {
  const Shape body = intersect({round_cone({0, 0, -30}, 10.5, {0, 0, 90}, 4.5), half_space({0, 0, 60}, {0, 0, 1}),
                                half_space({0, 0, 0}, {0, 0, -1})});
  const Part part = column({{-10, -10, 0}, {10, 10, 60}}, Axis::straight({0, 0, 0}, {0, 0, 60}));
  MfsParams params;
  const auto fibres_at = [&](const Shape& membranes, double z) {
    // Voids wholly inside the lumen's section.
    const double radius = 9 - z / 20 - 1, step = 0.1;
    const int n = static_cast<int>(2 * radius / step);
    Image<std::uint8_t> open(n, n);
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const Vec3d p{x * step - radius, y * step - radius, z};
        open(x, y) = std::hypot(p.x, p.y) < radius && membranes(p) > 0;
      }
    int count = 0;
    const Regions voids = regions_of(open);
    for (const std::int64_t pixels : voids.pixels) count += pixels > 20;
    return count;
  };
  const Fill even = generate(part, params, body, 1.0);
  params.taper = true;
  const Fill tapered = generate(part, params, body, 1.0);
  const double even_wide = fibres_at(even.shape, 6), even_narrow = fibres_at(even.shape, 54);
  const double wide = fibres_at(tapered.shape, 6), narrow = fibres_at(tapered.shape, 54);
  EXPECT_LT(even_narrow, 0.65 * even_wide);
  EXPECT_GT(narrow, 0.75 * wide);
  EXPECT_LE(tapered.shape.lipschitz(), 1.05);
  for (const double z : {5.0, 30.0, 55.0}) {
    const Discs section(tapered.shape, frame_along({0, 0, z}, {0, 0, 1}), 9, 9, 0.02);
    EXPECT_TRUE(section.walls_hold(0.8 - 0.03, 1.2)) << z;
    EXPECT_TRUE(section.gaps_hold(0.4 - 0.03, 1.2)) << z;
  }
}

/// A quarter of a ring, as thick as a limb, and nine sections from end to end of it.
struct BentLimb {
  static constexpr double ring = 30, thick = 9, pixel = 0.1;
  static constexpr int sections = 9;
  MfsParams params;
  Shape body = intersect({torus({}, ring, thick), half_space({}, {-1, 0, 0}), half_space({}, {0, -1, 0})});
  Shape lumen = offset(body, -1.0);
  Fill fill;

  explicit BentLimb(double fibre_mm) {
    params.fibre_mm = fibre_mm;
    std::vector<Vec3d> line;
    for (int i = 0; i <= 60; ++i) line.push_back(on_line(std::numbers::pi / 2 * i / 60));
    fill =
        generate(column({{0, 0, -thick}, {ring + thick, ring + thick, thick}}, Axis::along(line)), params, body, 1.0);
  }
  static Vec3d on_line(double a) { return {ring * std::cos(a), ring * std::sin(a), 0}; }
  [[nodiscard]] static PlaneGrid grid_at(int section) {
    const double a = 0.06 + (std::numbers::pi / 2 - 0.12) * section / (sections - 1);
    return PlaneGrid::about({frame_along(on_line(a), {-std::sin(a), std::cos(a), 0})}, thick, pixel, 2);
  }
  [[nodiscard]] int ends_at(const Shape& membranes, int section) const {
    const PlaneGrid grid = grid_at(section);
    return count_free_edges(sample(membranes, grid), sample(lumen, grid), params.wall_mm, pixel);
  }
  [[nodiscard]] int fibres_at(int section) const {
    const PlaneGrid grid = grid_at(section);
    const FloatImage inside = sample(lumen, grid);
    return census(sample(fill.shape, grid), pixel, 0.25 * params.wall_mm * params.wall_mm, &inside).fibres;
  }
};

TEST(Mfs, NoMembraneOfABentLimbEndsInAVoidAnywhereAlongIt) {
  for (const double fibre_mm : {2.4, 6.0}) {
    const BentLimb limb(fibre_mm);
    EXPECT_EQ(limb.fill.free_edges, 0);
    EXPECT_GT(limb.fill.fibres, 0.8 * std::numbers::pi * 8 * 8 / (fibre_mm * fibre_mm));
    for (int k = 0; k < BentLimb::sections; ++k) {
      EXPECT_EQ(limb.ends_at(limb.fill.shape, k), 0) << k;
      EXPECT_NEAR(limb.fibres_at(k), limb.fill.fibres, 1) << k;
    }
  }
}

/// The longest wall near the middle of the second section, cut open to a gap of 0.6 mm with round ends on either side,
/// for 1.2 mm along the limb: found there, and in no other section, nor in the middle one that the report looks at.
TEST(Mfs, AMembraneCutOpenAnywhereAlongABentLimbIsFound) {
  const BentLimb limb(6);
  const double wall = limb.params.wall_mm, reach = 1.1;
  const PlaneGrid second = BentLimb::grid_at(1);
  const auto depth = [&](double u, double v) { return -limb.fill.shape(second.frame.to_world({u, v, 0})); };
  double best = 0, u = 0, v = 0, way = 0;
  for (double x = -4; x < 4; x += 0.1)
    for (double y = -4; y < 4; y += 0.1) {
      if (depth(x, y) > 0.55 * wall) continue;  // a junction
      for (double turn = 0; turn < std::numbers::pi; turn += 0.1) {
        const double dx = reach * std::cos(turn), dy = reach * std::sin(turn);
        const double least = std::min({depth(x, y), depth(x + dx, y + dy), depth(x - dx, y - dy)});
        if (least <= best) continue;
        best = least;
        u = x, v = y, way = turn;
      }
    }
  ASSERT_GT(best, 0.4 * wall);
  Frame at = second.frame;
  at.origin = second.frame.to_world({u, v, 0});
  at.x = std::cos(way) * second.frame.x + std::sin(way) * second.frame.y;
  at.y = cross(at.z, at.x);
  const double end = 0.3 + 0.5 * wall;
  const auto rim = [&](double side) { return capsule({side * end, 0, -0.6}, {side * end, 0, 0.6}, 0.5 * wall); };
  const Shape gap = placed(cuboid({{-end, -1.5, -0.6}, {end, 1.5, 0.6}}), at);
  const Shape torn = unite({subtract(limb.fill.shape, gap), placed(unite({rim(-1), rim(1)}), at)});
  for (int k = 0; k < BentLimb::sections; ++k) EXPECT_EQ(limb.ends_at(torn, k), k == 1 ? 2 : 0) << k;
}

TEST(Mfs, ATaperChangesNothingInAnEvenLimb) {
  const Shape body = cylinder({0, 0, 0}, {0, 0, 40}, 6);
  MfsParams params;
  const Fill even = generate(straight_column(6), params, body, 1.0);
  params.taper = true;
  const Fill tapered = generate(straight_column(6), params, body, 1.0);
  for (double x = -4; x < 4; x += 0.37)
    EXPECT_NEAR(even.shape({x, 0.4 * x, 20}), tapered.shape({x, 0.4 * x, 20}), 1e-3);
}

TEST(Mfs, ANarrowLumenIsFilledAndSaysSo) {
  const Shape body = cylinder({0, 0, 0}, {0, 0, 40}, 3);
  const Fill fill = generate(straight_column(3), MfsParams{}, body, 1.0);
  EXPECT_EQ(fill.fibres, 0);
  EXPECT_LT(fill.shape({0, 0, 20}), 0);
  EXPECT_LT(fill.shape({2.9, 0, 5}), 0);
  ASSERT_EQ(fill.warnings.size(), 1U);
  EXPECT_THAT(fill.warnings[0], ::testing::HasSubstr("part 4"));
  EXPECT_THAT(fill.warnings[0], ::testing::HasSubstr("4.0 mm"));
  EXPECT_THAT(fill.warnings[0], ::testing::HasSubstr("4.8 mm"));
}

TEST(Mfs, TheWidthDecidesAtTwoFibres) {
  for (const auto& [radius, filled] : {std::pair{3.3, true}, std::pair{3.5, false}}) {
    const Fill fill = generate(straight_column(radius), MfsParams{}, cylinder({0, 0, 0}, {0, 0, 40}, radius), 1.0);
    EXPECT_EQ(fill.warnings.size(), filled ? 1U : 0U) << "lumen " << 2 * (radius - 1);
  }
}

TEST(Mfs, OnlyThePartsOwnLimbIsMeasured) {
  // A wide body beside the limb, outside the part's region, must not make the limb look wide.
  const Shape body = unite({cylinder({0, 0, 0}, {0, 0, 40}, 3), cuboid({{10, -20, 0}, {50, 20, 40}})});
  PartMaker::Fields fields;
  fields.kind = Kind::Column;
  fields.region = half_space({6, 0, 0}, {1, 0, 0});
  fields.bounds_mm = {{-3, -3, 0}, {6, 3, 40}};
  fields.axis = Axis::straight({0, 0, 0}, {0, 0, 40});
  EXPECT_EQ(generate(PartMaker::make(fields), MfsParams{}, body, 1.0).warnings.size(), 1U);
}

TEST(Mfs, SeedsAndPartsDiffer) {
  const Shape body = cylinder({0, 0, 0}, {0, 0, 40}, 6);
  const Box3d bounds{{-6, -6, 0}, {6, 6, 40}};
  const Axis axis = Axis::straight({0, 0, 0}, {0, 0, 40});
  const auto values = [&](int id, std::uint64_t seed) {
    MfsParams params;
    params.seed = seed;
    const Fill fill = generate(column(bounds, axis, id), params, body, 1.0);
    std::vector<float> v;
    for (double x = -4; x < 4; x += 0.3) v.push_back(fill.shape({x, 0.5 * x, 12}));
    return v;
  };
  const std::vector<float> first = values(1, 1);
  EXPECT_EQ(values(1, 1), first);
  EXPECT_NE(values(2, 1), first);
  EXPECT_NE(values(1, 2), first);
}

TEST(Mfs, BadNumbersAndTemplatesAreRefused) {
  const Shape body = cylinder({0, 0, 0}, {0, 0, 40}, 6);
  const auto code = [&](auto change) {
    MfsParams params;
    change(params);
    try {
      (void)generate(straight_column(6), params, body, 1.0);
    } catch (const Error& e) {
      return e.code();
    }
    return Code::Internal;
  };
  const testing::TempDir folder;
  std::ofstream(folder / "bad.png") << "x";
  EXPECT_EQ(code([](MfsParams& p) { p.fibre_mm = 1.5; }), Code::BadRecipe);
  EXPECT_EQ(code([](MfsParams& p) { p.wall_mm = -1; }), Code::BadRecipe);
  EXPECT_EQ(code([&](MfsParams& p) { p.micrograph = folder / "bad.png"; }), Code::BadInput);
  EXPECT_EQ(code([&](MfsParams& p) { p.micrograph = folder / "none.png"; }), Code::BadInput);
}

}  // namespace
}  // namespace fibrolite
