// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/slice_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "archive.h"
#include "fibrolite/error.h"
#include "fibrolite/kept_work.h"
#include "models.h"

namespace fibrolite {
namespace {

using namespace fibrolite::testing;
using ::testing::HasSubstr;
using ::testing::StartsWith;
namespace fs = std::filesystem;

constexpr double pi = std::numbers::pi;

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A tube with a pin in it, and a block beside it so that no turn or mirror image is the same.
Shape part() {
  return unite({subtract(cylinder({0, 0, 0}, {0, 0, 4}, 5), cylinder({0, 0, -1}, {0, 0, 5}, 4)),
                cylinder({1, 1, 0}, {1, 1, 4}, 1), cuboid({{6, 3, 0}, {8, 5, 4}})});
}
constexpr double part_mm3 = 4 * (9 * pi + pi + 4);
SliceJob job() {
  return {.shape = part(),
          .plates = {{"", slice_grid({}, {{-6, -6, 0}, {9, 6, 4}}, {0.1, 0.1}, 0.5)}},
          .name = "Tube & pin"};
}

std::vector<SlicedPlate> write(const fs::path& path, const SliceJob& job, const Context& context = {}) {
  return write_slices(path, slice_format(path), job, context);
}

TEST(SliceIo, AZipHoldsTheLayersAndSaysWhatTheyAre) {
  const TempDir folder;
  const auto done = write(folder / "a.zip", job());
  ASSERT_EQ(done.size(), 1U);
  EXPECT_NEAR(done[0].volume_mm3, part_mm3, 0.002 * part_mm3);
  auto entries = unzipped(content(folder / "a.zip"));
  ASSERT_EQ(entries.size(), 9U);
  const auto manifest = nlohmann::json::parse(entries.at("manifest.json"));
  const auto& plate = manifest.at("plates").at(0);
  EXPECT_EQ(plate.at("layers"), 8);
  EXPECT_EQ(plate.at("layer_mm"), 0.5);
  EXPECT_EQ(plate.at("size_px"), (nlohmann::json{150, 120}));
  EXPECT_EQ(plate.at("origin_mm"), (nlohmann::json{-6.0, -6.0, 0.0}));
  for (std::size_t n = 0; n < 8; ++n) {
    const auto& file = plate.at("files").at(n);
    const GrayImage png = grey_png(entries.at(file.at("file")));
    const Slice layer = slice(part(), job().plates[0].grid, static_cast<int>(n));
    EXPECT_EQ(file.at("area_mm2"), layer.area_mm2);
    ASSERT_EQ(png.width, 150);
    ASSERT_EQ(png.height, 120);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 150; ++x) ASSERT_EQ(png(x, 119 - y), layer.coverage(x, y)) << x << " " << y;
    }
  }
}

TEST(SliceIo, PlatesAreFoldersOfOneZip) {
  const TempDir folder;
  SliceJob two = job();
  two.plates = {{"left", slice_grid({}, {{-6, -6, 0}, {0, 6, 4}}, {0.1, 0.1}, 0.5)},
                {"right", slice_grid({}, {{0, -6, 0}, {9, 6, 4}}, {0.1, 0.1}, 0.5)}};
  const auto done = write(folder / "a.zip", two);
  EXPECT_NEAR(done[0].volume_mm3 + done[1].volume_mm3, part_mm3, 0.002 * part_mm3);
  const auto entries = unzipped(content(folder / "a.zip"));
  EXPECT_EQ(entries.count("left/layer_00007.png"), 1U);
  EXPECT_EQ(entries.count("right/layer_00007.png"), 1U);
  EXPECT_THROW(write(folder / "a.sl1", two), Error);
}

TEST(SliceIo, AnSl1IsWhatThePrinterReads) {
  const TempDir folder;
  SliceJob turned = job();
  turned.screen = {.portrait = true, .mirrored = true};
  write(folder / "a.sl1", turned);
  const auto entries = unzipped(content(folder / "a.sl1"));
  EXPECT_THAT(entries.at("config.ini"), HasSubstr("jobDir = tube___pin\nlayerHeight = 0.5\n"));
  EXPECT_THAT(entries.at("config.ini"), HasSubstr("numFast = 8\n"));
  const std::string& profile = entries.at("prusaslicer.ini");
  for (const char* line : {"display_pixels_x = 150\n", "display_pixels_y = 120\n", "display_width = 15\n",
                           "display_height = 12\n", "display_orientation = portrait\n", "display_mirror_x = 1\n"})
    EXPECT_THAT(profile, HasSubstr(line));
  const GrayImage png = grey_png(entries.at("tube___pin00003.png"));
  EXPECT_EQ(png.width, 120);
  EXPECT_EQ(png.height, 150);
}

