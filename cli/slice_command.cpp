// SPDX-License-Identifier: GPL-3.0-or-later
// slice: layers for a printer, straight from the volume; no mesh is made.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "commands.h"
#include "exit_codes.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/solid_io.h"
#include "fibrolite/to_solid.h"
#include "job.h"
#include "options.h"
#include "resume.h"
#include "slice_plates.h"
#include "summary.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

struct SliceOptions {
  ModelOptions model;
  RecipeOptions recipe;
  RunOptions run;
  OutputOptions output;
  std::optional<double> voxel_mm, layer_mm, pixel_mm;
  std::optional<Printer> printer;
  bool tile = false, resume = false;
  int planes = 1;

  [[nodiscard]] bool from_solid() const { return model.path.extension() == ".vdb" || model.path.extension() == ".VDB"; }
};

/// What is cut into layers. Of a model it is only known how large it is until fill() has made it.
constexpr double process_bytes = 50e6;  // of a program that has begun

struct Source {
  Box3d box;                      // in the frame of the print
  double area_mm2 = 0;            // of its surfaces: what the size of a file depends on
  double curls = 1.3;             // how many more points its contours have than smooth walls, at a pixel
  Prediction expected;            // of a model
  double memory = 0;              // to make it, bytes
  std::optional<SlabPlan> slabs;  // if it does not fit into memory as a whole
  Shape shape;
  double volume_mm3 = 0;
};

Box3d bounds_in(const Frame& frame, const Mesh& mesh) {
  Box3d box;
  for (const Vec3f& v : mesh.vertices) box.include(frame.to_local(to_double(v)));
  return box;
}

void check_options(const SliceOptions& options) {
  if (options.printer && options.pixel_mm)
    throw UsageError("--printer and --pixel together", "command line", "use one: a printer has its own pixels");
  if (options.tile && !options.printer)
    throw UsageError("--tile without a printer", "command line", "use it with --printer");
  for (const fs::path& file : options.output.files) {
    if (options.tile && slice_format(file) != SliceFormat::PngZip)
      throw UsageError("--tile makes several plates, this file holds one", file.string(), "use .zip");
  }
}

/// A solid is cut as it stands: what says how to make one of a model would be ignored without a word.
void check_of_solid(const CLI::App& command, const fs::path& solid) {
  for (const char* option : {"--size", "--unit", "--infill", "--voxel", "--preset", "--recipe", "--set", "--seed"}) {
    if (command.count(option) == 0) continue;
    throw UsageError(std::string(option) + " is for a model, this is a solid", solid.string(),
                     "leave it out, or give it to generate, which makes the solid");
  }
}

/// A layer higher than the part, or a pixel wider: another unit was meant.
void check_steps(const SliceGrid& grid, const Vec3d& size) {
  const auto refuse = [](const char* option, double step_mm, const char* what, double part_mm) {
    throw UsageError("a " + std::string(what) + " of " + number_text(step_mm) + " mm is more than the part, " +
                         number_text(part_mm) + " mm",
                     option, std::string("lengths are mm; use a smaller ") + option);
  };
  const double widest = std::max(size.x, size.y);
  if (grid.layer_mm > size.z) refuse("--layer", grid.layer_mm, "layer", size.z);
  if (grid.pixel_mm.x > widest || grid.pixel_mm.y > widest)
    refuse("--pixel", std::max(grid.pixel_mm.x, grid.pixel_mm.y), "pixel", widest);
}

/// Layers and pixels that a format cannot hold are refused before anything is made.
void check_plates(const SliceOptions& options, const std::vector<SlicePlate>& plates, double memory) {
  double layers = 0;
  for (const SlicePlate& plate : plates) layers += plate.grid.layers;
  for (const fs::path& file : options.output.files) {
    const int most = most_layers(slice_format(file));
    if (layers > most) {
      throw Error(Code::TooLarge,
                  number_text(layers, 12) + " layers, more than the " + std::to_string(most) + " that the format holds",
                  file.string(), "use a larger --layer");
    }
  }
  const double needed = memory + slicing_memory(plates.front().grid);
  if (needed > options.run.allowed_bytes()) {
    throw Error(
        Code::TooLarge,
        "the run would need about " + memory_text(needed) + " of memory, more than " +
            memory_text(options.run.allowed_bytes()),
        std::to_string(plates.front().grid.width) + " x " + std::to_string(plates.front().grid.height) + " pixels",
        "use a larger --pixel, or raise --max-memory");
  }
}

