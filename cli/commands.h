// SPDX-License-Identifier: GPL-3.0-or-later
// The commands. Each adds itself to the program; its work runs when the command line has been parsed.
#pragma once

#include <CLI/CLI.hpp>

namespace fibrolite::cli {

void add_generate_command(CLI::App& program);
void add_partition_command(CLI::App& program);
void add_verify_command(CLI::App& program);
void add_slice_command(CLI::App& program);
void add_check_command(CLI::App& program);
void add_recipe_command(CLI::App& program);

}  // namespace fibrolite::cli
