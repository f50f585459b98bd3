// SPDX-License-Identifier: GPL-3.0-or-later
// What is run, and what it should reach.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fibrolite::bench {

/// Upper bounds; none: only reported.
struct Goals {
  std::optional<double> floor_ratio{};  ///< Compute stages over the floor's.
  std::optional<double> wall_s{};       ///< Of the whole process.
  std::optional<double> partition_s{};  ///< Everything that decides the parts, verification included.
  std::optional<double> peak_rss_mb{};
  std::optional<double> joints_share{};  ///< Of the CPU time of all stages.
  // Beside the case named Case::beside, in the same suite:
  std::optional<double> cpu_times{};      ///< CPU time of the compute stages.
  std::optional<double> realize_times{};  ///< CPU time of `realize` per active voxel.
  std::optional<double> checks_times{};   ///< CPU time of `print checks` per active voxel.
  std::optional<double> compute_times{};  ///< Wall time of the compute stages, those that decide the parts left out.
  std::optional<double> peak_times{};     ///< Peak memory.
  /// At least: wall time of `realize` and `surface`, or of `layers`, here over theirs there.
  std::optional<double> speed_up{};
  std::optional<double> eager_times{};  ///< At least: OpenVDB's tools' wall time over the compute stages there.
  // Of fibrolite-floor --band:
  std::optional<double> band_speed_up{};  ///< At least: meshToLevelSet's wall time over to_solid()'s.
  std::optional<double> wide_times{};     ///< Wall time of to_solid() with 1 mm inside over that with the band alone.
};
struct Case {
  std::string name;
  std::filesystem::path model;
  double size_mm = 100;  ///< Longest side.
  double voxel_mm = 0.2;
  std::string infill = "hybrid", preset = "default";
  int repeats = 1;  ///< The median is reported.
  Goals goals;
  std::vector<std::string> set{};  ///< Recipe keys, as `--set` takes them.
  std::string beside{};            ///< An earlier case to compare with.
  std::string max_memory{};        ///< As `--max-memory` takes it.
  int threads = 0;                 ///< 0: as all the others.
  double layer_mm = 0;             ///< Above 0: `slice` to a .zip, layers so high, pixels of 0.05 mm; no floor.
  /// Not the program, but fibrolite-floor with this option: "--band" (the model to its band, beside OpenVDB's) or
  /// "--eager" (all of it by OpenVDB's tools, beside an earlier case).
  std::string floor_option{};
};
struct SuiteParams {
  std::filesystem::path assets;                 ///< Bundled models, .ply.
  std::optional<std::filesystem::path> models;  ///< A folder of the user's.
  bool quick = false;
};
/// The goals stand on the first case's model: horse.ply of the user's folder if it is there, else the bundled
/// quadruped.
/// @throws std::runtime_error: no model found.
[[nodiscard]] std::vector<Case> suite(const SuiteParams& params);

}  // namespace fibrolite::bench
