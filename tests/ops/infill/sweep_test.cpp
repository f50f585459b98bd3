// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/sweep.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "discs.h"
#include "fibrolite/ops/infill/mfs.h"
#include "fibrolite/random.h"

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
  EXPECT_NEAR(moved(f.to_world({1.5, -0.5, 4})), -2, 0.06) << "the tip of a cone is blunt";
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

/// Steepest rise over pairs of points up to 2 mm apart and over 0.02 mm, and the flattest near the surface, of places
/// `place` gives.
struct Slopes {
  double steepest = 0, flattest_at_surface = 10;
};
template <class Place>
Slopes slopes(const Shape& shape, Place&& place) {
  Slopes result;
  Random random(17, "slopes");
  const auto direction = [&] {
    return normalized(Vec3d{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5});
  };
  for (int i = 0; i < 40000; ++i) {
    const Vec3d p = place(random);
    const double value = shape(p);
    for (const double apart : {0.02, 0.3, 2.0}) {
      const Vec3d q = p + apart * random.uniform() * direction();
      if (norm(p - q) > 0.25 * apart)
        result.steepest = std::max(result.steepest, (std::abs(shape(q) - value) - 2e-6) / norm(p - q));
    }
    const double h = 0.01;
    const Vec3d gradient =
        (0.5 / h) * Vec3d{static_cast<double>(shape(p + Vec3d{h, 0, 0}) - shape(p - Vec3d{h, 0, 0})),
                          static_cast<double>(shape(p + Vec3d{0, h, 0}) - shape(p - Vec3d{0, h, 0})),
                          static_cast<double>(shape(p + Vec3d{0, 0, h}) - shape(p - Vec3d{0, 0, h}))};
    result.steepest = std::max(result.steepest, norm(gradient) - 1e-3);
    if (std::abs(value) < 0.05) result.flattest_at_surface = std::min(result.flattest_at_surface, norm(gradient));
  }
  return result;
}

/// A place up to `reach` off a quarter of a circle.
Vec3d about_arc(Random& random, double ring_mm, double reach_mm) {
  const double a = 0.05 + (pi / 2 - 0.1) * random.uniform(), r = reach_mm * std::sqrt(random.uniform()),
               turn = 2 * pi * random.uniform(), out = ring_mm + r * std::cos(turn);
  return {out * std::cos(a), out * std::sin(a), r * std::sin(turn)};
}

TEST(Sweep, ADistanceWithinFivePercent) {
  const auto straight = [](Random& random) {
    return Vec3d{20 * random.uniform() - 10, 20 * random.uniform() - 10, 30 * random.uniform()};
  };
  const Slopes along_line = slopes(sweep(muscle(), Axis::straight({0, 0, 0}, {0, 0, 30})), straight);
  EXPECT_LE(along_line.steepest, 1.05);
  EXPECT_GE(along_line.flattest_at_surface, 0.9) << "blunt within two pixels of the middle of a void of 0.4";
  for (const double ring : {16.0, 25.0, 60.0}) {  // 16: the limb's inner side is at half the radius of its line
    const Slopes bent = slopes(sweep(muscle(), arc(ring)), [&](Random& random) { return about_arc(random, ring, 8); });
    EXPECT_LE(bent.steepest, 1.05) << ring;
    EXPECT_GE(bent.flattest_at_surface, 0.9) << ring;
  }
  EXPECT_LE(sweep(muscle(), arc(25)).lipschitz(), 1.05);
}

