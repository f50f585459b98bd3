// SPDX-License-Identifier: GPL-3.0-or-later
// recipe: print the full recipe as JSON, or what each key means.
#include <memory>

#include "commands.h"
#include "options.h"
#include "terminal.h"

namespace fibrolite::cli {
namespace {

std::string explained() {
  std::string text;
  for (const RecipeKey& about : recipe_keys()) text += about.key + "\n    " + about.doc + "\n    " + about.range + "\n";
  text += "material\n    all four by name\n   ";
  for (const NamedMaterial& row : materials()) text += " " + row.name;
  return text + "\n";
}

}  // namespace

void add_recipe_command(CLI::App& program) {
  struct Options {
    RecipeOptions recipe;
    bool keys = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App& command = *program.add_subcommand("recipe", "Print the full recipe as JSON");
  add_options(command, options->recipe);
  command.add_flag("--keys", options->keys, "Print what each key means and accepts instead");
  command.callback([options] {
    if (options->keys) return print(explained());
    const Recipe recipe = options->recipe.load();
    check_recipe(recipe, 0);
    print(to_json(recipe) + "\n");
  });
}

}  // namespace fibrolite::cli
