// SPDX-License-Identifier: GPL-3.0-or-later
// Presets and the rules between numbers; reading and printing is recipe_json.cpp.
#include "fibrolite/ops/recipe.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"

namespace fibrolite {
namespace {

Recipe fdm() {
  Recipe recipe;
  recipe.tcs.stretch_z = true;
  return recipe;
}

/// What the paper states: threshold 0.26, stresses along x, y, z, bridges by bounding boxes.
Recipe paper() {
  Recipe recipe;
  recipe.partition.threshold = 0.26;
  recipe.verify.world_axes = true;
  recipe.joint.bridge = Bridge::Bbox;
  return recipe;
}

/// The work that other lattice tools are measured by.
Recipe peer_tcs() {
  Recipe recipe;
  recipe.tcs.cell_mm = 5;
  recipe.tcs.stick_mm = 1.0;
  recipe.tcs.ball_mm = 1.6;
  recipe.shell.thickness_mm = 1.0;
  recipe.print.check = false;  // no part of that work
  return recipe;
}

struct Preset {
  const char* name;
  Recipe (*make)();
  InfillKind infill = InfillKind::Hybrid;
};
constexpr Preset presets[] = {
    {"default", [] { return Recipe{}; }}, {"fdm", fdm}, {"paper", paper}, {"peer-tcs", peer_tcs, InfillKind::Tcs}};

/// A length that has to survive sampling.
struct Feature {
  const char* key;
  double mm;
};
/// What the thickness of the crystal's thinnest members follows from.
const char* member_key(const TcsParams& tcs) {
  return tcs.density ? "tcs.density" : tcs.form == TcsForm::Sheet ? "tcs.wall_mm" : "tcs.stick_mm";
}
std::vector<Feature> features(const Recipe& recipe, InfillKind infill) {
  std::vector<Feature> list;
  if (infill == InfillKind::Solid) return list;
  list.push_back({"shell.thickness_mm", recipe.shell.thickness_mm});
  const bool hybrid = infill == InfillKind::Hybrid;
  if (hybrid || infill == InfillKind::Tcs) list.push_back({member_key(recipe.tcs), members(recipe.tcs).least_mm});
  if (hybrid || infill == InfillKind::Mfs) list.push_back({"mfs.wall_mm", recipe.mfs.wall_mm});
  const auto& chosen = recipe.partition.overrides.parts;
  const bool gyroid_part =
      hybrid && std::any_of(chosen.begin(), chosen.end(), [](const auto& c) { return c.infill == PartInfill::Gyroid; });
  if (infill == InfillKind::Gyroid || gyroid_part)
    list.push_back({recipe.gyroid.density ? "gyroid.density" : "gyroid.wall_mm", sized(recipe.gyroid).wall_mm});
  if (hybrid && recipe.joint.enabled) {
    const JointParams joint = joint_params(recipe);
    list.push_back({"joint.layer_mm", joint.layer_mm});
    if (joint.columns) list.push_back({"joint.column_mm", joint.column_mm});
    list.push_back({"joint.min_wall_mm", joint.min_wall_mm});
  }
  return list;
}

/// The same and what is cut: all that must be two voxels thick.
std::vector<Feature> sampled(const Recipe& recipe, InfillKind infill) {
  std::vector<Feature> list = features(recipe, infill);
  if (const double drain_mm = recipe.print.drain_mm.value_or(0); drain_mm > 0)
    list.push_back({"print.drain_mm", drain_mm});
  return list;
}

constexpr double rounding = 1 - 1e-9;  // 0.8 mm at a voxel of 0.4 mm is two voxels, whatever the last bit says

[[noreturn]] void unfit(const std::string& what, const std::string& where, const std::string& hint) {
  throw Error(Code::BadRecipe, what, where, hint);
}

void check_tcs(const TcsParams& given) {
  const TcsParams tcs = sized(given);
  const CellEdges& cell = tcs.cell_mm;
  if (cell.most() > 3 * cell.least())
    unfit(std::string("tcs.cell_mm has edges of ")
              .append(number_text(cell.least()))
              .append(" and ")
              .append(number_text(cell.most())),
          "recipe", "use edges that are at most 3 times each other");
  const bool sheet = tcs.form == TcsForm::Sheet;
  const double member = members(given).most_mm, times = cell_per_member(tcs.form);
  if (cell.least() < times * member * (1 - 1e-12))
    unfit(std::string("tcs.cell_mm is ")
              .append(number_text(cell.least()))
              .append(sheet ? ", too small for walls of " : ", too small for sticks of ")
              .append(number_text(member))
              .append(" mm"),
          "recipe",
          std::string("use a cell of ")
              .append(number_text(times * member))
              .append(" or more (")
              .append(number_text(times))
              .append(" * ")
              .append(sheet ? "tcs.wall_mm), or thinner walls" : "tcs.stick_mm), or thinner sticks"));
  if (tcs.form == TcsForm::Sticks && tcs.ball_mm < tcs.stick_mm)
    unfit("tcs.ball_mm is " + number_text(tcs.ball_mm) + ", smaller than the sticks", "recipe",
          "use " + number_text(tcs.stick_mm) + " or more (tcs.stick_mm)");
  if (tcs.grade == TcsGrade::None) return;
  if (tcs.grade_most < tcs.grade_least)
    unfit("tcs.grade_most is " + number_text(tcs.grade_most) + ", less than the least", "recipe",
          "use " + number_text(tcs.grade_least) + " or more (tcs.grade_least)");
  if (tcs.grade_depth_mm < cell.most())
    unfit("tcs.grade_depth_mm is " + number_text(tcs.grade_depth_mm) + ", less than a cell", "recipe",
          "use " + number_text(cell.most()) + " or more (tcs.cell_mm)");
}

void check_mfs(const MfsParams& mfs) {
  const double least = least_fibre_mm(mfs.wall_mm, mfs.gap_mm, mfs.walls);
  if (mfs.fibre_mm <= least)
    unfit("mfs.fibre_mm is " + number_text(mfs.fibre_mm) + ", no room for a void between walls of " +
              number_text(mfs.wall_mm) + " mm",
          "recipe", "use more than " + number_text(least) + ", or thinner walls");
}

void check_joint(const JointParams& joint, double wall_mm) {
  // What a run adds by itself must not be what its own print checks then find too thin.
  const auto printable = [wall_mm](const char* key, double mm) {
    if (mm < wall_mm * rounding)
      unfit(std::string(key).append(" is ").append(number_text(mm)).append(" mm, thinner than print.wall_mm"), "recipe",
            "use " + number_text(wall_mm) + " or more, or a smaller print.wall_mm, or auto, which follows it");
  };
  printable("joint.layer_mm", joint.layer_mm);
  if (joint.columns) printable("joint.column_mm", joint.column_mm);
  printable("joint.min_wall_mm", joint.min_wall_mm);
  if (joint.spacing_mm <= joint.column_mm)
    unfit("joint.spacing_mm is " + number_text(joint.spacing_mm) + ", columns would touch", "recipe",
          "use more than " + number_text(joint.column_mm) + " (joint.column_mm)");
}

/// All that is too thin at once: who does what the message says is not refused for the next.
void check_sampled(const Recipe& recipe, double voxel_mm, InfillKind infill) {
  const double least = 2 * voxel_mm;
  std::vector<Feature> thin = sampled(recipe, infill);
  std::erase_if(thin, [&](const Feature& feature) { return feature.mm >= least * rounding; });
  if (thin.empty()) return;
  std::string what;
  for (const Feature& feature : thin)
    what.append(what.empty() ? "" : ", ")
        .append(feature.key)
        .append(std::string_view(feature.key).ends_with(".density") ? " makes members of " : " is ")
        .append(number_text(feature.mm))
        .append(" mm");
  unfit(what + ": thinner than 2 voxels", "voxel " + number_text(voxel_mm) + " mm",
        "use " + number_text(rounded_up(least)) + " mm or more" + (thin.size() > 1 ? " for each" : "") +
            ", or --voxel " + number_text(most_voxel_mm(recipe, infill)) + " or less");
}

}  // namespace

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const Preset& p : presets) names.emplace_back(p.name);
  return names;
}

