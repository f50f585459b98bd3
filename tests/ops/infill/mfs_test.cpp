// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/mfs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "models.h"
#include "part_maker.h"

namespace fibrolite {
namespace {

using std::numbers::pi;

/// The image of a disc of radius r: distance r - |p| to its rim seen from a solid disc, negative inside.
MembraneImage disc_image(double radius_mm, double half_mm, double pixel_mm = 0.1) {
  MembraneImage image;
  image.pixel_mm = pixel_mm;
  const int middle = static_cast<int>(std::lround(half_mm / pixel_mm)), n = 2 * middle + 1;
  image.distance_mm = FloatImage(n, n);
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x)
      image.distance_mm(x, y) =
          static_cast<float>(std::hypot((x - middle) * pixel_mm, (y - middle) * pixel_mm) - radius_mm);
  return image;
}

const MembraneImage& muscle() {
  static const MembraneImage image = [] {
    MembraneParams params;
    params.width_mm = params.height_mm = 30;
    return synthesize(find_fibres(read_gray(bundled_micrograph())), params);
  }();
  return image;
}

/// A quarter circle of radius `ring` in the xy plane about the origin.
Axis arc(double ring_mm, int pieces = 60) {
  std::vector<Vec3d> line;
  for (int i = 0; i <= pieces; ++i) {
    const double a = pi / 2 * i / pieces;
    line.push_back({ring_mm * std::cos(a), ring_mm * std::sin(a), 0});
  }
  return Axis::along(line);
}

TEST(Sweep, ADiscAlongALineIsACylinder) {
  const Shape swept = sweep(disc_image(3, 8), Axis::straight({1, 2, 3}, {4, 6, 3}));
  const Vec3d t = normalized(Vec3d{3, 4, 0});
  Random random(1, "test");
  for (int i = 0; i < 500; ++i) {
    const Vec3d p{1 + 10 * random.uniform() - 5, 2 + 10 * random.uniform() - 5, 3 + 8 * random.uniform() - 4};
    const Vec3d d = p - Vec3d{1, 2, 3};
    const double across = norm(d - dot(d, t) * t);
    if (across > 0.5 && across < 5) {
      EXPECT_NEAR(swept(p), across - 3, 0.004) << "bilinear: pixel^2 / (8 radius)";
    }
  }
}

TEST(Sweep, ADiscAlongAnArcIsATorus) {
  const double ring = 20;
  const Shape swept = sweep(disc_image(4, 9), arc(ring)), exact = torus({}, ring, 4);
  double worst = 0;
  for (double a = 0.01; a < pi / 2; a += 0.013)
    for (double r = 12.5; r < 28; r += 0.83)
      for (double z = -6; z <= 6; z += 0.77) {
        if (std::hypot(r - ring, z) < 0.7) continue;  // the tip of the cone, where bilinear values are blunt
        const Vec3d p{r * std::cos(a), r * std::sin(a), z};
        worst = std::max(worst, std::abs(static_cast<double>(swept(p) - exact(p))));
      }
  EXPECT_LT(worst, 0.01);
}

/// Round a ring the value depends on the place across it alone, and nowhere does a membrane break off: not at the seam
/// of a flat ring, and not where the frame of a ring bent out of its plane comes back turned.
TEST(Sweep, ARingHasNoSeam) {
  const double radius = 20;
  const int pieces = 90;
  std::vector<Vec3d> flat, bent;
  for (int i = 0; i <= pieces; ++i) {
    const double a = 2 * pi * (i % pieces) / pieces;
    flat.push_back({radius * std::cos(a), radius * std::sin(a), 0});
    bent.push_back({radius * std::cos(a), radius * std::sin(a), 6 * std::sin(2 * a) + 3 * std::cos(a)});
  }
  const Shape ring = sweep(muscle(), Axis::along(flat));
  for (double r = 15; r < 25; r += 0.7)
    for (double z = -5; z <= 5; z += 0.9) {
      const float first = ring({-r, 0, z});
      for (double a = -0.3; a < 0.3; a += 0.05)
        EXPECT_NEAR(ring({r * std::cos(a), r * std::sin(a), z}), first, 0.06) << r << ' ' << z << ' ' << a;
    }
  const Shape knot = sweep(muscle(), Axis::along(bent));
  const double step = 0.02, lipschitz = knot.lipschitz();
  for (double r = 17; r < 23; r += 1.1)
    for (double a = -0.2; a < 0.2; a += step / r) {
      const auto at = [&](double angle) {
        return knot({r * std::cos(angle), r * std::sin(angle), 6 * std::sin(2 * angle) + 3 * std::cos(angle)});
      };
      EXPECT_LT(std::abs(at(a) - at(a + step / r)), 2 * lipschitz * step) << r << ' ' << a;
    }
}

TEST(Sweep, CenterMovesTheImage) {
  const Axis axis = Axis::straight({0, 0, 0}, {0, 0, 10});
  const Shape moved = sweep(disc_image(2, 8), axis, {1.5, -0.5});
  const Frame f = frame_along({}, {0, 0, 1});
  EXPECT_NEAR(moved(f.to_world({1.5, -0.5, 4})), -2, 0.01);
  EXPECT_NEAR(moved(f.to_world({3.5, -0.5, -4})), 0, 0.01);
}

TEST(Sweep, MembranesRunAlongABentLimb) {
  const Shape swept = sweep(muscle(), arc(40));
  double worst = 0;
  for (double r = 29; r <= 51; r += 0.71)
    for (double z = -11; z <= 11; z += 0.67) {
      const float start = swept({r * std::cos(0.02), r * std::sin(0.02), z});
      for (double a = 0.03; a < 1.55; a += 0.05)
        worst = std::max(worst, std::abs(static_cast<double>(swept({r * std::cos(a), r * std::sin(a), z}) - start)));
    }
  EXPECT_LT(worst, 0.02);
}

/// c(s) = (r cos s, r sin s, h s) and the walk along the normal planes of it.
struct Helix {
  double r = 30, h = 12;
  [[nodiscard]] Vec3d at(double s) const { return {r * std::cos(s), r * std::sin(s), h * s}; }
  [[nodiscard]] Vec3d slope(double s) const { return {-r * std::sin(s), r * std::cos(s), h}; }
  [[nodiscard]] Vec3d bend(double s) const { return {-r * std::cos(s), -r * std::sin(s), 0}; }
  /// Parameter of the normal plane through p, by Newton from a guess.
  [[nodiscard]] double plane_of(Vec3d p, double s) const {
    for (int i = 0; i < 20; ++i) s += dot(p - at(s), slope(s)) / (dot(slope(s), slope(s)) - dot(p - at(s), bend(s)));
    return s;
  }
};

TEST(Sweep, ValueIsConstantAlongTheLimbInSpace) {
  // A helix has torsion: a frame that does not minimise rotation would twist the fibres out of their planes' normals.
  const Helix helix;
  std::vector<Vec3d> line;
  for (int i = 0; i <= 100; ++i) line.push_back(helix.at(2.5 * i / 100));
  const Shape swept = sweep(muscle(), Axis::along(line));
  double worst = 0;
  Random random(3, "test");
  for (int k = 0; k < 40; ++k) {
    const Frame f = frame_along(helix.at(0.1), helix.slope(0.1));
    Vec3d p = f.to_world({16 * random.uniform() - 8, 16 * random.uniform() - 8, 0});
    double s = 0.1;
    const float start = swept(p);
    while (s < 2.4) {  // midpoint rule along the field of plane normals, 0.05 mm a step
      const Vec3d half = p + 0.025 * normalized(helix.slope(s));
      p = p + 0.05 * normalized(helix.slope(helix.plane_of(half, s)));
      s = helix.plane_of(p, s);
      worst = std::max(worst, std::abs(static_cast<double>(swept(p) - start)));
    }
  }
  EXPECT_LT(worst, 0.04);
}

TEST(Sweep, BoundsHoldAndTheLipschitzConstantToo) {
  for (const Axis& axis : {arc(40), Axis::straight({0, 0, -5}, {3, 1, 50})}) {
    const Shape swept = sweep(muscle(), axis);
    const Vec3d base = axis.centre_line()[axis.centre_line().size() / 2];
    Random random(5, "test");
    const auto inside = [&](double reach) {
      return base + Vec3d{reach * (2 * random.uniform() - 1), reach * (2 * random.uniform() - 1),
                          reach * (2 * random.uniform() - 1)};
    };
    for (int i = 0; i < 300; ++i) {
      const Vec3d low = inside(8);
      const double side = 0.1 + 3 * random.uniform();
      const Box3d box{low, low + Vec3d{side, side, side}};
      const Interval bound = swept.bound(box);
      float before = 0;
      Vec3d q;
      for (int k = 0; k < 30; ++k) {
        const Vec3d p = low + side * Vec3d{random.uniform(), random.uniform(), random.uniform()};
        const float value = swept(p);
        EXPECT_GE(value, bound.lo);
        EXPECT_LE(value, bound.hi);
        if (k > 0) {
          EXPECT_LE(std::abs(value - before), swept.lipschitz() * norm(p - q) + 1e-3);
        }
        before = value;
        q = p;
      }
    }
  }
}

TEST(Sweep, ABlockGivesWhatSinglePointsGive) {
  const Shape swept = sweep(muscle(), arc(25));
  Random random(9, "test");
  for (int b = 0; b < 40; ++b) {
    std::array<float, 512> x, y, z, out;
    const double a = 1.4 * random.uniform() + 0.05;
    const Vec3d low{25 * std::cos(a) - 3, 25 * std::sin(a) - 3, -3};
    for (std::size_t i = 0; i < 512; ++i) {
      const std::size_t row = i / 64, column = i / 8 % 8, depth = i % 8;
      x[i] = static_cast<float>(low.x + 0.8 * static_cast<double>(row));
      y[i] = static_cast<float>(low.y + 0.8 * static_cast<double>(column));
      z[i] = static_cast<float>(low.z + 0.8 * static_cast<double>(depth));
    }
    swept.evaluate({x.data(), y.data(), z.data(), 512}, out.data());
    for (std::size_t i = 0; i < 512; i += 7) EXPECT_NEAR(out[i], swept({x[i], y[i], z[i]}), 1e-5);
  }
}

// --- generate
// ------------------------------------------------------------------------------------------------------------------

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
