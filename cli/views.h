// SPDX-License-Identifier: GPL-3.0-or-later
// What a picture of the result shows.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/picture.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace fibrolite::cli {

/// A file, and what shall be seen in it.
struct PictureOptions {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> views;  ///< Of the files, in their order; those that are left out are "cut".

  [[nodiscard]] std::string view(std::size_t file) const { return file < views.size() ? views[file] : "cut"; }
};
/// --picture and --view, each as often as wanted. Bad values throw UsageError while the command line is parsed.
void add_pictures(CLI::App& command, PictureOptions& options);

/// "cut", "whole", "part:ID", "joint:NUMBER" or "joint:NUMBER:back"; parts and joints as the report lists them.
/// @throws Error BadRecipe: there is no such part or joint.
[[nodiscard]] PictureParams picture_params(const std::string& view, const Hybrid& hybrid, const Recipe& recipe);

/// The legend of a run's pictures: the colour of each part, into the report.
void note_colors(Report& report);

}  // namespace fibrolite::cli