/// Triangles between the same fibres, straight and bent.
TEST(Sweep, ADistanceWithinFivePercentBetweenDelaunayWallsToo) {
  MembraneParams params;
  params.width_mm = params.height_mm = 30;
  params.walls = Walls::Delaunay;
  params.fibre_mm = 4.15;
  const MembraneImage triangles = synthesize(find_fibres(read_gray(bundled_micrograph())), params);
  const Slopes along_line = slopes(sweep(triangles, Axis::straight({0, 0, 0}, {0, 0, 30})), [](Random& random) {
    return Vec3d{20 * random.uniform() - 10, 20 * random.uniform() - 10, 30 * random.uniform()};
  });
  EXPECT_LE(along_line.steepest, 1.05);
  EXPECT_GE(along_line.flattest_at_surface, 0.9);
  const Shape swept = sweep(triangles, arc(25));
  const Slopes bent = slopes(swept, [](Random& random) { return about_arc(random, 25, 8); });
  EXPECT_LE(bent.steepest, 1.05);
  EXPECT_GE(bent.flattest_at_surface, 0.9);
  EXPECT_LE(swept.lipschitz(), 1.05);
}

/// A ring bent out of its plane: its frame comes back turned, and is turned back along the way.
TEST(Sweep, ADistanceWithinFivePercentAroundATwistedRing) {
  const auto line = [](double a) {
    return Vec3d{20 * std::cos(a), 20 * std::sin(a), 6 * std::sin(2 * a) + 3 * std::cos(a)};
  };
  std::vector<Vec3d> points;
  constexpr int count = 180;
  for (int i = 0; i <= count; ++i) points.push_back(line(2 * pi * (i % count) / count));
  const Axis axis = Axis::along(points);
  ASSERT_GT(std::abs(Sweep(axis).twist_per_mm()), 0) << "or it is no test of a twist";
  const Shape ring = sweep(muscle(), axis);
  EXPECT_LE(ring.lipschitz(), 1.05);
  const Slopes found = slopes(ring, [&](Random& random) {
    const double a = 2 * pi * random.uniform(), r = 6 * std::sqrt(random.uniform()), turn = 2 * pi * random.uniform();
    return frame_along(line(a), line(a + 1e-4) - line(a - 1e-4)).to_world({r * std::cos(turn), r * std::sin(turn), 0});
  });
  EXPECT_LE(found.steepest, 1.05);
  EXPECT_GE(found.flattest_at_surface, 0.9);
}

/// Samples of the inside of a bent tube, h apart along its section and its line: regions of void and of wall in space.
/// A membrane that broke off, or ended, would let two voids run into one, or one into its end.
TEST(Sweep, MembranesAreUnbrokenFromEndToEnd) {
  const double ring = 18, reach = 7, h = 0.1;
  const Shape shape = sweep(muscle(), arc(ring));
  const int side = static_cast<int>(2 * reach / h) + 1, length = 140;
  std::vector<std::uint8_t> open(static_cast<std::size_t>(side * side * length), 0);
  const auto index = [&](int i, int j, int k) { return static_cast<std::size_t>((k * side + j) * side + i); };
  std::vector<Vec3d> points;
  for (int k = 0; k < length; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const double a = 0.03 + (pi / 2 - 0.06) * k / (length - 1), out = ring + i * h - reach, up = j * h - reach;
        points.push_back({out * std::cos(a), out * std::sin(a), up});
      }
  std::vector<float> value(points.size());
  shape.evaluate(points, value);
  for (int k = 0; k < length; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i)
        open[index(i, j, k)] = value[index(i, j, k)] > 0 && std::hypot(i * h - reach, j * h - reach) < reach ? 1 : 0;
  // Regions of the first section alone, and of all of them.
  const auto regions = [&](int sections) {
    std::vector<std::uint8_t> left = open;
    int count = 0, through = 0;
    for (std::size_t start = 0; start < static_cast<std::size_t>(side * side * sections); ++start) {
      if (left[start] == 0) continue;
      ++count;
      bool at_first = false, at_last = false;
      std::vector<std::size_t> stack{start};
      left[start] = 0;
      while (!stack.empty()) {
        const auto n = static_cast<int>(stack.back());
        stack.pop_back();
        const int i = n % side, j = n / side % side, k = n / side / side;
        at_first |= k == 0;
        at_last |= k == sections - 1;
        for (const auto& [x, y, z] : {std::array{i - 1, j, k}, std::array{i + 1, j, k}, std::array{i, j - 1, k},
                                      std::array{i, j + 1, k}, std::array{i, j, k - 1}, std::array{i, j, k + 1}})
          if (x >= 0 && y >= 0 && z >= 0 && x < side && y < side && z < sections && left[index(x, y, z)] != 0) {
            left[index(x, y, z)] = 0;
            stack.push_back(index(x, y, z));
          }
      }
      through += at_first && at_last;
    }
    return std::pair{count, through};
  };
  const auto [in_section, one_deep] = regions(1);
  const auto [in_space, through] = regions(length);
  EXPECT_GT(in_section, 25);
  EXPECT_EQ(in_space, in_section);
  EXPECT_EQ(through, in_section);
}

