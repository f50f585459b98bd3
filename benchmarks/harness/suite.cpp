// SPDX-License-Identifier: GPL-3.0-or-later
#include "suite.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace fibrolite::bench {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> meshes(const fs::path& folder) {
  constexpr std::array endings{".stl", ".obj", ".ply", ".off", ".3mf"};
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (std::ranges::find(endings, entry.path().extension()) != endings.end()) found.push_back(entry.path());
  }
  std::ranges::sort(found);
  return found;
}

std::string label(double mm) {
  std::string text = std::to_string(mm);
  text.erase(text.find_last_not_of('0') + 1);
  return text;
}

/// What the parts of the method may cost, each beside the run without it.
std::vector<Case> costs(const std::filesystem::path& main_model, const SuiteParams& params) {
  const Case horse{.name = "", .model = main_model, .repeats = 3, .goals = {}};
  const auto made = [](Case c, const char* name, std::vector<std::string> set, const char* beside, Goals goals) {
    c.name = name;
    c.set = std::move(set);
    c.beside = beside;
    c.goals = goals;
    return c;
  };
  Case crystal = horse, bend = horse;
  crystal.infill = "tcs";
  Case larger = crystal;
  larger.size_mm = 200;
  larger.repeats = 1;
  bend.model = params.assets / "bent_tube.ply";
  bend.size_mm = 60;
  bend.voxel_mm = 0.1;
  bend.repeats = 1;
  const Goals graded{.cpu_times = 1.2}, swept{.realize_times = 3};
  const char* crystal_inside = R"(partition.overrides={"parts":[{"id":0,"infill":"tcs"}]})";
  return {made(horse, "cost hybrid", {}, "", {.joints_share = 0.1}),
          made(horse, "cost stress", {"tcs.grade=\"stress\""}, "cost hybrid", graded),
          made(crystal, "cost tcs", {}, "", {}),
          made(crystal, "cost surface", {"tcs.grade=\"surface\""}, "cost tcs", graded),
          made(larger, "cost checks", {}, "cost tcs", {.checks_times = 1.2}),
          made(bend, "cost bend tcs", {crystal_inside}, "", {}),
          made(bend, "cost bend mfs", {}, "cost bend tcs", swept),
          made(bend, "cost bend taper", {"mfs.taper=true"}, "cost bend tcs", swept)};
}

}  // namespace

std::vector<Case> suite(const SuiteParams& params) {
  std::vector<fs::path> models = meshes(params.assets);
  fs::path main_model = params.assets / "quadruped.ply";
  if (params.models) {
    models = meshes(*params.models);
    if (fs::exists(*params.models / "horse.ply")) main_model = *params.models / "horse.ply";
  }
  if (!fs::exists(main_model)) throw std::runtime_error(main_model.string() + " is missing");

  std::vector<Case> cases;
  for (const double voxel_mm : {0.4, 0.2, 0.1, 0.05}) {
    if (params.quick && voxel_mm < 0.2) continue;
    Case peer{.name = "peer-tcs " + label(voxel_mm),
              .model = main_model,
              .voxel_mm = voxel_mm,
              .infill = "tcs",
              .preset = "peer-tcs",
              .repeats = voxel_mm < 0.1 ? 1 : 3,
              .goals = {}};
    // Four times the samples and triangles: surface-bound, not volume-bound.
    if (voxel_mm < 0.4) peer.goals.cpu_times = 4.5;
    if (voxel_mm < 0.4) peer.beside = "peer-tcs " + label(2 * voxel_mm);
    if (voxel_mm < 0.4 && voxel_mm >= 0.1) peer.goals.floor_ratio = 0.6;
    if (voxel_mm == 0.1) peer.goals.peak_rss_mb = 550;
    cases.push_back(peer);
  }
  if (!params.quick) {
    const Case peer = cases[cases.size() - 2];
    Case slabs = peer;
    slabs.name += " slabs";
    slabs.repeats = 1;
    slabs.max_memory = "300M";
    slabs.beside = peer.name;
    slabs.goals = {.peak_rss_mb = 300 * 1.048576, .cpu_times = 1.8};
    cases.push_back(slabs);
    Case finer = slabs;
    finer.voxel_mm = 0.05;
    finer.name = "peer-tcs 0.05 slabs";
    finer.beside = slabs.name;
    finer.goals = {.peak_rss_mb = 300 * 1.048576, .peak_times = 1.3};
    cases.push_back(finer);
    Case alone = peer;
    alone.beside = alone.name;
    alone.name += " alone";
    alone.threads = 1;
    alone.goals = {.speed_up = 1.8};
    cases.push_back(alone);
    Case slices{
        .name = "slices 0.2", .model = main_model, .voxel_mm = 0.2, .infill = "tcs", .goals = {}, .layer_mm = 0.2};
    cases.push_back(slices);
    slices.beside = slices.name;
    slices.name += " alone";
    slices.threads = 1;
    slices.goals = {.speed_up = 1.8};
    cases.push_back(slices);
    for (const double voxel_mm : {0.2, 0.1}) {
      cases.push_back({.name = "band " + label(voxel_mm),
                       .model = main_model,
                       .voxel_mm = voxel_mm,
                       .goals = {.band_speed_up = voxel_mm < 0.2 ? 5 : 3, .wide_times = 1.5},
                       .floor_option = "--band"});
    }
    cases.push_back({.name = "eager 0.1",
                     .model = main_model,
                     .voxel_mm = 0.1,
                     .goals = {.eager_times = 8},
                     .beside = peer.name,
                     .floor_option = "--eager"});
    cases.push_back({.name = "tcs 0.1", .model = main_model, .voxel_mm = 0.1, .infill = "tcs", .goals = {}});
    cases.push_back({.name = "hybrid 0.1",
                     .model = main_model,
                     .voxel_mm = 0.1,
                     .goals = {.partition_s = 30, .compute_times = 1.6},
                     .beside = "tcs 0.1"});
  }
  if (params.quick) {
    cases.push_back({.name = "hybrid 100", .model = main_model, .voxel_mm = 0.25, .goals = {}});
    return cases;
  }
  cases.push_back({.name = "hybrid 300",
                   .model = main_model,
                   .size_mm = 300,
                   .voxel_mm = 0.4,
                   .goals = {.wall_s = 90, .partition_s = 30}});
  std::ranges::move(costs(main_model, params), std::back_inserter(cases));
  // 6000 voxels on the long side, 5002 layers: some ten minutes.
  cases.push_back({.name = "slices 300 mm",
                   .model = main_model,
                   .size_mm = 300,
                   .voxel_mm = 0.05,
                   .goals = {.peak_rss_mb = 4096 * 1.048576},
                   .max_memory = "4G",
                   .layer_mm = 0.05});
  for (const char* infill : {"tcs", "mfs", "solid"}) {
    cases.push_back({.name = infill, .model = main_model, .voxel_mm = 0.25, .infill = infill, .goals = {}});
  }
  for (const fs::path& model : models) {
    cases.push_back({.name = "hybrid 100", .model = model, .voxel_mm = 0.25, .goals = {}});
  }
  return cases;
}

}  // namespace fibrolite::bench
