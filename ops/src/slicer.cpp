// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/slicer.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/loads.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/to_solid.h"
#include "slab_turns.h"

namespace fibrolite {
namespace {

std::string gigabytes(double bytes) { return number_text(bytes / 1e9, 3) + " GB"; }

}  // namespace

struct Slicer::Filled {
  SliceGrid grid;
  SliceParams slice;
  Report report;
  Shape shape;                        ///< All of it, or of the slab that is there.
  std::optional<SolidStream> stream;  ///< If there are slabs.
  SlabTurns turns;

  double cut(int layer, const PixelRange& tile, std::uint8_t* rows, std::ptrdiff_t stride, const Context& context) {
    if (!stream) return slice_into(rows, stride, tile, shape, grid, layer, slice, context);
    // A thread that waits for tasks of ours takes up others meanwhile. If the host asks for layers in such tasks, one
    // of them would then wait for the slab that its own thread uses or makes.
    return tbb::this_task_arena::isolate([&] { return cut_slab(layer, tile, rows, stride, context); });
  }

 private:
  double cut_slab(int layer, const PixelRange& tile, std::uint8_t* rows, std::ptrdiff_t stride,
                  const Context& context) {
    const std::size_t wanted = stream->slab_at(grid.middle(layer)[stream->plan().axis]);
    const auto make = [&] {
      shape = {};  // before the next takes its memory
      shape = stream->printed(stream->slab(wanted, context), context);
    };
    const auto use = [&] { return slice_into(rows, stride, tile, shape, grid, layer, slice, context); };
    return turns.with(wanted, make, use, context);
  }
};

Slicer::Slicer(const MeshFile& model, const SlicerParams& params, const Context& context) {
  auto filled = std::make_shared<Filled>();
  HybridizeParams fill = params.fill;
  fill.function = true;
  Model prepared = prepare(model, params.prepare, context.part(0, 0.05, "prepare"));
  fill.recipe.verify.up = direction(params.up);
  fill.recipe.verify.loads = with_paint(std::move(fill.recipe.verify.loads), prepared.painted);
  fill.voxel_mm = choose_voxel(bounds(prepared.mesh), fill.recipe, fill.infill, fill.voxel_mm);

  // What cannot be sliced, or does not fit, is refused before it is filled.
  const Frame frame = upright(params.up);
  Box3d box;
  for (const Vec3f& v : prepared.mesh.vertices) box.include(frame.to_local(to_double(v)));
  filled->grid = slice_grid(frame, box, params.pixel_mm, params.layer_mm);
  filled->slice = params.slice;
  check(params.slice);
  check_recipe(fill.recipe, *fill.voxel_mm, fill.infill);
  if (const double needed =
          most_memory(prepared.mesh, *fill.voxel_mm, fill.recipe, fill.infill, {.open = is_open(prepared.mesh)});
      needed > params.max_memory_bytes) {
    fill.slabs = plan_slabs(prepared.mesh, *fill.voxel_mm, fill.recipe, fill.infill,
                            needs_of_layers(params.up, params.layer_mm, *fill.voxel_mm), params.max_memory_bytes);
    const bool drains = fill.recipe.print.drain_mm.value_or(0) > 0;
    if (drains || fill.slabs->memory_bytes > params.max_memory_bytes) {
      throw Error(Code::TooLarge,
                  "the run would need about " + gigabytes(drains ? needed : fill.slabs->memory_bytes) +
                      " of memory, more than " + gigabytes(params.max_memory_bytes) +
                      (drains ? ", and print.drain_mm needs the whole solid in it" : " even slab by slab"),
                  number_text(*fill.voxel_mm).insert(0, "voxel ") + " mm", "use a larger voxel, or allow more memory");
    }
    fill.function = false;
  }

  Report& report = filled->report;
  report.command = "slice";
  report.recipe = fill.recipe;
  report.infill = std::ranges::find(infill_names, fill.infill, &InfillName::kind)->name;
  report.model.triangles = static_cast<std::int64_t>(prepared.mesh.triangles.size());
  report.model.size_mm = bounds(prepared.mesh).size();
  report.model.repairs = prepared.repairs;
  report.warnings = prepared.warnings;
  Hybrid hybrid = hybridize(prepared, fill, report, context.part(0.05, fill.slabs ? 0.6 : 1, "fill"));
  filled->shape = std::move(hybrid.printed);
  filled->stream = std::move(hybrid.stream);
  if (filled->stream) {
    // What is reported of the whole takes a look at each.
    const auto count = static_cast<double>(filled->stream->slabs());
    for (std::size_t i = 0; i < filled->stream->slabs(); ++i) {
      const auto n = static_cast<double>(i);
      (void)filled->stream->slab(i, context.part(0.6 + 0.4 * n / count, 0.6 + 0.4 * (n + 1) / count, "measure"));
    }
    filled->stream->finish(report);
  }
  context.check();
  context.progress(1);
  filled_ = std::move(filled);
}

const SliceGrid& Slicer::grid() const { return filled_->grid; }
const Report& Slicer::report() const { return filled_->report; }

Slice Slicer::layer(int number) const {
  const SliceGrid& g = grid();
  Slice out{GrayImage(g.width, g.height), 0};
  out.area_mm2 = tile(number, {0, 0, g.width, g.height}, out.coverage.pixels.data(), g.width);
  return out;
}

double Slicer::tile(int layer, const PixelRange& tile, std::uint8_t* rows, std::ptrdiff_t stride,
                    const Context& context) const {
  if (layer < 0 || layer >= grid().layers)
    throw Error(Code::BadRecipe, "there is no layer " + std::to_string(layer),
                "layers 0 to " + std::to_string(grid().layers - 1));
  return filled_->cut(layer, tile, rows, stride, context);
}

}  // namespace fibrolite

