// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/slicer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "fibrolite/error.h"
#include "models.h"

namespace fibrolite {
namespace {

using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

const Mesh ball = testing::icosphere(10, 4, {3, -2, 5});

/// The ball with crystal in it, quickly.
fibrolite_options quick() {
  fibrolite_options options{};
  options.recipe = R"({"tcs": {"cell_mm": 5, "stick_mm": 1, "ball_mm": 1.6}})";
  options.infill = "tcs";
  options.voxel_mm = 0.4;
  options.pixel_x_mm = 0.1;
  options.layer_mm = 0.25;
  return options;
}

fibrolite_mesh as_c(const Mesh& mesh) {
  return {&mesh.vertices.front().x, mesh.vertices.size(), mesh.triangles.front().data(), mesh.triangles.size()};
}

/// A job that is freed.
class Job {
 public:
  explicit Job(fibrolite_progress progress = nullptr, void* user = nullptr) : job_(fibrolite_job_new(progress, user)) {}
  ~Job() { fibrolite_job_free(job_); }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;
  [[nodiscard]] fibrolite_job* get() const { return job_; }
  [[nodiscard]] int open(const Mesh& mesh, const fibrolite_options& options) const {
    const fibrolite_mesh given = as_c(mesh);
    return fibrolite_job_open_mesh(job_, &given, &options);
  }
  [[nodiscard]] fibrolite_layers layers() const {
    fibrolite_layers layers{};
    EXPECT_EQ(fibrolite_job_layers(job_, &layers), FIBROLITE_OK) << fibrolite_last_message();
    return layers;
  }
  [[nodiscard]] std::vector<std::uint8_t> layer(int number, double* area = nullptr) const {
    const fibrolite_layers all = layers();
    std::vector<std::uint8_t> rows(static_cast<std::size_t>(all.width) * static_cast<std::size_t>(all.height), 7);
    EXPECT_EQ(fibrolite_job_tile(job_, number, 0, 0, all.width, all.height, rows.data(),
                                 static_cast<std::size_t>(all.width), area),
              FIBROLITE_OK)
        << fibrolite_last_message();
    return rows;
  }

 private:
  fibrolite_job* job_;
};

class SlicerOfABall : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    job = new Job;
    ASSERT_EQ(job->open(ball, quick()), FIBROLITE_OK) << fibrolite_last_message();
  }
  static void TearDownTestSuite() { delete job; }
  static inline const Job* job = nullptr;
};

TEST_F(SlicerOfABall, ItsLayersAreThoseOfTheFunction) {
  // The long way round: what the interface stands for.
  HybridizeParams params;
  params.recipe = parse_recipe(quick().recipe, {}, "test");
  params.infill = InfillKind::Tcs;
  params.voxel_mm = 0.4;
  params.function = true;
  const Model model = prepare({.mesh = ball, .unit_mm = 1, .notes = {}}, {});
  Report report;
  const Shape printed = hybridize(model, params, report).printed;
  const SliceGrid grid = slice_grid({}, bounds(model.mesh), {0.1, 0.1}, 0.25);

  const fibrolite_layers all = job->layers();
  ASSERT_EQ(all.width, grid.width);
  ASSERT_EQ(all.height, grid.height);
  ASSERT_EQ(all.layers, grid.layers);
  EXPECT_EQ(all.layers, 80);
  EXPECT_NEAR(all.origin[0], -7, 0.1);
  EXPECT_NEAR(all.origin[2], -5, 0.1);
  EXPECT_EQ(all.axis_z[2], 1);
  EXPECT_DOUBLE_EQ(all.volume_mm3, report.solid.volume_mm3);
  double volume = 0;
  for (int n = 0; n < all.layers; ++n) {
    const Slice wanted = slice(printed, grid, n);
    double area = 0;
    ASSERT_EQ(job->layer(n, &area), wanted.coverage.pixels) << "layer " << n;
    ASSERT_EQ(area, wanted.area_mm2);
    volume += area * all.layer_mm;
  }
  EXPECT_NEAR(volume, all.volume_mm3, 0.01 * all.volume_mm3);
}