TEST(SliceIo, ARunThatWasCutShortGoesOnToTheSameBytes) {
  const TempDir folder;
  SliceJob tall = job();
  const auto grid = [](double from, double to) {
    return slice_grid({}, {{from, -6, 0}, {to, 6, 4}}, {0.1, 0.1}, 0.05);
  };
  tall.plates = {{"", grid(-6, 9)}};
  SliceJob two = tall;
  two.plates = {{"left", grid(-6, 0)}, {"right", grid(0, 9)}};
  for (const auto& [name, work, layers] :
       {std::tuple("a.sl1", tall, 80), std::tuple("a.svg", tall, 80), std::tuple("a.cli", tall, 80),
        std::tuple("a.svg.zip", tall, 80), std::tuple("a.3mf", tall, 80), std::tuple("a.zip", two, 160)}) {
    const auto wanted = write(folder / name, work);
    const std::string bytes = content(folder / name);
    fs::remove(folder / name);
    // Cut short by its caller, again and again; stretches of 21 layers end anywhere in what is kept together.
    int made = 0, runs = 0;
    for (bool ended = false; !ended; ++runs) {
      ASSERT_LT(runs, 20) << name;
      SliceJob part = work;
      part.kept = std::make_shared<KeptWork>(folder / "kept", "this very job\n");
      const std::size_t before = part.kept->parts().size();
      part.run_from = [&made, &shape = work.shape, ready = 0](const SlicePlate& plate, int first) mutable {
        if (ready >= 42) throw Error(Code::Cancelled, "enough for now");
        const int last = std::min(first + 21, plate.grid.layers);
        made += last - first;
        ready += last - first;
        return LayerRun{last, shape};
      };
      try {
        const auto done = write(folder / name, part);
        ended = true;
        ASSERT_EQ(done.size(), wanted.size());
        for (std::size_t p = 0; p < done.size(); ++p) EXPECT_EQ(done[p].area_mm2, wanted[p].area_mm2);
        part.kept->discard();
      } catch (const Error& error) {
        ASSERT_EQ(error.code(), Code::Cancelled);
        EXPECT_FALSE(fs::exists(folder / name));
        EXPECT_GE(part.kept->parts().size(), before + 2) << name;  // of 42 layers at least 32 stay
      }
    }
    EXPECT_GE(runs, 2);
    EXPECT_LE(made, layers + 15 * runs) << name;
    EXPECT_TRUE(content(folder / name) == bytes) << name;
    EXPECT_FALSE(fs::exists(folder / "kept"));
  }
}

/// Signed areas and closedness of the polylines of an ASCII .cli, layer by layer.
struct CliLayer {
  double z_mm = 0;
  std::vector<double> area_mm2;
};
std::vector<CliLayer> read_cli(const std::string& text) {
  std::istringstream in(text);
  std::vector<CliLayer> layers;
  double unit = 0;
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line.substr(line.find('/') + 1));
    if (line.starts_with("$$UNITS/")) words >> unit;
    if (line.starts_with("$$LAYER/")) {
      words >> layers.emplace_back().z_mm;
      layers.back().z_mm *= unit;
    }
    if (!line.starts_with("$$POLYLINE/")) continue;
    int id = 0, direction = 0, count = 0;
    words >> id >> direction >> count;
    std::vector<Vec2d> p(static_cast<std::size_t>(count));
    for (Vec2d& q : p) words >> q.x >> q.y;
    EXPECT_TRUE(words && words.peek() == EOF) << line.substr(0, 60);
    EXPECT_EQ(p.front(), p.back());
    double twice = 0;
    for (std::size_t i = 1; i < p.size(); ++i) twice += p[i - 1].x * p[i].y - p[i].x * p[i - 1].y;
    EXPECT_EQ(direction, twice > 0 ? 1 : 0);
    layers.back().area_mm2.push_back(0.5 * twice * unit * unit);
  }
  return layers;
}

TEST(SliceIo, ACliHoldsClosedAndDirectedOutlines) {
  const TempDir folder;
  const auto done = write(folder / "a.cli", job());
  const std::string text = content(folder / "a.cli");
  EXPECT_THAT(text, StartsWith("$$HEADERSTART\n$$ASCII\n$$UNITS/0.0001\n"));
  EXPECT_THAT(text, HasSubstr("$$LAYERS/9\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/0\n$$LAYER/5000\n"));
  EXPECT_TRUE(text.ends_with("$$GEOMETRYEND\n"));
  const auto layers = read_cli(text);
  ASSERT_EQ(layers.size(), 9U);
  EXPECT_TRUE(layers[0].area_mm2.empty());
  double volume = 0;
  for (std::size_t n = 1; n < layers.size(); ++n) {
    EXPECT_NEAR(layers[n].z_mm, 0.5 * static_cast<double>(n), 1e-12);
    auto areas = layers[n].area_mm2;
    std::sort(areas.begin(), areas.end());
    ASSERT_EQ(areas.size(), 4U);
    const double truth[] = {-16 * pi, pi, 4, 25 * pi};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(areas[i], truth[i], 0.004 * std::abs(truth[i]));
    for (const double a : areas) volume += 0.5 * a;
  }
  EXPECT_NEAR(volume, done[0].volume_mm3, 1e-4 * volume);
}

