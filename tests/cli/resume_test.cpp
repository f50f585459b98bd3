// SPDX-License-Identifier: GPL-3.0-or-later
// fibrolite slice --resume: killed, interrupted, damaged, asked for something else; in the end the bytes of a run that
// nobody disturbed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "fibrolite/mesh_io.h"
#include "fibrolite_program.h"

namespace fibrolite {
namespace {

using namespace fibrolite::testing;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
namespace fs = std::filesystem;

enum { BadModel = 3, NoOutput = 7, Interrupted = 130, Killed = 1000 + SIGKILL };

using Arguments = std::vector<std::string>;
Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Command {
  std::string output;  // name of the first
  Arguments arguments;
};
/// Too large for its memory: slab by slab.
Command in_slabs(const TempDir& folder, const std::string& output) {
  return {output,
          {"slice", asset("molar"), "--infill", "tcs", "--voxel", "0.2", "--layer", "0.25", "--pixel", "0.25",
           "--max-memory", "120M", "-o", folder / output}};
}
/// Whole; the plate of a printer. A layer takes some 50 ms, a batch 0.8 s.
Command whole(const TempDir& folder, const std::string& output) {
  return {output,
          {"slice", asset("y"), "--size", "40", "--infill", "tcs", "--voxel", "0.4", "--layer", "0.25", "--printer",
           "sl1", "-o", folder / output}};
}

fs::path kept_folder(const TempDir& folder, const Command& run) { return folder / ("." + run.output + ".resume"); }

/// Names of the kept files that begin so.
std::vector<std::string> kept(const TempDir& folder, const Command& run, const std::string& begin) {
  std::vector<std::string> names;
  if (!fs::exists(kept_folder(folder, run))) return names;
  for (const std::string& name : names_in(kept_folder(folder, run)))
    if (name.starts_with(begin) && name.ends_with(".kept")) names.push_back(name);
  return names;
}

/// Starts it and sends the signal as soon as so many batches of layers are kept. Returns exit code and stderr.
Finished stopped(const TempDir& folder, const Command& run, std::size_t batches, int signal) {
  Process process(FIBROLITE_PROGRAM, run.arguments + Arguments{"--resume"});
  while (kept(folder, run, "layers-").size() < batches && !process.ended()) std::this_thread::yield();
  process.send(signal);
  const int code = process.wait();
  return {code, process.out(), process.err()};
}

/// The first MB of the archive is on the disk.
bool archive_grows(const Process& process, const TempDir& folder) {
  const auto sizes = process.open_in(folder.path());
  return std::any_of(sizes.begin(), sizes.end(), [](std::uintmax_t size) { return size > 0; });
}

void expect_same_report(json a, json b) {
  for (json* report : {&a, &b}) {
    for (json& stage : (*report)["stages"]) stage = stage["name"];
    report->erase("threads");
  }
  EXPECT_EQ(a, b);
}
void expect_same_outcome(const TempDir& a, const TempDir& b, const std::vector<std::string>& outputs) {
  for (const std::string& name : outputs) EXPECT_TRUE(content(a / name) == content(b / name)) << name;
  const std::string report = fs::path(outputs.front()).replace_extension(".report.json");
  expect_same_report(report_in(a / report), report_in(b / report));
}

/// The number after a word.
int number_after(const std::string& text, const std::string& word) {
  const auto at = text.find(word);
  return at == std::string::npos ? -1 : std::stoi(text.substr(at + word.size()));
}

TEST(Resume, KilledInTheMiddleOfSlabsItEndsWithTheSameBytes) {
  const TempDir folder, undisturbed;
  const Command once = in_slabs(undisturbed, "molar.zip"), again = in_slabs(folder, "molar.zip");
  run(once.arguments);
  EXPECT_EQ(stopped(folder, again, 5, SIGKILL).code, Killed);
  if (has_nameless_files(folder.path())) {
    EXPECT_THAT(names_in(folder.path()), ElementsAre(".molar.zip.resume"));
  }
  const auto layers = static_cast<int>(16 * kept(folder, again, "layers-").size());
  const std::size_t slabs = kept(folder, again, "slab_").size();
  EXPECT_LT(layers, 320);
  // A second time, on another number of threads.
  EXPECT_EQ(stopped(folder, again, 10, SIGKILL).code, Killed);
  EXPECT_GT(kept(folder, again, "slab_").size(), slabs);
  EXPECT_FALSE(fs::exists(folder / "molar.zip"));

  const Finished last = run(again.arguments + Arguments{"--resume", "--threads", "1"});
  EXPECT_GE(number_after(last.err, "resumed layers "), 160) << last.err;
  EXPECT_GT(number_after(last.err, "what was measured of "), static_cast<int>(slabs)) << last.err;
  EXPECT_GT(layers, 0);
  expect_same_outcome(folder, undisturbed, {"molar.zip"});
  EXPECT_THAT(names_in(folder.path()), ElementsAre("molar.report.json", "molar.zip"));
}

TEST(Resume, KilledInTheMiddleOfAWholeItEndsWithTheSameBytes) {
  const TempDir folder, undisturbed;
  // The first output decides where it is kept; the others are sliced after it.
  const auto with_outlines = [](const TempDir& at) {
    Command run = whole(at, "y.sl1");
    run.arguments =
        run.arguments + Arguments{"-o", at / "y.svg", "-o", at / "y.cli", "-o", at / "y.svg.zip", "-o", at / "y.3mf"};
    return run;
  };
  const Command once = with_outlines(undisturbed), again = with_outlines(folder);
  run(once.arguments);
  std::size_t batches = 0;
  // In each of the files.
  for (const char* format : {"sl1", "svg", "cli", "svgzip", "3mf"}) {
    Process process(FIBROLITE_PROGRAM, again.arguments + Arguments{"--resume"});
    while (kept(folder, again, std::string("layers-").append(format).append("-0-16")).empty() && !process.ended())
      std::this_thread::yield();
    process.send(SIGKILL);
    EXPECT_EQ(process.wait(), Killed) << format;
    EXPECT_GT(kept(folder, again, "layers-").size(), batches);
    batches = kept(folder, again, "layers-").size();
  }
  const Finished last = run(again.arguments + Arguments{"--resume"});
  EXPECT_THAT(last.err, HasSubstr("resumed layers"));
  expect_same_outcome(folder, undisturbed, {"y.sl1", "y.svg", "y.cli", "y.svg.zip", "y.3mf"});
  EXPECT_THAT(names_in(folder.path()), ElementsAre("y.3mf", "y.cli", "y.report.json", "y.sl1", "y.svg", "y.svg.zip"));
}

TEST(Resume, InterruptedItSaysHowToGoOn) {
  const TempDir folder;
  const Command again = whole(folder, "y.sl1");
  const Finished finished = stopped(folder, again, 2, SIGINT);
  expect_refused({finished.code, finished.out, finished.err}, Interrupted);
  EXPECT_THAT(finished.err, HasSubstr("run again with --resume to go on"));
  EXPECT_THAT(names_in(folder.path()), ElementsAre(".y.sl1.resume"));
  EXPECT_THAT(run(again.arguments + Arguments{"--resume"}).err, HasSubstr("resumed layers"));
  EXPECT_THAT(names_in(folder.path()), ElementsAre("y.report.json", "y.sl1"));
}

TEST(Resume, AfterAFullDiskItGoesOnWithWhatIsFinished) {
  const TempDir folder, undisturbed;
  const Command once = whole(undisturbed, "y.sl1"), again = whole(folder, "y.sl1");
  run(once.arguments);
  // No file may grow beyond a third of the archive, which is then refused as on a full disk.
  const auto limit = fs::file_size(undisturbed / "y.sl1") / 3 / 1024;
  std::string command = "trap '' XFSZ; ulimit -f " + std::to_string(limit) + "; exec " + std::string(FIBROLITE_PROGRAM);
  for (const std::string& argument : again.arguments) command.append(" '").append(argument).append("'");
  const Finished full = run_program("/bin/bash", {"-c", command + " --resume"});
  expect_refused(full, NoOutput);
  EXPECT_THAT(full.err, HasSubstr("run again with --resume to go on"));
  EXPECT_THAT(names_in(folder.path()), ElementsAre(".y.sl1.resume"));
  EXPECT_GE(number_after(run(again.arguments + Arguments{"--resume"}).err, "resumed layers "), 32);
  expect_same_outcome(folder, undisturbed, {"y.sl1"});
}

TEST(Resume, InterruptedBeforeAnythingIsFinishedOrWithoutItNothingStays) {
  const TempDir folder;
  const Command again = whole(folder, "y.sl1");
  for (const bool resume : {false, true}) {
    Process process(FIBROLITE_PROGRAM, again.arguments + (resume ? Arguments{"--resume"} : Arguments{}));
    // Without: as soon as the archive grows. With: as soon as there is a place to keep what is finished.
    const auto begun = [&] {
      return resume ? fs::exists(kept_folder(folder, again) / "outputs.kept") : archive_grows(process, folder);
    };
    while (!begun() && !process.ended()) std::this_thread::yield();
    process.send(SIGINT);
    EXPECT_EQ(process.wait(), Interrupted) << process.err();
    EXPECT_THAT(process.err(), HasSubstr("nothing was written"));
    EXPECT_THAT(names_in(folder.path()), IsEmpty());
  }
}

TEST(Resume, KilledWithoutItNothingStays) {
  const TempDir folder;
  if (!has_nameless_files(folder.path())) GTEST_SKIP() << "no files without a name here";
  Process process(FIBROLITE_PROGRAM, whole(folder, "y.sl1").arguments);
  while (!archive_grows(process, folder) && !process.ended()) std::this_thread::yield();
  process.send(SIGKILL);
  EXPECT_EQ(process.wait(), Killed) << process.err();
  EXPECT_THAT(names_in(folder.path()), IsEmpty());
}

TEST(Resume, OtherWorkIsRefusedAndNothingIsLost) {
  const TempDir folder, models;
  const Command again = whole(folder, "y.sl1");
  EXPECT_EQ(stopped(folder, again, 2, SIGKILL).code, Killed);
  const auto before = kept(folder, again, "");
  const auto refused = [&](const Arguments& arguments) {
    const Finished finished = run_program(FIBROLITE_PROGRAM, arguments + Arguments{"--resume", "--quiet"});
    expect_refused(finished, BadModel);
    EXPECT_EQ(kept(folder, again, ""), before);
    return finished.err;
  };
  EXPECT_THAT(refused(again.arguments + Arguments{"--set", "tcs.cell_mm=5"}),
              AllOf(HasSubstr("tcs.cell_mm"), HasSubstr(kept_folder(folder, again).string()),
                    HasSubstr("give the command that was interrupted, or remove that folder")));
  EXPECT_THAT(refused(again.arguments + Arguments{"--up", "x"}), HasSubstr("--up"));
  EXPECT_THAT(refused(again.arguments + Arguments{"--planes", "2"}), HasSubstr("--planes was 1, now it is 2"));
  EXPECT_THAT(refused(again.arguments + Arguments{"--seed", "2"}), HasSubstr("seed was 1, now it is 2"));
  // Another model of the same name.
  Arguments other = again.arguments;
  MeshFile moved = read_mesh(asset("y"));
  moved.mesh.vertices.front().x += 0.01F;
  write_mesh(models / "y.ply", moved.mesh);
  other[1] = models / "y.ply";
  EXPECT_THAT(refused(other), HasSubstr("the_model's_content"));
  run(again.arguments + Arguments{"--resume"});
}

TEST(Resume, WhatWasDamagedIsMadeAgain) {
  const TempDir folder, undisturbed;
  const Command once = in_slabs(undisturbed, "molar.zip"), again = in_slabs(folder, "molar.zip");
  run(once.arguments);
  EXPECT_EQ(stopped(folder, again, 6, SIGKILL).code, Killed);
  const auto layers = kept(folder, again, "layers-");
  const auto damage = [&](const std::string& name, std::size_t at) {
    std::fstream file(kept_folder(folder, again) / name, std::ios::binary | std::ios::in | std::ios::out);
    file.seekg(static_cast<std::streamoff>(at));
    const char byte = static_cast<char>(file.get());
    file.seekp(static_cast<std::streamoff>(at));
    file.put(static_cast<char>(byte ^ 4));
  };
  damage("layers-png-0-16.kept", 2000);
  damage(kept(folder, again, "slab_").front(), 100);
  fs::resize_file(kept_folder(folder, again) / "layers-png-0-64.kept", 1000);
  const Finished last = run(again.arguments + Arguments{"--resume"});
  for (const char* name : {"layers-png-0-16.kept", "layers-png-0-64.kept", "slab_"})
    EXPECT_THAT(last.err, HasSubstr(name));
  EXPECT_EQ(number_after(last.err, "resumed layers "), static_cast<int>(16 * (layers.size() - 2))) << last.err;
  expect_same_outcome(folder, undisturbed, {"molar.zip"});
  EXPECT_THAT(names_in(folder.path()), ElementsAre("molar.report.json", "molar.zip"));
}

TEST(Resume, TheFirstPassIsMadeAgainIfItWasDamaged) {
  const TempDir folder, undisturbed;
  const Command once = in_slabs(undisturbed, "molar.zip"), again = in_slabs(folder, "molar.zip");
  run(once.arguments);
  EXPECT_EQ(stopped(folder, again, 3, SIGKILL).code, Killed);
  fs::resize_file(kept_folder(folder, again) / "pieces.kept", 30);
  const Finished last = run(again.arguments + Arguments{"--resume"});
  EXPECT_THAT(last.err, AllOf(HasSubstr("pieces.kept"), Not(HasSubstr("resumed the first pass"))));
  EXPECT_GE(number_after(last.err, "resumed layers "), 48);
  expect_same_outcome(folder, undisturbed, {"molar.zip"});
}

TEST(Resume, OneRunAtATime) {
  const TempDir folder;
  const Command again = whole(folder, "y.sl1");
  Process process(FIBROLITE_PROGRAM, again.arguments + Arguments{"--resume"});
  while (kept(folder, again, "layers-").empty() && !process.ended()) std::this_thread::yield();
  const Finished second = run_program(FIBROLITE_PROGRAM, again.arguments + Arguments{"--resume", "--quiet"});
  expect_refused(second, NoOutput);
  EXPECT_THAT(second.err, HasSubstr("another run is at work there"));
  EXPECT_EQ(process.wait(), 0) << process.err();
  EXPECT_THAT(names_in(folder.path()), ElementsAre("y.report.json", "y.sl1"));
}

}  // namespace
}  // namespace fibrolite
