// SPDX-License-Identifier: GPL-3.0-or-later
// generate: model in, hybrid solid out.
#include <algorithm>
#include <memory>

#include "commands.h"
#include "exit_codes.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/mesh_layers.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/solid_io.h"
#include "fibrolite/surface.h"
#include "fibrolite/to_solid.h"
#include "job.h"
#include "options.h"
#include "run.h"
#include "summary.h"
#include "views.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

bool is_vdb(const fs::path& file) { return file.extension() == ".vdb" || file.extension() == ".VDB"; }

struct GenerateOptions {
  ModelOptions model;
  RecipeOptions recipe;
  RunOptions run;
  OutputOptions output;
  std::optional<double> voxel_mm;
  PictureOptions pictures;
  std::optional<fs::path> steps;
  bool fix = false;

  /// What cannot be made slab by slab; empty if all can.
  [[nodiscard]] std::string needs_whole(const Recipe& made_by) const {
    for (const fs::path& file : output.files)
      if (is_vdb(file)) return file.filename().string();
    if (steps) return "--steps";
    if (!pictures.files.empty()) return "--picture";
    if (fix) return "--fix";
    return made_by.print.drain_mm.value_or(0) > 0 ? "print.drain_mm" : "";
  }
  [[nodiscard]] Extras extras(const Recipe& made_by) const {
    return {.mends = fix || made_by.print.drain_mm.value_or(0) > 0,
            .pictures = !pictures.files.empty(),
            .steps = steps.has_value()};
  }
  /// What may be written besides the outputs and their report.
  [[nodiscard]] std::vector<fs::path> more_files() const {
    std::vector<fs::path> all = pictures.files;
    if (steps) all.push_back(*steps);
    return all;
  }
};

/// Of a file: what its format takes for a triangle and half a vertex, or a voxel; compressed files as measured.
double expected_bytes(const fs::path& file, const Prediction& expected) {
  const std::string ending = file.extension().string();
  if (is_vdb(file)) return 3.3 * expected.active_voxels;
  const double triangle = ending == ".ply"                       ? 19
                          : ending == ".obj" || ending == ".off" ? 39
                          : ending == ".3mf"                     ? 14
                                                                 : 50;
  return triangle * expected.triangles;
}

/// Of the processor, as measured.
double expected_s(const fs::path& file, const Prediction& expected) {
  const std::string ending = file.extension().string();
  if (is_vdb(file)) return 40e-9 * expected.active_voxels;
  const double triangle = ending == ".obj" ? 150e-9 : ending == ".off" ? 120e-9 : ending == ".3mf" ? 620e-9 : 62e-9;
  return triangle * expected.triangles;
}

std::string plan(const GenerateOptions& options, const Model& model, const HybridizeParams& params,
                 const fs::path& report) {
  const Vec3d size = bounds(model.mesh).size();
  std::string text = "model     " + options.model.path.string() + ", " + std::to_string(model.mesh.triangles.size()) +
                     " triangles, " + number_text(size.x) + " x " + number_text(size.y) + " x " + number_text(size.z) +
                     " mm\n";
  text += "infill    " + std::string(name_of(options.recipe.infill())) + "\n";
  text += "voxel     " + number_text(*params.voxel_mm) + " mm\n";
  Extras extras = options.extras(params.recipe);
  extras.open = is_open(model.mesh);
  const Prediction expected = predict(model.mesh, *params.voxel_mm, params.recipe, params.infill, extras);
  text += "solid     about " + number_text(expected.active_voxels / 1e6, 2) + " million voxels, a mesh of " +
          number_text(expected.triangles / 1e6, 2) + " million triangles\n";
  const double memory = params.slabs ? params.slabs->usual_bytes : expected.memory_bytes;
  text += "memory    about " + memory_text(memory) + " of ";
  text += memory_text(options.run.allowed_bytes());
  if (params.slabs) text += ", in " + std::to_string(params.slabs->borders.size() - 1) + " slabs";
  text += "\n";
  double cpu_s = expected.cpu_s + (params.slabs ? expected.slabs_s : 0);
  for (const fs::path& file : options.output.files) cpu_s += expected_s(file, expected);
  cpu_s *= machine_times();
  text += time_text(cpu_s);
  for (const fs::path& file : options.output.files)
    text += "output    " + file.string() + ", about " + memory_text(expected_bytes(file, expected)) + "\n";
  text += "output    " + report.string() + "\n";
  return text + "dry run: nothing was written\n";
}

/// Shell, joints, then each part in its own colour.
PointColor colors(const Hybrid& hybrid, double shell_mm) {
  std::vector<Shape> layers_and_columns;
  for (const Joint& joint : hybrid.joints) layers_and_columns.push_back(joint.shape);
  std::vector<Rgb> by_part;
  for (const Part& part : hybrid.parts.parts) by_part.push_back(part_color(part.id(), part.kind() == Kind::Column));
  return [body = hybrid.body, joints = unite(layers_and_columns), labels = hybrid.parts.labels, by_part,
          shell_mm](Vec3d p) {
    if (body(p) > -shell_mm) return shell_color;
    if (joints(p) <= 0) return joint_color;
    return by_part.at(static_cast<std::size_t>(labels.label(p)));
  };
}

