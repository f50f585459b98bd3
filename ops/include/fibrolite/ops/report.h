// SPDX-License-Identifier: GPL-3.0-or-later
// Everything measured in a run: report.json, schema 1.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fibrolite/mesh.h"
#include "fibrolite/ops/fill.h"
#include "fibrolite/ops/mend.h"
#include "fibrolite/ops/recipe.h"

namespace fibrolite {

struct PartReport {
  int id = 0;
  std::vector<int> candidates;  ///< Of the partition, that it is made of.
  std::string kind, infill;
  double volume_mm3 = 0;         ///< Of the part of the body, on the fine grid.
  double lumen_mm3 = 0;          ///< Inside the shell.
  double infill_volume_mm3 = 0;  ///< Material in the lumen.
  int fibres = 0;
  FibreCensus section{}, micrograph{};  ///< As in Fill.
  Vec3d centroid_mm{}, axis{};
  double diameter_mm = 0;
  PartStress stress;
  std::string reason;
  std::string color_name, color_hex;  ///< In the pictures of the run; empty: there is none.
};
struct InterfaceReport {
  int a = 0, b = 0;
  Vec3d centroid_mm{}, normal{};  ///< Of a mantle: its axis; of a bent border: in its middle.
  double radius_mm = 0;           ///< Of the mantle of a core; else 0.
  bool bent = false;              ///< No plane, and no mantle.
  double area_mm2 = 0;
  int regions_before = 0, regions_after = 0, columns = 0, columns_dropped = 0;
  double layer_area_mm2 = 0, union_area_mm2 = 0, bridge_area_mm2 = 0, contact_area_mm2 = 0;
  double mst_bridge_mm3 = 0, bbox_bridge_mm3 = 0;  ///< Material of the bridges by either rule, whichever was used; NaN:
                                                   ///< a mantle, which has none.
  double shell_area_mm2 = 0;                       ///< Of the shell, which runs on through the section.
  double demand_n = 0;  ///< Integral over the section of the traction, everywhere of the load case that has most.
  double capacity_over_demand = 0;  ///< (contact_area + shell_area) * yield / demand; infinite without a demand.
};
struct SolidReport {
  double volume_mm3 = 0, fill_ratio = 0, mass_g = 0;
  std::int64_t pieces = 0, cavities = 0;
  double cavity_volume_mm3 = 0;
  std::int64_t ties = 0;                         ///< Struts added to loose pieces.
  std::int64_t necks_thickened = 0;              ///< Of those, along necks that were too thin.
  std::int64_t tips_tied = 0, tips_removed = 0;  ///< Stick ends that would have ended in the void.
  std::int64_t specks_removed = 0;               ///< Loose pieces of a few voxels.
  std::int64_t voids_filled = 0;                 ///< Micro-voids.
  std::int64_t dangling = 0;  ///< Sticks that end in the void; membranes that do, in the middle section of a column.
  std::int64_t unreached =
      0;               ///< Material that hangs on the shell only through necks thinner than the thinnest member.
  double neck_mm = 0;  ///< Thinner necks than this were looked for; 0 where nothing has a thickness.
  std::int64_t active_voxels = 0;
  double voxel_mm = 0;
};
struct StageReport {
  std::string name;
  double wall_s = 0;
  double cpu_s = 0;        ///< All threads, and child processes that have ended.
  double peak_rss_mb = 0;  ///< Highest resident memory of the process up to the end of the stage, 10^6 bytes.
};
struct ModelReport {
  std::string path;
  std::int64_t triangles = 0;
  Vec3d size_mm{};
  double volume_mm3 = 0;
  std::vector<std::string> repairs;
};
/// Sizes and checks of the finite element solves; zero where there was none.
struct VerificationReport {
  std::int64_t tets = 0, dof = 0;        ///< Of all solves together.
  int iterations = 0;                    ///< Of the solve that took most; 0: all were direct.
  double residual = 0, equilibrium = 0;  ///< Relative, of the worst solve.
  std::vector<Selected> selected;        ///< What supports and forces got hold of.
};
/// Stress in one place of the printed solid: a joint, or the shell or the infill of a part.
struct PlaceReport {
  std::string name;
  double volume_mm3 = 0;  ///< Of its material that was measured.
  double max_von_mises_mpa = 0, p99_von_mises_mpa = 0;
  double failure_load_n = 0;  ///< load * yield / p99 of this place.
  Vec3d weakest_mm{};
};
/// What the finished solid carries under one load case (strength.h).
struct StrengthReport {
  std::string load_case;
  double load_n = 0, compliance_n_mm = 0, max_displacement_mm = 0;
  double max_von_mises_mpa = 0, p99_von_mises_mpa = 0;
  double failure_load_n = 0;  ///< load * yield / p99.
  double safety_factor = 0;   ///< yield / p99.
  Vec3d weakest_mm{};
  std::string weakest;              ///< The first of `places`.
  std::vector<PlaceReport> places;  ///< Of 100 cells or more; the one that yields first, first.
  std::int64_t cells = 0;
  double cell_mm = 0;
  int iterations = 0;
  double residual = 0;
};
/// What the print checks found on the finished solid, and what was mended before.
struct PrintReport {
  bool checked = false;
  Printable found;
  std::vector<Drain> drains;
  std::int64_t thickened = 0;     ///< Balls put into thin walls and small gaps.
  std::int64_t pillars = 0;       ///< Under overhangs.
  bool stretched = false;         ///< The crystal, so that its sticks stand steeper (TcsParams::stretch_z).
  std::int64_t voids_filled = 0;  ///< Enclosed, too small for a hole.
};
/// The layers of one plate.
struct PlateReport {
  std::string name;
  int layers = 0;
  double layer_mm = 0;
  Vec2d pixel_mm{};
  int width = 0, height = 0;  ///< Pixels.
  double volume_mm3 = 0;
  std::vector<double> area_mm2;  ///< One per layer.
};
struct Report {
  std::string command;
  std::vector<std::string> formats;  ///< Of the outputs, in their order: "stl", "vdb".
  Recipe recipe;
  std::string infill = "hybrid";
  int threads = 0;  ///< 0: not known.
  ModelReport model;
  double threshold = 0, stable_from = 0, stable_to = 0;
  VerificationReport verification;
  std::vector<PartReport> parts;
  std::vector<InterfaceReport> interfaces;
  SolidReport solid;
  PrintReport print;  ///< Left out of the JSON if nothing was checked.
  MeshCheck mesh;
  std::vector<StrengthReport> strength;  ///< Empty if it was not asked for.
  std::vector<PlateReport> slices;       ///< Empty if nothing was sliced; then the report has no such key.
  std::vector<StageReport> stages;
  std::vector<std::string> warnings;

  [[nodiscard]] double sliced_mm3() const;  ///< Of all plates.
};
/// Schema 1, pretty, keys in a fixed order; no NaN or infinity ever (null instead). What a run does not measure is
/// given as NaN.
[[nodiscard]] std::string to_json(const Report& report);
/// Version of the library, "major.minor.patch".
[[nodiscard]] std::string version();

/// Measures wall, CPU and peak memory of named stages.
class Stopwatch {
 public:
  explicit Stopwatch(std::vector<StageReport>& out) : out_(&out) {}
  /// Run `work` as the stage `name`. A stage is noted even if its work throws.
  template <class Work>
  auto operator()(const char* name, Work&& work) {
    Lap lap(*out_, name);
    return work();
  }

 private:
  struct Lap {
    Lap(std::vector<StageReport>& out, const char* name);
    ~Lap();
    Lap(const Lap&) = delete;
    Lap& operator=(const Lap&) = delete;
    std::vector<StageReport>* out;
    const char* name;
    double wall0, cpu0;
  };
  std::vector<StageReport>* out_;
};

}  // namespace fibrolite
