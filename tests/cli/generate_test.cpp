// SPDX-License-Identifier: GPL-3.0-or-later
// The main job through the program, on bundled models, small and coarse so that it is quick.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/picture.h"
#include "fibrolite/solid_io.h"
#include "fibrolite_program.h"
#include "mesh_checks.h"

namespace fibrolite {
namespace {

using namespace fibrolite::testing;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;
namespace fs = std::filesystem;
using std::chrono::milliseconds;

const std::vector<std::string> coarse{"--size", "40", "--voxel", "0.4"};

/// generate MODEL ... with the coarse options.
std::vector<std::string> generate(const fs::path& model, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"generate", model};
  arguments.insert(arguments.end(), coarse.begin(), coarse.end());
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

void expect_sound(const fs::path& file, double volume_mm3) {
  const IndependentCount counted = count(read_mesh(file).mesh);
  EXPECT_TRUE(counted.sound()) << file << ": " << counted.boundary_edges << " open, " << counted.nonmanifold_edges
                               << " non-manifold edges, " << counted.nonmanifold_vertices << " vertices, "
                               << counted.degenerate_triangles << " degenerate";
  EXPECT_NEAR(counted.volume_mm3, volume_mm3, 1e-4 * volume_mm3) << file;
}

TEST(Generate, FixLeavesOnePieceAndNoClosedVoid) {
  const TempDir folder;
  run(generate(asset("molar"), {"--infill", "tcs", "-o", folder / "a.stl"}));
  run(generate(asset("molar"), {"--infill", "tcs", "--fix", "-o", folder / "b.stl"}));
  const json closed = report_in(folder / "a.report.json"), open = report_in(folder / "b.report.json");
  EXPECT_EQ(closed["solid"]["cavities"], 1);
  EXPECT_TRUE(closed["print"]["drains"].empty());
  EXPECT_EQ(open["solid"]["cavities"], 0);
  EXPECT_EQ(open["solid"]["pieces"], 1);
  EXPECT_EQ(open["mesh"]["shells"], 1);
  EXPECT_EQ(open["print"]["small_gaps"]["places"], 0);
  ASSERT_EQ(open["print"]["drains"].size(), 1U);
  EXPECT_TRUE(open["print"]["drains"][0]["outward"]);
  expect_sound(folder / "b.stl", open["mesh"]["volume_mm3"]);
}

TEST(Generate, EveryFormatHoldsTheSameSoundMesh) {
  const TempDir folder;
  const Finished finished = run(generate(
      asset("molar"), {"--infill", "tcs", "-o", folder / "a.stl", "-o", folder / "a.obj", "-o", folder / "a.ply", "-o",
                       folder / "a.3mf", "-o", folder / "a.vdb", "--picture", folder / "a.png"}));
  EXPECT_THAT(names_in(folder.path()),
              ElementsAre("a.3mf", "a.obj", "a.ply", "a.png", "a.report.json", "a.stl", "a.vdb"));
  const json report = report_in(folder / "a.report.json");
  EXPECT_EQ(report["parts"][0]["color"]["name"], "yellow") << "in its picture";
  const double volume = report["mesh"]["volume_mm3"];
  for (const char* name : {"a.stl", "a.obj", "a.ply", "a.3mf"}) expect_sound(folder / name, volume);

  const json& solid = report["solid"];
  EXPECT_NEAR(volume, solid["volume_mm3"].get<double>(), 0.01 * volume);
  EXPECT_NEAR(read_vdb(folder / "a.vdb").volume_mm3(), solid["volume_mm3"].get<double>(), 1e-6 * volume);
  EXPECT_EQ(solid["pieces"], 1);
  EXPECT_EQ(solid["voxel_mm"], 0.4);
  EXPECT_NEAR(solid["mass_g"].get<double>(), 1.24e-3 * solid["volume_mm3"].get<double>(), 1e-9);  // PLA
  EXPECT_NEAR(solid["fill_ratio"].get<double>(),
              solid["volume_mm3"].get<double>() / report["model"]["volume_mm3"].get<double>(), 0.01);
  EXPECT_GT(solid["fill_ratio"], 0.1);
  EXPECT_LT(solid["fill_ratio"], 0.8);
  for (const char* defect : {"boundary_edges", "nonmanifold_edges", "nonmanifold_vertices", "degenerate_triangles"})
    EXPECT_EQ(report["mesh"][defect], 0) << defect;

  const json& size = report["model"]["size_mm"];
  EXPECT_NEAR(std::max({size[0].get<double>(), size[1].get<double>(), size[2].get<double>()}), 40, 1e-4);
  EXPECT_EQ(report["infill"], "tcs");
  EXPECT_EQ(report["parts"].size(), 1U);
  EXPECT_FALSE(report["stages"].empty());
  EXPECT_THAT(content(folder / "a.png").substr(1, 3), "PNG");
  EXPECT_THAT(finished.out, HasSubstr((folder / "a.3mf").string()));
  EXPECT_EQ(finished.err, "");
}

TEST(Generate, OneAndTwoThreadsGiveTheSameBytes) {
  const TempDir one, two;
  const auto hybrid = [](const TempDir& folder, const char* threads) {
    return generate(asset("quadruped"),
                    {"-o", folder / "a.stl", "-o", folder / "a.3mf", "-o", folder / "a.vdb", "--steps",
                     folder / "steps.vdb", "--picture", folder / "a.png", "--threads", threads, "--quiet"});
  };
  run(hybrid(one, "1"));
  run(hybrid(two, "2"));
  for (const char* name : {"a.stl", "a.3mf", "a.vdb", "steps.vdb", "a.png"})
    EXPECT_TRUE(content(one / name) == content(two / name)) << name;
  json a = report_in(one / "a.report.json"), b = report_in(two / "a.report.json");
  EXPECT_EQ(a["threads"], 1);
  EXPECT_EQ(b["threads"], 2);
  for (json* report : {&a, &b}) {
    report->erase("stages");
    report->erase("threads");
  }
  EXPECT_EQ(a.dump(), b.dump());

  // And it is a hybrid, in one sound piece.
  EXPECT_EQ(a["solid"]["pieces"], 1);
  expect_sound(one / "a.stl", a["mesh"]["volume_mm3"]);
  double parts = 0;
  for (const json& part : a["parts"]) {
    parts += part["volume_mm3"].get<double>();
    EXPECT_TRUE(part["kind"] == "column" || part["kind"] == "bulk");
    EXPECT_EQ(part["infill"], part["kind"] == "column" ? "mfs" : "tcs");
    EXPECT_NE(part["reason"], "");
  }
  EXPECT_GT(a["parts"].size(), 1U);
  EXPECT_NEAR(parts, a["model"]["volume_mm3"].get<double>(), 0.02 * parts);  // every point has one part
  for (const json& interface : a["interfaces"]) EXPECT_EQ(interface["regions_after"], 1);
}

TEST(Generate, LessMemoryGivesTheSameFilesSlabBySlab) {
  const TempDir whole, slabs;
  const auto generated = [&](const TempDir& folder, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"generate", asset("molar").string(), "--infill", "tcs", "--voxel", "0.2"};
    for (const char* ending : {"stl", "ply", "obj", "off", "3mf"})
      arguments.insert(arguments.end(), {"-o", (folder / (std::string("part.") + ending)).string()});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  EXPECT_THAT(generated(slabs, {"--max-memory", "180M", "--dry-run"}).out, HasSubstr("slabs"));
  generated(whole, {});
  generated(slabs, {"--max-memory", "180M"});
  for (const char* ending : {"stl", "ply", "obj", "off", "3mf"}) {
    const std::string name = std::string("part.") + ending;
    EXPECT_TRUE(content(whole / name) == content(slabs / name)) << ending;
  }
  const json a = report_in(whole / "part.report.json"), b = report_in(slabs / "part.report.json");
  for (const char* block : {"model", "parts", "interfaces", "solid", "print", "mesh", "warnings"})
    EXPECT_EQ(a[block], b[block]) << block;
  EXPECT_EQ(b["mesh"]["boundary_edges"], 0);
  for (const json& stage : b["stages"]) EXPECT_LE(stage["peak_rss_mb"], 180 * 1.048576);
  EXPECT_EQ(names_in(slabs.path()).size(), 6U);  // nothing stays behind
}

TEST(Generate, LessMemoryTiesAndRemovesTheSameStickEnds) {
  const TempDir whole, slabs;
  const std::string cut = R"(partition.overrides={"cuts":[{"point_mm":[0,0,20],"normal":[0.1,0.05,1]}],)"
                          R"("parts":[{"id":0,"infill":"tcs"},{"id":1,"infill":"shell"}]})";
  const auto generated = [&](const TempDir& folder, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"generate", asset("rounded_box"),
                                       "--size",   "40",
                                       "--voxel",  "0.15",
                                       "--set",    cut,
                                       "--set",    "joint.enabled=false",
                                       "-o",       folder / "part.stl"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  const std::string memory = "320M";
  EXPECT_THAT(generated(slabs, {"--max-memory", memory, "--dry-run"}).out, HasSubstr("slabs"));
  generated(whole, {});
  generated(slabs, {"--max-memory", memory});
  EXPECT_TRUE(content(whole / "part.stl") == content(slabs / "part.stl"));
  const json a = report_in(whole / "part.report.json"), b = report_in(slabs / "part.report.json");
  EXPECT_GE(a["solid"]["tips_removed"], 10);
  EXPECT_GE(a["solid"]["tips_tied"], 1);
  EXPECT_EQ(a["solid"]["dangling"], 0);
  for (const char* block : {"model", "parts", "interfaces", "solid", "print", "mesh", "warnings"})
    EXPECT_EQ(a[block], b[block]) << block;
}

TEST(Generate, APresetBringsItsInfillUnlessOneIsNamed) {
  const TempDir folder;
  const auto plan = [&](std::vector<std::string> more) {
    std::vector<std::string> command{"generate", asset("molar"), "--voxel", "0.4", "-o", folder / "a.stl", "--dry-run"};
    command.insert(command.end(), more.begin(), more.end());
    return run(command).out;
  };
  EXPECT_THAT(plan({}), HasSubstr("infill    hybrid"));
  EXPECT_THAT(plan({"--preset", "peer-tcs"}), HasSubstr("infill    tcs"));
  EXPECT_THAT(plan({"--infill", "mfs", "--preset", "peer-tcs"}), HasSubstr("infill    mfs"));
}

/// What is said of a run that is not made, and what it took.
struct Foretold {
  double voxels = 0, triangles = 0, bytes = 0;  ///< Millions; of the output.
};
Foretold foretold(const std::string& text) {
  const auto after = [&](const std::string& words) {
    const std::size_t at = text.find(words);
    EXPECT_NE(at, std::string::npos) << words << text;
    return text.substr(at + words.size());
  };
  const std::string size = after(".stl, about ");
  const double unit = size.find("KB") < size.find("MB") ? 1024 : 1024 * 1024;
  return {std::stod(after("solid     about ")), std::stod(after("voxels, a mesh of ")), std::stod(size) * unit};
}

TEST(Generate, ADryRunForetellsVoxelsTrianglesAndTheFile) {
  for (const auto& [name, options] : {std::pair<std::string, std::vector<std::string>>{"molar", {"--infill", "tcs"}},
                                      {"torus", {"--infill", "tcs"}},
                                      {"molar", {"--infill", "tcs", "--set", "tcs.form=sheet"}},
                                      {"rounded_box", {"--infill", "gyroid"}},
                                      {"molar", {"--infill", "shell"}},
                                      {"bracket", {"--infill", "solid"}},
                                      {"cylinder_on_box", {"--infill", "hybrid"}}}) {
    const TempDir folder;
    std::vector<std::string> command{"generate", asset(name), "--voxel", "0.4", "-o", folder / "a.stl"};
    command.insert(command.end(), options.begin(), options.end());
    run(command);
    const json report = report_in(folder / "a.report.json");
    const auto bytes = static_cast<double>(std::filesystem::file_size(folder / "a.stl"));
    command.insert(command.end(), {"--dry-run", "--overwrite"});
    const Foretold said = foretold(run(command).out);
    EXPECT_NEAR(said.voxels * 1e6 / report["solid"]["active_voxels"].get<double>(), 1, 0.15) << name << options.back();
    EXPECT_NEAR(said.triangles * 1e6 / report["mesh"]["triangles"].get<double>(), 1, 0.2) << name << options.back();
    EXPECT_NEAR(said.bytes / bytes, 1, 0.2) << name << options.back();
  }
}

/// Whatever a run does besides: it keeps to its memory, or it is refused.
TEST(Generate, NothingTakesMoreMemoryThanItMay) {
  const TempDir folder;
  Mesh open = read_mesh(asset("molar")).mesh;
  open.triangles.pop_back();
  write_mesh(folder / "open.ply", open);
  int ran = 0;
  for (const auto& [model, options] : {std::pair<std::string, std::vector<std::string>>{asset("molar"), {"--fix"}},
                                       {asset("molar"), {"--set", "print.drain_mm=2"}},
                                       {asset("molar"), {"--picture", folder / "a.png"}},
                                       {asset("molar"), {"--steps", folder / "steps.vdb"}},
                                       {folder / "open.ply", {}}})
    for (const int megabytes : {160, 270, 400}) {
      const std::string most = std::to_string(megabytes) + "M";
      std::vector<std::string> command{"generate",     model, "--infill",   "tcs",
                                       "--voxel",      "0.3", "-o",         folder / "a.stl",
                                       "--max-memory", most,  "--overwrite"};
      command.insert(command.end(), options.begin(), options.end());
      const Finished finished = run_program(FIBROLITE_PROGRAM, command);
      if (finished.code == 5) continue;
      ASSERT_EQ(finished.code, 0) << finished.err;
      ++ran;
      for (const json& stage : report_in(folder / "a.report.json")["stages"])
        EXPECT_LE(stage["peak_rss_mb"].get<double>(), 1.048576 * megabytes) << command[1] << options.size() << most;
    }
  EXPECT_GE(ran, 5);
}

TEST(Generate, ADryRunSaysWhatTheRunWillTake) {
  const auto said = [](const std::string& voxel, const std::string& unit) {
    const TempDir folder;
    const Finished finished =
        run({"generate", asset("molar"), "--infill", "tcs", "--voxel", voxel, "-o", folder / "a.stl", "--dry-run"});
    const std::size_t at = finished.out.find("time      about ");
    EXPECT_NE(at, std::string::npos) << finished.out;
    EXPECT_THAT(names_in(folder.path()), IsEmpty());
    const std::size_t end = finished.out.find(unit, at);
    const std::size_t begin = finished.out.rfind(' ', end - 1);
    return std::stod(finished.out.substr(begin, end - begin));
  };
  // Four times the voxels and triangles; the machine is asked anew each time.
  const double once = said("0.2", " s of CPU"), four_times = said("0.1", " s of CPU");
  EXPECT_GT(four_times, 2 * once);
  EXPECT_LT(four_times, 10 * once);
}

TEST(Generate, TheVoxelChosenByItselfTellsNecksOfAWallAndACoarserOneSaysThatItDoesNot) {
  const auto ran = [](const std::vector<std::string>& voxel) {
    const TempDir folder;
    std::vector<std::string> arguments{"generate", asset("molar"), "--size", "100",
                                       "--infill", "tcs",          "-o",     folder / "a.stl"};
    arguments.insert(arguments.end(), voxel.begin(), voxel.end());
    run(arguments);
    return report_in(folder / "a.report.json");
  };
  const json chosen = ran({}), coarse_run = ran({"--voxel", "0.4"});
  EXPECT_LT(chosen["solid"]["voxel_mm"], 0.25);  // a 400th of the side
  EXPECT_NEAR(chosen["solid"]["neck_mm"], 0.4, 1e-6);
  EXPECT_THAT(chosen["warnings"], IsEmpty());
  EXPECT_LT(coarse_run["solid"]["neck_mm"], 0.2);
  ASSERT_EQ(coarse_run["warnings"].size(), 1U);
  EXPECT_THAT(coarse_run["warnings"][0].get<std::string>(), HasSubstr("use --voxel 0.23 or less"));
}

TEST(Generate, WhatNeedsTheWholeSolidIsRefusedIfItDoesNotFit) {
  const TempDir folder;
  const auto refused = [&](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"generate", asset("molar").string(), "--infill", "tcs", "--voxel",
                                       "0.2",      "--max-memory",          "180M",     "-o",  folder / output};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return refused_run(arguments, 5, folder.path());
  };
  EXPECT_THAT(refused("part.vdb", {}), HasSubstr("part.vdb needs the whole solid"));
  EXPECT_THAT(refused("part.stl", {"--fix"}), HasSubstr("--fix needs the whole solid"));
  EXPECT_THAT(refused("part.stl", {"--steps", folder / "steps.vdb"}), HasSubstr("--steps needs the whole solid"));
  EXPECT_THAT(refused("part.stl", {"--picture", folder / "a.png"}), HasSubstr("--picture needs the whole solid"));
  EXPECT_THAT(refused("part.stl", {"--set", "print.drain_mm=2"}), HasSubstr("print.drain_mm needs the whole solid"));
}

TEST(Generate, OverwriteReplacesAndAFailedRunKeepsTheOld) {
  const TempDir folder;
  std::ofstream(folder / "a.stl") << "old";
  const std::vector<std::string> options{"--infill", "solid", "-o", folder / "a.stl", "--overwrite"};
  std::vector<std::string> too_large = options;
  too_large.insert(too_large.end(), {"--max-memory", "1M"});
  EXPECT_EQ(run_program(FIBROLITE_PROGRAM, generate(asset("torus"), too_large)).code, 5);
  EXPECT_EQ(content(folder / "a.stl"), "old");
  EXPECT_THAT(names_in(folder.path()), ElementsAre("a.stl"));
  run(generate(asset("torus"), options));
  EXPECT_NE(content(folder / "a.stl"), "old");
  EXPECT_THAT(names_in(folder.path()), ElementsAre("a.report.json", "a.stl"));
}

TEST(Generate, ALinkAsOutputStaysALink) {
  const TempDir folder;
  std::ofstream(folder / "real.stl") << "old";
  fs::create_symlink("real.stl", folder / "link.stl");
  run(generate(asset("torus"), {"--infill", "solid", "-o", folder / "link.stl", "--overwrite"}));
  EXPECT_TRUE(fs::is_symlink(folder / "link.stl"));
  EXPECT_GT(content(folder / "real.stl").size(), 1000U);
}

TEST(Generate, ALevelSetIsAModelToo) {
  const TempDir folder;
  run(generate(asset("torus"), {"--infill", "solid", "-o", folder / "a.vdb", "-o", folder / "a.stl"}));
  run({"generate", folder / "a.vdb", "--infill", "solid", "--voxel", "0.4", "-o", folder / "b.stl"});
  const json a = report_in(folder / "a.report.json"), b = report_in(folder / "b.report.json");
  EXPECT_NEAR(a["solid"]["volume_mm3"].get<double>(), b["solid"]["volume_mm3"].get<double>(),
              0.01 * a["solid"]["volume_mm3"].get<double>());
}

TEST(Generate, ALevelSetAmongOthersIsNotTakenByChance) {
  const TempDir folder;
  run(generate(asset("molar"), {"--infill", "tcs", "-o", folder / "m.vdb", "--steps", folder / "steps.vdb"}));
  const auto mesh_in = [&](const char* file) { return json::parse(run({"check", folder / file}).out)["mesh"]; };
  EXPECT_EQ(mesh_in("steps.vdb"), mesh_in("m.vdb"));
  run({"partition", asset("molar"), "-o", folder / "parts.vdb"});
  const Finished parts = run_program(FIBROLITE_PROGRAM, {"check", folder / "parts.vdb"});
  expect_refused(parts, 3);
  EXPECT_THAT(parts.err, HasSubstr("none is called 'solid'"));
}

TEST(Generate, AVoxelThatLosesTheModelIsWarnedOf) {
  const TempDir folder;
  const auto warnings = [&](const char* voxel) {
    run({"generate", asset("molar"), "--infill", "solid", "--size", "30", "--voxel", voxel, "-o", folder / "m.stl",
         "--overwrite"});
    return report_in(folder / "m.report.json")["warnings"].dump();
  };
  const std::string warned = warnings("5");
  EXPECT_THAT(warned, HasSubstr("its shape is lost"));
  const std::string word = "use --voxel ";
  const auto at = warned.find(word) + word.size();
  EXPECT_EQ(warnings(warned.substr(at, warned.find(' ', at) - at).c_str()), "[]");
}

/// There are no faces inside: no share of them is told.
TEST(Generate, ASolidPartHasNoOverhangsInside) {
  const TempDir folder;
  const Finished finished = run(generate(asset("molar"), {"--infill", "solid", "-o", folder / "m.stl"}));
  EXPECT_THAT(finished.out, Not(HasSubstr("overhang")));
}

TEST(Generate, QuietPrintsNothing) {
  const TempDir folder;
  const Finished finished = run(generate(asset("torus"), {"--infill", "tcs", "-o", folder / "a.stl", "--quiet"}));
  EXPECT_EQ(finished.out, "");
  EXPECT_EQ(finished.err, "");
}

TEST(Generate, JsonLogIsOneObjectALineAndNeverFallsBack) {
  const TempDir folder;
  const Finished finished = run(generate(asset("torus"), {"--infill", "tcs", "-o", folder / "a.stl", "--log", "json"}));
  std::istringstream lines(finished.err);
  double last = 0;
  for (std::string line; std::getline(lines, line);) {
    const json event = json::parse(line);
    if (event["event"] != "progress") continue;
    EXPECT_GE(event["fraction"].get<double>(), last);
    last = event["fraction"];
  }
  EXPECT_EQ(last, 1.0);
}

TEST(Generate, AFullDiskLeavesNothing) {
  const TempDir folder;
  std::string command = "ulimit -f 16; exec \"$0\" \"$@\"";  // no file above 16 blocks: the mesh does not fit
  std::vector<std::string> arguments{"-c", command, FIBROLITE_PROGRAM};
  const auto options =
      generate(asset("torus"), {"--infill", "tcs", "-o", folder / "a.vdb", "-o", folder / "a.stl", "--quiet"});
  arguments.insert(arguments.end(), options.begin(), options.end());
  const Finished finished = run_program("/bin/sh", arguments);
  EXPECT_EQ(finished.code, 7);
  EXPECT_THAT(finished.err, StartsWith("fibrolite: error: "));
  EXPECT_THAT(names_in(folder.path()), IsEmpty());
}

// ---- being stopped

/// A job of many seconds, at work when this returns.
class LongJob {
 public:
  LongJob()
      : process_(FIBROLITE_PROGRAM,
                 {"generate", asset("quadruped"), "--size", "200", "--voxel", "0.2", "-o", folder_ / "a.stl", "-o",
                  folder_ / "a.vdb", "--picture", folder_ / "a.png", "--log", "json"}) {
    while (process_.err().find("progress") == std::string::npos && !process_.ended())
      std::this_thread::sleep_for(milliseconds(10));
  }
  void wait_and_send(milliseconds delay, int signal) {
    std::this_thread::sleep_for(delay);
    ASSERT_FALSE(process_.ended()) << "too quick to be stopped: " << process_.err();
    process_.send(signal);
  }
  void expect_clean_end() {
    EXPECT_EQ(process_.wait(), 130);
    EXPECT_THAT(process_.err(), HasSubstr("\nfibrolite: error: cancelled"));
    EXPECT_EQ(process_.out(), "");
    EXPECT_THAT(names_in(folder_.path()), IsEmpty());
  }

