// SPDX-License-Identifier: GPL-3.0-or-later
// Whatever is wrong with what the user gives: one clear line, the right exit code, and no file left behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <bit>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "fibrolite/mesh_io.h"
#include "fibrolite_program.h"

namespace fibrolite {
namespace {

using namespace fibrolite::testing;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
namespace fs = std::filesystem;

enum { Done = 0, Usage = 2, BadModel = 3, BadRecipe = 4, OutOfMemory = 5, NoOutput = 7 };

class BadInput : public ::testing::Test {
 protected:
  TempDir models, outputs;

  fs::path model(const std::string& name, const std::string& bytes) {
    std::ofstream(models / name, std::ios::binary) << bytes;
    return models / name;
  }
  fs::path good_model() {
    fs::path path = models / "cube.stl";
    write_mesh(path, cube(20));
    return path;
  }

  std::string refused(const std::vector<std::string>& arguments, int code) {
    return refused_run(arguments, code, outputs.path());
  }
  std::string refused_model(const fs::path& path) {
    return refused({"generate", path, "-o", outputs / "out.stl", "--voxel", "0.4"}, BadModel);
  }
  std::string refused_option(const std::vector<std::string>& options, int code) {
    std::vector<std::string> arguments{"generate", good_model(), "-o", outputs / "out.stl"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return refused(arguments, code);
  }
};

// ---- models

/// A binary STL with these triangles, nine floats each.
std::string binary_stl(const std::vector<std::array<float, 9>>& triangles) {
  std::string bytes(80, '\0');
  const auto put = [&](const auto& value) {
    const auto raw = std::bit_cast<std::array<char, sizeof value>>(value);
    bytes.append(raw.data(), raw.size());
  };
  put(static_cast<std::uint32_t>(triangles.size()));
  for (const auto& corners : triangles) {
    for (int i = 0; i < 3; ++i) put(0.0F);
    for (const float c : corners) put(c);
    put(std::uint16_t{0});
  }
  return bytes;
}
const std::vector<std::array<float, 9>> tetrahedron{
    {0, 0, 0, 0, 9, 0, 9, 0, 0}, {0, 0, 0, 9, 0, 0, 0, 0, 9}, {0, 0, 0, 0, 0, 9, 0, 9, 0}, {9, 0, 0, 0, 9, 0, 0, 0, 9}};

TEST_F(BadInput, MissingModel) { EXPECT_THAT(refused_model(models / "nowhere.stl"), HasSubstr("nowhere.stl")); }
TEST_F(BadInput, AFolderAsModel) { EXPECT_THAT(refused_model(models.path()), HasSubstr("a folder, not a model")); }
TEST_F(BadInput, NoEnding) { EXPECT_THAT(refused_model(model("cube", "solid")), HasSubstr("no ending")); }
TEST_F(BadInput, AModelFarFromTheOrigin) {
  Mesh mesh = cube(20);
  for (Vec3f& v : mesh.vertices) v.x += 1e8F;
  const fs::path path = models / "far.stl";
  write_mesh(path, mesh);
  EXPECT_THAT(refused_model(path), HasSubstr("move it to the origin"));
}
/// A unit forgotten is what a newcomer does first: by the size it is asked for, whatever else is in the way.
TEST_F(BadInput, ModelsWhoseUnitIsWrong) {
  const fs::path path = models / "metres.stl";
  write_mesh(path, cube(20000));
  EXPECT_THAT(refused({"generate", path, "-o", outputs / "out.stl", "--max-memory", "500M"}, OutOfMemory),
              AllOf(HasSubstr("20000 mm"), HasSubstr("try --unit or --size")));
  EXPECT_THAT(refused({"generate", path, "-o", outputs / "out.stl", "--size", "1e25"}, OutOfMemory),
              AllOf(HasSubstr("a million TB or more"), HasSubstr("try --unit or --size")));
}
TEST_F(BadInput, EmptyFiles) {
  for (const char* name : {"a.stl", "a.obj", "a.ply", "a.off", "a.3mf", "a.vdb"}) refused_model(model(name, ""));
}
TEST_F(BadInput, TextNamedStl) { refused_model(model("letter.stl", "Dear reader,\nthis is no model.\n")); }
TEST_F(BadInput, TextNamedAsEveryFormat) {
  for (const char* name : {"a.obj", "a.ply", "a.off", "a.3mf", "a.vdb"})
    refused_model(model(name, "Dear reader,\nthis is no model.\n"));
}
TEST_F(BadInput, UnknownEnding) { refused_model(model("a.xyz", "0 0 0\n")); }
TEST_F(BadInput, TruncatedBinaryStl) {
  const std::string whole = binary_stl(tetrahedron);
  refused_model(model("cut.stl", whole.substr(0, whole.size() - 30)));
  refused_model(model("head.stl", whole.substr(0, 84)));
}
TEST_F(BadInput, CoordinatesThatAreNoNumbers) {
  for (const float bad : {std::nanf(""), HUGE_VALF, -HUGE_VALF}) {
    auto triangles = tetrahedron;
    triangles[2][4] = bad;
    refused_model(model("bad.stl", binary_stl(triangles)));
  }
  refused_model(model("bad.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"));
}
TEST_F(BadInput, IndexOutOfRange) {
  refused_model(model("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"));
  refused_model(model("bad.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"));
}
TEST_F(BadInput, NoTriangles) {
  refused_model(model("none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"));
  refused_model(model("none.stl", binary_stl({})));
}
TEST_F(BadInput, AllInOnePlane) {
  refused_model(model("flat.stl", binary_stl({{0, 0, 0, 9, 0, 0, 0, 9, 0}, {9, 0, 0, 9, 9, 0, 0, 9, 0}})));
}
TEST_F(BadInput, AnOpenSheet) {
  // A roof: two slopes that meet in a ridge, nothing below.
  refused_model(
      model("roof.obj", "v 0 0 0\nv 20 0 0\nv 20 10 5\nv 0 10 5\nv 20 20 0\nv 0 20 0\nf 1 2 3 4\nf 4 3 5 6\n"));
}
TEST_F(BadInput, PartitionAndCheckRefuseItToo) {
  refused({"partition", model("a.stl", ""), "-o", outputs / "out.ply"}, BadModel);
  refused({"check", models / "nowhere.stl"}, BadModel);
}

// ---- command line

TEST_F(BadInput, VoxelsThatAreNone) {
  for (const char* voxel : {"0", "-1", "nan", "inf", "1e999", "0.4mm", "", "abc", "0x1"})
    EXPECT_THAT(refused_option({"--voxel", voxel}, Usage), HasSubstr("--voxel")) << voxel;
}
TEST_F(BadInput, SizesThatAreNone) {
  for (const char* size : {"0", "-100", "nan", "inf"}) refused_option({"--size", size}, Usage);
}
TEST_F(BadInput, OtherNumbers) {
  for (const char* threads : {"0", "-2", "1.5", "many"}) refused_option({"--threads", threads}, Usage);
  for (const char* memory : {"0", "-4G", "4X", "nan", "G", ""}) refused_option({"--max-memory", memory}, Usage);
  for (const char* seed : {"-1", "1.5", "x"}) refused_option({"--seed", seed}, Usage);
}
TEST_F(BadInput, UnknownNamesComeWithTheNearest) {
  EXPECT_THAT(refused_option({"--infill", "hybird"}, Usage),
              AllOf(HasSubstr("hybird"), HasSubstr("did you mean hybrid?")));
  EXPECT_THAT(refused_option({"--up", "w"}, Usage), HasSubstr("did you mean"));
  EXPECT_THAT(refused_option({"--unit", "inch"}, Usage), HasSubstr("did you mean in?"));
  EXPECT_THAT(refused_option({"--log", "jsn"}, Usage), HasSubstr("did you mean json?"));
  EXPECT_THAT(refused_option({"--voxle", "1"}, Usage), HasSubstr("did you mean --voxel?"));
  EXPECT_THAT(refused({"genrate", "a.stl"}, Usage), HasSubstr("did you mean generate?"));
}
TEST_F(BadInput, CommandsThatDoNotExist) {
  EXPECT_THAT(refused({}, Usage), HasSubstr("no command"));
  EXPECT_THAT(refused({"fly", "a.stl"}, Usage), HasSubstr("unknown command 'fly'"));
}
TEST_F(BadInput, MissingAndSurplusArguments) {
  refused({"generate"}, Usage);
  refused({"generate", good_model()}, Usage);
  refused({"generate", good_model(), "-o"}, Usage);
  refused({"generate", good_model(), good_model(), "-o", outputs / "out.stl"}, Usage);
  refused_option({"--voxel"}, Usage);
  refused_option({"--voxel", "0.4", "--voxel", "0.5"}, Usage);
}
TEST_F(BadInput, OutputEndings) {
  EXPECT_THAT(refused({"generate", good_model(), "-o", outputs / "out.step"}, Usage), HasSubstr(".stl"));
  refused({"partition", good_model(), "-o", outputs / "out.stl"}, Usage);
  refused_option({"--picture", outputs / "a.jpg"}, Usage);
  refused_option({"--steps", outputs / "a.stl"}, Usage);
}
TEST_F(BadInput, Views) {
  for (const char* view : {"front", "part", "part:", "part:x", "part:0:back", "joint:-1", "joint:99999"})
    EXPECT_THAT(refused_option({"--picture", outputs / "a.png", "--view", view}, Usage), HasSubstr("joint:NUMBER"));
  EXPECT_THAT(refused_option({"--view", "whole"}, Usage), HasSubstr("more views than pictures"));
  EXPECT_THAT(refused_option({"--infill", "tcs", "--voxel", "0.4", "--picture", outputs / "a.png", "--view", "joint:0"},
                             BadRecipe),
              HasSubstr("this model has none"));
}
TEST_F(BadInput, OneNameForTwoOutputs) {
  refused_option({"-o", outputs / "out.stl"}, Usage);
  refused_option({"--report", outputs / "." / "out.stl"}, Usage);
}
TEST_F(BadInput, AnOutputOverTheModel) {
  const std::string before = content(good_model());
  refused({"generate", good_model(), "-o", good_model(), "--overwrite"}, Usage);
  EXPECT_EQ(content(models / "cube.stl"), before);
}

// ---- recipes

TEST_F(BadInput, UnknownPreset) {
  EXPECT_THAT(refused_option({"--preset", "papper"}, BadRecipe),
              AllOf(HasSubstr("papper"), HasSubstr("did you mean paper?")));
}
TEST_F(BadInput, UnknownRecipeKeys) {
  EXPECT_THAT(refused_option({"--set", "tcs.cel_mm=5"}, BadRecipe), HasSubstr("did you mean tcs.cell_mm?"));
  EXPECT_THAT(refused_option({"--recipe", model("r.json", R"({"mfs": {"wal_mm": 1}})")}, BadRecipe),
              AllOf(HasSubstr("did you mean mfs.wall_mm?"), HasSubstr("r.json")));
}
TEST_F(BadInput, LoadsAndMaterials) {
  EXPECT_THAT(refused_option({"--set", "loads=stnad"}, BadRecipe), HasSubstr("did you mean stand?"));
  EXPECT_THAT(refused_option({"--set", "material=PETF"}, BadRecipe), HasSubstr("did you mean PETG?"));
  EXPECT_THAT(
      refused_option({"--recipe", model("r.json", R"({"loads": [{"name": "a", "supports": [], "forces": []}]})")},
                     BadRecipe),
      HasSubstr("load case 'a' has no support"));
}
TEST_F(BadInput, RecipesThatAreNone) {
  refused_option({"--recipe", model("r.json", "{")}, BadRecipe);
  refused_option({"--recipe", model("r.json", "")}, BadRecipe);
  refused_option({"--recipe", models / "nowhere.json"}, BadRecipe);
  refused_option({"--recipe", models.path()}, BadRecipe);
  refused_option({"--set", "tcs.cell_mm"}, BadRecipe);
  refused_option({"--set", "tcs.cell_mm=nan"}, BadRecipe);
  refused({"recipe", "--set", "tcs.ball_mm=0.1"}, BadRecipe);
}
TEST_F(BadInput, SticksThinnerThanTwoVoxels) {
  EXPECT_THAT(refused_option({"--voxel", "0.5"}, BadRecipe),
              AllOf(HasSubstr("thinner than 2 voxels"), HasSubstr("--voxel 0.4")));
  EXPECT_THAT(refused_option({"--voxel", "0.25", "--set", "tcs.stick_mm=0.4"}, BadRecipe), HasSubstr("tcs.stick_mm"));
}

/// The number after a word of a message.
std::string proposed(const std::string& message, const std::string& word) {
  const auto at = message.rfind(word + " ");
  if (at == std::string::npos) return {};
  const auto from = at + word.size() + 1;
  return message.substr(from, message.find_first_of(" ,\n", from) - from);
}
TEST_F(BadInput, WhatAMessageProposesIsTaken) {
  using Options = std::vector<std::string>;
  const fs::path cut = models / "small.stl";
  write_mesh(cut, cube(20));
  const std::vector<Options> all{
      {"--voxel", "0.6", "--set", "shell.thickness_mm=1.1"},
      {"--voxel", "0.5", "--set", "shell.thickness_mm=0.9", "--set", "mfs.wall_mm=0.7777777"},
      {"--voxel", "0.5", "--infill", "tcs", "--set", "tcs.density=0.0712345"},
      {"--voxel", "0.5", "--infill", "gyroid", "--set", "gyroid.density=0.0612345"},
      {"--voxel", "0.4", "--set", "print.drain_mm=0.6543217"},
      {"--voxel", "0.4", "--infill", "solid", "--set", "print.drain_mm=0.6543217"},
      {"--voxel", "0.01", "--max-memory", "500M"},
      {"--voxel", "0.1", "--max-memory", "100M"},
      {"--voxel", "0.05", "--max-memory", "60M", "--picture", outputs / "out.png"},
      {"--voxel", "0.05", "--max-memory", "50M"},
  };
  for (const char* command : {"generate", "slice"}) {
    for (const Options& options : all) {
      const bool meshes_only = options.size() > 4 && options[4] == "--picture";
      if (command == std::string("slice") && meshes_only) continue;
      Options arguments{command, cut, "-o", outputs / (command == std::string("slice") ? "out.zip" : "out.stl")};
      if (command == std::string("slice")) arguments.insert(arguments.end(), {"--layer", "1", "--pixel", "1"});
      arguments.insert(arguments.end(), options.begin(), options.end());
      arguments.emplace_back("--dry-run");
      const Finished first = run_program(FIBROLITE_PROGRAM, arguments);
      expect_refused(first, options[2] == "--max-memory" ? OutOfMemory : BadRecipe);
      for (const auto& [option, word] :
           {std::pair("--voxel", "use --voxel"), {"--voxel", "or --voxel"}, {"--max-memory", "--max-memory to"}}) {
        const std::string value = proposed(first.err, word);
        if (!value.empty()) *(std::find(arguments.begin(), arguments.end(), option) + 1) = value;
      }
      const Finished second = run_program(FIBROLITE_PROGRAM, arguments);
      EXPECT_EQ(second.code, Done) << first.err << second.err;
    }
  }
  // The lengths that it asks for instead do too.
  const std::string message = refused_option({"--voxel", "0.5123456"}, BadRecipe), least = proposed(message, "use");
  Options longer{"--voxel", "0.5123456", "--dry-run", "--set", "tcs.cell_mm=9", "--set", "tcs.ball_mm=2"};
  for (const char* key :
       {"shell.thickness_mm", "tcs.stick_mm", "tcs.wall_mm", "mfs.wall_mm", "joint.column_mm", "joint.min_wall_mm"}) {
    if (message.find(key) == std::string::npos) continue;
    longer.insert(longer.end(), {"--set", std::string(key) + "=" + least});
  }
  longer.insert(longer.begin(), {"generate", good_model(), "-o", outputs / "out.stl"});
  EXPECT_EQ(run(longer).code, Done) << message;
}

// ---- memory

TEST_F(BadInput, AVoxelTooSmallForTheMemory) {
  EXPECT_THAT(refused_option({"--voxel", "0.01", "--max-memory", "500M"}, OutOfMemory),
              AllOf(HasSubstr("500 MB"), HasSubstr("use --voxel")));
  for (const char* voxel : {"1e-5", "1e-30", "1e-300"}) refused_option({"--voxel", voxel}, OutOfMemory);
}

// ---- outputs

TEST_F(BadInput, OutputFolderMissing) {
  EXPECT_THAT(refused({"generate", good_model(), "-o", outputs / "nowhere" / "out.stl"}, NoOutput),
              HasSubstr("nowhere"));
  refused({"partition", good_model(), "-o", outputs / "nowhere" / "out.ply"}, NoOutput);
  refused_option({"--report", outputs / "nowhere" / "r.json"}, NoOutput);
  refused_option({"--picture", outputs / "nowhere" / "p.png"}, NoOutput);
}
TEST_F(BadInput, OutputFolderNotWritable) {
  // No one may make files in here, root neither.
  refused({"generate", good_model(), "-o", "/proc/out.stl"}, NoOutput);
  if (geteuid() == 0) return;
  const fs::path locked = models / "locked";
  fs::create_directory(locked);
  fs::permissions(locked, fs::perms::owner_read | fs::perms::owner_exec);
  refused({"generate", good_model(), "-o", locked / "out.stl"}, NoOutput);
}
TEST_F(BadInput, OutputExists) {
  const fs::path existing = model("existing.stl", "mine");
  EXPECT_THAT(refused({"generate", good_model(), "-o", existing}, NoOutput), HasSubstr("--overwrite"));
  EXPECT_EQ(content(existing), "mine");
  const fs::path report = model("other.report.json", "mine");
  EXPECT_THAT(refused({"generate", good_model(), "-o", models / "other.stl"}, NoOutput),
              HasSubstr("other.report.json"));
  EXPECT_EQ(content(report), "mine");
  EXPECT_THAT(names_in(models.path()), ElementsAre("cube.stl", "existing.stl", "other.report.json"));
}
TEST_F(BadInput, AFolderAsOutput) {
  fs::create_directory(models / "folder.stl");
  refused({"generate", good_model(), "-o", models / "folder.stl", "--overwrite"}, NoOutput);
}
TEST_F(BadInput, OutputsAreCheckedBeforeTheModelIsRead) {
  EXPECT_THAT(refused({"generate", models / "nowhere.stl", "-o", outputs / "nowhere" / "out.stl"}, NoOutput),
              HasSubstr("folder"));
}
/// The file is written under a hidden name: the user never gave that.
TEST_F(BadInput, AnOutputThatCannotGrowIsNamedAsItWasAskedFor) {
  const Finished run =
      run_program("/bin/sh", {"-c", "trap '' XFSZ; ulimit -f 16; exec \"$0\" \"$@\"", FIBROLITE_PROGRAM, "generate",
                              good_model(), "-o", outputs / "out.stl", "--voxel", "0.4", "--infill", "tcs"});
  expect_refused(run, NoOutput);
  EXPECT_THAT(run.err, HasSubstr("(" + (outputs / "out.stl").string() + ")"));
  EXPECT_THAT(names_in(outputs.path()), IsEmpty());
}
TEST_F(BadInput, AStandardOutputThatIsFull) {
  struct stat full {};
  if (stat("/dev/full", &full) != 0 || !S_ISCHR(full.st_mode)) GTEST_SKIP() << "no device /dev/full here";
  const Finished run = run_program("/bin/sh", {"-c", "exec \"$0\" recipe > /dev/full", FIBROLITE_PROGRAM});
  EXPECT_EQ(run.code, NoOutput);
  EXPECT_THAT(run.err, StartsWith("fibrolite: error: "));
}

// ---- what is not bad

/// A model smaller than the shell is thick, and than the walls that are looked for: solid, with a word on its unit.
TEST_F(BadInput, AModelOfATwentiethOfAMillimetre) {
  const fs::path path = models / "tiny.ply";
  write_mesh(path, icosphere(0.025, 5));
  const Finished run = run_program(FIBROLITE_PROGRAM, {"generate", path, "-o", outputs / "out.stl", "--infill", "tcs",
                                                       "--voxel", "0.0005", "--max-memory", "1G"});
  ASSERT_EQ(run.code, Done) << run.err;
  const auto report = report_in(outputs / "out.report.json");
  EXPECT_NEAR(report["solid"]["fill_ratio"].get<double>(), 1, 0.001);
  EXPECT_THAT(report["warnings"].dump(), HasSubstr("is its unit right?"));
  EXPECT_EQ(report["print"]["thin_walls"]["places"], 1);
}

TEST_F(BadInput, HelpAndRecipeAreNoErrors) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, {"--version"}, {"generate", "--help"}, {"recipe"}, {"recipe", "--keys"}}) {
    const Finished run = run_program(FIBROLITE_PROGRAM, arguments);
    EXPECT_EQ(run.code, Done);
    EXPECT_EQ(run.err, "");
    EXPECT_NE(run.out, "");
  }
  EXPECT_EQ(nlohmann::json::parse(
                run_program(FIBROLITE_PROGRAM, {"recipe", "--preset", "paper"}).out)["partition"]["threshold"],
            0.26);
}
TEST_F(BadInput, PresetThenFileThenSet) {
  const fs::path file = model("r.json", R"({"tcs": {"stick_mm": 0.9, "ball_mm": 1.7}})");
  const Finished run = run_program(FIBROLITE_PROGRAM, {"recipe", "--set", "tcs.ball_mm=1.8", "--seed", "7", "--preset",
                                                       "peer-tcs", "--recipe", file});
  const auto tcs = nlohmann::json::parse(run.out)["tcs"];
  EXPECT_EQ(tcs["cell_mm"], 5.0);
  EXPECT_EQ(tcs["stick_mm"], 0.9);
  EXPECT_EQ(tcs["ball_mm"], 1.8);
  EXPECT_EQ(nlohmann::json::parse(run.out)["seed"], 7);
}
TEST_F(BadInput, ADryRunWritesNothing) {
  const Finished run = run_program(FIBROLITE_PROGRAM, {"generate", good_model(), "-o", outputs / "a b.stl", "-o",
                                                       outputs / "c.vdb", "--dry-run", "--up", "-z", "--voxel", "0.4"});
  EXPECT_EQ(run.code, Done) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("voxel     0.4 mm"), HasSubstr("a b.stl"), HasSubstr("c.vdb"),
                             HasSubstr("a b.report.json")));
  EXPECT_THAT(names_in(outputs.path()), IsEmpty());
}

}  // namespace
}  // namespace fibrolite