TEST_F(SlicerOfABall, TilesAreCutOutOfLayers) {
  const fibrolite_layers all = job->layers();
  const std::vector<std::uint8_t> whole = job->layer(33);
  const int x0 = 61, y0 = 17, width = 101, height = 130;
  constexpr std::size_t stride = 128;
  std::vector<std::uint8_t> rows(stride * static_cast<std::size_t>(height), 7);
  ASSERT_EQ(fibrolite_job_tile(job->get(), 33, x0, y0, width, height, rows.data(), stride, nullptr), FIBROLITE_OK);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = rows.data() + static_cast<std::size_t>(y) * stride;
    ASSERT_TRUE(std::equal(row, row + width, whole.data() + (y0 + y) * all.width + x0)) << "row " << y;
    ASSERT_EQ(std::count(row + width, row + stride, 7), 27);
  }
}

TEST_F(SlicerOfABall, FourThreadsGetWhatOneGets) {
  const int layers = job->layers().layers;
  std::vector<std::vector<std::uint8_t>> one, four(static_cast<std::size_t>(layers));
  for (int n = 0; n < layers; ++n) one.push_back(job->layer(n));
  std::vector<std::thread> threads;
  std::atomic<int> next = 0;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int n = next++; n < layers; n = next++) four[static_cast<std::size_t>(n)] = job->layer(n);
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(four, one);
}

