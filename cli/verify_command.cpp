// SPDX-License-Identifier: GPL-3.0-or-later
// verify: parts by shape, judged by finite elements; the stresses as files for other programs.
#include <cmath>
#include <limits>
#include <memory>

#include "commands.h"
#include "fibrolite/ops/stance.h"
#include "fibrolite/ops/strength.h"
#include "fibrolite/ops/stress_field.h"
#include "fibrolite/ops/text.h"
#include "job.h"
#include "options.h"
#include "summary.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

struct VerifyOptions {
  ModelOptions model;
  RecipeOptions recipe;
  RunOptions run;
  OutputOptions output;
  bool solid = false;
  std::optional<double> voxel_mm;
  int coarsen = 0;
};

constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

PartReport part_report(const Part& part) {
  PartReport row;
  row.id = part.id();
  row.kind = name(part.kind());
  row.volume_mm3 = part.volume_mm3();
  row.lumen_mm3 = row.infill_volume_mm3 = not_measured;
  row.centroid_mm = part.centroid_mm();
  row.axis = part.axis().mean();
  row.diameter_mm = part.diameter_mm();
  row.stress = part.stress();
  row.reason = part.reason();
  return row;
}

/// The body, taken as solid: its parts and their stresses.
StressField judge_body(const Model& model, const Recipe& recipe, Report& report, const Context& context) {
  Stopwatch stage(report.stages);
  const FoundParts found = find_parts(model, recipe, report, context.part(0, 0.5, ""));
  Verification verified = stage("verify", [&] {
    return verify(found.proxy, found.partition, in_stance(recipe.verify), recipe.material,
                  context.part(0.5, 1, "verify"));
  });
  report.verification = {verified.tets,     verified.dof,         verified.iterations,
                         verified.residual, verified.equilibrium, verified.selected};
  report.warnings.insert(report.warnings.end(), verified.notes.begin(), verified.notes.end());
  for (const Part& part : placed(verified.parts, found.proxy.frame).parts) report.parts.push_back(part_report(part));
  return std::move(verified.field);
}

/// The printed solid under the same load cases; a hybrid brings the stresses of the body along.
StressField judge_solid(const VerifyOptions& options, const Model& model, const Recipe& recipe, Report& report,
                        const Context& context) {
  const double voxel = choose_voxel(bounds(model.mesh), recipe, options.recipe.infill(), options.voxel_mm);
  check_memory(model.mesh, voxel, recipe, options.recipe.infill(), options.run);
  const HybridizeParams params{.recipe = recipe, .infill = options.recipe.infill(), .voxel_mm = voxel, .steps = false};
  Hybrid hybrid = hybridize(model, params, report, context.part(0, 0.5, "fill"));
  report.infill = name_of(options.recipe.infill());
  Stopwatch stage(report.stages);
  report.strength = stage("strength", [&] {
    return strength(hybrid, recipe, {.coarsen = options.coarsen}, context.part(0.5, 1, "strength"));
  });
  if (const double thinnest = thinnest_mm(recipe, options.recipe.infill()), cell = report.strength.front().cell_mm;
      thinnest < 5 * cell) {
    const double across = thinnest / cell;
    report.warnings.push_back("the thinnest members are " + number_text(across) + " cells thick: they bend about " +
                              number_text(std::round(130 / (across * across))) +
                              " % too little; compare solids at the same cell, or take a finer --voxel");
  }
  return std::move(hybrid.field);
}

/// Options that matter to the printed solid alone are not ignored without a word.
void note_unused(const CLI::App& command, std::vector<std::string>& warnings) {
  for (const char* option : {"--infill", "--voxel", "--coarsen"})
    if (command.count(option) > 0) warnings.push_back(std::string(option) + " changes nothing without --solid");
}

void run_verify(const VerifyOptions& options, const CLI::App& command) {
  Recipe recipe = options.recipe.load();
  recipe.verify.up = direction(options.model.up);
  recipe.verify.keep_field = true;
  if (options.solid) check_recipe(recipe, options.voxel_mm.value_or(0), options.recipe.infill());
  Job job("verify", recipe, options.model, options.run, options.output);
  const Context& context = job.context();
  Report& report = job.report;
  Stopwatch stage(report.stages);
  if (!options.solid) note_unused(command, report.warnings);

  const Model model = load_model(options.model, report, context.part(0, 0.1, "read"));
  report.model.volume_mm3 = signed_volume(model.mesh);
  recipe.verify.loads = with_paint(std::move(recipe.verify.loads), model.painted);
  StressField field;
  if (options.solid) field = judge_solid(options, model, recipe, report, context.part(0.1, 0.9, ""));
  if (field.cases.empty()) {
    Report body = report;  // a solid of one structure has no parts: the body's are only for the fields
    body.stages.clear();
    field = judge_body(model, recipe, options.solid ? body : report, context.part(options.solid ? 0.9 : 0.1, 0.95, ""));
  }

  stage("write", [&] {
    for (const fs::path& file : options.output.files) {
      const bool deck = file.extension() == ".inp" || file.extension() == ".INP";
      if (deck) write_inp(job.outputs.place(file), field, context);
      if (!deck) write_vtu(job.outputs.place(file), field, context);
    }
  });
  job.finish();
  if (!options.run.quiet) print_parts(report, job.targets);
}

}  // namespace

void add_verify_command(CLI::App& program) {
  const auto options = std::make_shared<VerifyOptions>();
  CLI::App& command =
      *program.add_subcommand("verify", "Parts and their stresses, for ParaView (.vtu) or CalculiX (.inp)");
  add_options(command, options->model);
  add_options(command, options->output, {".vtu", ".inp"});
  command.add_flag("--solid", options->solid, "Also the printed solid: what it carries and where it breaks first");
  add_infill(command, options->recipe);
  add_voxel(command, options->voxel_mm, "Voxel edge of the solid (default: as for generate)");
  command
      .add_option("--coarsen", options->coarsen,
                  "Samples along the edge of a finite element of the solid: 1, 2, 4 (default: the finest of at most "
                  "four million elements)")
      ->check(CLI::IsMember({1, 2, 4}));
  add_options(command, options->recipe);
  add_options(command, options->run);
  command.callback([options, &command] { run_verify(*options, command); });
}

}  // namespace fibrolite::cli
