// SPDX-License-Identifier: GPL-3.0-or-later
#include "options.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

#include "exit_codes.h"
#include "fibrolite/ops/text.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& option, const std::string& value, const std::string& hint) {
  throw UsageError(option + " cannot be '" + value + "'", "command line", hint);
}

/// The whole text as a number. CLI11's own conversion depends on the locale and lets nan through.
template <class Number>
std::optional<Number> number(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

CLI::Option* add_positive(CLI::App& command, const std::string& name, std::optional<double>& target,
                          const std::string& help) {
  return command.add_option_function<std::string>(
      name,
      [name, &target](const std::string& text) {
        target = number<double>(text);
        if (!target || !std::isfinite(*target) || *target <= 0) refuse(name, text, "use a number above 0");
      },
      help);
}

/// One of a list of names.
template <class Value>
CLI::Option* add_choice(CLI::App& command, const std::string& name,
                        const std::vector<std::pair<std::string, Value>>& choices, std::function<void(Value)> take,
                        const std::string& help) {
  return command.add_option_function<std::string>(
      name,
      [name, choices, take](const std::string& text) {
        std::vector<std::string> names;
        std::string all;
        for (const auto& [choice, value] : choices) {
          if (choice == text) return take(value);
          names.push_back(choice);
          all += (all.empty() ? "" : ", ") + choice;
        }
        refuse(name, text, "did you mean " + nearest_name(text, names) + "? There are: " + all);
      },
      help);
}

/// "4G", "500M", "1.5GiB"; steps of 1024; a plain number is bytes.
std::optional<double> memory_size(std::string text) {
  for (const char* suffix : {"iB", "B"})
    if (text.ends_with(suffix)) {
      text.erase(text.size() - std::string(suffix).size());
      break;
    }
  double factor = 1;
  const std::string units = "KMGT";
  if (!text.empty()) {
    const auto power = units.find(text.back() >= 'a' ? static_cast<char>(text.back() - 'a' + 'A') : text.back());
    if (power != std::string::npos) {
      factor = std::pow(1024.0, static_cast<double>(power + 1));
      text.pop_back();
    }
  }
  const std::optional<double> value = number<double>(text);
  if (!value || !std::isfinite(*value) || *value <= 0) return std::nullopt;
  return *value * factor;
}

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::string listed(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : " ") + word;
  return all;
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::error_code error;
  if (!in || fs::is_directory(file, error))
    throw Error(Code::BadRecipe, "the recipe cannot be read", file.string(), "check the path");
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

InfillKind RecipeOptions::infill() const { return given_infill.value_or(usual_infill(preset)); }

Recipe RecipeOptions::load() const {
  Recipe recipe = fibrolite::preset(preset);
  if (file) recipe = parse_recipe(content_of(*file), recipe, file->string());
  for (const std::string& assignment : assignments) recipe = set(recipe, assignment);
  return seed ? set(recipe, "seed=" + std::to_string(*seed)) : recipe;
}

double RunOptions::allowed_bytes() const {
  if (memory_bytes) return *memory_bytes;
  double bytes = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  // A container may be given less; the file reads "max" where it is not.
  double limit = 0;
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> limit && limit > 0) bytes = std::min(bytes, limit);
  return bytes;
}

void add_options(CLI::App& command, ModelOptions& options) {
  command.add_option("MODEL", options.path, "Model: .stl .obj .ply .off .3mf, or a level set in .vdb")->required();
  add_positive(command, "--size", options.prepare.size_mm, "Scale so that the longest side is this long")
      ->type_name("MM");
  add_choice<double>(
      command, "--unit", {{"mm", 1.0}, {"cm", 10.0}, {"m", 1000.0}, {"in", 25.4}},
      [&](double mm) { options.prepare.unit_mm = mm; },
      "Unit of MODEL: mm cm m in (default: what the file says, else mm)")
      ->type_name("UNIT");
  add_choice<Up>(
      command, "--up",
      {{"x", Up::X}, {"y", Up::Y}, {"z", Up::Z}, {"-x", Up::MinusX}, {"-y", Up::MinusY}, {"-z", Up::MinusZ}},
      [&](Up up) { options.up = up; }, "Which way is up, for loads and printing: x y z -x -y -z (default z)")
      ->type_name("AXIS");
}