namespace {

const Preset& find_preset(std::string_view name) {
  for (const Preset& p : presets)
    if (name == p.name) return p;
  std::string all;
  for (const std::string& known : preset_names()) all += (all.empty() ? "" : ", ") + known;
  throw Error(Code::BadRecipe, "unknown preset '" + std::string(name) + "'", "presets: " + all,
              "did you mean " + nearest_name(name, preset_names()) + "?");
}

}  // namespace

Recipe preset(std::string_view name) { return find_preset(name).make(); }
InfillKind usual_infill(std::string_view preset_name) { return find_preset(preset_name).infill; }

CoreParams core_params(const Recipe& recipe) {
  return {recipe.partition.concentration, recipe.partition.core_share, recipe.partition.min_slenderness,
          2 * (recipe.mfs.fibre_mm + recipe.mfs.wall_mm)};
}

JointParams joint_params(const Recipe& recipe) {
  const JointRecipe& asked = recipe.joint;
  JointParams joint{.enabled = asked.enabled, .columns = asked.columns, .bridge = asked.bridge};
  const double wall_mm = recipe.print.wall_mm;
  joint.layer_mm = asked.layer_mm.value_or(std::max(joint.layer_mm, wall_mm));
  joint.column_mm = asked.column_mm.value_or(std::max(joint.column_mm, wall_mm));
  joint.spacing_mm = asked.spacing_mm.value_or(std::max(joint.spacing_mm, 2 * joint.column_mm));
  joint.reach_mm = asked.reach_mm;
  joint.min_wall_mm = asked.min_wall_mm.value_or(std::max(joint.min_wall_mm, wall_mm));
  return joint;
}

