// SPDX-License-Identifier: GPL-3.0-or-later
// The program: a thin hand around the library. Every way to fail ends here, as one line and one exit code.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <new>
#include <string>
#include <vector>

#include "commands.h"
#include "exit_codes.h"
#include "fibrolite/ops/report.h"
#include "fibrolite/ops/text.h"
#include "outputs.h"
#include "terminal.h"

namespace fibrolite::cli {
namespace {

std::vector<std::string> command_names(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

/// The first word decides the command; CLI11 would only say that it did not expect it.
void check_command_name(const CLI::App& program, int argc, char** argv) {
  const std::vector<std::string> names = command_names(program);
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  if (argc < 2) throw UsageError("no command given", "command line", "use one of: " + all);
  const std::string word = argv[1];
  if (word.starts_with('-') || std::find(names.begin(), names.end(), word) != names.end()) return;
  throw UsageError("unknown command '" + word + "'", "command line",
                   "did you mean " + nearest_name(word, names) + "? There are: " + all);
}

/// What CLI11 objects to, with the option that may have been meant.
UsageError as_usage_error(const CLI::App& program, const CLI::ParseError& error) {
  const auto chosen = program.get_subcommands();
  const CLI::App& command = chosen.empty() ? program : *chosen.front();
  const std::string help = (chosen.empty() ? "" : command.get_name() + " ") + "--help";
  // A misspelt option may first show as a missing required one: look at what was left over in any case.
  for (const std::string& left : command.remaining()) {
    if (!left.starts_with('-')) continue;
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
      if (option->nonpositional()) names.push_back(option->get_name());
    const std::string name = left.substr(0, left.find('='));
    return {"unknown option " + name, "command line",
            "did you mean " + nearest_name(name, names) + "? See fibrolite " + help};
  }
  return {error.what(), "command line", "see fibrolite " + help};
}

int run(int argc, char** argv) {
  CLI::App program("Fibrolite " + version() + ": hybrid interior structures for 3D-printed parts", "fibrolite");
  program.set_version_flag("--version", "fibrolite " + version());
  program.require_subcommand(1);
  add_generate_command(program);
  add_partition_command(program);
  add_verify_command(program);
  add_slice_command(program);
  add_check_command(program);
  add_recipe_command(program);
  check_command_name(program, argc, argv);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);  // --help, --version
    throw as_usage_error(program, error);
  }
  return Done;
}

int fail(const std::string& message, ExitCode code) {
  print_error(with_asked_names(message));
  return code;
}

int run_and_report(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& problem) {
    // What a cancelled stage or a child process complains about then is only an echo.
    if (interrupted()) return fail(std::string(cancelled_line()), Interrupted);
    if (const auto* error = dynamic_cast<const Error*>(&problem)) {
      const bool later = error->code() == Code::Io && resumable();
      return fail(std::string(error->what()).append(later ? "; then run again with --resume to go on" : ""),
                  exit_code(error->code()));
    }
    if (dynamic_cast<const UsageError*>(&problem) != nullptr) return fail(problem.what(), Usage);
    if (dynamic_cast<const std::bad_alloc*>(&problem) != nullptr)
      return fail("out of memory (allocation failed); use a larger --voxel", OutOfMemory);
    return fail(std::string("internal error: ") + problem.what() + "; please report it", Bug);
  }
}

}  // namespace
}  // namespace fibrolite::cli

int main(int argc, char** argv) {
  fibrolite::cli::handle_signals();
  return fibrolite::cli::run_and_report(argc, argv);
}