/// Layers from slab after slab: those whose middle lies in it.
std::function<LayerRun(const SlicePlate&, int)> from_slabs(SolidStream stream, const Context& context) {
  return [stream, context](const SlicePlate& plate, int first) mutable {
    const auto slab_of = [&](int layer) { return stream.slab_at(plate.grid.middle(layer)[stream.plan().axis]); };
    const std::size_t slab = slab_of(first);
    int last = first + 1;
    while (last < plate.grid.layers && slab_of(last) == slab) ++last;
    return LayerRun{last, stream.printed(stream.slab(slab, context), context)};
  };
}

/// Bytes for each pixel that a surface runs through, measured on seven solids, of smooth walls.
double bytes_a_cut(SliceFormat format, double curls) {
  switch (format) {
    case SliceFormat::PngZip:
    case SliceFormat::Sl1:
      return 2.3;
    case SliceFormat::SvgZip:
      return 2.65 * curls;
    case SliceFormat::Svg:
      return 7.3 * curls;
    case SliceFormat::Cli:
      return 6.4 * curls;
    case SliceFormat::ThreeMf:
      return 4.7 * curls;
  }
  return 0;
}

/// A pixel of a picture takes a thousandth of a byte at least: no more than that is gained by deflating.
double bytes_a_pixel(SliceFormat format) {
  return format == SliceFormat::PngZip || format == SliceFormat::Sl1 ? 1.0 / 1000 : 0;
}

/// Contours of round sticks turn more than those of walls.
double curls_of(const Recipe& recipe, InfillKind infill) {
  if (infill == InfillKind::Hybrid) return 1.3;
  return infill == InfillKind::Tcs && recipe.tcs.form != TcsForm::Sheet ? 1.65 : 1;
}

/// Pixels that a surface runs through, in all layers.
double cuts_of(const std::vector<SlicePlate>& plates, double area_mm2) {
  const SliceGrid& grid = plates.front().grid;
  return area_mm2 / (grid.layer_mm * std::sqrt(grid.pixel_mm.x * grid.pixel_mm.y));
}

/// Within some 30 % of what is written.
double expected_bytes(const fs::path& file, const std::vector<SlicePlate>& plates, const Source& source) {
  const SliceFormat format = slice_format(file);
  double layers = 0, pixels = 0;
  for (const SlicePlate& plate : plates) {
    layers += plate.grid.layers;
    pixels += 1.0 * plate.grid.layers * plate.grid.width * plate.grid.height;
  }
  return 1000 * layers + bytes_a_pixel(format) * pixels +
         bytes_a_cut(format, source.curls) * cuts_of(plates, source.area_mm2);
}

/// What is known of the plates before they are sliced.
std::vector<PlateReport> described(const std::vector<SlicePlate>& plates) {
  std::vector<PlateReport> all;
  for (const SlicePlate& plate : plates) {
    const SliceGrid& grid = plate.grid;
    all.push_back({plate.name, grid.layers, grid.layer_mm, grid.pixel_mm, grid.width, grid.height, 0, {}});
  }
  return all;
}

std::string plan(const SliceOptions& options, const Source& source, const std::vector<SlicePlate>& plates) {
  const Vec3d size = source.box.size();
  std::string text = "model     " + options.model.path.string() + ", ";
  text += number_text(size.x) + " x " + number_text(size.y) + " x " + number_text(size.z) + " mm\n";
  text += layers_text(described(plates));
  if (!options.from_solid())
    text += "solid     about " + number_text(source.expected.active_voxels / 1e6, 2) + " million voxels\n";
  text += "memory    about ";
  // Half of the layers that may wait do.
  text += memory_text(source.memory + 0.5 * slicing_memory(plates.front().grid)) + " of ";
  text += memory_text(options.run.allowed_bytes());
  if (source.slabs) text += ", in " + std::to_string(source.slabs->borders.size() - 1) + " slabs";
  text += "\n";
  constexpr double layers_s = 1.4e-6;  // a cut, in each file; half or twice that
  const double cuts_s = layers_s * cuts_of(plates, source.area_mm2) * static_cast<double>(options.output.files.size());
  const double solid_s = source.expected.solid_s + (source.slabs ? source.expected.slabs_s : 0);
  text += time_text(machine_times() * (solid_s + cuts_s));
  for (const fs::path& file : options.output.files)
    text += "output    " + file.string() + ", about " + memory_text(expected_bytes(file, plates, source)) + "\n";
  return text + "dry run: nothing was written\n";
}

