// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/stance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "fibrolite/error.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/random.h"
#include "label_field.h"
#include "load.h"
#include "models.h"

namespace fibrolite {
namespace {

constexpr double right_angle = 90;

VerifyParams load(Vec3d up, double azimuth_deg) {
  VerifyParams params;
  params.up = up;
  params.azimuth_deg = azimuth_deg;
  return params;
}

TEST(Stance, the_default_is_the_world) {
  const Frame frame = stance({});
  EXPECT_EQ(frame.origin, Vec3d{});
  EXPECT_EQ(frame.x, (Vec3d{1, 0, 0}));
  EXPECT_EQ(frame.y, (Vec3d{0, 1, 0}));
  EXPECT_EQ(frame.z, (Vec3d{0, 0, 1}));
}

/// Turned by quarters, no coordinate changes but by place and sign.
TEST(Stance, quarter_turns_are_exact) {
  for (const Vec3d up : {Vec3d{1, 0, 0}, Vec3d{0, -3, 0}, Vec3d{0, 0, 1}, Vec3d{-2, 0, 0}})
    for (int quarter = -1; quarter <= 2; ++quarter) {
      const Frame frame = stance(load(up, right_angle * quarter));
      for (const Vec3d axis : {frame.x, frame.y, frame.z}) {
        EXPECT_EQ(std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z), 1);
        EXPECT_EQ(norm(axis), 1);
      }
      EXPECT_EQ(frame.z, up / norm(up));
      EXPECT_EQ(cross(frame.x, frame.y), frame.z);
    }
}

TEST(Stance, a_slanted_stance_is_right_handed_and_keeps_lengths) {
  const Frame frame = stance(load({1, 2, 3}, 33));
  EXPECT_NEAR(norm(frame.x), 1, 1e-12);
  EXPECT_NEAR(dot(frame.x, frame.z), 0, 1e-12);
  EXPECT_NEAR(norm(cross(frame.x, frame.y) - frame.z), 0, 1e-12);
  Mesh mesh;
  mesh.vertices = {{1, 2, 3}, {-4, 5, 6}};
  const Mesh seen = seen_from(frame, mesh);
  EXPECT_NEAR(norm(to_double(seen.vertices[0]) - to_double(seen.vertices[1])),
              norm(to_double(mesh.vertices[0]) - to_double(mesh.vertices[1])), 1e-5);
  EXPECT_NEAR(norm(frame.to_world(to_double(seen.vertices[1])) - Vec3d{-4, 5, 6}), 0, 1e-5);
  EXPECT_EQ(in_stance(load({1, 2, 3}, 33)).up, (Vec3d{0, 0, 1}));
  EXPECT_EQ(in_stance(load({1, 2, 3}, 33)).azimuth_deg, 0);
}

/// Load cases turn with the model, up and azimuth cannot: seen in their stance, the turned ones are the same.
TEST(Stance, forces_of_the_load_cases_say_how_the_model_stands) {
  const Vec3d down{0, 0, -1}, slanted = normalized(Vec3d{-1, 0, -1});
  const auto cases = [&](const Frame& turn) {
    const auto turned = [&](Vec3d d) { return turn.to_world(d); };
    VerifyParams params;
    for (const Vec3d d : {down, slanted}) {
      TotalForce force{.newton = 5, .direction = {Direction::Of::World, 3 * turned(d)}};
      force.where.seen_from = Direction{Direction::Of::World, turned({0, 0, 1})};
      params.loads.push_back({"to " + std::to_string(d.x), {}, {force}});
    }
    return params;
  };
  const Frame same = stance(cases({}));
  EXPECT_EQ(same.x, (Vec3d{1, 0, 0}));
  EXPECT_EQ(same.z, (Vec3d{0, 0, 1}));
  const Frame turn = frame_along({}, {1, -2, 0.5});
  const VerifyParams params = cases(turn);
  const Frame frame = stance(params);
  EXPECT_NEAR(norm(frame.x - turn.x), 0, 1e-12);
  EXPECT_NEAR(norm(frame.y - turn.y), 0, 1e-12);
  EXPECT_NEAR(norm(frame.z - turn.z), 0, 1e-12);
  const VerifyParams standing = in_stance(params);
  EXPECT_NEAR(norm(std::get<TotalForce>(standing.loads[1].forces[0]).direction.vector - 3 * slanted), 0, 1e-12);
  EXPECT_NEAR(norm(frame.to_world(standing.up) - params.up), 0, 1e-12) << "up itself stays where it is";
  // The words for directions still mean the same: what is slanted comes from the world's x.
  const Vec3d from = load_directions(standing.up, standing.azimuth_deg)[1];
  EXPECT_NEAR(norm(frame.to_world(from) - slanted), 0, 1e-12);
}

TEST(Stance, up_must_be_a_direction) {
  EXPECT_THROW((void)stance(load({0, 0, 0}, 0)), Error);
  EXPECT_THROW((void)stance(load({0, 0, 1}, std::numeric_limits<double>::quiet_NaN())), Error);
}

/// Two labels parted by a plane: placed, they are asked in world coordinates.
TEST(Stance, parts_come_back_to_the_world) {
  LabelSamples samples;
  samples.origin = {-4, -4, -4};
  samples.voxel_mm = 2;
  samples.size = {5, 5, 5};
  samples.count = 2;
  samples.clamp_mm = 10;
  for (int i = 0; i < 125; ++i) {
    const int layer = i / 25;
    const double z = -4 + 2.0 * layer;
    samples.label.push_back(z < 1 ? 0 : 1);
    samples.near.push_back({i, 0, 1, static_cast<float>(std::abs(z - 1))});
  }
  Partition partition;
  partition.labels = make_labels(samples);
  partition.candidates.resize(1);
  partition.candidates[0].centroid_mm = {1, 2, 3};
  partition.candidates[0].axis = Axis::straight({0, 0, 0}, {0, 0, 5});
  partition.cuts.push_back({0, 1, Frame{{0, 0, 1}}, 3});
  const Frame frame = stance(load({1, 0, 0}, 0));  // z of the stance is x of the world
  const Partition world = placed(partition, frame);
  EXPECT_EQ(world.labels.label({0.5, 3, -3}), 0);
  EXPECT_EQ(world.labels.label({1.5, 3, -3}), 1);
  EXPECT_NEAR(world.labels.region(0)({3, 1, 1}), 2, 1e-5);
  EXPECT_NEAR(world.labels.merged({1, 0}).region(1)({3, 1, 1}), 2, 1e-5);
  EXPECT_NEAR(norm(world.cuts[0].frame.origin - Vec3d{1, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(norm(world.cuts[0].frame.z - Vec3d{1, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(norm(world.candidates[0].axis.mean() - Vec3d{1, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(norm(world.candidates[0].centroid_mm - frame.to_world({1, 2, 3})), 0, 1e-12);
}

/// The bundled quadruped turned at random in its file, the forces of its load cases with it: the same candidates.
TEST(Stance, a_model_turned_with_its_load_is_parted_the_same) {
  const Mesh upright = read_mesh(testing::asset("quadruped")).mesh;
  std::vector<double> first;
  for (int turn = 0; turn < 3; ++turn) {
    Random random(1, "turns", static_cast<std::uint64_t>(turn));
    const auto unit = [&] { return 2 * random.uniform() - 1; };
    const Frame frame = turn == 0 ? Frame{} : frame_along({}, {unit(), unit(), unit()});
    Mesh mesh = upright;
    for (Vec3f& v : mesh.vertices) v = to_float(frame.to_world(to_double(v)));
    Recipe recipe;
    for (const Vec3d to : {Vec3d{0, 0, -1}, Vec3d{-1, 0, -1}}) {
      const TotalForce force{.newton = 1000, .direction = {Direction::Of::World, frame.to_world(to)}};
      recipe.verify.loads.push_back({"to " + std::to_string(to.x), {}, {force}});
    }
    std::vector<StageReport> stages;
    const Proxy proxy = make_proxy(mesh, {.frame = stance(recipe.verify)});
    std::vector<double> volumes;
    for (const Candidate& c : find_candidates(proxy, recipe, in_stance(recipe.verify), stages).candidates)
      volumes.push_back(c.volume_mm3);
    std::sort(volumes.begin(), volumes.end());
    if (turn == 0) first = volumes;
    ASSERT_EQ(volumes.size(), first.size()) << "turn " << turn;
    for (std::size_t i = 0; i < volumes.size(); ++i) EXPECT_NEAR(volumes[i], first[i], 0.01 * first[i]);
  }
  EXPECT_GE(first.size(), 5U);  // four legs and a body at least
}

}  // namespace
}  // namespace fibrolite
