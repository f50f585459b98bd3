// SPDX-License-Identifier: GPL-3.0-or-later
// What commands share on the command line. Options are bound straight to the structs that the library takes.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fibrolite/ops/infill/infill.h"
#include "fibrolite/ops/prepare.h"
#include "fibrolite/ops/recipe.h"

namespace fibrolite::cli {

enum class LogFormat { Text, Json };

struct ModelOptions {
  std::filesystem::path path;
  PrepareParams prepare;
  Up up = Up::Z;
};
struct RecipeOptions {
  std::string preset = preset_names().front();
  std::optional<std::filesystem::path> file;
  std::vector<std::string> assignments;
  std::optional<std::uint64_t> seed;
  std::optional<InfillKind> given_infill;
  /// Preset, then the file, then each --set, then --seed. @throws Error BadRecipe.
  [[nodiscard]] Recipe load() const;
  /// --infill, else the preset's usual one.
  [[nodiscard]] InfillKind infill() const;
};
struct RunOptions {
  int threads = 0;                     ///< 0: as many as the machine has.
  std::optional<double> memory_bytes;  ///< --max-memory.
  bool overwrite = false, quiet = false, dry_run = false;
  LogFormat log = LogFormat::Text;
  /// What the run may use: --max-memory, else all the memory of this machine (or container), bytes.
  [[nodiscard]] double allowed_bytes() const;
};
/// Where results go.
struct OutputOptions {
  std::vector<std::filesystem::path> files;
  std::optional<std::filesystem::path> report;  ///< --report.
};

// Bad values throw UsageError while the command line is parsed.
void add_options(CLI::App& command, ModelOptions& options);
void add_options(CLI::App& command, RecipeOptions& options);
void add_options(CLI::App& command, RunOptions& options);
/// `endings`: what an output may end with, lower case, with the dot.
void add_options(CLI::App& command, OutputOptions& options, const std::vector<std::string>& endings);
void add_voxel(CLI::App& command, std::optional<double>& voxel_mm, const std::string& help);
/// A length above 0, mm.
void add_length(CLI::App& command, const std::string& name, std::optional<double>& length_mm, const std::string& help);
void add_infill(CLI::App& command, RecipeOptions& options);
[[nodiscard]] std::string_view name_of(InfillKind kind);
/// @throws UsageError: the file's ending is none of these (lower case, with the dot).
void require_ending(const std::string& option, const std::filesystem::path& file,
                    const std::vector<std::string>& endings);
/// An extra output with one fixed ending.
void add_file(CLI::App& command, const std::string& name, std::optional<std::filesystem::path>& file,
              const std::string& ending, const std::string& help);

}  // namespace fibrolite::cli