/// What the layers are made of and how; threads and memory do not matter, but for what needs the whole solid.
WorkText work_of(const SliceOptions& options, const HybridizeParams& params, const std::vector<SlicePlate>& plates,
                 const Context& context) {
  WorkText work(context);
  work.add_file("the_model's_content", options.model.path);
  work.add("--unit", options.model.prepare.unit_mm.value_or(0));
  work.add("--size", options.model.prepare.size_mm.value_or(0));
  const Vec3d up = direction(options.model.up);
  work.add("--up", number_text(up.x) + " " + number_text(up.y) + " " + number_text(up.z));
  work.add("--infill", std::string(name_of(options.recipe.infill())));
  work.add("--voxel", params.voxel_mm.value_or(0));
  work.add("--planes", std::to_string(options.planes));
  const Screen screen = options.printer ? options.printer->screen : Screen{};
  work.add("screen", std::string(screen.portrait ? "portrait" : "landscape") + (screen.mirrored ? ", mirrored" : ""));
  for (const SlicePlate& plate : plates) {
    const SliceGrid& grid = plate.grid;
    const std::string of = plate.name.empty() ? "" : "_of_" + plate.name;
    work.add("--layer" + of, grid.layer_mm);
    work.add("layers" + of, std::to_string(grid.layers));
    work.add("--pixel.x" + of, grid.pixel_mm.x);
    work.add("--pixel.y" + of, grid.pixel_mm.y);
    work.add("width" + of, std::to_string(grid.width));
    work.add("height" + of, std::to_string(grid.height));
    const Frame& frame = grid.frame;
    int number = 0;
    for (const Vec3d at : {frame.origin, frame.x, frame.y, frame.z})
      for (int axis = 0; axis < 3; ++axis) work.add("place" + of + "." + std::to_string(number++), at[axis]);
  }
  work.add(params.recipe);
  // Stick ends are only mended of a whole solid.
  work.add("the_solid", params.slabs ? "in slabs (see --max-memory)" : "whole (see --max-memory)");
  return work;
}

void slice_to_files(const SliceOptions& options) {
  check_options(options);
  HybridizeParams params;
  params.recipe = options.recipe.load();
  params.recipe.verify.up = direction(options.model.up);
  params.infill = options.recipe.infill();
  params.function = true;
  Job job("slice", params.recipe, options.model, options.run, options.output);
  const Context& context = job.context();
  Report& report = job.report;
  Stopwatch stage(report.stages);

  const Frame frame = upright(options.model.up);
  Source source;
  Model model;
  if (options.from_solid()) {
    report.model.path = options.model.path.string();
    stage("read", [&] {
      const Solid solid = read_vdb(options.model.path);
      source.box = fibrolite::bounds_in(frame, solid);
      source.shape = smooth_distance_to(solid);
      source.volume_mm3 = solid.volume_mm3();
      source.memory = process_bytes + static_cast<double>(solid.memory_bytes());
      // A band of six voxels about the surface.
      source.area_mm2 = static_cast<double>(solid.active_voxels()) * std::pow(solid.grid().voxel_mm, 2) / 6;
      report.solid.active_voxels = solid.active_voxels();
      report.solid.voxel_mm = solid.grid().voxel_mm;
    });
    if (source.box.empty()) throw Error(Code::BadInput, "the solid is empty", options.model.path.string());
    report.model.size_mm = source.box.size();
  } else {
    check_recipe(params.recipe, options.voxel_mm.value_or(0), options.recipe.infill());
    model = load_model(options.model, report, context.part(0, 0.05, "read"));
    params.recipe.verify.loads = with_paint(std::move(params.recipe.verify.loads), model.painted);
    params.voxel_mm = choose_voxel(bounds(model.mesh), params.recipe, options.recipe.infill(), options.voxel_mm);
    check_recipe(params.recipe, *params.voxel_mm, options.recipe.infill());
    source.box = bounds_in(frame, model.mesh);
  }
  const std::vector<SlicePlate> plates =
      make_plates(frame, source.box,
                  {options.layer_mm.value_or(0.05), options.pixel_mm.value_or(0.05), options.printer, options.tile});
  check_steps(plates.front().grid, source.box.size());
  check_plates(options, plates, source.memory);
  if (!options.from_solid()) {
    const bool drains = params.recipe.print.drain_mm.value_or(0) > 0;
    Extras extras{.mends = drains};
    params.slabs = fit_into_memory(
        model.mesh, *params.voxel_mm, params.recipe, options.recipe.infill(), options.run,
        [&](double voxel_mm) { return needs_of_layers(options.model.up, options.layer_mm.value_or(0.05), voxel_mm); },
        slicing_memory(plates.front().grid), drains ? "print.drain_mm" : "", extras);
    params.most_bytes = options.run.allowed_bytes();
    source.slabs = params.slabs;
    if (options.run.dry_run) {
      extras.open = is_open(model.mesh);
      const Prediction expected = predict(model.mesh, *params.voxel_mm, params.recipe, params.infill, extras);
      source.memory = params.slabs ? params.slabs->usual_bytes : expected.sliced_memory_bytes;
      source.area_mm2 = expected.faces_mm2;
      source.curls = curls_of(params.recipe, params.infill);
      source.expected = expected;
    }
  }
  if (options.run.dry_run) return print(plan(options, source, plates));

  std::optional<Resume> resume;
  if (options.resume) {
    resume.emplace(options.output.files.front(), work_of(options, params, plates, context), job.outputs, context);
    params.kept = resume->kept();
  }
  std::optional<SolidStream> stream;
  if (!options.from_solid()) {
    report.infill = name_of(options.recipe.infill());
    params.function = !params.slabs;
    Hybrid hybrid = hybridize(model, params, report, context.part(0.05, 0.4, "fill"));
    model = {};
    // The function stays; the solid, on which pieces were tied and everything was measured, goes.
    source.shape = std::move(hybrid.printed);
    stream = std::move(hybrid.stream);
  } else {
    report.solid.volume_mm3 = source.volume_mm3;
  }

  SliceJob work{source.shape, plates, options.planes, options.output.files.front().stem().string(),
                options.printer ? options.printer->screen : Screen{}};
  if (stream) work.run_from = from_slabs(*stream, context);
  work.kept = params.kept;
  std::vector<SlicedPlate> done;
  stage("layers", [&] {
    const auto files = static_cast<double>(options.output.files.size());
    for (std::size_t i = 0; i < options.output.files.size(); ++i) {
      const auto n = static_cast<double>(i);
      const fs::path& file = options.output.files[i];
      done = write_slices(job.outputs.place(file), slice_format(file), work,
                          context.part(0.4 + 0.6 * n / files, 0.4 + 0.6 * (n + 1) / files, "layers"));
    }
  });
  if (stream) stream->finish(report, context);
  report.slices = described(plates);
  for (std::size_t p = 0; p < plates.size(); ++p) {
    report.slices[p].volume_mm3 = done[p].volume_mm3;
    report.slices[p].area_mm2 = std::move(done[p].area_mm2);
  }
  const double volume_mm3 = report.sliced_mm3();
  const double solid_mm3 = report.solid.volume_mm3;
  if (std::abs(volume_mm3 - solid_mm3) > 0.005 * solid_mm3) {
    report.warnings.push_back("the layers add up to " + number_text(volume_mm3) + " mm3, the solid has " +
                              number_text(solid_mm3) + " mm3: use thinner layers or smaller pixels or voxels");
  }
  job.finish();
  if (resume) resume->done();
  if (!options.run.quiet) print_layers(report, job.targets);
}

}  // namespace