TEST_F(SlicerOfABall, WhatIsNotThereIsABadArgument) {
  const fibrolite_layers all = job->layers();
  std::vector<std::uint8_t> rows(100 * 100);
  const auto tile = [&](int layer, int x, int y, int width, int height, std::size_t stride) {
    return fibrolite_job_tile(job->get(), layer, x, y, width, height, rows.data(), stride, nullptr);
  };
  EXPECT_EQ(tile(0, 0, 0, 100, 100, 100), FIBROLITE_OK);
  EXPECT_EQ(tile(-1, 0, 0, 100, 100, 100), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(tile(all.layers, 0, 0, 100, 100, 100), FIBROLITE_BAD_ARGUMENT);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("layer"));
  EXPECT_EQ(tile(0, all.width - 99, 0, 100, 100, 100), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(tile(0, 0, 0, 100, 100, 99), FIBROLITE_BAD_ARGUMENT);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("stride"));
  EXPECT_EQ(fibrolite_job_tile(job->get(), 0, 0, 0, 1, 1, nullptr, 1, nullptr), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(fibrolite_job_layers(nullptr, nullptr), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(job->open(ball, quick()), FIBROLITE_BAD_ARGUMENT) << "opened twice";
  const Job closed;
  fibrolite_layers none{};
  EXPECT_EQ(fibrolite_job_layers(closed.get(), &none), FIBROLITE_BAD_ARGUMENT);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("not open"));
}

TEST_F(SlicerOfABall, WhatDoesNotFitAnIntIsABadArgumentToo) {
  std::uint8_t pixel = 7;
  const auto tile = [&](int x, int y, int width, int height, std::size_t stride) {
    return fibrolite_job_tile(job->get(), 0, x, y, width, height, &pixel, stride, nullptr);
  };
  constexpr int most = std::numeric_limits<int>::max();
  EXPECT_EQ(tile(most, 0, 1, 1, 1), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(tile(0, most, 1, most, 1), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(tile(1, 0, most, 1, most), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(tile(0, 0, -1, 1, 1), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(tile(0, 0, 1, 1, SIZE_MAX), FIBROLITE_BAD_ARGUMENT);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("stride"));
  EXPECT_EQ(pixel, 7) << "nothing is written";
}

TEST(Slicer, NullPointersAndEmptyMeshesAreRefused) {
  const fibrolite_mesh given = as_c(ball);
  const fibrolite_options options = quick();
  const auto opened = [&](const fibrolite_mesh* mesh, const fibrolite_options& wanted) {
    const Job job;
    return fibrolite_job_open_mesh(job.get(), mesh, &wanted);
  };
  EXPECT_EQ(fibrolite_job_open_mesh(nullptr, &given, &options), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(fibrolite_job_open_file(nullptr, "a.stl", &options), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(opened(nullptr, options), FIBROLITE_BAD_ARGUMENT);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("no mesh"));
  fibrolite_mesh part = given;
  part.vertices = nullptr;
  EXPECT_EQ(opened(&part, options), FIBROLITE_BAD_ARGUMENT);
  part = given;
  part.triangles = nullptr;
  EXPECT_EQ(opened(&part, options), FIBROLITE_BAD_ARGUMENT);
  part = given;
  part.triangle_count = 0;
  EXPECT_EQ(opened(&part, options), FIBROLITE_BAD_INPUT);
  part.vertex_count = 0;
  EXPECT_EQ(opened(&part, options), FIBROLITE_BAD_INPUT);
  const Job job;
  EXPECT_EQ(fibrolite_job_open_file(job.get(), nullptr, &options), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(fibrolite_job_layers(job.get(), nullptr), FIBROLITE_BAD_ARGUMENT);
  std::uint8_t pixel = 0;
  EXPECT_EQ(fibrolite_job_tile(nullptr, 0, 0, 0, 1, 1, &pixel, 1, nullptr), FIBROLITE_BAD_ARGUMENT);
  EXPECT_EQ(fibrolite_job_tile(job.get(), 0, 0, 0, 1, 1, &pixel, 1, nullptr), FIBROLITE_BAD_ARGUMENT) << "not open";
  fibrolite_job_cancel(nullptr);
  fibrolite_job_free(nullptr);
}

TEST(Slicer, AJobMayBeCancelledByItsProgress) {
  fibrolite_job* cancelled = nullptr;
  const Job job([](double, const char*, void* user) { fibrolite_job_cancel(*static_cast<fibrolite_job**>(user)); },
                &cancelled);
  cancelled = job.get();
  EXPECT_EQ(job.open(ball, quick()), FIBROLITE_CANCELLED);
  EXPECT_EQ(job.open(ball, quick()), FIBROLITE_BAD_ARGUMENT) << "once per job, whatever came of it";
}

TEST(Slicer, SaysWhatIsWrongWithTheRequest) {
  const auto refused = [](const auto& change, const Mesh& mesh = ball) {
    fibrolite_options options = quick();
    change(options);
    const Job job;
    return job.open(mesh, options);
  };
  EXPECT_EQ(refused([](auto& o) { o.recipe = R"({"tcs": {"cel_mm": 5}})"; }), FIBROLITE_BAD_RECIPE);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("did you mean tcs.cell_mm?"));
  EXPECT_EQ(refused([](auto& o) { o.recipe = "{"; }), FIBROLITE_BAD_RECIPE);
  EXPECT_EQ(refused([](auto& o) { o.preset = "papr"; }), FIBROLITE_BAD_RECIPE);
  EXPECT_EQ(refused([](auto& o) { o.infill = "tsc"; }), FIBROLITE_BAD_RECIPE);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("did you mean tcs?"));
  EXPECT_EQ(refused([](auto& o) { o.layer_mm = -1; }), FIBROLITE_BAD_RECIPE);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("layer_mm"));
  EXPECT_EQ(refused([](auto& o) { o.pixel_x_mm = std::nan(""); }), FIBROLITE_BAD_RECIPE);
  EXPECT_EQ(refused([](auto& o) { o.planes = 17; }), FIBROLITE_BAD_RECIPE);
  EXPECT_EQ(refused([](auto& o) { o.voxel_mm = 0.6; }), FIBROLITE_BAD_RECIPE);
  EXPECT_EQ(refused([](auto& o) { o.max_memory_bytes = 1e6; }), FIBROLITE_TOO_LARGE);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("0.001 GB"));
  EXPECT_EQ(refused([](auto& o) { o.pixel_x_mm = 1e-6; }), FIBROLITE_TOO_LARGE);
  const auto nothing = [](auto&) {};
  Mesh bad = ball;
  bad.triangles[5][1] = 100000;
  EXPECT_EQ(refused(nothing, bad), FIBROLITE_BAD_INPUT);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("triangle 5"));
  bad = ball;
  bad.vertices[3].y = NAN;
  EXPECT_EQ(refused(nothing, bad), FIBROLITE_BAD_INPUT);
  const Job job;
  EXPECT_EQ(fibrolite_job_open_file(job.get(), "no_such_file.stl", nullptr), FIBROLITE_BAD_INPUT);
  EXPECT_THAT(fibrolite_last_message(), HasSubstr("no_such_file.stl"));
}

TEST(Slicer, OpensAFileAndLiesAcrossUp) {
  fibrolite_options options = quick();
  options.up = FIBROLITE_UP_X;
  options.size_mm = 20;
  options.infill = "solid";
  const Job job;
  ASSERT_EQ(fibrolite_job_open_file(job.get(), testing::asset("cylinder_on_box").c_str(), &options), FIBROLITE_OK)
      << fibrolite_last_message();
  const fibrolite_layers all = job.layers();
  EXPECT_EQ(all.axis_z[0], 1);
  double volume = 0;
  for (int n = 0; n < all.layers; ++n) {
    double area = 0;
    (void)job.layer(n, &area);
    volume += area * all.layer_mm;
  }
  EXPECT_NEAR(volume, all.volume_mm3, 0.01 * all.volume_mm3);
}

TEST(Slicer, ProgressRisesToOne) {
  std::vector<double> seen;
  const Job job(
      [](double fraction, const char*, void* user) { static_cast<std::vector<double>*>(user)->push_back(fraction); },
      &seen);
  ASSERT_EQ(job.open(ball, quick()), FIBROLITE_OK);
  ASSERT_GT(seen.size(), 3U);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 1);
}

