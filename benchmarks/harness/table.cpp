// SPDX-License-Identifier: GPL-3.0-or-later
#include "table.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace fibrolite::bench {
namespace {

// By the names that `fibrolite generate` gives its stages. Preparing (welding, orienting) goes with reading: the
// floor's figure leaves both out too.
bool moves_files(const std::string& stage) {
  return stage == "prepare" || stage.starts_with("read") || stage.starts_with("write");
}
bool decides_parts(const std::string& stage) {
  constexpr std::array names{"proxy", "diameter", "partition", "verify"};
  return std::ranges::find(names, stage) != names.end();
}

std::string number(double value, int decimals) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

}  // namespace

namespace {

void read_stages(Run& run, const nlohmann::json& report) {
  for (const auto& stage : report.at("stages")) {
    run.stages.push_back({.name = stage.at("name"),
                          .wall_s = stage.at("wall_s"),
                          .cpu_s = stage.value("cpu_s", 0.0),
                          .peak_rss_mb = stage.at("peak_rss_mb")});
  }
}

}  // namespace

void read_slices(Run& run, const nlohmann::json& report) {
  read_stages(run, report);
  for (const auto& plate : report.at("slices").at("plates")) run.layers += plate.at("layers").get<double>();
  for (const Stage& stage : run.stages)
    if (stage.name == "layers") run.layers_s = run.parallel_s = stage.wall_s;
  run.active_voxels = report.at("solid").at("active_voxels");
}

void read_report(Run& run, const nlohmann::json& report, const nlohmann::json& floor) {
  read_stages(run, report);
  double all_cpu_s = 0, joints_cpu_s = 0;
  for (const Stage& stage : run.stages) {
    all_cpu_s += stage.cpu_s;
    if (stage.name == "joints") joints_cpu_s += stage.cpu_s;
    if (stage.name == "realize") run.realize_cpu_s += stage.cpu_s;
    if (stage.name == "print checks") run.checks_cpu_s += stage.cpu_s;
    if (stage.name == "realize" || stage.name == "surface") run.parallel_s += stage.wall_s;
    if (moves_files(stage.name)) {
      run.files_s += stage.wall_s;
      continue;
    }
    run.compute_s += stage.wall_s;
    run.compute_cpu_s += stage.cpu_s;
    if (decides_parts(stage.name)) run.partition_s += stage.wall_s;
  }
  run.joints_share = joints_cpu_s / all_cpu_s;
  run.active_voxels = report.at("solid").at("active_voxels");
  run.triangles = report.at("mesh").at("triangles");
  run.floor_compute_s = floor.at("compute_s");
  run.floor_compute_cpu_s = floor.at("compute_cpu_s");
}

void read_band(Run& run, const nlohmann::json& band) {
  run.level_set_s = band.at("level_set_s");
  run.band_s = band.at("band_s");
  run.wide_s = band.at("wide_band_s");
  run.active_voxels = band.at("band_voxels");
}

void read_eager(Run& run, const nlohmann::json& eager) {
  run.eager_s = eager.at("eager_s");
  run.offset_s = eager.at("offset_s");
  run.triangles = eager.at("triangles");
}

void print_head() {
  std::printf("%-14s %-18s %6s %6s | %7s %7s %7s %7s | %7s %8s %8s | %8s %7s %7s %7s\n", "case", "model", "size",
              "voxel", "wall s", "CPU s", "compute", "files", "peak MB", "M voxels", "M tris", "floor s", "x floor",
              "x CPU", "process");
}

namespace {

void print_stages(const Case& c, const Run& run, const std::string& model) {
  std::printf("%-14s %-18s %6g %6g | %7.2f %7.2f %7.2f %7.2f | %7.0f %8.2f %8.2f | %8.2f %7.2f %7.2f %7.2f\n",
              c.name.c_str(), model.c_str(), c.size_mm, c.voxel_mm, run.program.wall_s, run.program.cpu_s,
              run.compute_s, run.files_s, run.program.peak_rss_mb, run.active_voxels / 1e6, run.triangles / 1e6,
              run.floor_compute_s, run.compute_ratio(), run.cpu_ratio(), run.process_ratio());
  std::string line = "    wall/CPU s:";
  for (const Stage& stage : run.stages)
    line += "  " + stage.name + " " + number(stage.wall_s, 2) + "/" + number(stage.cpu_s, 2);
  std::printf("%s\n", line.c_str());
}

}  // namespace