 private:
  TempDir folder_;
  Process process_;
};

void expect_clean_stop(milliseconds delay, int signal) {
  LongJob job;
  job.wait_and_send(delay, signal);
  const auto asked = std::chrono::steady_clock::now();
  job.expect_clean_end();
  EXPECT_LT(std::chrono::steady_clock::now() - asked, milliseconds(2000)) << "stopped after " << delay.count() << " ms";
}

TEST(Generate, CtrlCLeavesNothing) {
  for (const int delay_ms : {1, 1500, 4000}) expect_clean_stop(milliseconds(delay_ms), SIGINT);
}
TEST(Generate, SoDoesBeingTerminated) { expect_clean_stop(milliseconds(500), SIGTERM); }

TEST(Generate, ASecondCtrlCEndsAtOnce) {
  LongJob job;
  job.wait_and_send(milliseconds(500), SIGINT);
  job.wait_and_send(milliseconds(0), SIGINT);
  job.expect_clean_end();
}

/// When one output is whole and waits for the others, the next is half written.
TEST(Generate, KilledItLeavesNothing) {
  const TempDir folder;
  if (!has_nameless_files(folder.path())) GTEST_SKIP() << "no files without a name here";
  Process process(FIBROLITE_PROGRAM, {"generate", asset("quadruped"), "--size", "100", "--voxel", "0.25", "--infill",
                                      "tcs", "-o", folder / "a.vdb", "-o", folder / "a.stl"});
  const auto two_begun = [&] {
    const auto sizes = process.open_in(folder.path());
    return sizes.size() > 1 && std::count(sizes.begin(), sizes.end(), 0U) == 0;
  };
  while (!two_begun() && !process.ended()) std::this_thread::yield();
  process.send(SIGKILL);
  EXPECT_EQ(process.wait(), 1000 + SIGKILL) << process.err();
  EXPECT_THAT(names_in(folder.path()), IsEmpty());
}

// ---- the other commands

TEST(Partition, PartsInColourAsGridsAndInTheReport) {
  const TempDir folder;
  const Finished finished =
      run({"partition", asset("quadruped"), "--size", "100", "-o", folder / "p.ply", "-o", folder / "p.vdb"});
  const json report = report_in(folder / "p.report.json");
  ASSERT_GE(report["parts"].size(), 5U);  // a body and four legs at least
  int columns = 0;
  double volume = 0;
  for (const json& part : report["parts"]) {
    columns += part["kind"] == "column" ? 1 : 0;
    volume += part["volume_mm3"].get<double>();
    const Solid grid = read_vdb(folder / "p.vdb", "part_" + std::to_string(part["id"].get<int>()));
    EXPECT_NEAR(grid.volume_mm3(), part["volume_mm3"].get<double>(), 0.05 * grid.volume_mm3());
    EXPECT_TRUE(part["dominance"].is_null());  // nothing was loaded
  }
  EXPECT_GE(columns, 4);
  EXPECT_NEAR(volume, report["model"]["volume_mm3"].get<double>(), 0.03 * volume);
  EXPECT_THAT(content(folder / "p.ply").substr(0, 600), HasSubstr("red"));
  EXPECT_THAT(finished.out, HasSubstr("column"));
}

/// The legend: what has a part's colour in the picture lies on that part's own grid, and nothing else has it.
TEST(Partition, SaysWhichColourIsWhichPart) {
  const TempDir folder;
  const Finished finished =
      run({"partition", asset("quadruped"), "--size", "100", "-o", folder / "p.ply", "-o", folder / "p.vdb"});
  const json parts = report_in(folder / "p.report.json")["parts"];
  const Mesh mesh = read_mesh(folder / "p.ply").mesh;
  ASSERT_EQ(mesh.triangle_colors.size(), mesh.triangles.size());
  std::map<std::string, std::vector<Vec3d>> middles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Vec3d sum{};
    for (const std::uint32_t corner : mesh.triangles[t]) sum = sum + to_double(mesh.vertices[corner]);
    middles[hex(mesh.triangle_colors[t])].push_back(sum / 3);
  }
  EXPECT_EQ(middles.size(), parts.size());
  for (const json& part : parts) {
    const std::string name = part["color"]["name"], code = part["color"]["hex"];
    EXPECT_THAT(finished.out, HasSubstr(std::string(name).append(" ").append(code)));
    ASSERT_TRUE(middles.contains(code)) << part["id"] << " is " << code;
    const Solid grid = read_vdb(folder / "p.vdb", "part_" + std::to_string(part["id"].get<int>()));
    for (const Vec3d p : middles.at(code)) ASSERT_LT(std::abs(grid.distance(p)), 2 * grid.grid().voxel_mm) << code;
  }
}

TEST(Verify, StressesForParaViewAndADeckForCalculix) {
  const TempDir folder;
  const Finished finished =
      run({"verify", asset("cylinder_on_box"), "--size", "60", "-o", folder / "v.vtu", "-o", folder / "v.inp"});
  const json report = report_in(folder / "v.report.json");
  EXPECT_EQ(report["command"], "verify");
  ASSERT_EQ(report["parts"].size(), 2U);
  EXPECT_EQ(report["parts"][0]["kind"], "bulk");
  EXPECT_EQ(report["parts"][1]["kind"], "column");
  EXPECT_GT(report["parts"][1]["dominance"], 2);
  EXPECT_GT(report["verification"]["dof"], 1000);
  EXPECT_LT(report["verification"]["equilibrium"], 1e-6);
  EXPECT_LT(report["verification"]["residual"], 1e-6);
  for (const char* field :
       {"part", "displacement_mm at 45 degrees", "stress_mpa from above", "von_mises_mpa at 45 degrees"})
    EXPECT_THAT(content(folder / "v.vtu").substr(0, 4000), HasSubstr(std::string("Name=\"") + field));
  EXPECT_THAT(content(folder / "v.inp"), HasSubstr("*ELEMENT,TYPE=C3D10,ELSET=PART_1"));
  EXPECT_THAT(finished.out, HasSubstr("column"));
}

TEST(Verify, OptionsOfTheSolidAloneAreNotIgnoredWithoutAWord) {
  const TempDir folder;
  run({"verify", asset("cylinder_on_box"), "--size", "40", "-o", folder / "v.vtu", "--voxel", "0.3"});
  EXPECT_THAT(report_in(folder / "v.report.json")["warnings"].dump(),
              HasSubstr("--voxel changes nothing without --solid"));
}

TEST(Verify, ThePrintedSolidFailsSomewhere) {
  const TempDir folder;
  const Finished finished = run({"verify", asset("cylinder_on_box"), "--size", "40", "--infill", "tcs", "--voxel",
                                 "0.4", "--solid", "--set", "loads=paper-compare", "-o", folder / "v.vtu"});
  const json report = report_in(folder / "v.report.json");
  ASSERT_EQ(report["strength"].size(), 1U);
  const json& answer = report["strength"][0];
  EXPECT_EQ(answer["load_n"], 110);
  const double p99 = answer["p99_von_mises_mpa"], yield = report["recipe"]["material"]["yield_mpa"];
  EXPECT_GT(p99, 0);
  EXPECT_LE(p99, answer["max_von_mises_mpa"]);
  EXPECT_NEAR(answer["failure_load_n"], 110 * yield / p99, 1e-6 * 110 * yield / p99);
  EXPECT_LT(answer["residual"], 1e-6);
  EXPECT_THAT(answer["weakest"], HasSubstr("part"));
  EXPECT_THAT(finished.out, HasSubstr("breaks first"));
  EXPECT_THAT(finished.out, HasSubstr("the thinnest members are 2 cells thick"));
  // Every place has its own, the weakest first.
  const json& places = answer["places"];
  ASSERT_GE(places.size(), 2U);
  EXPECT_EQ(answer["weakest"], places[0]["place"]);
  for (std::size_t i = 1; i < places.size(); ++i)
    EXPECT_GE(places[i]["failure_load_n"], places[i - 1]["failure_load_n"]);
}

TEST(Check, TellsAClosedMeshFromAnOpenOne) {
  const TempDir folder;
  write_mesh(folder / "closed.stl", cube(10));
  write_mesh(folder / "open.stl", without_triangle(cube(10), 3));
  const json closed = json::parse(run({"check", folder / "closed.stl"}).out);
  const json open = json::parse(run({"check", folder / "open.stl"}).out);
  EXPECT_EQ(closed["closed"], true);
  EXPECT_NEAR(closed["volume_mm3"].get<double>(), 1000, 1e-9);
  EXPECT_EQ(closed["mesh"]["boundary_edges"], 0);
  EXPECT_EQ(closed["self_intersections"], 0);
  EXPECT_EQ(open["closed"], false);
  EXPECT_EQ(open["mesh"]["boundary_edges"], 3);
  EXPECT_EQ(closed["size_mm"], json({10.0, 10.0, 10.0}));
}

}  // namespace
}  // namespace fibrolite
