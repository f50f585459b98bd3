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
#include "fibrolite/ops/infill/mfs.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/ops/joint.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/ops/verify.h"

namespace fibrolite {

struct ShellParams {
  double thickness_mm = 1.0;  ///< 2 voxels or more.
};
struct Recipe {
  ShellParams shell;
  PartitionParams partition;
  VerifyParams verify;
  MfsParams mfs;
  TcsParams tcs;
  JointParams joint;
  Material material;
  std::uint64_t seed = 1;
};

/// Names for --preset, first is the default.
[[nodiscard]] std::vector<std::string> preset_names();
/// @throws Error BadRecipe: unknown preset (with the nearest name).
[[nodiscard]] Recipe preset(std::string_view name);

/// Strict: an unknown key, a wrong type or a value out of range is an error that names the place and the nearest key.
/// Keys left out keep the value of `base`. @throws Error BadRecipe.
[[nodiscard]] Recipe parse_recipe(std::string_view json, const Recipe& base, std::string_view source_name);
/// "tcs.cell_mm=5": path and value as in --set. @throws Error BadRecipe.
[[nodiscard]] Recipe set(const Recipe& base, std::string_view assignment);
/// The whole recipe as pretty JSON that parse_recipe() reads back to the same values.
[[nodiscard]] std::string to_json(const Recipe& recipe);

/// Ranges that need the voxel: everything is at least two voxels thick. @throws Error BadRecipe, naming the key.
void check_recipe(const Recipe& recipe, double voxel_mm);
/// The thinnest feature of the recipe, mm.
[[nodiscard]] double thinnest_mm(const Recipe& recipe);

}  // namespace fibrolite