// The C part: no exception leaves it.

struct fibrolite_job {
  fibrolite::Context context;
  std::atomic<bool> begun = false, ready = false;
  std::optional<fibrolite::Slicer> slicer;  // not touched any more once `ready`
};

namespace fibrolite {
namespace {

/// The caller's mistake in calling, not in what it asks for.
struct Misuse {
  const char* what;
};

// A buffer, not a string: it is written where there may be no memory left.
thread_local std::array<char, 1024> message{};

int failed(fibrolite_code code, const char* text) noexcept {
  std::snprintf(message.data(), message.size(), "%s", text);
  return code;
}

fibrolite_code code_of(Code code) noexcept {
  switch (code) {
    case Code::BadInput:
    case Code::Unsupported:
      return FIBROLITE_BAD_INPUT;
    case Code::BadRecipe:
      return FIBROLITE_BAD_RECIPE;
    case Code::TooLarge:
      return FIBROLITE_TOO_LARGE;
    case Code::SolverFailed:
      return FIBROLITE_SOLVER_FAILED;
    case Code::Io:
      return FIBROLITE_IO;
    case Code::Cancelled:
      return FIBROLITE_CANCELLED;
    case Code::Internal:
      return FIBROLITE_INTERNAL;
  }
  return FIBROLITE_INTERNAL;
}

template <class Work>
int guarded(const Work& work) noexcept {
  try {
    work();
    return FIBROLITE_OK;
  } catch (const Misuse& misuse) {
    return failed(FIBROLITE_BAD_ARGUMENT, misuse.what);
  } catch (const Error& error) {
    return failed(code_of(error.code()), error.what());
  } catch (const std::bad_alloc&) {
    return failed(FIBROLITE_TOO_LARGE, "no memory left; use a larger voxel");
  } catch (const std::exception& error) {
    return failed(FIBROLITE_INTERNAL, error.what());
  } catch (...) {
    return failed(FIBROLITE_INTERNAL, "unknown exception");
  }
}

void need(bool given, const char* what) {
  if (!given) throw Misuse{what};
}

Up up_of(fibrolite_up up) {
  switch (up) {
    case FIBROLITE_UP_Z:
      return Up::Z;
    case FIBROLITE_UP_X:
      return Up::X;
    case FIBROLITE_UP_Y:
      return Up::Y;
    case FIBROLITE_UP_MINUS_X:
      return Up::MinusX;
    case FIBROLITE_UP_MINUS_Y:
      return Up::MinusY;
    case FIBROLITE_UP_MINUS_Z:
      return Up::MinusZ;
  }
  throw Misuse{"options.up is no direction"};
}

InfillKind infill_of(std::string_view name) {
  std::vector<std::string> names;
  for (const InfillName& known : infill_names) {
    if (known.name == name) return known.kind;
    names.emplace_back(known.name);
  }
  throw Error(Code::BadRecipe, std::string("unknown infill ").append(name), "infill",
              nearest_name(name, names).insert(0, "did you mean ").append("?"));
}

/// 0: `none`.
double positive(double value, double none, const char* key) {
  if (value == 0) return none;
  if (!(value > 0) || !std::isfinite(value)) throw Error(Code::BadRecipe, "must be above zero", key);
  return value;
}

SlicerParams params_of(const fibrolite_options& options) {
  SlicerParams params;
  const std::string start = options.preset != nullptr ? options.preset : preset_names().front();
  params.fill.recipe = preset(start);
  params.fill.infill = usual_infill(start);
  if (options.recipe != nullptr) params.fill.recipe = parse_recipe(options.recipe, params.fill.recipe, "recipe");
  if (options.infill != nullptr) params.fill.infill = infill_of(options.infill);
  const auto wanted = [](double value, const char* key) {
    return value == 0 ? std::optional<double>() : positive(value, 0, key);
  };
  params.fill.voxel_mm = wanted(options.voxel_mm, "voxel_mm");
  params.prepare = {wanted(options.size_mm, "size_mm"), wanted(options.unit_mm, "unit_mm")};
  params.up = up_of(options.up);
  params.pixel_mm.x = positive(options.pixel_x_mm, params.pixel_mm.x, "pixel_x_mm");
  params.pixel_mm.y = positive(options.pixel_y_mm, params.pixel_mm.x, "pixel_y_mm");
  params.layer_mm = positive(options.layer_mm, params.layer_mm, "layer_mm");
  params.slice.planes = options.planes == 0 ? 1 : options.planes;
  params.max_memory_bytes = positive(options.max_memory_bytes, params.max_memory_bytes, "max_memory_bytes");
  return params;
}

Mesh mesh_of(const fibrolite_mesh& given) {
  need(given.vertices != nullptr && given.triangles != nullptr, "the mesh has no vertices or no triangles");
  Mesh mesh;
  for (std::size_t i = 0; i < given.vertex_count; ++i) {
    const float* v = given.vertices + 3 * i;
    if (!std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2]))
      throw Error(Code::BadInput, "a coordinate is not a finite number", "vertex " + std::to_string(i));
    mesh.vertices.push_back({v[0], v[1], v[2]});
  }
  for (std::size_t i = 0; i < given.triangle_count; ++i) {
    const std::uint32_t* t = given.triangles + 3 * i;
    if (std::max({t[0], t[1], t[2]}) >= given.vertex_count)
      throw Error(Code::BadInput, "a corner is no vertex of the mesh", "triangle " + std::to_string(i));
    mesh.triangles.push_back({t[0], t[1], t[2]});
  }
  return mesh;
}

