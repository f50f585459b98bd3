// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/slice.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

constexpr double pi = std::numbers::pi;

/// A grid over [-half, half] in x and y and z.
SliceGrid around(double half, double pixel, double layer) {
  return slice_grid({}, {{-half, -half, -half}, {half, half, half}}, {pixel, pixel}, layer);
}
double height(const SliceGrid& grid, int layer) { return grid.frame.origin.z + (layer + 0.5) * grid.layer_mm; }

double volume(const Shape& shape, const SliceGrid& grid, const SliceParams& params = {}) {
  double sum = 0;
  for (int n = 0; n < grid.layers; ++n) sum += slice(shape, grid, n, params).area_mm2;
  return sum * grid.layer_mm;
}

TEST(Slice, LayersOfASphereAreCircles) {
  const Shape ball = sphere({}, 8);
  const SliceGrid grid = around(9, 0.1, 0.25);
  for (int n = 0; n < grid.layers; ++n) {
    const double z = height(grid, n), truth = pi * std::max(0.0, 64 - z * z);
    const double area = slice(ball, grid, n).area_mm2;
    if (truth == 0) {
      EXPECT_EQ(area, 0);
    } else {
      EXPECT_NEAR(area, truth, 1e-3 * truth) << "z = " << z;
    }
  }
}

TEST(Slice, AreasAddUpToTheVolume) {
  const double truth = 4.0 / 3 * pi * 512;
  EXPECT_NEAR(volume(sphere({0.01, 0.02, 0.03}, 8), around(9, 0.1, 0.2)), truth, 0.001 * truth);
  // A turned ring, sampled from voxels four pixels wide, as a .vdb holds it.
  const Solid ring = realize(torus(frame_along({}, {1, 2, 3}), 6, 2), {{-9, -9, -9}, {9, 9, 9}}, {.voxel_mm = 0.4});
  EXPECT_NEAR(volume(smooth_distance_to(ring), around(9, 0.1, 0.2)), ring.volume_mm3(), 0.005 * ring.volume_mm3());
}

TEST(Slice, ThinSticksKeepTheirVolume) {
  // Three voxels thick and askew: straight lines between samples would take a tenth of it.
  const Solid stick = realize(capsule({-6, -3, -5}, {6, 4, 5}, 0.4), {{-9, -9, -9}, {9, 9, 9}}, {.voxel_mm = 0.26});
  const double truth = pi * 0.16 * norm(Vec3d{12, 7, 10}) + 4.0 / 3 * pi * 0.064;
  EXPECT_NEAR(volume(smooth_distance_to(stick), around(9, 0.05, 0.1)), truth, 0.02 * truth);
  EXPECT_NEAR(volume(smooth_distance_to(stick), around(9, 0.05, 0.1)), stick.volume_mm3(), 0.02 * truth);
}

TEST(Slice, ABoxIsExact) {
  const Shape box = cuboid({{-5, -4, -3}, {5, 4, 3}});
  const SliceGrid grid = slice_grid({}, {{-5, -4, -3}, {5, 4, 3}}, {0.1, 0.2}, 0.1);
  EXPECT_EQ(grid.width, 100);
  EXPECT_EQ(grid.height, 40);
  EXPECT_EQ(grid.layers, 60);
  for (int n = 0; n < grid.layers; ++n) {
    const Slice layer = slice(box, grid, n);
    EXPECT_NEAR(layer.area_mm2, 80, 80 * 2e-5);
    EXPECT_TRUE(
        std::all_of(layer.coverage.pixels.begin(), layer.coverage.pixels.end(), [](auto p) { return p == 255; }));
  }
}

TEST(Slice, AWallThroughAPixelMakesItGrey) {
  // Walls at 25 %, 50 % and 75 % of a pixel; upright, and at 45 degrees, where half the pixels on it are half full.
  for (const double share : {0.25, 0.5, 0.75}) {
    const Slice layer = slice(half_space({0.1 * share, 0, 0}, {1, 0, 0}), around(2, 0.1, 0.1), 5);
    const int wall = 20;  // x = 0
    EXPECT_EQ(layer.coverage(wall - 1, 7), 255);
    EXPECT_NEAR(layer.coverage(wall, 7), 255 * share, 1);
    EXPECT_EQ(layer.coverage(wall + 1, 7), 0);
  }
  const Slice slope = slice(half_space({}, {1, 1, 0}), around(2, 0.1, 0.1), 5);
  for (int i = 0; i < 40; ++i) EXPECT_NEAR(slope.coverage(i, 39 - i), 127.5, 1);
  EXPECT_NEAR(slope.area_mm2, 8, 1e-3);
}

TEST(Slice, PlanesMakeFlatSlopesGrey) {
  // A roof that rises one layer over ten pixels: one plane sees a step, ten see the ramp.
  const Shape roof = half_space({}, {0.1, 0, 1});
  const SliceGrid grid{{{-0.5, 0, -0.05}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.1, 0.1}, 0.1, 10, 3, 1};
  const Slice flat = slice(roof, grid, 0), ramp = slice(roof, grid, 0, {.planes = 16});
  EXPECT_EQ(flat.coverage(0, 1), 255);
  EXPECT_EQ(flat.coverage(9, 1), 0);
  for (int x = 0; x < 10; ++x) EXPECT_NEAR(ramp.coverage(x, 1), 255 * (0.95 - 0.1 * x), 255.0 / 16) << x;
}

