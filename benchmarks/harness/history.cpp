// SPDX-License-Identifier: GPL-3.0-or-later
#include "history.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace fibrolite::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

fs::path file_of(const fs::path& dir, const std::string& commit) { return dir / (commit + ".json"); }

const json* find(const json& list, const json& name) {
  const auto found = std::ranges::find_if(list, [&](const json& one) { return one.at("name") == name; });
  return found != list.end() ? &*found : nullptr;
}

bool measured(const json& row) { return !row.contains("failure"); }

void print_line(const std::string& name, double now, double then, double peak_now, double peak_then) {
  if (std::max(now, then) < 0.02) return;  // hundredths of the floor: noise
  std::printf("  %-14s %8.3f %8.3f %7.2f %9.0f %9.0f %7.2f\n", name.c_str(), now, then, then > 0 ? now / then : 0,
              peak_now, peak_then, peak_then > 0 ? peak_now / peak_then : 0);
}

}  // namespace

void remember(const fs::path& dir, const std::string& commit, const json& result) {
  fs::create_directories(dir);
  const fs::path file = file_of(dir, commit);
  json all = result;
  if (fs::exists(file)) {
    for (const json& old : json::parse(std::ifstream(file)).at("cases"))
      if (find(all.at("cases"), old.at("name")) == nullptr) all["cases"].push_back(old);
  }
  std::ofstream(file) << all.dump(2) << '\n';
}

json recall(const fs::path& dir, const std::string& commit) {
  const fs::path file = file_of(dir, commit);
  if (!fs::exists(file))
    throw std::runtime_error("nothing was measured at " + commit + " (" + file.string() +
                             "); check it out and run the benchmarks there first");
  return json::parse(std::ifstream(file));
}

void print_comparison(const json& now, const json& then, const std::string& commit) {
  std::printf("\nagainst %s: CPU time in units of each run's own floor, and peak memory\n", commit.c_str());
  std::printf("  %-14s %8s %8s %7s %9s %9s %7s\n", "", "now", "then", "x", "MB now", "MB then", "x");
  for (const json& row : now.at("cases")) {
    const json* old = find(then.at("cases"), row.at("name"));
    if (old == nullptr || !measured(row) || !measured(*old)) continue;
    if (!row.contains("stages") || !old->contains("stages")) continue;
    std::printf("%s\n", row.at("name").get<std::string>().c_str());
    const double unit = row["floor"]["compute_cpu_s"], old_unit = (*old)["floor"]["compute_cpu_s"];
    for (const json& stage : row.at("stages")) {
      const json* was = find(old->at("stages"), stage.at("name"));
      if (was == nullptr) continue;
      print_line(stage["name"], stage["cpu_s"].get<double>() / unit, (*was)["cpu_s"].get<double>() / old_unit,
                 stage["peak_rss_mb"], (*was)["peak_rss_mb"]);
    }
    print_line("all compute", row["compute_cpu_s"].get<double>() / unit,
               (*old)["compute_cpu_s"].get<double>() / old_unit, row["peak_rss_mb"], (*old)["peak_rss_mb"]);
  }
}

}  // namespace fibrolite::bench
