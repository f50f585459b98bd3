// SPDX-License-Identifier: GPL-3.0-or-later
// Layers through the program: from a model and from a solid, and whatever may be wrong with what is asked for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <tuple>

#include "archive.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/realize.h"
#include "fibrolite/solid_io.h"
#include "fibrolite_program.h"

namespace fibrolite {
namespace {

using namespace fibrolite::testing;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
namespace fs = std::filesystem;

constexpr double pi = std::numbers::pi;

double sum(const json& list) {
  double all = 0;
  for (const json& value : list) all += value.get<double>();
  return all;
}

TEST(Slicing, AModelsLayersAddUpToItsSolid) {
  const TempDir folder;
  // The crystal all over, and every structure at once.
  for (const auto& [model, size, infill] : {std::tuple("molar", "30", "tcs"), std::tuple("y", "50", "hybrid")}) {
    run({"slice", asset(model), "--size", size, "--voxel", "0.25", "--infill", infill, "--layer", "0.2", "--pixel",
         "0.1", "-o", folder / "a.zip", "-o", folder / "a.cli", "-o", folder / "a.svg.zip", "--overwrite"});
    EXPECT_THAT(names_in(folder.path()), ElementsAre("a.cli", "a.report.json", "a.svg.zip", "a.zip"));
    const json report = report_in(folder / "a.report.json");
    const double solid = report["solid"]["volume_mm3"], layers = report["slices"]["volume_mm3"];
    EXPECT_NEAR(layers, solid, 0.005 * solid) << model;
    EXPECT_LT(solid, 0.9 * report["model"]["volume_mm3"].get<double>());
    EXPECT_THAT(report["warnings"].dump(), Not(HasSubstr("add up")));
    const json& plate = report["slices"]["plates"][0];
    EXPECT_NEAR(sum(plate["area_mm2"]) * 0.2, layers, 1e-3);

    const auto entries = unzipped(content(folder / "a.zip"));
    EXPECT_EQ(entries.size(), plate["layers"].get<std::size_t>() + 1);
    double pixels = 0;
    for (const auto& [name, bytes] : entries) {
      if (!name.ends_with(".png")) continue;
      for (const std::uint8_t p : grey_png(bytes).pixels) pixels += p / 255.0;
    }
    EXPECT_NEAR(pixels * 2e-3, solid, 0.005 * solid) << model;
  }
}

TEST(Slicing, ASolidIsSlicedAsItStands) {
  const TempDir folder;
  write_vdb(folder / "ball.vdb",
            {{"solid", realize(sphere({3, 4, 5}, 5), {{-9, -9, -9}, {19, 19, 19}}, {.voxel_mm = 0.4})}});
  run({"slice", folder / "ball.vdb", "-o", folder / "ball.cli", "--layer", "0.1", "--pixel", "0.1", "--up", "-x"});
  const json report = report_in(folder / "ball.report.json");
  const double truth = 4.0 / 3 * pi * 125;
  EXPECT_NEAR(report["slices"]["volume_mm3"], truth, 0.005 * truth);
  EXPECT_NEAR(report["solid"]["volume_mm3"], truth, 0.005 * truth);
  EXPECT_EQ(report["slices"]["plates"][0]["layers"], 100);
}

TEST(Slicing, APrinterHasItsOwnPlateAndPixels) {
  const TempDir folder;
  write_mesh(folder / "cube.stl", cube(20));
  run({"slice", folder / "cube.stl", "--infill", "solid", "--voxel", "0.4", "--layer", "0.5", "--printer", "sl1", "-o",
       folder / "cube.sl1"});
  const auto entries = unzipped(content(folder / "cube.sl1"));
  EXPECT_EQ(entries.size(), 42U);
  const GrayImage png = grey_png(entries.at("cube00020.png"));
  EXPECT_EQ(png.width, 1440);
  EXPECT_EQ(png.height, 2560);
  EXPECT_EQ(png(720, 1280), 255);  // in the middle of the plate
  // 10 mm are 211.64 pixels.
  EXPECT_EQ(png(720 - 213, 1280), 0);
  EXPECT_NEAR(png(720 - 212, 1280), 0.636 * 255, 3);
  EXPECT_EQ(png(720 - 211, 1280), 255);
}

TEST(Slicing, TilesCoverThePart) {
  const TempDir folder;
  write_mesh(folder / "cube.stl", cube(20));
  run({"slice", folder / "cube.stl", "--infill", "solid", "--voxel", "0.4", "--layer", "0.5", "--printer",
       "15x30x12:150x300", "--tile", "-o", folder / "cube.zip"});
  const json report = report_in(folder / "cube.report.json");
  ASSERT_EQ(report["slices"]["plates"].size(), 4U);
  EXPECT_NEAR(report["slices"]["volume_mm3"], 8000, 40);
  EXPECT_EQ(report["slices"]["plates"][0]["name"], "plate_1_1_1");
  EXPECT_EQ(report["slices"]["plates"][3]["layers"], 16);
}

TEST(Slicing, LessMemoryGivesTheSameBytesSlabBySlab) {
  const TempDir whole, slabs;
  const std::string model = testing::asset("molar").string();
  const std::vector<std::string> options{"slice", model,     "--infill", "tcs",     "--voxel",
                                         "0.2",   "--layer", "0.5",      "--pixel", "0.5"};
  const auto sliced = [&](const TempDir& folder, std::vector<std::string> more) {
    std::vector<std::string> arguments = options;
    arguments.insert(arguments.end(), {"-o", (folder / "molar.zip").string()});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  EXPECT_THAT(sliced(slabs, {"--max-memory", "180M", "--dry-run"}).out, HasSubstr("slabs"));
  sliced(whole, {});
  sliced(slabs, {"--max-memory", "180M"});
  EXPECT_TRUE(content(whole / "molar.zip") == content(slabs / "molar.zip"));
  json a = report_in(whole / "molar.report.json"), b = report_in(slabs / "molar.report.json");
  for (const char* block : {"model", "parts", "interfaces", "solid", "print", "slices"})
    EXPECT_EQ(a[block], b[block]) << block;
  for (const json& stage : b["stages"]) EXPECT_LE(stage["peak_rss_mb"], 180 * 1.048576);
}

TEST(Slicing, ADryRunOnlySays) {
  const TempDir folder;
  write_mesh(folder / "cube.stl", cube(20));
  const Finished finished =
      run({"slice", folder / "cube.stl", "--layer", "0.1", "--pixel", "0.05", "-o", folder / "cube.zip", "--dry-run"});
  for (const char* part : {"200 of 0.1 mm", "400 x 400 of 0.05 x 0.05 mm", "memory    about", "cube.zip, about"})
    EXPECT_THAT(finished.out, HasSubstr(part));
  EXPECT_THAT(names_in(folder.path()), ElementsAre("cube.stl"));
}

/// Mesh and layers of one model have the same name but for the ending: each has its report, and neither is lost.
TEST(Slicing, TheReportOfAnotherOutputStays) {
  const TempDir folder;
  write_mesh(folder / "cube.stl", cube(20));
  const auto made = [&](const char* command, const char* output, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{command, folder / "cube.stl", "--infill", "solid", "--voxel", "0.5"};
    arguments.insert(arguments.end(), {"-o", folder / output});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  const std::vector<std::string> layers{"--layer", "2", "--pixel", "1"};
  run(made("generate", "part.ply", {}));
  const std::string report = content(folder / "part.report.json");
  EXPECT_EQ(json::parse(report)["formats"], json({"ply"}));
  EXPECT_THAT(run(made("slice", "part.zip", layers)).out, HasSubstr("part.zip.report.json"));
  EXPECT_EQ(content(folder / "part.report.json"), report);
  EXPECT_EQ(report_in(folder / "part.zip.report.json")["command"], "slice");
  run(made("generate", "part.OBJ", {}));
  EXPECT_EQ(content(folder / "part.report.json"), report);

  // Its own is refused as ever, and replaced where it is.
  EXPECT_EQ(run_program(FIBROLITE_PROGRAM, made("slice", "part.zip", layers)).code, 7);
  fs::remove(folder / "part.zip");
  EXPECT_EQ(run_program(FIBROLITE_PROGRAM, made("slice", "part.zip", layers)).code, 7);
  std::vector<std::string> finer{"--layer", "1", "--pixel", "1", "--overwrite"};
  run(made("slice", "part.zip", finer));
  EXPECT_EQ(report_in(folder / "part.zip.report.json")["slices"]["plates"][0]["layers"], 20);
  EXPECT_EQ(content(folder / "part.report.json"), report);
  fs::remove(folder / "part.ply");
  EXPECT_EQ(run_program(FIBROLITE_PROGRAM, made("generate", "part.ply", {})).code, 7);

  // Who asks for it has the plain name.
  run(made("slice", "part.cli", finer));
  EXPECT_EQ(report_in(folder / "part.report.json")["command"], "slice");
  EXPECT_THAT(names_in(folder.path()), ElementsAre("cube.stl", "part.OBJ", "part.OBJ.report.json", "part.cli",
                                                   "part.report.json", "part.zip", "part.zip.report.json"));
}

enum { Usage = 2, BadModel = 3, OutOfMemory = 5, NoOutput = 7 };

class SlicingRefused : public ::testing::Test {
 protected:
  TempDir models, outputs;

  fs::path good_model() {
    write_mesh(models / "cube.stl", cube(20));
    return models / "cube.stl";
  }
  /// One line of error, this exit code, nothing written.
  std::string refused(const std::vector<std::string>& options, int code, const std::string& output = "out.zip") {
    std::vector<std::string> arguments{"slice",    good_model(), "-o",      outputs / output,
                                       "--infill", "solid",      "--voxel", "0.5"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return refused_run(arguments, code, outputs.path());
  }
};

TEST_F(SlicingRefused, LengthsThatAreNone) {
  for (const char* bad : {"0", "-0.1", "nan", "inf", "thin"}) {
    EXPECT_THAT(refused({"--layer", bad}, Usage), HasSubstr("--layer"));
    EXPECT_THAT(refused({"--pixel", bad}, Usage), HasSubstr("--pixel"));
  }
}
TEST_F(SlicingRefused, StepsLargerThanThePart) {
  EXPECT_THAT(refused({"--layer", "21"}, Usage), HasSubstr("a layer of 21 mm is more than the part, 20 mm"));
  EXPECT_THAT(refused({"--pixel", "21"}, Usage), HasSubstr("a pixel of 21 mm is more than the part, 20 mm"));
}
TEST_F(SlicingRefused, PrintersThatAreNone) {
  for (const char* bad : {"sl9", "", "10x10:5x5", "10x10x10:5x5x5", "10x10x10:5.5x5", "0x10x10:5x5", "10x10xnan:5x5",
                          "10x10x10:0x5", "10x10x10:100000x100000"})
    EXPECT_THAT(refused({"--printer", bad}, Usage), HasSubstr("--printer"));
  refused({"--printer", "sl1", "--pixel", "0.1"}, Usage);
  refused({"--planes", "3"}, Usage);
}
TEST_F(SlicingRefused, APrinterSmallerThanThePart) {
  EXPECT_THAT(refused({"--printer", "15x30x30:150x300"}, Usage), HasSubstr("use --tile"));
  EXPECT_THAT(refused({"--printer", "30x30x15:300x300"}, Usage), HasSubstr("20 x 20 x 20 mm"));
  refused({"--tile"}, Usage);
  EXPECT_THAT(refused({"--printer", "15x30x30:150x300", "--tile"}, Usage, "out.sl1"), HasSubstr("use .zip"));
}
TEST_F(SlicingRefused, MoreThanTheFormatHolds) {
  EXPECT_THAT(refused({"--layer", "0.0003"}, OutOfMemory, "out.sl1"), HasSubstr("66667 layers"));
  EXPECT_THAT(refused({"--layer", "1e-9"}, OutOfMemory), HasSubstr("layer"));
  EXPECT_THAT(refused({"--pixel", "1e-4"}, OutOfMemory), HasSubstr("pixel"));
  EXPECT_THAT(refused({"--pixel", "0.001", "--max-memory", "300M"}, OutOfMemory), HasSubstr("20000 x 20000 pixels"));
}
TEST_F(SlicingRefused, DrainHolesOfASolidThatDoesNotFit) {
  const std::string said =
      refused({"--size", "400", "--layer", "5", "--pixel", "1", "--max-memory", "180M", "--set", "print.drain_mm=2"},
              OutOfMemory);
  EXPECT_THAT(said, HasSubstr("print.drain_mm needs the whole solid"));
}
TEST_F(SlicingRefused, FilesAndModels) {
  refused({}, Usage, "out.png");
  refused({}, NoOutput, "nowhere/out.zip");
  write_vdb(models / "ball.vdb", {{"solid", realize(sphere({}, 5), {{-9, -9, -9}, {9, 9, 9}}, {.voxel_mm = 0.5})}});
  const auto solid = [&](const std::vector<std::string>& more, int code) {
    std::vector<std::string> arguments{"slice", models / "ball.vdb", "-o", outputs / "out.zip"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return refused_run(arguments, code, outputs.path());
  };
  // What only makes sense for a model is not ignored without a word.
  const std::vector<std::pair<std::string, std::string>> of_a_model{
      {"--size", "20"},        {"--unit", "cm"},       {"--infill", "tcs"}, {"--voxel", "0.5"},
      {"--preset", "default"}, {"--recipe", "a.json"}, {"--seed", "2"},     {"--set", "tcs.cell_mm=5"}};
  for (const auto& [option, value] : of_a_model)
    EXPECT_THAT(solid({option, value}, Usage), HasSubstr(option + " is for a model"));
  fs::resize_file(models / "ball.vdb", 1000);
  solid({}, BadModel);
}
TEST_F(SlicingRefused, AFullDiskMidRun) {
  // No file may grow beyond 64 KiB: the archive is refused half-way, as on a full disk.
  for (const std::string name : {"out.zip", "out.cli", "out.svg", "out.3mf"}) {
    const std::string command = "trap '' XFSZ; ulimit -f 64; exec '" + std::string(FIBROLITE_PROGRAM) + "' slice '" +
                                good_model().string() + "' -o '" + (outputs / name).string() +
                                "' --infill solid --voxel 0.5 --layer 0.02 --pixel 0.05";
    const Finished finished = run_program("/bin/bash", {"-c", command});
    expect_refused(finished, NoOutput);
    EXPECT_THAT(names_in(outputs.path()), IsEmpty());
  }
}

}  // namespace
}  // namespace fibrolite
