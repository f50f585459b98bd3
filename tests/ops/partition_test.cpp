// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/partition.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "models.h"

namespace fibrolite {
namespace {

struct Parted {
  Proxy proxy;
  DiameterField field;
  Partition partition;
};

Parted parted(const Shape& shape, const Box3d& box, double voxel_mm, const PartitionParams& params = {}) {
  Parted p;
  p.proxy.solid = realize(shape, box, Grid{voxel_mm, 3});
  p.proxy.surface = surface(p.proxy.solid);
  p.field = diameter(p.proxy.surface);
  p.partition = partition(p.proxy, p.field, params);
  return p;
}

Parted parted(const Mesh& model, const PartitionParams& params = {}) {
  Parted p;
  p.proxy = make_proxy(model, {.triangles = 20000});
  p.field = diameter(p.proxy.surface);
  p.partition = partition(p.proxy, p.field, params);
  return p;
}

std::vector<Candidate> columns(const Partition& p) {
  std::vector<Candidate> list;
  std::copy_if(p.candidates.begin(), p.candidates.end(), std::back_inserter(list),
               [](const auto& c) { return c.column_like; });
  return list;
}

double degrees_between(Vec3d a, Vec3d b) {
  return std::acos(std::min(1.0, std::abs(dot(normalized(a), normalized(b))))) * 180 / std::numbers::pi;
}

// A ball of radius 20 with a finger of radius 5 up to z = 65 whose root is rounded.
const Box3d finger_box{{-22, -22, -22}, {22, 22, 67}};
Shape ball_with_finger() { return smooth_unite(sphere({}, 20), capsule({}, {0, 0, 60}, 5), 2); }

const Box3d quadruped_box{{-50, -20, -62}, {50, 20, 20}};
Shape quadruped(int quarter_turns = 0) {
  const auto turn = [&](Vec3d p) { return quarter_turns == 0 ? p : Vec3d{-p.y, p.x, p.z}; };
  Shape body = capsule(turn({-30, 0, 0}), turn({30, 0, 0}), 16);
  for (const double x : {-28.0, 28.0})
    for (const double y : {-9.0, 9.0})
      body = smooth_unite(body, round_cone(turn({x, y, -8}), 6.5, turn({1.1 * x, y, -55}), 4.5), 3);
  return body;
}

// Quarter of a ring of radius 40 in the xz plane, about (0, 0, 0), from the x axis to the z axis.
Shape bent_tube(double ring_mm, double tube_mm) {
  constexpr int pieces = 32;
  std::vector<Shape> links;
  Vec3d from{ring_mm, 0, 0};
  for (int i = 1; i <= pieces; ++i) {
    const double a = std::numbers::pi / 2 * i / pieces;
    const Vec3d to{ring_mm * std::cos(a), 0, ring_mm * std::sin(a)};
    links.push_back(capsule(from, to, tube_mm));
    from = to;
  }
  return unite(std::move(links));
}

const Box3d y_box{{-42, -8, -48}, {42, 8, 30}};
Shape y_shape() {
  return unite({capsule({}, {0, 0, -40}, 6), capsule({}, {34, 0, 20}, 6), capsule({}, {-34, 0, 20}, 6)});
}

// Made once for the tests that only look.
const Parted& finger() {
  static const Parted made = parted(ball_with_finger(), finger_box, 1.2);
  return made;
}
const Parted& animal() {
  static const Parted made = parted(quadruped(), quadruped_box, 1.6);
  return made;
}

TEST(Partition, AFingerOnABallIsCutOffAtItsRoot) {
  const Parted& p = finger();
  ASSERT_EQ(p.partition.candidates.size(), 2U);
  EXPECT_FALSE(p.partition.candidates[0].column_like);
  const Candidate& finger = p.partition.candidates[1];
  ASSERT_TRUE(finger.column_like) << finger.reason;
  ASSERT_EQ(p.partition.cuts.size(), 1U);
  const Cut& cut = p.partition.cuts[0];
  // The ball meets the finger at z = sqrt(20^2 - 5^2) = 19.4; its rounding ends within half a finger of that.
  EXPECT_GT(cut.frame.origin.z, 19.0);
  EXPECT_LT(cut.frame.origin.z, 24.5);
  EXPECT_LT(degrees_between(cut.frame.z, {0, 0, 1}), 5);
  EXPECT_NEAR(cut.radius_mm, 5, 1.2);
  const double z = cut.frame.origin.z;
  const double volume = std::numbers::pi * 25 * (60 - z) + 2.0 / 3 * std::numbers::pi * 125;
  EXPECT_NEAR(finger.volume_mm3, volume, 0.05 * volume);
  EXPECT_NEAR(finger.length_mm, 65 - z, 1.5);
  EXPECT_LT(degrees_between(finger.axis.mean(), {0, 0, 1}), 1.5);
  EXPECT_GT(finger.axis.mean().z, 0) << "from the cut to the tip";
  EXPECT_GE(p.partition.stable_to - p.partition.stable_from, 0.1);
}

TEST(Partition, AQuadrupedHasABodyAndFourLegs) {
  const Parted& p = animal();
  ASSERT_EQ(p.partition.candidates.size(), 5U);
  EXPECT_FALSE(p.partition.candidates[0].column_like);
  double total = 0;
  for (const Candidate& c : p.partition.candidates) total += c.volume_mm3;
  EXPECT_NEAR(total, p.proxy.solid.volume_mm3(), 1e-9 * total);
  for (std::size_t i = 1; i < 5; ++i) {
    const Candidate& leg = p.partition.candidates[i];
    EXPECT_TRUE(leg.column_like) << leg.reason;
    // A cone of radii 6.5 and 4.5 from the belly (z = -14 .. -19) to z = -59.5.
    EXPECT_GT(leg.volume_mm3, std::numbers::pi * 25 * 38);
    EXPECT_LT(leg.volume_mm3, std::numbers::pi * 36 * 46);
    const Vec3d along = {leg.centroid_mm.x > 0 ? 2.8 : -2.8, 0, -47};
    EXPECT_LT(degrees_between(leg.axis.mean(), along), 4) << leg.reason;
  }
}

TEST(Partition, ATurnedModelHasTheSameParts) {
  const Parted& a = animal();
  const Parted b = parted(quadruped(1), Box3d{{-20, -50, -62}, {20, 50, 20}}, 1.6);
  ASSERT_EQ(a.partition.candidates.size(), b.partition.candidates.size());
  for (const Candidate& c : a.partition.candidates) {
    const Vec3d at{-c.centroid_mm.y, c.centroid_mm.x, c.centroid_mm.z};
    const auto same = std::min_element(
        b.partition.candidates.begin(), b.partition.candidates.end(),
        [&](const auto& x, const auto& y) { return norm(x.centroid_mm - at) < norm(y.centroid_mm - at); });
    EXPECT_EQ(c.column_like, same->column_like);
    EXPECT_NEAR(c.volume_mm3, same->volume_mm3, 0.03 * c.volume_mm3);
    EXPECT_LT(norm(same->centroid_mm - at), 0.8);
  }
}

TEST(Partition, TheVoxelOfTheProxyDoesNotDecide) {
  const Parted& a = animal();
  const Parted b = parted(quadruped(), quadruped_box, 1.2);
  ASSERT_EQ(a.partition.candidates.size(), b.partition.candidates.size());
  EXPECT_EQ(columns(a.partition).size(), columns(b.partition).size());
}

TEST(Partition, ATorusIsOneRingWithItsCentreLine) {
  const Parted p = parted(torus(Frame{}, 30, 6), Box3d{{-38, -38, -8}, {38, 38, 8}}, 1.3);
  ASSERT_EQ(p.partition.candidates.size(), 1U);
  const Candidate& ring = p.partition.candidates[0];
  ASSERT_TRUE(ring.column_like) << ring.reason;
  EXPECT_NEAR(ring.axis.length_mm(), 2 * std::numbers::pi * 30, 0.03 * 2 * std::numbers::pi * 30);
  for (int i = 0; i < 12; ++i) {
    const double a = 2 * std::numbers::pi * (i + 0.5) / 12;
    const Vec3d p0{30 * std::cos(a), 30 * std::sin(a), 0};
    EXPECT_LT(degrees_between(ring.axis.tangent(p0), {-std::sin(a), std::cos(a), 0}), 6)
        << "at " << i * 30 << " degrees";
  }
  for (const Vec3d q : ring.axis.centre_line()) {
    EXPECT_NEAR(std::hypot(q.x, q.y), 30, 0.7);
    EXPECT_NEAR(q.z, 0, 0.5);
  }
  EXPECT_TRUE(p.partition.cuts.empty());
}

// Around z, ring_mm to the middle of a tube that is thinnest, thin_mm instead of tube_mm, at one angle.
Shape uneven_ring(double ring_mm, double tube_mm, double thin_mm, double thin_at) {
  constexpr int pieces = 120;
  const auto angle = [](int i) { return 2 * std::numbers::pi * i / pieces; };
  const auto place = [&](int i) { return Vec3d{ring_mm * std::cos(angle(i)), ring_mm * std::sin(angle(i)), 0}; };
  const auto radius = [&](int i) {
    const double off = std::remainder(angle(i) - thin_at, 2 * std::numbers::pi) / 0.5;
    return tube_mm - (tube_mm - thin_mm) * std::exp(-off * off);
  };
  std::vector<Shape> links;
  for (int i = 0; i < pieces; ++i) links.push_back(round_cone(place(i), radius(i), place(i + 1), radius(i + 1)));
  return unite(std::move(links));
}

TEST(Partition, ARingIsCutWhereItIsThinnest) {
  for (const double degrees : {10.0, 133.0, 275.0}) {
    const double thin_at = degrees * std::numbers::pi / 180;
    const Parted p = parted(uneven_ring(30, 7, 5, thin_at), Box3d{{-39, -39, -9}, {39, 39, 9}}, 1.3);
    ASSERT_EQ(p.partition.candidates.size(), 1U);
    const Candidate& ring = p.partition.candidates[0];
    ASSERT_NE(ring.reason.find("ring"), std::string::npos) << ring.reason;
    // The line starts and ends in the cut.
    const Vec3d cut = ring.axis.centre_line().front();
    EXPECT_LT(norm(cut - ring.axis.centre_line().back()), 1e-6);
    const double off = std::remainder(std::atan2(cut.y, cut.x) - thin_at, 2 * std::numbers::pi);
    EXPECT_LT(std::abs(30 * off), 0.25 * 14) << degrees;                  // of the ring's width
    EXPECT_LT(7 - 2 * std::exp(-off * off / 0.25), 1.03 * 5) << degrees;  // its radius there
  }
}

TEST(Partition, AYIsThreeLimbs) {
  const Parted p = parted(y_shape(), y_box, 1.2);
  ASSERT_EQ(p.partition.candidates.size(), 3U);
  EXPECT_EQ(columns(p.partition).size(), 3U);
  double total = 0;
  for (const Candidate& c : p.partition.candidates) total += c.volume_mm3;
  EXPECT_NEAR(total, p.proxy.solid.volume_mm3(), 1e-9 * total);
  // Each arm is a bar of radius 6 and length 40 with a round end: 4976 mm3 less or more of the fork.
  for (const Candidate& c : p.partition.candidates) {
    EXPECT_GT(c.volume_mm3, 4000);
    EXPECT_LT(c.volume_mm3, 6200);
    Vec3d arm = c.centroid_mm.z < -5 ? Vec3d{0, 0, -1} : c.centroid_mm.x > 0 ? Vec3d{34, 0, 20} : Vec3d{-34, 0, 20};
    // Out on the arm, away from the fork that one of them keeps.
    EXPECT_LT(degrees_between(c.axis.tangent(28 * normalized(arm)), arm), 3) << c.reason;
  }
}

/// A trunk down from the origin and two arms up, each leaning so many degrees, turned by a frame.
Shape leaning_y(double degrees, const Frame& turn) {
  const double lean = degrees * std::numbers::pi / 180, x = 56 * std::sin(lean), z = 56 * std::cos(lean);
  const auto at = [&](Vec3d p) { return turn.to_world(p); };
  const Shape arms = unite({capsule(at({}), at({x, 0, z}), 8), capsule(at({}), at({-x, 0, z}), 8)});
  return smooth_unite(capsule(at({}), at({0, 0, -64}), 9.5), arms, 5);
}

/// Whether a trunk runs straight on into an arm is not decided by where a level set happens to pass the fork: the limit
/// is a lean of 32 degrees.
TEST(Partition, AForkIsJudgedAlikeHoweverItIsTurned) {
  Random random(1, "forks", 0);
  const auto unit = [&] { return 2 * random.uniform() - 1; };
  const auto limbs = [](const Shape& shape) {
    return parted(shape, Box3d{{-80, -80, -80}, {80, 80, 80}}, 1.6).partition.candidates.size();
  };
  for (int turn = 0; turn < 10; ++turn) {
    const Frame frame = frame_along({}, {unit(), unit(), unit() + 0.01});
    EXPECT_EQ(limbs(leaning_y(34.5, frame)), 3U) << turn;
    if (turn % 3 == 0) {
      EXPECT_EQ(limbs(leaning_y(29.5, frame)), 2U) << turn;
    }
  }
}

TEST(Partition, ABarThatRunsOnKeepsItsSideBranchOff) {
  const Shape t = unite({capsule({-40, 0, 0}, {40, 0, 0}, 6), capsule({}, {0, 0, 45}, 6)});
  const Parted p = parted(t, Box3d{{-48, -8, -8}, {48, 8, 53}}, 1.2);
  ASSERT_EQ(p.partition.candidates.size(), 2U);
  EXPECT_TRUE(p.partition.candidates[0].column_like && p.partition.candidates[1].column_like);
  EXPECT_LT(degrees_between(p.partition.candidates[0].axis.mean(), {1, 0, 0}), 2);
  EXPECT_NEAR(p.partition.candidates[0].length_mm, 92, 2);
  EXPECT_LT(degrees_between(p.partition.candidates[1].axis.mean(), {0, 0, 1}), 2);
}

TEST(Partition, TheAxisFollowsABentTube) {
  const Parted p = parted(bent_tube(40, 6), Box3d{{-8, -8, -8}, {48, 8, 48}}, 1.1);
  ASSERT_EQ(p.partition.candidates.size(), 1U);
  const Candidate& tube = p.partition.candidates[0];
  ASSERT_TRUE(tube.column_like) << tube.reason;
  EXPECT_NEAR(tube.length_mm, std::numbers::pi / 2 * 40 + 12, 1.5);
  for (int i = 1; i < 10; ++i) {
    const double a = std::numbers::pi / 2 * i / 10;
    for (const double r : {36.0, 40.0, 44.0}) {
      const Vec3d at{r * std::cos(a), 1, r * std::sin(a)};
      EXPECT_LT(degrees_between(tube.axis.tangent(at), {-std::sin(a), 0, std::cos(a)}), 4)
          << "at " << 9 * i << " degrees, r " << r;
    }
  }
  // Evenly spaced, and normal planes do not cross inside the tube.
  const std::vector<Vec3d>& line = tube.axis.centre_line();
  const double step = tube.axis.length_mm() / static_cast<double>(line.size() - 1);
  for (std::size_t i = 0; i + 1 < line.size(); ++i) EXPECT_NEAR(norm(line[i + 1] - line[i]), step, 0.05 * step);
}

TEST(Partition, LumpsAreBulk) {
  const Box3d box{{-14, -14, -14}, {14, 14, 14}};
  for (const Shape& lump :
       {sphere({}, 10), cuboid({{-10, -10, -10}, {10, 10, 10}}), cuboid({{-12, -12, -2}, {12, 12, 2}})}) {
    const Parted p = parted(lump, box, 1.0);
    ASSERT_EQ(p.partition.candidates.size(), 1U);
    EXPECT_FALSE(p.partition.candidates[0].column_like) << p.partition.candidates[0].reason;
    EXPECT_EQ(p.partition.labels.count(), 1);
  }
}

TEST(Partition, AHandleIsAColumnBetweenTwoCuts) {
  const Shape jug = unite({cuboid({{-30, -15, -20}, {30, 15, 0}}), capsule({-20, 0, -5}, {-20, 0, 25}, 4),
                           capsule({20, 0, -5}, {20, 0, 25}, 4), capsule({-20, 0, 25}, {20, 0, 25}, 4)});
  const Parted p = parted(jug, Box3d{{-32, -17, -22}, {32, 17, 31}}, 1.2);
  ASSERT_EQ(p.partition.candidates.size(), 2U);
  EXPECT_TRUE(p.partition.candidates[1].column_like) << p.partition.candidates[1].reason;
  ASSERT_EQ(p.partition.cuts.size(), 2U);
  // Up, across and down; corners are rounded off.
  EXPECT_GT(p.partition.candidates[1].length_mm, 75);
  EXPECT_LT(p.partition.candidates[1].length_mm, 90);
}

TEST(Labels, EveryPointHasOneOwnerAndRegionsAgree) {
  const Parted& p = animal();
  const Labels& labels = p.partition.labels;
  std::vector<Shape> regions;
  for (int i = 0; i < labels.count(); ++i) regions.push_back(labels.region(i));
  Random random(7, "points");
  for (int n = 0; n < 4000; ++n) {
    // Points as blocks see them: floats. Half of them near a cut, where it matters.
    Vec3d at{-60 + 120 * random.uniform(), -30 + 60 * random.uniform(), -70 + 100 * random.uniform()};
    if (n % 2 == 0) {
      const Cut& cut = p.partition.cuts[random.below(p.partition.cuts.size())];
      at = cut.frame.to_world({16 * random.uniform() - 8, 16 * random.uniform() - 8, 6 * random.uniform() - 3});
    }
    at = to_double(to_float(at));
    const int owner = labels.label(at);
    int inside = 0;
    int least = 0;
    for (int i = 0; i < labels.count(); ++i) {
      const float value = regions[static_cast<std::size_t>(i)](at);
      if (value < 0) ++inside;
      if (value < regions[static_cast<std::size_t>(least)](at)) least = i;
      EXPECT_EQ(value < 0, i == owner);
    }
    EXPECT_EQ(inside, 1);
    EXPECT_EQ(least, owner);
  }
}

TEST(Labels, NearACutTheRegionIsThePlane) {
  const Parted& p = finger();
  const Cut& cut = p.partition.cuts[0];
  const Shape a = p.partition.labels.region(cut.a);
  const Shape b = p.partition.labels.region(cut.b);
  for (const double x : {-4.0, 0.0, 3.0}) {
    for (const double z : {-2.0, -0.5, -0.01, 0.01, 0.3, 1.9}) {
      const Vec3d at = cut.frame.to_world({x, 0.7 * x, z});
      EXPECT_NEAR(a(at), z, 2e-4) << "z points from a into b";
      EXPECT_NEAR(b(at), -z, 2e-4);
    }
  }
}

TEST(Labels, ANeighbouringLimbKnowsNothingOfTheCut) {
  // Two fingers side by side, 3 mm apart; the second stands on the far side of the ball and bends over the first one's
  // root.
  const Shape shape =
      unite({ball_with_finger(), capsule({0, 14, 0}, {0, 16, 40}, 4), capsule({0, 16, 40}, {0, 30, 40}, 4)});
  const Parted p = parted(shape, Box3d{{-22, -22, -22}, {22, 36, 67}}, 1.2);
  for (const Cut& cut : p.partition.cuts) {
    for (int other = 0; other < p.partition.labels.count(); ++other) {
      if (other == cut.a || other == cut.b) continue;
      const Vec3d centre = p.partition.candidates[static_cast<std::size_t>(other)].centroid_mm;
      EXPECT_EQ(p.partition.labels.label(centre), other);
    }
  }
}

TEST(Labels, BoundsHold) {
  const Parted& p = animal();
  Random random(11, "boxes");
  for (int n = 0; n < 300; ++n) {
    const Vec3d corner{-60 + 120 * random.uniform(), -30 + 60 * random.uniform(), -70 + 100 * random.uniform()};
    const double side = 0.2 + 12 * random.uniform();
    const Box3d box{corner, corner + Vec3d{side, side, side}};
    const Shape region = p.partition.labels.region(static_cast<int>(random.below(5)));
    const Interval bound = region.bound(box);
    for (int k = 0; k < 40; ++k) {
      const Vec3d at = corner + side * Vec3d{random.uniform(), random.uniform(), random.uniform()};
      const float value = region(at);
      EXPECT_GE(value, bound.lo - 1e-4F);  // the last digits of a float
      EXPECT_LE(value, bound.hi + 1e-4F);
    }
  }
}

TEST(Labels, MergedPartsForgetTheBorderBetweenThem) {
  const Parted& p = animal();
  const std::vector<int> name{0, 1, 0, 1, 0};
  const Labels merged = p.partition.labels.merged(name);
  EXPECT_EQ(merged.count(), 2);
  Random random(5, "points");
  for (int n = 0; n < 2000; ++n) {
    const Vec3d at{-60 + 120 * random.uniform(), -30 + 60 * random.uniform(), -70 + 100 * random.uniform()};
    EXPECT_EQ(merged.label(at), name[static_cast<std::size_t>(p.partition.labels.label(at))]);
  }
  const Labels one = p.partition.labels.merged({0, 0, 0, 0, 0});
  EXPECT_LT(one.region(0)(Vec3d{1, 2, 3}), 0);
  EXPECT_THROW((void)p.partition.labels.merged({0, 1}), Error);
}

TEST(Labels, ADefaultOneOwnsEverything) {
  const Labels labels;
  EXPECT_EQ(labels.count(), 1);
  EXPECT_EQ(labels.label({3, 4, 5}), 0);
  EXPECT_LT(labels.region(0)(Vec3d{3, 4, 5}), 0);
}

TEST(Partition, SameBitsOnOneAndTwoThreads) {
  std::vector<Parted> runs;
  for (const std::size_t threads : {1, 2}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    runs.push_back(parted(quadruped(), quadruped_box, 1.8));
  }
  const Partition& a = runs[0].partition;
  const Partition& b = runs[1].partition;
  ASSERT_EQ(a.candidates.size(), b.candidates.size());
  for (std::size_t i = 0; i < a.candidates.size(); ++i) {
    EXPECT_EQ(a.candidates[i].volume_mm3, b.candidates[i].volume_mm3);
    EXPECT_EQ(a.candidates[i].axis.centre_line(), b.candidates[i].axis.centre_line());
    EXPECT_EQ(a.candidates[i].reason, b.candidates[i].reason);
  }
  ASSERT_EQ(a.cuts.size(), b.cuts.size());
  for (std::size_t i = 0; i < a.cuts.size(); ++i) EXPECT_EQ(a.cuts[i].frame.origin, b.cuts[i].frame.origin);
  EXPECT_EQ(a.notes, b.notes);
}

TEST(Partition, AGivenThresholdIsUsedAndRangesAreChecked) {
  const Parted p = parted(ball_with_finger(), finger_box, 1.2, {.threshold = 0.4});
  EXPECT_EQ(p.partition.threshold, 0.4);
  EXPECT_EQ(p.partition.candidates.size(), 2U);
  const Parted none = parted(ball_with_finger(), finger_box, 1.2, {.threshold = 0.0});
  EXPECT_EQ(none.partition.candidates.size(), 1U) << "no face is below 0";
  PartitionParams area;
  area.min_area = -1;
  PartitionParams slender;
  slender.min_slenderness = std::nan("");
  for (const PartitionParams& bad : {PartitionParams{.threshold = 1.5}, area, slender}) {
    try {
      (void)partition(p.proxy, p.field, bad);
      FAIL() << "a value out of range";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::BadRecipe) << error.what();
    }
  }
}

TEST(Partition, AMolarHasTwoRoots) {
  const auto path = testing::asset("molar");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the bundled models have not been generated";
  const Parted p = parted(read_mesh(path).mesh);
  ASSERT_EQ(p.partition.candidates.size(), 3U);
  EXPECT_FALSE(p.partition.candidates[0].column_like) << "the crown";
  EXPECT_EQ(columns(p.partition).size(), 2U);
}

/// The paper's threshold is an eighth of the way from 8 to 40 mm, and roots are thinner than that at their ends alone.
TEST(Partition, AThresholdThatCutsOffNoLimbIsNotedInMillimetres) {
  const auto path = testing::asset("molar");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the bundled models have not been generated";
  const auto notes = [&](double threshold) {
    std::string all;
    const Parted p = parted(read_mesh(path).mesh, {.threshold = threshold});
    for (const std::string& note : p.partition.notes) all += note + "\n";
    return all;
  };
  const std::string paper = notes(0.26);
  const std::string start = "the threshold 0.26, a diameter of ";
  ASSERT_NE(paper.find(start), std::string::npos) << paper;
  EXPECT_NEAR(std::stod(paper.substr(paper.find(start) + start.size())), 11.9, 0.3);
  EXPECT_NE(paper.find("partition.threshold=auto"), std::string::npos) << paper;
  EXPECT_EQ(notes(0.5).find("cuts off no limb"), std::string::npos);
}

TEST(Partition, AHorseHasFourLegs) {
  const auto path = testing::shared_model("horse.ply");
  if (!path) GTEST_SKIP() << "the shared real meshes are not here";
  Mesh horse = read_mesh(*path).mesh;
  if (signed_volume(horse) < 0) horse = testing::flipped(std::move(horse));
  const double scale = 300 / bounds(horse).longest_side();
  for (Vec3f& v : horse.vertices) v = to_float(scale * to_double(v));
  const Parted p = parted(horse);
  EXPECT_FALSE(p.partition.candidates[0].column_like);
  int legs = 0;
  const double feet = bounds(horse).min.z;
  for (const Candidate& c : p.partition.candidates) {
    if (!c.column_like || c.centroid_mm.z > feet + 0.35 * bounds(horse).size().z) continue;
    ++legs;
    EXPECT_GT(c.length_mm, 80) << "a whole leg: " << c.reason;
    EXPECT_LT(degrees_between(c.axis.mean(), {0, 0, 1}), 25);
  }
  EXPECT_EQ(legs, 4);
}

TEST(Axis, OfAStraightLine) {
  const Axis axis = Axis::straight({1, 2, 3}, {1, 2, 13});
  EXPECT_NEAR(axis.length_mm(), 10, 1e-12);
  EXPECT_EQ(axis.tangent({50, -7, 100}), (Vec3d{0, 0, 1}));
  EXPECT_EQ(axis.mean(), (Vec3d{0, 0, 1}));
  EXPECT_EQ(Axis{}.tangent({4, 5, 6}), (Vec3d{0, 0, 1}));
  EXPECT_THROW((void)Axis::straight({1, 1, 1}, {1, 1, 1}), Error);
}

TEST(Axis, AlongACircleTheTangentIsSquareToTheRadius) {
  std::vector<Vec3d> circle;
  for (int i = 0; i <= 90; ++i) {
    const double a = std::numbers::pi * i / 90;
    circle.push_back({20 * std::cos(a), 20 * std::sin(a), 5});
  }
  const Axis axis = Axis::along(circle);
  EXPECT_NEAR(axis.length_mm(), std::numbers::pi * 20, 0.02);
  for (int i = 2; i < 18; ++i) {
    const double a = std::numbers::pi * i / 20 + 0.013;
    for (const double r : {14.0, 20.0, 27.0}) {
      const Vec3d t = axis.tangent({r * std::cos(a), r * std::sin(a), 5});
      EXPECT_NEAR(norm(t), 1, 1e-12);
      EXPECT_NEAR(dot(t, {std::cos(a), std::sin(a), 0}), 0, 0.02);
    }
  }
  EXPECT_NEAR(axis.mean().x, -1, 1e-9) << "the chord of half a circle";
}

}  // namespace
}  // namespace fibrolite
