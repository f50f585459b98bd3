// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/straighten.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fibrolite/mesh_io.h"
#include "fibrolite/realize.h"
#include "models.h"

namespace fibrolite {
namespace {

using std::numbers::pi;

Axis arc(double ring_mm, double angle) {
  std::vector<Vec3d> line;
  for (int i = 0; i <= 80; ++i)
    line.push_back({ring_mm * std::cos(angle * i / 80), ring_mm * std::sin(angle * i / 80), 0});
  return Axis::along(line);
}

/// The normal plane of every station, from the line out to the surface, is still between its neighbours' planes.
/// Returns how many planes were walked.
int planes_in_order(const Axis& axis, const Shape& inside, const std::string& name) {
  const std::vector<Vec3d>& line = axis.centre_line();
  const double step = axis.length_mm() / static_cast<double>(line.size() - 1);
  int planes = 0, crossed = 0;
  for (std::size_t k = 2; k + 2 < line.size(); ++k) {
    const Vec3d before = normalized(line[k] - line[k - 2]), along = normalized(line[k + 1] - line[k - 1]),
                after = normalized(line[k + 2] - line[k]);
    const Frame frame = frame_along(line[k], along);
    if (inside(line[k]) >= 0) continue;
    ++planes;
    for (int turn = 0; turn < 24; ++turn) {
      const double a = 2 * pi * turn / 24;
      for (double r = 0;; r += std::max(0.5 * step, 0.05)) {
        const Vec3d q = frame.to_world({r * std::cos(a), r * std::sin(a), 0});
        if (inside(q) >= 0) break;
        crossed += dot(q - line[k + 1], after) >= 0 || dot(q - line[k - 1], before) <= 0;
      }
    }
  }
  EXPECT_EQ(crossed, 0) << name;
  return planes;
}

TEST(Straighten, TheBendOfATubeIsItsRadiusOverTheRings) {
  EXPECT_NEAR(sharpest_bend(arc(20, 1.5), torus({}, 20, 5)), 0.25, 0.04);
  EXPECT_EQ(sharpest_bend(Axis::straight({0, 0, 0}, {0, 0, 9}), sphere({}, 100)), 0);
}

TEST(Straighten, AGentleLineStaysAsItIs) {
  const Axis axis = arc(20, 1.5);
  EXPECT_EQ(straightened(axis, torus({}, 20, 10)).centre_line(), axis.centre_line());
}

TEST(Straighten, AnElbowTooSharpForItsLimbIsRounded) {
  std::vector<Vec3d> line;
  for (int i = 0; i <= 60; ++i) line.push_back(i < 30 ? Vec3d{30.0 - i, 0, 0} : Vec3d{0, i - 30.0, 0});
  const Shape limb = unite({capsule({30, 0, 0}, {0, 0, 0}, 6), capsule({0, 0, 0}, {0, 30, 0}, 6)});
  const Axis sharp = Axis::along(line), round = straightened(sharp, limb);
  EXPECT_GT(sharpest_bend(sharp, limb), 1);
  EXPECT_LE(sharpest_bend(round, limb), 0.8);
  EXPECT_GT(planes_in_order(round, limb, "elbow"), 30);
  EXPECT_LT(norm(round.centre_line().front() - line.front()), 1e-6);
  EXPECT_LT(norm(round.centre_line().back() - line.back()), 1e-6);
}

/// Smoothing would make a ring smaller, and its bend sharper.
TEST(Straighten, AFatRingIsMadeNoTighter) {
  std::vector<Vec3d> line;
  for (int i = 0; i <= 96; ++i) line.push_back({10 * std::cos(pi * i / 48), 10 * std::sin(pi * i / 48), 0});
  line.back() = line.front();
  const Axis ring = Axis::along(line);
  const Shape limb = torus({}, 10, 9.2);
  const double before = sharpest_bend(ring, limb);
  ASSERT_GT(before, 0.8);
  const Axis after = straightened(ring, limb);
  EXPECT_LE(sharpest_bend(after, limb), before);
  EXPECT_GT(planes_in_order(after, limb, "ring"), 80);
}

/// Of limbs as they are found.
TEST(Straighten, PlanesDoNotCrossInsideTheLimbsOfModels) {
  std::vector<std::pair<std::string, std::filesystem::path>> models;
  for (const char* name : {"bent_tube", "figure", "quadruped"}) models.emplace_back(name, testing::asset(name));
  for (const char* file : {"horse.ply", "hand.obj", "armadillo.obj", "fertility.off"})
    if (const auto path = testing::shared_model(file)) models.emplace_back(file, *path);
  int planes = 0;
  for (const auto& [name, path] : models) {
    const Proxy proxy = make_proxy(read_mesh(path).mesh, {.triangles = 8000});
    const Partition found = partition(proxy, diameter(proxy.surface));
    const Shape body = distance_to(proxy.solid);
    for (const Candidate& limb : found.candidates) {
      if (!limb.column_like) continue;
      const Shape inside = intersect({body, found.labels.region(limb.id)});
      const Axis axis = straightened(limb.axis, inside);
      const std::string which = name + " " + std::to_string(limb.id);
      EXPECT_LE(sharpest_bend(axis, inside), 0.8) << which;
      planes += planes_in_order(axis, inside, which);
    }
  }
  EXPECT_GT(planes, 200);
}

}  // namespace
}  // namespace fibrolite
