// SPDX-License-Identifier: GPL-3.0-or-later
#include "run.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/file.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/stance.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/solid_io.h"
#include "fibrolite/surface.h"
#include "fibrolite/to_solid.h"

namespace fibrolite::cli {
namespace {

MeshFile read_model(const std::filesystem::path& path, const Context& context) {
  const std::string ending = path.extension().string();
  if (ending == ".vdb" || ending == ".VDB") {
    MeshFile file;
    file.mesh = surface(read_vdb(path), {}, context);
    return file;
  }
  return read_mesh(path, context);
}

/// As --max-memory takes it, no less.
std::string memory_option(double bytes) {
  constexpr double mb = 1024.0 * 1024, gb = 1024 * mb;
  return bytes < gb ? number_text(rounded_up(bytes / mb, 2)) + "M" : number_text(rounded_up(bytes / gb, 2)) + "G";
}

}  // namespace

Model load_model(const ModelOptions& options, Report& report, const Context& context) {
  Stopwatch stage(report.stages);
  const MeshFile file = stage("read", [&] { return read_model(options.path, context.part(0, 0.5, "read")); });
  Model model = stage("prepare", [&] { return prepare(file, options.prepare, context.part(0.5, 1, "prepare")); });
  report.model.path = options.path.string();
  report.model.triangles = static_cast<std::int64_t>(model.mesh.triangles.size());
  report.model.size_mm = bounds(model.mesh).size();
  report.model.repairs = model.repairs;
  for (const std::vector<std::string>& list : {std::cref(file.notes), std::cref(std::as_const(model.warnings))})
    report.warnings.insert(report.warnings.end(), list.begin(), list.end());
  return model;
}

namespace {

/// `needed`: bytes, by voxel; `why` follows what is said of them. `most`: the coarsest voxel that the recipe allows.
[[noreturn]] void refuse(const Mesh& model, double voxel_mm, double most, const std::function<double(double)>& needed,
                         double allowed, const std::string& why) {
  const std::string what = "the run would need about " + memory_text(needed(voxel_mm)) + " of memory, more than " +
                           memory_text(allowed) + why;
  const double side = bounds(model).longest_side(), coarsest = std::min(side, most);
  // Slabs are whole layers of blocks thick: what a slightly larger voxel needs may be a little more.
  const auto fits = [&](double voxel) { return needed(voxel) <= allowed && needed(1.1 * voxel) <= allowed; };
  double fitting = voxel_mm;
  while (!fits(fitting) && fitting < coarsest) fitting *= 2;
  fitting = std::max(voxel_mm, fitting / 2);
  while (!fits(fitting) && fitting < coarsest) fitting = rounded_up(fitting * 1.05, 2);
  std::string remedy = is_odd_size(side) ? "is the model's unit right? It is " + number_text(side, 6) +
                                               " mm long: try --unit or --size, or "
                                         : "";
  fitting = std::min(fitting, coarsest);
  if (needed(fitting) <= allowed)
    remedy += "use --voxel " + number_text(fitting) + (fitting < most ? " or larger" : "") + ", or raise --max-memory";
  else if (fitting == most && needed(most) < 1e18)
    remedy += "raise --max-memory to " + memory_option(needed(voxel_mm)) +
              (voxel_mm < most ? " (" + memory_option(needed(most)) + " with --voxel " + number_text(most) + ")" : "") +
              ", use a smaller --size, or a recipe of thicker members";
  else
    remedy += "raise --max-memory";
  throw Error(Code::TooLarge, what, "voxel " + number_text(voxel_mm) + " mm", remedy);
}

}  // namespace

void check_memory(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill, const RunOptions& run) {
  const Extras extras{.open = is_open(model)};
  const auto needed = [&](double voxel) { return most_memory(model, voxel, recipe, infill, extras); };
  if (!(needed(voxel_mm) <= run.allowed_bytes()))
    refuse(model, voxel_mm, most_voxel_mm(recipe, infill), needed, run.allowed_bytes(), "");
}

std::optional<SlabPlan> fit_into_memory(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill,
                                        const RunOptions& run, const std::function<SlabNeeds(double)>& needs,
                                        double more_bytes, const std::string& whole, Extras extras) {
  const double allowed = run.allowed_bytes(), most = most_voxel_mm(recipe, infill);
  extras.open = is_open(model);
  const auto as_whole = [&](double voxel) { return most_memory(model, voxel, recipe, infill, extras) + more_bytes; };
  if (as_whole(voxel_mm) <= allowed) return std::nullopt;
  if (!whole.empty())
    refuse(model, voxel_mm, most, as_whole, allowed, ", and " + whole + " needs the whole solid in it");
  const auto plan_of = [&](double voxel) {
    SlabPlan plan = plan_slabs(model, voxel, recipe, infill, needs(voxel), allowed - more_bytes);
    // An open mesh is closed all at once, before there are slabs.
    if (extras.open) {
      const double mending = most_memory(model, voxel, recipe, InfillKind::Solid) + repair_bytes(model, voxel);
      plan.memory_bytes = std::max(plan.memory_bytes, mending);
      plan.usual_bytes = std::max(plan.usual_bytes, 0.9 * mending);
    }
    return plan;
  };
  SlabPlan plan = plan_of(voxel_mm);
  if (plan.memory_bytes + more_bytes > allowed) {
    const auto in_slabs = [&](double voxel) { return plan_of(voxel).memory_bytes + more_bytes; };
    refuse(model, voxel_mm, most, in_slabs, allowed, " even slab by slab");
  }
  return plan;
}

FoundParts find_parts(const Model& model, const Recipe& recipe, Report& report, const Context& context) {
  Stopwatch stage(report.stages);
  FoundParts found;
  found.proxy = stage(
      "proxy", [&] { return make_proxy(model.mesh, {.frame = stance(recipe.verify)}, context.part(0, 0.1, "proxy")); });
  found.partition =
      find_candidates(found.proxy, recipe, in_stance(recipe.verify), report.stages, context.part(0.1, 1, "partition"));
  report.warnings.insert(report.warnings.end(), found.partition.notes.begin(), found.partition.notes.end());
  report.threshold = found.partition.threshold;
  report.stable_from = found.partition.stable_from;
  report.stable_to = found.partition.stable_to;
  return found;
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

std::string time_text(double cpu_s) {
  const double shared = 1 + 0.65 * (ThreadLimit::count() - 1);  // how much less it takes than on one thread
  return "time      about " + number_text(cpu_s / shared, 2) + " s, " + number_text(cpu_s, 2) +
         " s of CPU, and what the disk takes\n";
}

std::string memory_text(double bytes) {
  constexpr double most = 1e6 * 1024.0 * 1024 * 1024 * 1024;
  if (!(bytes < most)) return "a million TB or more";
  const char* unit = "bytes";
  for (const char* larger : {"KB", "MB", "GB", "TB"}) {
    if (bytes < 1000) break;
    bytes /= 1024;
    unit = larger;
  }
  return number_text(bytes, 3) + " " + unit;
}

ThreadLimit::ThreadLimit(int threads) {
  if (threads > 0) control_.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
}
int ThreadLimit::count() {
  return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

}  // namespace fibrolite::cli
