// SPDX-License-Identifier: GPL-3.0-or-later
// Every number of a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fibrolite/ops/diameter.h"
#include "fibrolite/ops/infill/gyroid.h"
#include "fibrolite/ops/infill/infill.h"
#include "fibrolite/ops/infill/mfs.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/ops/joint.h"
#include "fibrolite/ops/load_cores.h"
#include "fibrolite/ops/loads.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/ops/printable.h"
#include "fibrolite/ops/verify.h"

namespace fibrolite {

struct ShellParams {
  double thickness_mm = 1.0;  ///< 2 voxels or more.
};
/// Layers and columns as a recipe asks for them. Lengths left open ("auto") follow print.wall_mm: see joint_params().
struct JointRecipe {
  bool enabled = true;
  bool columns = true;
  Bridge bridge = Bridge::Mst;
  std::optional<double> layer_mm, column_mm, spacing_mm, min_wall_mm;
  double reach_mm = JointParams{}.reach_mm;
};
struct Recipe {
  ShellParams shell;
  PartitionParams partition;
  VerifyParams verify;
  MfsParams mfs;  ///< Its seed follows `seed`.
  TcsParams tcs;
  GyroidParams gyroid;
  JointRecipe joint;
  PrintParams print;
  Material material;
  std::uint64_t seed = 1;
};

/// Names for --preset, first is the default.
[[nodiscard]] std::vector<std::string> preset_names();
/// @throws Error BadRecipe: unknown preset (with the nearest name).
[[nodiscard]] Recipe preset(std::string_view name);
/// What fills the body where a preset is named and no infill is: hybrid, but tcs with peer-tcs, whose work has no
/// parts.
[[nodiscard]] InfillKind usual_infill(std::string_view preset_name);

/// Strict: an unknown or repeated key, a wrong type or a value out of range is an error that names the place and the
/// nearest key. Keys left out keep the value of `base`. `source_name` is where the text comes from, for messages.
/// @throws Error BadRecipe.
[[nodiscard]] Recipe parse_recipe(std::string_view json, const Recipe& base, std::string_view source_name);
/// "tcs.cell_mm=5", "material=PETG", "loads=stand": path and value as in --set. @throws Error BadRecipe.
[[nodiscard]] Recipe set(const Recipe& base, std::string_view assignment);
/// The whole recipe as pretty JSON that parse_recipe() reads back to the same values.
[[nodiscard]] std::string to_json(const Recipe& recipe);

/// One key of a recipe, for help texts.
struct RecipeKey {
  std::string key;    ///< E.g. "tcs.cell_mm".
  std::string range;  ///< What it accepts, in words.
  std::string doc;
};
/// Every key, in the order of to_json().
[[nodiscard]] std::vector<RecipeKey> recipe_keys();

/// What join() needs to know. Of the lengths left open, layer, columns and bridges are as thick as the defaults of
/// JointParams, or as print.wall_mm where that is more; columns stand as far apart as the default, or as twice their
/// diameter where that is more.
[[nodiscard]] JointParams joint_params(const Recipe& recipe);
/// The same run with every such length as a number: what a report records.
[[nodiscard]] Recipe with_joint_lengths(Recipe recipe);

/// What the numbers must be to each other (layers, columns and bridges of joints no thinner than print.wall_mm), and
/// that everything `infill` makes is at least two voxels thick. A voxel of 0 checks the first alone. Only features that
/// `infill` uses matter. @throws Error BadRecipe, naming the key.
void check_recipe(const Recipe& recipe, double voxel_mm, InfillKind infill = InfillKind::Hybrid);
/// The coarsest voxel that check_recipe() lets pass, mm, to three digits; infinity if any does.
[[nodiscard]] double most_voxel_mm(const Recipe& recipe, InfillKind infill);
/// What find_cores() needs to know: numbers of the partition, and a diameter that holds two fibres and a wall around.
[[nodiscard]] CoreParams core_params(const Recipe& recipe);
/// The thinnest feature that `infill` makes, mm; infinity if it makes none.
[[nodiscard]] double thinnest_mm(const Recipe& recipe, InfillKind infill = InfillKind::Hybrid);

}  // namespace fibrolite