template <class Read>
int open(fibrolite_job* job, const fibrolite_options* options, const Read& read) noexcept {
  return guarded([&] {
    need(job != nullptr, "no job");
    need(!job->begun.exchange(true), "the job was opened before; make another");
    job->context.check();
    const SlicerParams params = params_of(options != nullptr ? *options : fibrolite_options{});
    job->slicer.emplace(read(), params, job->context);
    job->ready = true;
  });
}

const Slicer& slicer_of(const fibrolite_job* job) {
  need(job != nullptr, "no job");
  job->context.check();
  need(job->ready, "the job is not open");
  return *job->slicer;
}

}  // namespace
}  // namespace fibrolite

fibrolite_job* fibrolite_job_new(fibrolite_progress progress, void* user) {
  fibrolite_job* job = nullptr;
  (void)fibrolite::guarded([&] {
    fibrolite::Context::Progress report;
    if (progress != nullptr) {
      report = [progress, user](double fraction, std::string_view stage) {
        progress(fraction, std::string(stage).c_str(), user);
      };
    }
    job = new fibrolite_job{.context = {std::move(report), {}}, .slicer = {}};
  });
  return job;
}

int fibrolite_job_open_mesh(fibrolite_job* job, const fibrolite_mesh* mesh, const fibrolite_options* options) {
  return fibrolite::open(job, options, [&] {
    fibrolite::need(mesh != nullptr, "no mesh");
    return fibrolite::MeshFile{.mesh = fibrolite::mesh_of(*mesh), .unit_mm = 1, .notes = {}};
  });
}