Recipe with_joint_lengths(Recipe recipe) {
  const JointParams joint = joint_params(recipe);
  recipe.joint.layer_mm = joint.layer_mm;
  recipe.joint.column_mm = joint.column_mm;
  recipe.joint.spacing_mm = joint.spacing_mm;
  recipe.joint.min_wall_mm = joint.min_wall_mm;
  return recipe;
}

double thinnest_mm(const Recipe& recipe, InfillKind infill) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Feature& feature : features(recipe, infill)) thinnest = std::min(thinnest, feature.mm);
  return thinnest;
}

void check_recipe(const Recipe& recipe, double voxel_mm, InfillKind infill) {
  const bool hybrid = infill == InfillKind::Hybrid;
  check_material(recipe.material);
  check_loads(recipe.verify.loads);
  if (hybrid || infill == InfillKind::Tcs) check_tcs(recipe.tcs);
  if (infill == InfillKind::Tcs && recipe.tcs.grade == TcsGrade::Stress)
    unfit("tcs.grade is stress, which only a hybrid run knows", "recipe", "use --infill hybrid, or tcs.grade=surface");
  if (hybrid || infill == InfillKind::Mfs) check_mfs(recipe.mfs);
  if (hybrid && recipe.partition.by == PartBy::Load && !recipe.partition.overrides.cuts.empty())
    unfit("partition.overrides.cuts part by shape, but partition.by is load", "recipe", "use partition.by=both");
  if (infill == InfillKind::Gyroid) (void)density(recipe.gyroid);
  if (hybrid && recipe.joint.enabled) check_joint(joint_params(recipe), recipe.print.wall_mm);

  check_sampled(recipe, voxel_mm, infill);
}

double most_voxel_mm(const Recipe& recipe, InfillKind infill) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Feature& feature : sampled(recipe, infill)) thinnest = std::min(thinnest, feature.mm);
  return std::isfinite(thinnest) ? rounded_down(thinnest / 2) : thinnest;
}

}  // namespace fibrolite