TEST(SliceIo, SvgsHaveMillimetresAndEvenOddHoles) {
  const TempDir folder;
  write(folder / "a.svg", job());
  const std::string text = content(folder / "a.svg");
  EXPECT_THAT(text, HasSubstr("width=\"15mm\" height=\"12mm\" viewBox=\"0 0 15 12\""));
  EXPECT_THAT(text, HasSubstr("<g id=\"layer7\" data-z-mm=\"4\">\n<path fill-rule=\"evenodd\" d=\"M"));
  EXPECT_TRUE(text.ends_with("</g>\n</svg>\n"));
  write(folder / "b.svg.zip", job());
  const auto entries = unzipped(content(folder / "b.svg.zip"));
  ASSERT_EQ(entries.size(), 9U);
  // The block's path, y down: its left edge is 12 mm from the left, its top 1 mm from the top.
  const std::string& layer = entries.at("layer_00000.svg");
  EXPECT_THAT(layer, StartsWith("<?xml"));
  EXPECT_EQ(std::count(layer.begin(), layer.end(), 'Z'), 4);
}

TEST(SliceIo, AnSvgsOutlinesEndAtTheRimOfItsPicture) {
  // A block that reaches over the left and the upper rim, both at 0 in the picture.
  const TempDir folder;
  SliceJob cut = job();
  cut.shape = cuboid({{-9, 0, 0}, {0, 9, 4}});
  const auto done = write(folder / "a.svg", cut);
  std::string text = content(folder / "a.svg");
  text = text.substr(text.find(" d=\"M") + 5);
  text = text.substr(0, text.find('Z'));
  std::replace(text.begin(), text.end(), 'L', ' ');
  std::istringstream in(text.substr(1));
  std::vector<Vec2d> points;
  for (Vec2d p; in >> p.x >> p.y;) points.push_back(p);
  ASSERT_TRUE(in.eof()) << text;
  double least = 1, most = 0, twice = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2d p = points[i], q = points[(i + 1) % points.size()];
    least = std::min({least, p.x, p.y});
    most = std::max({most, p.x, p.y});
    twice += p.x * q.y - p.y * q.x;
  }
  EXPECT_EQ(least, 0);
  EXPECT_NEAR(most, 6, 1e-3);
  EXPECT_NEAR(std::abs(twice) / 2, 36, 0.02);  // a corner of the rim is cut
  EXPECT_NEAR(done[0].area_mm2[0], 36, 0.02);
}

TEST(SliceIo, SameBytesOnOneAndTwoThreads) {
  const TempDir folder;
  for (const std::string ending : {".zip", ".sl1", ".svg", ".svg.zip", ".cli", ".3mf"}) {
    for (int threads = 1; threads <= 2; ++threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
      write(folder / (std::to_string(threads) + ending), job());
    }
    EXPECT_EQ(content(folder / ("1" + ending)), content(folder / ("2" + ending))) << ending;
  }
}

TEST(SliceIo, RefusesWhatTheFormatCannotHold) {
  const TempDir folder;
  SliceJob tall = job();
  tall.plates[0].grid.layers = 70000;
  EXPECT_THROW(write(folder / "a.sl1", tall), Error);
  tall.plates[0].grid.layers = (1 << 24) + 1;
  for (const char* name : {"a.zip", "a.sl1", "a.svg.zip"}) EXPECT_THROW(write(folder / name, tall), Error);
  EXPECT_THROW(write(folder / "a.gif", job()), Error);
  EXPECT_THROW(write(folder / "nowhere" / "a.zip", job()), Error);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(SliceIo, WhatIsCancelledLeavesNothing) {
  const TempDir folder;
  std::atomic<int> seen = 0;
  std::unique_ptr<Context> context;
  context = std::make_unique<Context>(
      [&](double fraction, std::string_view) {
        if (fraction > 0.2 && ++seen == 1) context->cancel();
      },
      nullptr);
  EXPECT_THROW(write(folder / "a.zip", job(), *context), Error);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace fibrolite
