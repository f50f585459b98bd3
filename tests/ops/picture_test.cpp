// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/picture.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "models.h"

namespace fibrolite {
namespace {

constexpr double pi = std::numbers::pi;
constexpr Rgb blue{20, 60, 230};

Solid make(const Shape& shape, double reach_mm, double voxel_mm = 0.5) {
  return realize(shape, Box3d{{-reach_mm, -reach_mm, -reach_mm}, {reach_mm, reach_mm, reach_mm}}, Grid{voxel_mm, 3});
}
Rgb all_blue(Vec3d) { return blue; }

/// The background and its shadow are gray, the object is not.
bool is_object(Rgb c) { return c.b - c.r > 25; }
std::int64_t object_pixels(const RgbImage& image) {
  return std::count_if(image.pixels.begin(), image.pixels.end(), is_object);
}

/// Straight at the cut: nothing is foreshortened but what the camera's tilt does.
PictureParams square(int side_px) {
  PictureParams params;
  params.width_px = params.height_px = side_px;
  params.margin = 0.1;
  return params;
}

TEST(Picture, SphereHasTheSilhouetteOfADisc) {
  const Solid ball = make(sphere({}, 10), 12);
  PictureParams params = square(400);
  params.cut = false;
  const RgbImage image = picture(surface(ball), ball, all_blue, params);
  // The margins leave 80 % of the side to the diameter: radius 160 px.
  EXPECT_NEAR(static_cast<double>(object_pixels(image)), pi * 160 * 160, 0.01 * pi * 160 * 160);
}

TEST(Picture, CornersAreBackground) {
  const Solid ball = make(sphere({}, 10), 12);
  const RgbImage image = picture(surface(ball), ball, all_blue, square(200));
  for (const int x : {0, 199}) {
    for (const int y : {0, 199}) {
      const Rgb c = image(x, y);
      EXPECT_GT(std::min({c.r, c.g, c.b}), 225);
      EXPECT_LT(std::max({c.r, c.g, c.b}) - std::min({c.r, c.g, c.b}), 12);
    }
  }
  EXPECT_EQ(image(0, 0), image(199, 0)) << "the gradient runs down, not across";
}

/// Pixels of the cut face: it is flat, so inside its outline each has exactly the same colour.
std::int64_t pixels_of(const RgbImage& image, Rgb color) {
  return std::count(image.pixels.begin(), image.pixels.end(), color);
}

TEST(Picture, CutFaceIsFlatAndHasTheRightArea) {
  const Solid ball = make(sphere({}, 10), 12);
  const Mesh mesh = surface(ball);
  PictureParams params = square(600);
  params.cut_point = Vec3d{};
  params.cut_normal = Vec3d{0, -1, 0};
  const RgbImage image = picture(mesh, ball, all_blue, params);
  const Rgb cap = image(300, 300);
  EXPECT_TRUE(is_object(cap));
  // The half ball is seen whole across the cut (its disc) and beyond it, so the radius follows from the silhouette: the
  // disc is an ellipse with the cosine of the view, the half ball behind adds the other half of a full disc.
  //   silhouette = pi r^2 (1 + cos) / 2, cut face = pi r^2 cos.
  const double cosine = std::cos(24 * pi / 180) * std::cos(17 * pi / 180);
  const double r2 = 2 * static_cast<double>(object_pixels(image)) / (pi * (1 + cosine));
  const double outline = 1.7;  // px, all around, not counted as flat
  const double r = std::sqrt(r2) - outline / std::sqrt(cosine);
  EXPECT_NEAR(static_cast<double>(pixels_of(image, cap)), pi * r * r * cosine, 0.02 * pi * r * r * cosine);
}

TEST(Picture, HollowSphereShowsARingOfTheRightWidth) {
  const Solid shell = make(subtract(sphere({}, 10), sphere({}, 7)), 12, 0.25);
  const Mesh mesh = surface(shell);
  PictureParams params = square(800);
  params.cut_point = Vec3d{};
  params.cut_normal = Vec3d{0, -1, 0};
  const RgbImage hollow = picture(mesh, shell, all_blue, params);
  const Solid ball = make(sphere({}, 10), 12, 0.25);
  const RgbImage full = picture(surface(ball), ball, all_blue, params);
  const Rgb cap = full(400, 400);
  EXPECT_NE(hollow(400, 400), cap) << "the middle is open";
  // Ring to disc: (10^2 - 7^2) / 10^2, less what the outlines take: their width in mm times the circumferences.
  const double cosine = std::cos(24 * pi / 180) * std::cos(17 * pi / 180);
  const double px_per_mm = std::sqrt(2 * static_cast<double>(object_pixels(full)) / (pi * (1 + cosine))) / 10;
  const double line = 1.7 / px_per_mm;
  const auto disc = [](double r) { return pi * r * r; };
  const double expected = (disc(10 - line) - disc(7 + line)) / disc(10 - line);
  const double seen = static_cast<double>(pixels_of(hollow, cap)) / static_cast<double>(pixels_of(full, cap));
  EXPECT_NEAR(seen, expected, 0.02 * expected);
}

TEST(Picture, CutFaceTakesTheColourOfEachPoint) {
  const Solid ball = make(sphere({}, 10), 12);
  PictureParams params = square(300);
  params.cut_point = Vec3d{};
  params.cut_normal = Vec3d{0, -1, 0};
  const Rgb red{230, 40, 20};
  const RgbImage image = picture(
      surface(ball), ball, [&](Vec3d p) { return p.z > 0 ? red : blue; }, params);
  EXPECT_GT(image(150, 110).r, image(150, 110).b);
  EXPECT_LT(image(150, 190).r, image(150, 190).b);
}

TEST(Picture, DefaultCutGoesWhereMostColoursShow) {
  // Two bars along x, one colour each, 12 mm apart: the plane between them would show neither, one plane both never.
  const Solid bars = make(unite({capsule({-20, -6, 0}, {20, -6, 0}, 3), capsule({-20, 6, 0}, {20, 6, 0}, 3)}), 26);
  const RgbImage image = picture(surface(bars), bars, all_blue, square(200));
  const Rgb cap = [&] {  // the commonest colour of the object is the flat cut face
    std::int64_t most = 0;
    Rgb best;
    for (const Rgb c : image.pixels) {
      if (!is_object(c)) continue;
      const std::int64_t n = pixels_of(image, c);
      if (n > most) {
        most = n;
        best = c;
      }
    }
    return best;
  }();
  // 40 x 6 mm of cut face in about 160 px for 46 mm: well over a thousand flat pixels; without a cut there are none.
  EXPECT_GT(pixels_of(image, cap), 1500);
}

TEST(Picture, SameBytesOnOneAndTwoThreads) {
  const Solid shell = make(subtract(sphere({}, 10), sphere({3, 0, 2}, 6)), 12);
  const Mesh mesh = surface(shell);
  const testing::TempDir dir;
  const auto bytes = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto path = dir / ("t" + std::to_string(threads) + ".png");
    write_png(path, picture(
                        mesh, shell, [](Vec3d p) { return p.x > 0 ? shell_color : joint_color; }, square(160)));
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string one = bytes(1);
  EXPECT_EQ(one.substr(1, 3), "PNG");
  EXPECT_GT(one.size(), 2000U);
  EXPECT_EQ(one, bytes(2));
}

TEST(Picture, NothingToShowIsBackgroundOnly) {
  const RgbImage image = picture(Mesh{}, Solid{}, all_blue, square(32));
  EXPECT_EQ(object_pixels(image), 0);
}

TEST(Picture, RefusesWhatItCannotDraw) {
  const auto code = [](const PictureParams& params) {
    try {
      (void)picture(Mesh{}, Solid{}, all_blue, params);
    } catch (const Error& error) {
      return error.code();
    }
    return Code::Internal;
  };
  EXPECT_EQ(code(square(15)), Code::BadRecipe);
  EXPECT_EQ(code(square(8193)), Code::BadRecipe);
  PictureParams params = square(100);
  params.margin = 0.5;
  EXPECT_EQ(code(params), Code::BadRecipe);
  params = square(100);
  params.up = {};
  EXPECT_EQ(code(params), Code::BadRecipe);
}

TEST(Picture, CancelStopsIt) {
  const Solid ball = make(sphere({}, 10), 12);
  const Context context;
  context.cancel();
  EXPECT_THROW((void)picture(surface(ball), ball, all_blue, square(64), context), Error);
}

TEST(Picture, WritingIntoAMissingFolderIsAnIoError) {
  const testing::TempDir dir;
  try {
    write_png(dir / "missing" / "x.png", RgbImage(16, 16));
    FAIL() << "must throw";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::Io);
  }
}

TEST(PartColor, NeighboursDifferClearly) {
  const auto far = [](Rgb a, Rgb b) { return std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b) > 60; };
  for (int id = 0; id < 12; ++id) {
    EXPECT_TRUE(far(part_color(id, true), part_color(id + 1, true))) << id;
    EXPECT_TRUE(far(part_color(id, false), part_color(id + 1, false))) << id;
    EXPECT_TRUE(far(part_color(id, true), joint_color)) << id;
    EXPECT_TRUE(far(part_color(id, false), joint_color)) << id;
    for (int other = 0; other < 3; ++other) EXPECT_TRUE(far(part_color(id, true), part_color(other, false)));
  }
}

/// A legend names each colour once: none of them is another's, nor near it.
TEST(PartColor, ALegendOfTenColumnsAndSixBulksIsUnambiguous) {
  struct Entry {
    Rgb color;
    std::string name;
  };
  std::vector<Entry> entries;
  for (int id = 0; id < 10; ++id) entries.push_back({part_color(id, true), color_name(id, true)});
  for (int id = 0; id < 6; ++id) entries.push_back({part_color(id, false), color_name(id, false)});
  for (std::size_t i = 0; i < entries.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Rgb a = entries[i].color, b = entries[j].color;
      EXPECT_GT(std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b), 50) << i << ' ' << j;
      EXPECT_NE(entries[i].name, entries[j].name);
    }
  EXPECT_EQ(hex(part_color(0, true)), "#0072b2");
  EXPECT_EQ(color_name(0, true), "blue");
  EXPECT_EQ(color_name(6, true), "dark sky blue");
  EXPECT_EQ(hex(Rgb{0, 10, 255}), "#000aff");
  EXPECT_EQ(part_color(10, true), part_color(0, true));
}

}  // namespace
}  // namespace fibrolite
