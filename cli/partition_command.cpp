// SPDX-License-Identifier: GPL-3.0-or-later
// partition: the parts alone, coloured or as grids, before the stress analysis judges them.
#include <limits>
#include <memory>

#include "commands.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/ops/picture.h"
#include "fibrolite/ops/stance.h"
#include "fibrolite/realize.h"
#include "fibrolite/solid_io.h"
#include "fibrolite/surface.h"
#include "fibrolite/to_solid.h"
#include "job.h"
#include "options.h"
#include "summary.h"
#include "views.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

struct PartitionOptions {
  ModelOptions model;
  RecipeOptions recipe;
  RunOptions run;
  OutputOptions output;
  std::optional<double> voxel_mm;
};

constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

PartReport part_report(const Candidate& candidate) {
  PartReport part;
  part.id = candidate.id;
  part.kind = candidate.column_like ? "column" : "bulk";
  part.volume_mm3 = candidate.volume_mm3;
  part.lumen_mm3 = part.infill_volume_mm3 = not_measured;
  part.centroid_mm = candidate.centroid_mm;
  part.axis = candidate.axis.mean();
  part.diameter_mm = candidate.diameter_mm;
  part.stress = {not_measured, {not_measured, not_measured}, not_measured, not_measured, {}};
  part.reason = candidate.reason;
  return part;
}

InterfaceReport interface_report(const Cut& cut) {
  InterfaceReport interface;
  interface.a = cut.a;
  interface.b = cut.b;
  interface.centroid_mm = cut.frame.origin;
  interface.normal = cut.surface().normal({});
  interface.bent = !cut.bend.flat();
  interface.area_mm2 = interface.layer_area_mm2 = interface.union_area_mm2 = interface.bridge_area_mm2 =
      interface.contact_area_mm2 = interface.mst_bridge_mm3 = interface.bbox_bridge_mm3 = not_measured;
  return interface;
}

InterfaceReport interface_report(const Core& core, const Candidate& candidate) {
  InterfaceReport interface =
      interface_report(Cut{.a = core.id, .b = core.host, .frame = core.frame, .radius_mm = core.radius_mm});
  interface.centroid_mm = candidate.centroid_mm;
  interface.radius_mm = core.radius_mm;
  return interface;
}

void fill_report(Report& report, const Model& model, const Partition& parts) {
  report.model.volume_mm3 = signed_volume(model.mesh);
  for (const Candidate& candidate : parts.candidates) report.parts.push_back(part_report(candidate));
  for (const Cut& cut : parts.cuts) report.interfaces.push_back(interface_report(cut));
  for (const Core& core : parts.cores)
    report.interfaces.push_back(interface_report(core, parts.candidates.at(static_cast<std::size_t>(core.id))));
}

Mesh colored(Mesh mesh, const Partition& parts) {
  std::vector<Rgb> by_part;
  for (const Candidate& candidate : parts.candidates)
    by_part.push_back(part_color(candidate.id, candidate.column_like));
  mesh.triangle_colors.clear();
  for (const Mesh::Triangle& t : mesh.triangles) {
    const auto corner = [&](int i) { return to_double(mesh.vertices[t[static_cast<std::size_t>(i)]]); };
    const Vec3d middle = (corner(0) + corner(1) + corner(2)) / 3;
    mesh.triangle_colors.push_back(by_part.at(static_cast<std::size_t>(parts.labels.label(middle))));
  }
  return mesh;
}

std::vector<NamedSolid> grids(const Solid& body, const Partition& parts, const Context& context) {
  std::vector<NamedSolid> list;
  for (const Candidate& candidate : parts.candidates)
    list.push_back({"part_" + std::to_string(candidate.id),
                    realize(intersect({distance_to(body), parts.labels.region(candidate.id)}), body, context)});
  return list;
}

void run_partition(const PartitionOptions& options) {
  Recipe recipe = options.recipe.load();
  recipe.verify.up = direction(options.model.up);

  Job job("partition", recipe, options.model, options.run, options.output);
  const Context& context = job.context();
  Outputs& outputs = job.outputs;
  Report& report = job.report;
  Stopwatch stage(report.stages);

  const Model model = load_model(options.model, report, context.part(0, 0.1, "read"));
  recipe.verify.loads = with_paint(std::move(recipe.verify.loads), model.painted);
  if (options.voxel_mm) check_memory(model.mesh, *options.voxel_mm, recipe, InfillKind::Solid, options.run);
  const FoundParts found = find_parts(model, recipe, report, context.part(0.1, 0.8, ""));
  const Partition parts = placed(found.partition, found.proxy.frame);
  fill_report(report, model, parts);
  note_colors(report);

  // The parts are functions of space: they can be shown on a body as fine as is asked for.
  const double voxel = options.voxel_mm.value_or(found.proxy.solid.grid().voxel_mm);
  const Solid body = stage("body", [&] {
    return to_solid(model.mesh, {.grid = {.voxel_mm = voxel}}, context.part(0.8, 0.85, "body")).solid;
  });
  stage("write", [&] {
    for (const fs::path& file : options.output.files) {
      if (file.extension() == ".ply" || file.extension() == ".PLY") {
        write_mesh(outputs.place(file), colored(surface(body, {}, context), parts), context);
      } else {
        write_vdb(outputs.place(file), grids(body, parts, context), context);
      }
    }
  });
  job.finish();
  if (!options.run.quiet) print_parts(report, job.targets);
}

}  // namespace

void add_partition_command(CLI::App& program) {
  const auto options = std::make_shared<PartitionOptions>();
  CLI::App& command =
      *program.add_subcommand("partition", "Parts before they are judged, coloured (.ply) or as grids (.vdb)");
  add_options(command, options->model);
  add_options(command, options->output, {".ply", ".vdb"});
  add_voxel(command, options->voxel_mm,
            "Voxel edge of what is written (default: that of the coarse grid the parts are found on)");
  add_options(command, options->recipe);
  add_options(command, options->run);
  command.callback([options] { run_partition(*options); });
}

}  // namespace fibrolite::cli
