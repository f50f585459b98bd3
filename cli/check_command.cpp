// SPDX-License-Identifier: GPL-3.0-or-later
// check: is this mesh or solid fit to print?
#include <filesystem>
#include <memory>

#include "commands.h"
#include "fibrolite/ops/inspect.h"
#include "terminal.h"

namespace fibrolite::cli {

void add_check_command(CLI::App& program) {
  const auto file = std::make_shared<std::filesystem::path>();
  CLI::App& command = *program.add_subcommand("check", "Is this mesh or solid fit to print? JSON on stdout");
  command.add_option("FILE", *file, "Mesh (.stl .obj .ply .off .3mf) or level set (.vdb)")->required();
  command.callback([file] {
    std::string json = inspect_file(*file);
    if (!json.ends_with('\n')) json += '\n';
    print(json);
  });
}

}  // namespace fibrolite::cli