void print_row(const Case& c, const Run& run) {
  const std::string model = c.model.stem().string();
  if (!run.failure.empty()) {
    std::printf("%-14s %-18s %6g %6g | %s\n", c.name.c_str(), model.c_str(), c.size_mm, c.voxel_mm,
                run.failure.c_str());
    return;
  }
  if (run.layers > 0) {
    std::printf("%-14s %-18s %6g %6g | %7.2f %7.2f | %.0f layers in %.2f s, %.3f s each; peak %.0f MB\n",
                c.name.c_str(), model.c_str(), c.size_mm, c.voxel_mm, run.program.wall_s, run.program.cpu_s, run.layers,
                run.layers_s, run.layers_s / run.layers, run.program.peak_rss_mb);
  } else if (run.eager_s > 0) {
    std::printf("%-14s %-18s %6g %6g | OpenVDB's tools %.2f s, of which the shell's offset %.2f s; peak %.0f MB\n",
                c.name.c_str(), model.c_str(), c.size_mm, c.voxel_mm, run.eager_s, run.offset_s, run.floor.peak_rss_mb);
  } else if (run.band_s > 0) {
    std::printf("%-14s %-18s %6g %6g | meshToLevelSet %.2f s, to_solid %.2f s, with 1 mm inside %.2f s\n",
                c.name.c_str(), model.c_str(), c.size_mm, c.voxel_mm, run.level_set_s, run.band_s, run.wide_s);
  } else {
    print_stages(c, run, model);
  }
  bool met = true;
  for (const std::string& verdict : judge(c, run, met)) std::printf("    goal: %s\n", verdict.c_str());
  std::fflush(stdout);
}

std::vector<std::string> judge(const Case& c, const Run& run, bool& met) {
  std::vector<std::string> verdicts;
  const auto one = [&](const char* what, const std::optional<double>& bound, double value) {
    if (!bound) return;
    const bool ok = run.failure.empty() && value <= *bound;
    met = met && ok;
    verdicts.push_back(std::string(what) + " " + number(value, 2) + " of at most " +
                       number(*bound, *bound < 10 ? 1 : 0) + (ok ? ": ok" : ": missed"));
  };
  const auto at_least = [&](const std::string& what, const std::optional<double>& bound, double value) {
    if (!bound) return;
    const bool ok = run.failure.empty() && value >= *bound;
    met = met && ok;
    verdicts.push_back(what + " " + number(value, 2) + " of at least " + number(*bound, 1) +
                       (ok ? ": ok" : ": missed"));
  };
  one("compute / floor", c.goals.floor_ratio, run.compute_ratio());
  one("wall s", c.goals.wall_s, run.program.wall_s);
  one("partition and verification s", c.goals.partition_s, run.partition_s);
  one("peak MB", c.goals.peak_rss_mb, run.program.peak_rss_mb);
  one("joints / all stages, CPU", c.goals.joints_share, run.joints_share);
  if (run.layers > 0 && run.beside_parallel_s > 0)
    at_least("layers, time alone / " + c.beside, c.goals.speed_up, run.parallel_s / run.beside_parallel_s);
  else if (run.beside_cpu_s > 0 && run.eager_s > 0)
    at_least("OpenVDB's tools / " + c.beside, c.goals.eager_times, run.eager_s / run.beside_compute_s);
  else if (run.beside_cpu_s > 0) {
    const std::string over = " / " + c.beside;
    one(("compute CPU" + over).c_str(), c.goals.cpu_times, run.compute_cpu_s / run.beside_cpu_s);
    one(("realize CPU per voxel" + over).c_str(), c.goals.realize_times, run.realize_per_voxel() / run.beside_realize);
    one(("print checks CPU per voxel" + over).c_str(), c.goals.checks_times,
        run.checks_per_voxel() / run.beside_checks);
    one(("compute without what decides parts" + over).c_str(), c.goals.compute_times,
        (run.compute_s - run.partition_s) / run.beside_compute_s);
    one(("peak" + over).c_str(), c.goals.peak_times, run.program.peak_rss_mb / run.beside_peak_mb);
    at_least("realize and surface, time alone" + over, c.goals.speed_up, run.parallel_s / run.beside_parallel_s);
  }
  if (run.band_s > 0) {
    at_least("meshToLevelSet / to_solid", c.goals.band_speed_up, run.level_set_s / run.band_s);
    one("1 mm inside / band alone", c.goals.wide_times, run.wide_s / run.band_s);
  }
  return verdicts;
}

