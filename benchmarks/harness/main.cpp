// SPDX-License-Identifier: GPL-3.0-or-later
// Speed and memory of whole runs: each case is a child process of `fibrolite generate`, beside the floor measured right
// after it. Prints a table, writes bench.json. Never a test: machines differ; compare ratios of one run.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "child.h"
#include "growth_plot.h"
#include "history.h"
#include "suite.h"
#include "table.h"

namespace {

using namespace fibrolite::bench;
namespace fs = std::filesystem;

struct Options {
  SuiteParams suite;
  fs::path bin, out;
  int repeats = 0, threads = 0;
  std::string only;
  fs::path history;
  std::string commit, compare;
};

std::string first_line(const fs::path& log) {
  std::ifstream in(log);
  std::string line;
  std::getline(in, line);
  return line;
}

Run measure_floor(const Case& c, const Options& options) {
  Run run;
  const fs::path log = options.out / "log.txt";
  run.floor = fibrolite::bench::run(
      {options.bin / "fibrolite-floor", c.model, std::to_string(c.size_mm), std::to_string(c.voxel_mm), c.floor_option},
      log);
  if (run.floor.exit_code != 0) {
    run.failure = "floor: exit " + std::to_string(run.floor.exit_code) + ": " + first_line(log);
  } else if (c.floor_option == "--eager") {
    read_eager(run, nlohmann::json::parse(run.floor.output));
  } else {
    read_band(run, nlohmann::json::parse(run.floor.output));
  }
  return run;
}

Run measure(const Case& c, const Options& options) {
  if (!c.floor_option.empty()) return measure_floor(c, options);
  const bool slices = c.layer_mm > 0;
  const fs::path solid = options.out / (slices ? "solid.zip" : "solid.stl"), report = options.out / "report.json",
                 log = options.out / "log.txt";
  std::vector<std::string> command{options.bin / "fibrolite",
                                   slices ? "slice" : "generate",
                                   c.model,
                                   "-o",
                                   solid,
                                   "--report",
                                   report,
                                   "--size",
                                   std::to_string(c.size_mm),
                                   "--voxel",
                                   std::to_string(c.voxel_mm),
                                   "--infill",
                                   c.infill,
                                   "--preset",
                                   c.preset,
                                   "--overwrite",
                                   "--quiet"};
  for (const std::string& key : c.set) command.insert(command.end(), {"--set", key});
  if (slices) command.insert(command.end(), {"--layer", std::to_string(c.layer_mm), "--pixel", "0.05"});
  if (!c.max_memory.empty()) command.insert(command.end(), {"--max-memory", c.max_memory});
  const int threads = c.threads > 0 ? c.threads : options.threads;
  if (threads > 0) command.insert(command.end(), {"--threads", std::to_string(threads)});
  Run run;
  run.program = fibrolite::bench::run(command, log);
  fs::remove(solid);
  if (run.program.exit_code != 0) {
    run.failure = "exit " + std::to_string(run.program.exit_code) + ": " + first_line(log);
    return run;
  }
  if (slices) {
    read_slices(run, nlohmann::json::parse(std::ifstream(report)));
    return run;
  }
  run.floor = fibrolite::bench::run(
      {options.bin / "fibrolite-floor", c.model, std::to_string(c.size_mm), std::to_string(c.voxel_mm)}, log);
  if (run.floor.exit_code != 0) {
    run.failure = "floor: exit " + std::to_string(run.floor.exit_code) + ": " + first_line(log);
    return run;
  }
  read_report(run, nlohmann::json::parse(std::ifstream(report)), nlohmann::json::parse(run.floor.output));
  return run;
}

/// The run with the median ratio to its own floor.
Run median(const Case& c, const Options& options) {
  std::vector<Run> runs;
  for (int i = 0; i < (options.repeats > 0 ? options.repeats : c.repeats); ++i) {
    runs.push_back(measure(c, options));
    if (!runs.back().failure.empty()) return runs.back();
  }
  std::ranges::sort(runs, {}, &Run::compute_ratio);
  return runs[runs.size() / 2];
}

int bench(const Options& options) {
  fs::create_directories(options.out);
  nlohmann::json then;
  if (!options.compare.empty()) then = recall(options.history, options.compare);
  nlohmann::json json{
      {"cores", std::thread::hardware_concurrency()}, {"threads", options.threads}, {"cases", nlohmann::json::array()}};
  int failed = 0;
  std::map<std::string, Run> done;
  print_head();
  for (const Case& c : suite(options.suite)) {
    if (!options.only.empty() && c.name.find(options.only) == std::string::npos) continue;
    Run run = median(c, options);
    if (const auto found = done.find(c.beside); found != done.end()) {
      run.beside_cpu_s = found->second.compute_cpu_s;
      run.beside_realize = found->second.realize_per_voxel();
      run.beside_checks = found->second.checks_per_voxel();
      run.beside_compute_s = found->second.compute_s - found->second.partition_s;
      run.beside_parallel_s = found->second.parallel_s;
      run.beside_peak_mb = found->second.program.peak_rss_mb;
    }
    if (run.failure.empty()) done.emplace(c.name, run);
    failed += run.failure.empty() ? 0 : 1;
    print_row(c, run);
    json["cases"].push_back(to_json(c, run));
    std::ofstream(options.out / "bench.json") << json.dump(2) << '\n';
  }
  if (const std::string plot = growth_plot(json.at("cases")); !plot.empty())
    std::ofstream(options.out / "growth.svg") << plot;
  std::cout << "compute: stages without reading, preparing and writing files; x floor: compute over the floor's; "
               "process: whole "
               "processes.\n"
            << "written: " << (options.out / "bench.json").string() << std::endl;
  if (!options.history.empty() && !options.commit.empty()) remember(options.history, options.commit, json);
  if (!then.is_null()) print_comparison(json, then, options.compare);
  return failed == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) try {
  Options options;
  options.bin = fs::canonical("/proc/self/exe").parent_path();
  CLI::App app{"Speed and memory of whole runs, against the floor"};
  app.add_option("--assets", options.suite.assets, "Folder of the bundled models")->required();
  app.add_option("--models", options.suite.models,
                 "Folder of models of your own; horse.ply, if there, carries the goals");
  app.add_option("--out", options.out, "Folder for bench.json")->required();
  app.add_option("--only", options.only, "Only cases whose name contains this");
  app.add_option("--repeat", options.repeats, "Runs of each case, the median counts (default: 3 for peer-tcs, else 1)");
  app.add_option("--threads", options.threads, "Threads of each run (default: all)");
  auto* history = app.add_option("--history", options.history, "Folder of the results of earlier commits");
  app.add_option("--commit", options.commit, "Keep the results under this name")->needs(history);
  app.add_option("--compare", options.compare, "Say how they compare with those of this commit")->needs(history);
  app.add_flag("--quick", options.suite.quick, "A minute instead of many");
  CLI11_PARSE(app, argc, argv)
  return bench(options);
} catch (const std::exception& error) {
  std::cerr << "fibrolite-bench: " << error.what() << '\n';
  return 1;
}