int fibrolite_job_open_file(fibrolite_job* job, const char* path, const fibrolite_options* options) {
  return fibrolite::open(job, options, [&] {
    fibrolite::need(path != nullptr, "no path");
    return fibrolite::read_mesh(path, job->context.part(0, 0, "read"));
  });
}

int fibrolite_job_layers(const fibrolite_job* job, fibrolite_layers* layers) {
  return fibrolite::guarded([&] {
    fibrolite::need(layers != nullptr, "no place for the answer");
    const fibrolite::Slicer& slicer = fibrolite::slicer_of(job);
    const fibrolite::SliceGrid& grid = slicer.grid();
    const fibrolite::Frame& f = grid.frame;
    *layers = {.layers = grid.layers,
               .width = grid.width,
               .height = grid.height,
               .layer_mm = grid.layer_mm,
               .pixel_x_mm = grid.pixel_mm.x,
               .pixel_y_mm = grid.pixel_mm.y,
               .origin = {f.origin.x, f.origin.y, f.origin.z},
               .axis_x = {f.x.x, f.x.y, f.x.z},
               .axis_y = {f.y.x, f.y.y, f.y.z},
               .axis_z = {f.z.x, f.z.y, f.z.z},
               .volume_mm3 = slicer.report().solid.volume_mm3};
  });
}

int fibrolite_job_tile(const fibrolite_job* job, int layer, int x0, int y0, int width, int height, uint8_t* rows,
                       size_t stride, double* area_mm2) {
  return fibrolite::guarded([&] {
    const fibrolite::Slicer& slicer = fibrolite::slicer_of(job);
    const fibrolite::SliceGrid& grid = slicer.grid();
    fibrolite::need(rows != nullptr, "no rows");
    fibrolite::need(layer >= 0 && layer < grid.layers, "there is no such layer");
    fibrolite::need(
        x0 >= 0 && y0 >= 0 && width > 0 && height > 0 && width <= grid.width - x0 && height <= grid.height - y0,
        "the tile is empty, or reaches beyond the layer");
    fibrolite::need(stride >= static_cast<std::size_t>(width) && stride <= PTRDIFF_MAX,
                    "the stride is below the width, or beyond all memory");
    const double area =
        slicer.tile(layer, {x0, y0, width, height}, rows, static_cast<std::ptrdiff_t>(stride), job->context);
    if (area_mm2 != nullptr) *area_mm2 = area;
  });
}

void fibrolite_job_cancel(const fibrolite_job* job) {
  if (job != nullptr) job->context.cancel();
}

void fibrolite_job_free(fibrolite_job* job) { delete job; }

const char* fibrolite_last_message(void) { return fibrolite::message.data(); }