void add_options(CLI::App& command, RecipeOptions& options) {
  command.add_option("--preset", options.preset, "Recipe to start from: " + listed(preset_names()))->type_name("NAME");
  command.add_option("--recipe", options.file, "Recipe file; its keys replace those of the preset")
      ->type_name("FILE.json");
  command.add_option("--set", options.assignments, "One key of the recipe, e.g. tcs.cell_mm=5; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command
      .add_option_function<std::string>(
          "--seed",
          [&](const std::string& text) {
            options.seed = number<std::uint64_t>(text);
            if (!options.seed) refuse("--seed", text, "use a whole number, 0 or more");
          },
          "Of every random number (default 1)")
      ->type_name("N");
}

void add_options(CLI::App& command, RunOptions& options) {
  command
      .add_option_function<std::string>(
          "--threads",
          [&](const std::string& text) {
            const std::optional<int> count = number<int>(text);
            if (!count || *count < 1 || *count > 4096) refuse("--threads", text, "use a whole number from 1 to 4096");
            options.threads = *count;
          },
          "Threads to use (default: all); the result is the same on any number")
      ->type_name("N");
  command
      .add_option_function<std::string>(
          "--max-memory",
          [&](const std::string& text) {
            options.memory_bytes = memory_size(text);
            if (!options.memory_bytes) refuse("--max-memory", text, "use a size like 500M or 4G");
          },
          "Refuse work that would need more (default: the memory of this machine)")
      ->type_name("4G");
  command.add_flag("--overwrite", options.overwrite, "Replace outputs that exist");
  command.add_flag("--quiet", options.quiet, "Print nothing but errors");
  add_choice<LogFormat>(
      command, "--log", {{"text", LogFormat::Text}, {"json", LogFormat::Json}},
      [&](LogFormat format) { options.log = format; }, "Progress and log on stderr as text or json (one object a line)")
      ->type_name("FORMAT");
}

void add_options(CLI::App& command, OutputOptions& options, const std::vector<std::string>& endings) {
  command.add_option("-o,--output", options.files, "Output: " + listed(endings) + "; may be repeated")
      ->required()
      ->type_name("OUT")
      ->allow_extra_args(false)
      ->each([endings](const std::string& file) { require_ending("-o", file, endings); });
  command
      .add_option("--report", options.report,
                  "Report (default: OUT.report.json for the first OUT, without its ending unless another "
                  "output has its report there)")
      ->type_name("FILE.json");
}

void add_voxel(CLI::App& command, std::optional<double>& voxel_mm, const std::string& help) {
  add_length(command, "--voxel", voxel_mm, help);
}

void add_length(CLI::App& command, const std::string& name, std::optional<double>& length_mm, const std::string& help) {
  add_positive(command, name, length_mm, help)->type_name("MM");
}

std::string_view name_of(InfillKind kind) {
  return std::find_if(infill_names.begin(), infill_names.end(), [&](const InfillName& n) { return n.kind == kind; })
      ->name;
}

void add_infill(CLI::App& command, RecipeOptions& options) {
  std::vector<std::pair<std::string, InfillKind>> choices;
  std::string help = "What fills the body (default: hybrid; with --preset peer-tcs, tcs):";
  for (const InfillName& infill : infill_names) {
    choices.emplace_back(infill.name, infill.kind);
    help += "\n  " + std::string(infill.name) + ": " + std::string(infill.help);
  }
  add_choice<InfillKind>(
      command, "--infill", choices, [&](InfillKind chosen) { options.given_infill = chosen; }, help)
      ->type_name("NAME");
}

void require_ending(const std::string& option, const fs::path& file, const std::vector<std::string>& endings) {
  const std::string ending = lower(file.extension().string());
  if (std::find(endings.begin(), endings.end(), ending) == endings.end())
    refuse(option, file.string(), "its name must end in " + listed(endings));
}

void add_file(CLI::App& command, const std::string& name, std::optional<fs::path>& file, const std::string& ending,
              const std::string& help) {
  command.add_option(name, file, help)->type_name("FILE" + ending)->each([name, ending](const std::string& given) {
    require_ending(name, given, {ending});
  });
}

}  // namespace fibrolite::cli
