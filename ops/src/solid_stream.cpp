// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/solid_stream.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/piece_sweep.h"
#include "fibrolite/realize.h"
#include "fibrolite/slice.h"
#include "fibrolite/to_solid.h"
#include "run.h"

namespace fibrolite {
namespace {

constexpr int rounds = 3;  // as tie()

Context quiet(const Context& context) { return context.part(0, 0, ""); }
int& along(Vec3i& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

struct SolidStream::Impl {
  Impl(const Mesh& model, Design d, SlabPlan p, Grid g, const Context& context)
      : design(std::move(d)),
        plan(std::move(p)),
        grid(g),
        voxels(model, {.grid = grid, .inside_band_mm = design.assembly.shell_mm}, context) {
    for (const Part& part : design.parts.parts) regions.push_back(part.region());
    sums.resize(regions.size());
    measured.resize(plan.borders.size() - 1, false);
  }

  [[nodiscard]] SampleRange range(std::size_t slab) const {
    return {plan.axis, plan.borders[slab], plan.borders[slab + 1]};
  }

  [[nodiscard]] Solid body(std::size_t slab, int margin, const Context& context) const {
    SampleBox box = voxels.samples();
    along(box.min, plan.axis) = plan.borders[slab] - margin;
    along(box.max, plan.axis) = plan.borders[slab + 1] + margin;
    return voxels.within(box, context);
  }

  /// Before any tie.
  [[nodiscard]] Shape over(const Shape& body) const {
    return compose(body, design.parts, design.fills, design.joints, design.infill, design.recipe, design.assembly);
  }

  /// With the ties so far; not cleaned.
  [[nodiscard]] Solid raw(const Solid& body, const Context& context) const {
    const Shape b = distance_to(body);
    return realize(with_mends(over(b), b, made), body, context);
  }

  /// Loose pieces are tied, specks and micro-voids noted.
  void make_one_piece(const Context& context) {
    const TieParams params = tie_params(design.recipe, grid.voxel_mm);
    for (int round = 0;; ++round) {
      PieceSweep sweep(grid, {.axis = plan.axis, .clean = params.clean});
      for (std::size_t i = 0; i + 1 < plan.borders.size(); ++i) {
        context.check();
        const Solid solid = raw(body(i, 0, quiet(context)), quiet(context));
        sweep.add(solid, range(i).low, range(i).high, nothing(), quiet(context));
        context.progress(static_cast<double>(i + 1) / static_cast<double>(measured.size()));
      }
      found = sweep.finish();
      if (found.left.material.empty()) {
        throw Error(Code::BadInput, "the mesh encloses no volume at this voxel", {},
                    "close it, give it thickness, or use a smaller --voxel");
      }
      if (found.left.material.size() == 1 || round == rounds || !tie_loose(params, context)) break;
    }
    made.tied.dropped = found.dropped;
    made.tied.filled = found.filled;
    made.tied.left = found.left;
  }

  /// A strut from each loose piece to the nearest other, each looked at with what lies around it alone.
  bool tie_loose(const TieParams& params, const Context& context) {
    const auto reach = static_cast<int>(std::ceil(params.reach_mm / grid.voxel_mm)) + 1;
    std::vector<Capsule> struts;
    for (std::size_t i = 1; i < found.left.material.size(); ++i) {
      SampleBox box = found.boxes[i];
      for (int axis = 0; axis < 3; ++axis) {
        along(box.min, axis) -= reach;
        along(box.max, axis) += reach;
      }
      const Solid around = flipped(raw(voxels.within(box, quiet(context)), quiet(context)), found.flips);
      const auto gap = gap_from(around, found.left.material[i].sample_mm, params.reach_mm, quiet(context));
      if (gap) struts.push_back(strut(*gap, params.strut_mm));
    }
    made.tied.struts.insert(made.tied.struts.end(), struts.begin(), struts.end());
    return !struts.empty();
  }

  Slab slab(std::size_t number, const Context& context) {
    Slab result{range(number), body(number, plan.margin_vox, quiet(context)), {}, {}};
    context.check();
    result.solid = flipped(raw(result.body, quiet(context)), found.flips);
    context.check();
    if (!measured[number]) measure(number, result, context);
    Mended mended = made;
    mended.tied.solid = result.solid;
    result.printed = as_function(over(smooth_distance_to(result.body)), result.body, mended, context);
    return result;
  }

  void measure(std::size_t number, const Slab& slab, const Context& context) {
    measured[number] = true;
    const double shell_mm = design.assembly.shell_mm;
    const auto part = fibrolite::measure(slab.body, slab.solid, regions, shell_mm, slab.range, quiet(context));
    for (std::size_t i = 0; i < part.size(); ++i) sums[i] += part[i];
    body_vox += slab.body.volume_vox(slab.range);
    solid_vox += slab.solid.volume_vox(slab.range);
    active_voxels += slab.solid.active_voxels(slab.range);
  }

  void finish(Report& report) const {
    if (std::find(measured.begin(), measured.end(), false) != measured.end())
      throw Error(Code::Internal, "a slab was not asked for");
    std::vector<PartVolumes> volumes;
    for (const PartSums& part : sums) volumes.push_back(part.volumes(grid.voxel_mm));
    report_parts(design.parts, design.fills, volumes, design.infill, report);
    report_joints(design.interfaces, design.joints, design.demand_n, design.recipe, report);
    const double h = grid.voxel_mm;
    report.solid.active_voxels = active_voxels;
    report.solid.voxel_mm = h;
    report_solid(made.tied, body_vox * h * h * h, solid_vox * h * h * h, design.recipe.material, report);
  }

  const Design design;
  const SlabPlan plan;
  const Grid grid;
  const MeshVoxels voxels;
  std::vector<Shape> regions;
  Mended made;  ///< The ties; the solid stays empty.
  PieceSweep::Result found;
  std::vector<bool> measured;
  std::vector<PartSums> sums;
  double body_vox = 0, solid_vox = 0;
  std::int64_t active_voxels = 0;
};

const SlabPlan& SolidStream::plan() const { return impl_->plan; }
Grid SolidStream::grid() const { return impl_->grid; }
SolidStream::Slab SolidStream::slab(std::size_t number, const Context& context) { return impl_->slab(number, context); }
void SolidStream::finish(Report& report) const { impl_->finish(report); }

SolidStream stream(const Mesh& model, Design design, const SlabPlan& plan, Grid grid, Report& report,
                   const Context& context) {
  auto impl = std::make_shared<SolidStream::Impl>(model, std::move(design), plan, grid, context.part(0, 0.3, "body"));
  const std::vector<std::string>& repairs = impl->voxels.repairs();
  report.model.repairs.insert(report.model.repairs.end(), repairs.begin(), repairs.end());
  impl->make_one_piece(context.part(0.3, 1, "one piece"));
  return SolidStream(std::move(impl));
}

}  // namespace fibrolite