// --- taper
// ----------------------------------------------------------------------------------------------------------------

/// From 1.25 at one end to 0.8 at the other, over a length of 60.
Taper cone() {
  Taper taper;
  for (int i = 0; i <= 20; ++i) taper.scale.push_back(1.25 - 0.45 * i / 20);
  taper.slope = 8 * 0.45 / 60 / 0.8;  // of what lies 8 mm off the line
  return taper;
}

MembraneImage muscle_to_shrink(Walls walls) {
  MembraneParams params;
  params.width_mm = params.height_mm = 24;
  params.least_scale = 0.8;
  params.walls = walls;
  if (walls == Walls::Delaunay) params.fibre_mm = 5;
  return synthesize(find_fibres(read_gray(bundled_micrograph())), params);
}

TEST(Taper, FibresConvergeAndWallsAndGapsHold) {
  for (const Walls walls : {Walls::Image, Walls::Delaunay}) {
    const Shape shape = sweep(muscle_to_shrink(walls), Axis::straight({0, 0, 0}, {0, 0, 60}), {}, cone());
    for (const double z : {0.0, 20.0, 40.0, 60.0}) {
      const Discs section(shape, frame_along({0, 0, z}, {0, 0, 1}), 14, 14, 0.02);
      EXPECT_TRUE(section.walls_hold(0.8 - 0.03, 1.5)) << z;
      EXPECT_FALSE(section.walls_hold(0.8 + 0.06, 1.5)) << z << ": as thick wherever the limb is";
      EXPECT_TRUE(section.gaps_hold(0.4 - 0.03, 1.5)) << z;
    }
  }
}

TEST(Taper, AFibreIsFoundWhereTheScalePutsIt) {
  // Half way off the middle between two walls stays half way: what is void at the narrow end is void at the wide one.
  const Shape shape = sweep(muscle_to_shrink(Walls::Image), Axis::straight({0, 0, 0}, {0, 0, 60}), {}, cone());
  const Frame narrow = frame_along({0, 0, 60}, {0, 0, 1}), wide = frame_along({0, 0, 0}, {0, 0, 1});
  int voids = 0;
  for (double u = -6; u < 6; u += 0.13)
    for (double v = -6; v < 6; v += 0.17) {
      if (shape(narrow.to_world({u, v, 0})) < 0.02) continue;
      ++voids;
      EXPECT_GT(shape(wide.to_world({u * 1.25 / 0.8, v * 1.25 / 0.8, 0})), 0) << u << ' ' << v;
    }
  EXPECT_GT(voids, 1000);
}

TEST(Taper, ADistanceWithinFivePercent) {
  const Shape shape = sweep(muscle_to_shrink(Walls::Image), Axis::straight({0, 0, 0}, {0, 0, 60}), {}, cone());
  const Slopes found = slopes(shape, [](Random& random) {
    const double r = 7.5 * std::sqrt(random.uniform()), turn = 2 * pi * random.uniform();
    return Vec3d{r * std::cos(turn), r * std::sin(turn), 1 + 58 * random.uniform()};
  });
  EXPECT_LE(found.steepest, 1.05);
  EXPECT_GE(found.flattest_at_surface, 0.9);
  EXPECT_LE(shape.lipschitz(), 1.05);
}

}  // namespace
}  // namespace fibrolite