void add_slice_command(CLI::App& program) {
  const auto options = std::make_shared<SliceOptions>();
  CLI::App& command =
      *program.add_subcommand("slice", "Layers for a printer, from a model or a solid (.vdb); no mesh is made");
  add_options(command, options->model);
  add_options(command, options->output, {".zip", ".sl1", ".svg", ".cli", ".3mf"});
  add_length(command, "--layer", options->layer_mm, "Height of a layer (default 0.05)");
  add_length(command, "--pixel", options->pixel_mm, "Edge of a pixel (default 0.05)");
  command
      .add_option_function<std::string>(
          "--printer", [options](const std::string& text) { options->printer = parse_printer(text); },
          "Size and pixels of a printer: sl1, sl1s, or e.g. 120.96x68.04x150:2560x1440")
      ->type_name("WxDxH:PXxPY");
  command.add_flag("--tile", options->tile, "Cut a part that is larger than the printer into several plates");
  command
      .add_option("--planes", options->planes,
                  "Heights at which a layer is sampled: 1, 2, 4, 8 (default 1); more make flat slopes grey too")
      ->check(CLI::IsMember({1, 2, 4, 8}));
  add_infill(command, options->recipe);
  add_voxel(command, options->voxel_mm,
            "Voxel edge of the body, and of the check that all is one piece (default: as for generate)");
  add_options(command, options->recipe);
  command.add_flag(
      "--resume", options->resume,
      "Keep what is finished (in .OUT.resume beside the first OUT) until all is; go on from there if a run "
      "with --resume was interrupted");
  command.add_flag("--dry-run", options->run.dry_run, "Say what would be done, write nothing");
  add_options(command, options->run);
  command.callback([options, &command] {
    if (options->from_solid()) check_of_solid(command, options->model.path);
    slice_to_files(*options);
  });
}

}  // namespace fibrolite::cli
