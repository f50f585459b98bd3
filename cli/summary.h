// SPDX-License-Identifier: GPL-3.0-or-later
// What a run made, for a reader.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fibrolite/ops/report.h"

namespace fibrolite::cli {

/// Parts and files of a partition.
void print_parts(const Report& report, const std::vector<std::filesystem::path>& files);
/// Parts, solid, mesh, time, memory and files of a run whose outputs are in place; a failing standard output is let be.
void print_summary(const Report& report, const std::vector<std::filesystem::path>& files);
/// Layers, time, memory and files of a run that sliced.
void print_layers(const Report& report, const std::vector<std::filesystem::path>& files);
/// How many layers of how many pixels; one plate or more.
[[nodiscard]] std::string layers_text(const std::vector<PlateReport>& plates);

}  // namespace fibrolite::cli