TEST(Slicer, CancelEndsOpeningWithinASecond) {
  fibrolite_options options = quick();
  options.infill = nullptr;  // the whole method
  options.voxel_mm = 0.1;
  options.size_mm = 100;
  std::atomic<bool> filling = false;
  const Job job(
      [](double fraction, const char*, void* user) {
        if (fraction > 0.06) *static_cast<std::atomic<bool>*>(user) = true;
      },
      &filling);
  int code = -1;
  std::string said;
  Clock::time_point ended;
  std::thread host([&] {
    code = fibrolite_job_open_file(job.get(), testing::asset("quadruped").c_str(), &options);
    said = fibrolite_last_message();
    ended = Clock::now();
  });
  while (!filling && code == -1) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const Clock::time_point asked = Clock::now();
  fibrolite_job_cancel(job.get());
  host.join();
  EXPECT_EQ(code, FIBROLITE_CANCELLED) << said;
  EXPECT_THAT(said, HasSubstr("cancelled"));
  EXPECT_LT(std::chrono::duration<double>(ended - asked).count(), 1.0);
  fibrolite_layers none{};
  EXPECT_EQ(fibrolite_job_layers(job.get(), &none), FIBROLITE_CANCELLED);
}

TEST(Slicer, CancelEndsSlicingToo) {
  const Job job;
  ASSERT_EQ(job.open(ball, quick()), FIBROLITE_OK);
  fibrolite_job_cancel(job.get());
  std::uint8_t pixel = 0;
  EXPECT_EQ(fibrolite_job_tile(job.get(), 0, 0, 0, 1, 1, &pixel, 1, nullptr), FIBROLITE_CANCELLED);
}