int longest_axis(const Box3d& box) {
  const Vec3d size = box.size();
  return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

/// Of the solid, or of slab after slab.
void make_surface(Hybrid& hybrid, SurfaceLayers& layers, Report& report, const Context& context) {
  if (hybrid.stream) {
    SolidStream& stream = *hybrid.stream;
    const auto count = static_cast<double>(stream.slabs());
    for (std::size_t i = 0; i < stream.slabs(); ++i) {
      const auto n = static_cast<double>(i);
      const SolidStream::Slab slab = stream.slab(i, context.part(n / count, (n + 0.7) / count, "solid"));
      layers.add(slab.solid, slab.range, context.part((n + 0.7) / count, (n + 1) / count, "surface"));
    }
    stream.finish(report);
  } else {
    layers.add(hybrid.solid, context);
  }
  layers.finish(report.solid.volume_mm3);
}

void generate(const GenerateOptions& options) {
  HybridizeParams params;
  params.recipe = options.recipe.load();
  params.infill = options.recipe.infill();
  params.steps = options.steps.has_value();
  params.fix = options.fix;
  params.recipe.verify.up = direction(options.model.up);
  check_recipe(params.recipe, options.voxel_mm.value_or(0), options.recipe.infill());

  if (options.pictures.views.size() > options.pictures.files.size())
    throw UsageError("more views than pictures", "--view", "give each a --picture");
  Job job("generate", params.recipe, options.model, options.run, options.output, options.more_files());
  const Context& context = job.context();
  Outputs& outputs = job.outputs;
  Report& report = job.report;
  report.infill = name_of(options.recipe.infill());
  Stopwatch stage(report.stages);

  Model model = load_model(options.model, report, context.part(0, 0.05, "read"));
  params.recipe.verify.loads = with_paint(std::move(params.recipe.verify.loads), model.painted);
  params.voxel_mm = choose_voxel(bounds(model.mesh), params.recipe, options.recipe.infill(), options.voxel_mm);
  check_recipe(params.recipe, *params.voxel_mm, options.recipe.infill());
  const int axis = longest_axis(bounds(model.mesh));
  params.slabs = fit_into_memory(
      model.mesh, *params.voxel_mm, params.recipe, options.recipe.infill(), options.run,
      [&](double voxel_mm) { return SlabNeeds{.axis = axis, .margin_mm = 8 * voxel_mm, .surface = true}; }, 0,
      options.needs_whole(params.recipe), options.extras(params.recipe));
  params.most_bytes = options.run.allowed_bytes();
  if (options.run.dry_run) return print(plan(options, model, params, job.report_path));

  // Each thing goes as soon as nothing needs it: at the end only the surface and its check are in memory.
  Hybrid hybrid = hybridize(model, params, report, context.part(0.05, 0.75, "fill"));
  model = {};
  if (options.pictures.files.empty()) hybrid.body = {};
  stage("write solid", [&] {
    if (std::ranges::any_of(options.output.files, is_vdb)) hybrid.solid = narrowed(std::move(hybrid.solid));
    for (const fs::path& file : options.output.files)
      if (is_vdb(file)) write_vdb(outputs.place(file), {{"solid", hybrid.solid}}, context.part(0.75, 0.78, "write"));
    if (options.steps) write_vdb(outputs.place(*options.steps), hybrid.steps, context.part(0.78, 0.8, "write"));
  });
  hybrid.steps.clear();
  const auto scratch =
      params.slabs ? std::optional(outputs.place(options.output.files.front()).parent_path()) : std::nullopt;
  SurfaceLayers layers({.voxel_mm = *params.voxel_mm}, {.axis = axis}, scratch);
  stage("surface", [&] { make_surface(hybrid, layers, report, context.part(0.8, 0.88, "surface")); });
  if (const auto& files = options.pictures.files; !files.empty()) {
    note_colors(report);
    stage("picture", [&] {
      const Mesh mesh = gathered(layers, context.part(0.88, 0.88, "picture"));
      const PointColor color = colors(hybrid, params.recipe.shell.thickness_mm);
      const double each = 0.04 / static_cast<double>(files.size());
      for (std::size_t i = 0; i < files.size(); ++i) {
        const double from = 0.88 + each * static_cast<double>(i);
        const PictureParams view = picture_params(options.pictures.view(i), hybrid, params.recipe);
        write_png(outputs.place(files[i]),
                  picture(mesh, hybrid.solid, color, view, context.part(from, from + each, "picture")));
      }
    });
  }
  hybrid = {};
  report.mesh = stage("check mesh", [&] { return check(layers, context.part(0.92, 0.94, "check")); });
  stage("write mesh", [&] {
    for (const fs::path& file : options.output.files)
      if (!is_vdb(file)) write_mesh(outputs.place(file), layers, context.part(0.94, 1, "write"));
  });
  job.finish();
  if (!options.run.quiet) print_summary(report, job.targets);
}

}  // namespace

void add_generate_command(CLI::App& program) {
  const auto options = std::make_shared<GenerateOptions>();
  CLI::App& command = *program.add_subcommand("generate", "Model in, hybrid solid out");
  std::vector<std::string> endings = writable_mesh_endings();
  endings.emplace_back(".vdb");
  add_options(command, options->model);
  add_options(command, options->output, endings);
  add_infill(command, options->recipe);
  add_voxel(command, options->voxel_mm,
            "Voxel edge (default: the smallest of longest side / 400, the recipe's thinnest feature / 3, and what "
            "necks of print.wall_mm are told at)");
  add_options(command, options->recipe);
  add_pictures(command, options->pictures);
  add_file(command, "--steps", options->steps, ".vdb", "Every step as a named grid");
  command.add_flag("--fix", options->fix,
                   "Mend what the print checks find: thin walls, small gaps, overhangs, closed voids");
  command.add_flag("--dry-run", options->run.dry_run, "Say what would be done, write nothing");
  add_options(command, options->run);
  command.callback([options] { generate(*options); });
}

}  // namespace fibrolite::cli