TEST(Slice, FollowsItsFrame) {
  // Layers along x: the same circles, whichever way is up.
  const Frame turned = frame_along({1, 2, 3}, {1, 0, 0});
  const Shape bar = cylinder({-3, 0, 0}, {4, 0, 0}, 2);
  const Box3d box{{-6, -6, -4}, {6, 6, 3}};
  const SliceGrid grid = slice_grid(turned, box, {0.05, 0.05}, 0.1);
  EXPECT_EQ(grid.layers, 70);
  for (const int n : {0, 35, 69}) EXPECT_NEAR(slice(bar, grid, n).area_mm2, 4 * pi, 0.004 * pi);
}

TEST(Slice, SameBitsOnOneAndTwoThreads) {
  const Shape shape = unite({torus({}, 7, 2), capsule({0, 0, -9}, {0, 0, 9}, 1.5)});
  const SliceGrid grid = around(9.5, 0.03, 0.1);
  Slice layers[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    layers[threads - 1] = slice(shape, grid, 90, {.planes = 2});
  }
  EXPECT_EQ(layers[0].coverage.pixels, layers[1].coverage.pixels);
  EXPECT_EQ(layers[0].area_mm2, layers[1].area_mm2);
}

TEST(Slice, BoundsReachTheSurfaceBetweenSamples) {
  const Solid ball = realize(sphere({0.1, 0.2, 0.3}, 8.03), {{-12, -12, -12}, {12, 12, 12}}, {.voxel_mm = 0.5});
  const Box3d box = bounds_in(frame_along({1, 1, 1}, {1, 0, 0}), ball);
  EXPECT_NEAR(box.min.z, 0.1 - 8.03 - 1, 0.02);
  EXPECT_NEAR(box.max.z, 0.1 + 8.03 - 1, 0.02);
  EXPECT_NEAR(box.size().x, 16.06, 0.04);
  EXPECT_TRUE(bounds_in({}, Solid()).empty());
}

TEST(Slice, RefusesWhatIsNoLength) {
  const Box3d box{{0, 0, 0}, {1, 1, 1}};
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW((void)slice_grid({}, box, {bad, 0.1}, 0.1), Error) << bad;
    EXPECT_THROW((void)slice_grid({}, box, {0.1, 0.1}, bad), Error) << bad;
  }
  EXPECT_THROW((void)slice_grid({}, box, {1e-5, 1e-5}, 0.1), Error);
  EXPECT_THROW((void)slice_grid({}, box, {0.1, 0.1}, 1e-10), Error);
  EXPECT_THROW((void)slice(sphere({}, 1), slice_grid({}, box, {0.1, 0.1}, 0.1), 0, {.planes = 0}), Error);
}

TEST(SliceInto, ATileIsCutOutOfTheLayerByteForByte) {
  const Shape ball = subtract(sphere({0.3, 0.2, 0.1}, 8), sphere({0.3, 0.2, 0.1}, 7));
  const SliceGrid grid = around(9, 0.05, 0.25);
  ASSERT_GT(grid.width, 300);
  const Slice whole = slice(ball, grid, 30);
  double sum = 0;
  for (const PixelRange tile :
       {PixelRange{0, 0, 137, 360}, PixelRange{137, 0, 223, 11}, PixelRange{137, 11, 223, 349}}) {
    constexpr std::ptrdiff_t stride = 400;
    std::vector<std::uint8_t> rows(static_cast<std::size_t>(stride * tile.height), 7);
    sum += slice_into(rows.data(), stride, tile, ball, grid, 30);
    for (int y = 0; y < tile.height; ++y) {
      const std::uint8_t* row = rows.data() + y * stride;
      ASSERT_TRUE(std::equal(row, row + tile.width, &whole.coverage(tile.x, tile.y + y))) << "row " << y;
      ASSERT_EQ(std::count(row + tile.width, row + stride, 7), stride - tile.width) << "row " << y;
    }
  }
  EXPECT_NEAR(sum, whole.area_mm2, 1e-9 * sum);
}

TEST(SliceInto, RefusesTilesThatReachBeyondTheLayerAndStopsWhenCancelled) {
  const SliceGrid grid = around(9, 0.5, 0.25);
  std::vector<std::uint8_t> rows(static_cast<std::size_t>(grid.width * grid.height));
  const auto code = [&](const PixelRange& tile, std::ptrdiff_t stride, const Context& context = {}) {
    try {
      (void)slice_into(rows.data(), stride, tile, sphere({}, 8), grid, 10, {}, context);
    } catch (const Error& error) {
      return error.code();
    }
    return Code::Internal;
  };
  EXPECT_EQ(code({-1, 0, 5, 5}, 5), Code::BadRecipe);
  EXPECT_EQ(code({0, 0, 0, 5}, 5), Code::BadRecipe);
  EXPECT_EQ(code({10, 0, 2147483647, 5}, 36), Code::BadRecipe);
  EXPECT_EQ(code({0, 30, 5, 7}, 5), Code::BadRecipe);
  EXPECT_EQ(code({0, 0, 5, 5}, 4), Code::BadRecipe);
  const Context stopped;
  stopped.cancel();
  EXPECT_EQ(code({0, 0, 5, 5}, 5, stopped), Code::Cancelled);
}

}  // namespace
}  // namespace fibrolite