TEST(Slicer, WithLessMemoryThePixelsAreTheSameSlabBySlab) {
  const Mesh molar = read_mesh(testing::asset("molar")).mesh;
  SlicerParams params;
  params.fill.infill = InfillKind::Tcs;
  params.fill.voxel_mm = 0.3;
  params.pixel_mm = {0.4, 0.4};
  params.layer_mm = 0.5;
  const MeshFile model{.mesh = molar, .unit_mm = 1, .notes = {}};
  const Slicer whole(model, params);
  params.max_memory_bytes = 85e6;
  ASSERT_GT(most_memory(molar, 0.3, params.fill.recipe, InfillKind::Tcs), params.max_memory_bytes);
  const Slicer slabs(model, params);
  ASSERT_EQ(slabs.grid().layers, whole.grid().layers);
  EXPECT_EQ(slabs.report().solid.volume_mm3, whole.report().solid.volume_mm3);
  EXPECT_EQ(slabs.report().solid.pieces, 1);
  // Out of order, and two at once that may be of different slabs.
  const int layers = whole.grid().layers;
  std::vector<GrayImage> first(10), second(10);
  const auto ask = [&](std::vector<GrayImage>& into, int from) {
    for (std::size_t i = 0; i < into.size(); ++i)
      into[i] = slabs.layer((from + 37 * static_cast<int>(i)) % layers).coverage;
  };
  std::thread other([&] { ask(second, layers / 2); });
  ask(first, 0);
  other.join();
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].pixels, whole.layer(37 * static_cast<int>(i) % layers).coverage.pixels) << i;
    EXPECT_EQ(second[i].pixels, whole.layer((layers / 2 + 37 * static_cast<int>(i)) % layers).coverage.pixels) << i;
  }
  const auto refused = [&]() -> std::string {
    try {
      const Slicer made(model, params);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::TooLarge);
      return error.what();
    }
    return "made";
  };
  params.fill.recipe.print.drain_mm = 2;
  EXPECT_THAT(refused(), HasSubstr("print.drain_mm needs the whole solid"));
  params.fill.recipe.print.drain_mm.reset();
  params.max_memory_bytes = 60e6;
  EXPECT_THAT(refused(), HasSubstr("even slab by slab"));
}

/// A host that asks for layers in tasks of its own: a thread that waits for one layer's tasks takes up the host's next.
TEST(Slicer, LayersOfSlabsMayBeAskedForInTasks) {
  SlicerParams params;
  params.fill.infill = InfillKind::Tcs;
  params.fill.voxel_mm = 0.3;
  params.pixel_mm = {0.4, 0.4};
  params.layer_mm = 0.5;
  params.max_memory_bytes = 85e6;
  const Slicer slabs({.mesh = read_mesh(testing::asset("molar")).mesh, .unit_mm = 1, .notes = {}}, params);
  constexpr int apart = 10;  // each change of slab takes a while
  const int layers = slabs.grid().layers / apart;
  std::vector<double> one(static_cast<std::size_t>(layers)), tasks = one;
  for (int n = 0; n < layers; ++n) one[static_cast<std::size_t>(n)] = slabs.layer(apart * n).area_mm2;
  std::promise<void> done;
  std::thread host([&] {
    // A task for each layer, so that there are others to take up while one waits.
    tbb::parallel_for(
        0, layers, [&](int n) { tasks[static_cast<std::size_t>(n)] = slabs.layer(apart * n).area_mm2; },
        tbb::simple_partitioner{});
    done.set_value();
  });
  if (done.get_future().wait_for(std::chrono::minutes(3)) != std::future_status::ready) {
    std::fputs("the host's tasks wait for each other\n", stderr);
    std::_Exit(1);  // its threads cannot be ended
  }
  host.join();
  EXPECT_EQ(tasks, one);
}

TEST(Slicer, InCppThePixelsAreTheSame) {
  SlicerParams params;
  params.fill.recipe = parse_recipe(quick().recipe, {}, "test");
  params.fill.infill = InfillKind::Tcs;
  params.fill.voxel_mm = 0.4;
  params.pixel_mm = {0.1, 0.1};
  params.layer_mm = 0.25;
  const Slicer slicer({.mesh = ball, .unit_mm = 1, .notes = {}}, params);
  EXPECT_EQ(slicer.report().solid.pieces, 1);
  EXPECT_EQ(slicer.report().infill, "tcs");
  const Job job;
  ASSERT_EQ(job.open(ball, quick()), FIBROLITE_OK);
  EXPECT_EQ(slicer.layer(40).coverage.pixels, job.layer(40));
  EXPECT_THROW((void)slicer.layer(80), Error);
}

}  // namespace
}  // namespace fibrolite