nlohmann::json to_json(const Case& c, const Run& run) {
  nlohmann::json json{{"name", c.name},       {"model", c.model.filename().string()},
                      {"size_mm", c.size_mm}, {"voxel_mm", c.voxel_mm},
                      {"infill", c.infill},   {"preset", c.preset},
                      {"repeats", c.repeats}, {"set", c.set},
                      {"beside", c.beside},   {"max_memory", c.max_memory}};
  if (!run.failure.empty()) {
    json["failure"] = run.failure;
    return json;
  }
  json["threads"] = c.threads;
  if (run.layers > 0) {
    json["slices"] = {{"layers", run.layers},
                      {"layers_s", run.layers_s},
                      {"wall_s", run.program.wall_s},
                      {"cpu_s", run.program.cpu_s},
                      {"peak_rss_mb", run.program.peak_rss_mb}};
    bool met = true;
    json["goals"] = judge(c, run, met);
    json["met"] = met;
    return json;
  }
  if (!c.floor_option.empty()) {
    if (run.eager_s > 0)
      json["eager"] = {{"eager_s", run.eager_s}, {"offset_s", run.offset_s}, {"peak_rss_mb", run.floor.peak_rss_mb}};
    else
      json["band"] = {{"level_set_s", run.level_set_s}, {"band_s", run.band_s}, {"wide_band_s", run.wide_s}};
    bool met = true;
    json["goals"] = judge(c, run, met);
    json["met"] = met;
    return json;
  }
  json["stages"] = nlohmann::json::array();
  for (const Stage& s : run.stages) {
    json["stages"].push_back(
        {{"name", s.name}, {"wall_s", s.wall_s}, {"cpu_s", s.cpu_s}, {"peak_rss_mb", s.peak_rss_mb}});
  }
  json["wall_s"] = run.program.wall_s;
  json["cpu_s"] = run.program.cpu_s;
  json["peak_rss_mb"] = run.program.peak_rss_mb;
  json["compute_s"] = run.compute_s;
  json["compute_cpu_s"] = run.compute_cpu_s;
  json["files_s"] = run.files_s;
  json["partition_s"] = run.partition_s;
  json["joints_share"] = run.joints_share;
  json["realize_cpu_s"] = run.realize_cpu_s;
  json["active_voxels"] = run.active_voxels;
  json["triangles"] = run.triangles;
  json["floor"] = {{"wall_s", run.floor.wall_s},
                   {"cpu_s", run.floor.cpu_s},
                   {"peak_rss_mb", run.floor.peak_rss_mb},
                   {"compute_s", run.floor_compute_s},
                   {"compute_cpu_s", run.floor_compute_cpu_s}};
  json["compute_ratio"] = run.compute_ratio();
  json["cpu_ratio"] = run.cpu_ratio();
  json["process_ratio"] = run.process_ratio();
  bool met = true;
  json["goals"] = judge(c, run, met);
  json["goals_met"] = met;
  return json;
}

}  // namespace fibrolite::bench
