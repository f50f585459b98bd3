// SPDX-License-Identifier: GPL-3.0-or-later
// What a case measured, as a row and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "child.h"
#include "suite.h"

namespace fibrolite::bench {

struct Stage {
  std::string name;
  double wall_s = 0, cpu_s = 0, peak_rss_mb = 0;
};
/// One run of the program and of the floor, in that order, by the same harness.
struct Run {
  ChildResult program, floor;
  std::vector<Stage> stages;
  double compute_s = 0, compute_cpu_s = 0;  ///< All stages but those of files_s.
  double files_s = 0;                       ///< Reading, preparing, writing.
  double partition_s = 0;                   ///< Stages that decide the parts.
  double joints_share = 0;                  ///< Of the CPU time of all stages.
  double realize_cpu_s = 0, checks_cpu_s = 0;
  double active_voxels = 0, triangles = 0;
  double floor_compute_s = 0, floor_compute_cpu_s = 0;
  double parallel_s = 0;                           ///< Wall time of `realize` and `surface`, or of `layers`.
  double level_set_s = 0, band_s = 0, wide_s = 0;  ///< Of fibrolite-floor --band.
  double layers = 0, layers_s = 0;                 ///< Of slices: how many, and wall time of that stage.
  double eager_s = 0, offset_s = 0;                ///< Of fibrolite-floor --eager; the shell's offset alone.
  // Of the case to compare with; 0: none was run.
  double beside_cpu_s = 0, beside_realize = 0, beside_checks = 0, beside_compute_s = 0, beside_parallel_s = 0,
         beside_peak_mb = 0;
  std::string failure;  ///< Empty if both ended well.

  [[nodiscard]] double compute_ratio() const { return compute_s / floor_compute_s; }
  [[nodiscard]] double cpu_ratio() const { return compute_cpu_s / floor_compute_cpu_s; }
  [[nodiscard]] double realize_per_voxel() const { return realize_cpu_s / active_voxels; }
  [[nodiscard]] double checks_per_voxel() const { return checks_cpu_s / active_voxels; }
  [[nodiscard]] double process_ratio() const { return program.wall_s / floor.wall_s; }
};
/// Fill in what the program's report and the floor's answer say.
void read_report(Run& run, const nlohmann::json& report, const nlohmann::json& floor);

/// The same of a run of `slice`, which has no floor.
void read_slices(Run& run, const nlohmann::json& report);
/// The same of what `fibrolite-floor --band` says.
void read_band(Run& run, const nlohmann::json& band);
/// And of what `fibrolite-floor --eager` says.
void read_eager(Run& run, const nlohmann::json& eager);

void print_head();
void print_row(const Case& c, const Run& run);
[[nodiscard]] nlohmann::json to_json(const Case& c, const Run& run);
/// Each goal with its figure, and whether all were met.
[[nodiscard]] std::vector<std::string> judge(const Case& c, const Run& run, bool& met);

}  // namespace fibrolite::bench
