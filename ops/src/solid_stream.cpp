// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/solid_stream.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/trim.h"
#include "fibrolite/piece_sweep.h"
#include "fibrolite/reach.h"
#include "fibrolite/realize.h"
#include "fibrolite/slice.h"
#include "fibrolite/to_solid.h"
#include "kept_stream.h"
#include "print_limits.h"
#include "run.h"

namespace fibrolite {
namespace {

Context quiet(const Context& context) { return context.part(0, 0, ""); }
int& along(Vec3i& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

struct SolidStream::Impl {
  Impl(const Mesh& model, Design d, SlabPlan p, Grid g, std::shared_ptr<KeptWork> k, const Context& context)
      : design(std::move(d)),
        plan(std::move(p)),
        grid(g),
        kept(std::move(k)),
        voxels(model,
               {.grid = grid,
                .inside_band_mm = depth_for_shell(design.assembly.shell_mm, grid.voxel_mm),
                .most_bytes = plan.allowed_bytes},
               context) {
    for (const Part& part : design.parts.parts) regions.push_back(part.region());
    sticks = sticks_of(design.parts, design.fills);
    const PrintParams& limits = design.recipe.print;
    print_rules = patch_rules(limits, design.recipe.verify.up, node_mm(design.fills, limits), grid.voxel_mm);
    sums.volumes.parts.resize(regions.size());
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

  /// One piece, without ends of sticks in the void.
  void make(const Context& context) {
    const TieParams params = tie_params(design.recipe, design.infill, everything(), grid.voxel_mm);
    const Trimmed solid{[&] {
                          std::vector<LooseEnd> all;
                          for (StickSweep& part : along_sticks) {
                            const auto ends = part.finish(found.flips, surroundings(context));
                            all.insert(all.end(), ends.begin(), ends.end());
                          }
                          return all;
                        },
                        surroundings(context), [&] { make_one_piece(params, context); }};
    solid.remake();
    trim(made.tied, solid, grid.voxel_mm, params);
  }

  /// Loose pieces are tied, then what hangs on too thin a neck; specks and micro-voids are noted. As tie() does, but
  /// each loose thing is looked at with what lies around it alone.
  void make_one_piece(const TieParams& params, const Context& context) {
    made.tied.changes.emplace_back();
    for (int round = 0;; ++round) {
      sweep(params, context);
      if (found.left.material.empty()) {
        throw Error(Code::BadInput, "the mesh encloses no volume at this voxel", {},
                    "close it, give it thickness, or use a smaller --voxel");
      }
      if (round == tie_rounds || found.left.material.size() == 1 || !tie_loose(params, context)) break;
    }
    for (int round = 0; params.neck_mm > 0; ++round) {
      std::vector<Piece> left;
      if (!tie_necks(params, round < tie_rounds, left, context)) {
        made.tied.unreached = std::move(left);
        break;
      }
      sweep(params, context);
    }
    if (found.filled > 0 && found.left.material.size() > 1) recount(context);
    made.tied.dropped = found.dropped;
    made.tied.filled = found.filled;
    made.tied.left = found.left;
    if (made.tied.changes.back().struts.empty()) made.tied.changes.pop_back();
  }

  void sweep(const TieParams& params, const Context& context) {
    PieceSweep pieces(grid, {.axis = plan.axis, .clean = params.clean});
    PieceSweep necks(grid, {.axis = plan.axis, .skin_mm = skin_mm(params.neck_mm, grid)});
    along_sticks.clear();
    for (const Sticks& part : sticks) along_sticks.emplace_back(part, design.assembly.shell_mm, grid.voxel_mm);
    for (std::size_t i = 0; i < measured.size(); ++i) {
      context.check();
      const Solid body_here = body(i, 0, quiet(context)), solid = raw(body_here, quiet(context));
      for (StickSweep& part : along_sticks) part.add(body_here, solid, range(i), quiet(context));
      pieces.add(solid, range(i).low, range(i).high, nothing(), quiet(context));
      if (params.neck_mm > 0) {
        const Shape anchor = shell(distance_to(body_here), design.assembly.shell_mm);
        necks.add(solid, range(i).low, range(i).high, anchor, quiet(context));
      }
      context.progress(static_cast<double>(i + 1) / static_cast<double>(measured.size()));
    }
    found = pieces.finish();
    hanging = necks.finish();
  }

  /// A void that was filled may have been all that kept two pieces apart.
  void recount(const Context& context) {
    PieceSweep pieces(grid, {.axis = plan.axis});
    for (std::size_t i = 0; i < measured.size(); ++i) {
      context.check();
      const Solid solid = flipped(raw(body(i, 0, quiet(context)), quiet(context)), found.flips);
      pieces.add(solid, range(i).low, range(i).high, nothing(), quiet(context));
    }
    found.left = pieces.finish().left;
  }

  struct Window {
    Solid body, solid;
    Box3d inner;  ///< What does not touch its border.
  };
  [[nodiscard]] Window window(SampleBox box, double reach_mm, const Context& context) const {
    const auto reach = static_cast<int>(std::ceil(reach_mm / grid.voxel_mm)) + 8;
    for (int axis = 0; axis < 3; ++axis) {
      along(box.min, axis) -= reach;
      along(box.max, axis) += reach;
    }
    Window result;
    result.body = voxels.within(box, quiet(context));
    result.solid = flipped(raw(result.body, quiet(context)), found.flips);
    const auto corner = [&](Vec3i v) { return grid.voxel_mm * Vec3d{1.0 * v.x, 1.0 * v.y, 1.0 * v.z}; };
    result.inner.include(corner(box.min));
    result.inner.include(corner(box.max));
    result.inner = result.inner.grown(-4 * grid.voxel_mm);
    return result;
  }

  /// Boxes whose middles lie near each other share a window.
  [[nodiscard]] Surroundings surroundings(const Context& context) const {
    return
        [this, context](const std::vector<Box3d>& boxes, const std::function<void(std::size_t, const Solid&)>& visit) {
          constexpr double near_vox = 96;
          std::map<std::array<int, 3>, std::vector<std::size_t>> groups;
          for (std::size_t i = 0; i < boxes.size(); ++i) {
            const Vec3d middle = boxes[i].center();
            const auto cell = [&](double v) { return static_cast<int>(std::floor(v / (near_vox * grid.voxel_mm))); };
            groups[{cell(middle.x), cell(middle.y), cell(middle.z)}].push_back(i);
          }
          for (const auto& [place, group] : groups) {
            context.check();
            Box3d all;
            for (const std::size_t i : group) {
              all.include(boxes[i].min);
              all.include(boxes[i].max);
            }
            const auto low = [&](double v) { return static_cast<int>(std::floor(v / grid.voxel_mm)); };
            const SampleBox samples{{low(all.min.x), low(all.min.y), low(all.min.z)},
                                    {low(all.max.x) + 1, low(all.max.y) + 1, low(all.max.z) + 1}};
            const Window here = window(samples, 0, context);
            for (const std::size_t i : group) visit(i, here.solid);
          }
        };
  }

  /// A strut from each loose piece to the nearest other.
  bool tie_loose(const TieParams& params, const Context& context) {
    std::vector<Capsule> struts;
    for (std::size_t i = 1; i < found.left.material.size(); ++i) {
      const Window around = window(found.boxes[i], params.reach_mm, context);
      const auto gap = gap_from(around.solid, found.left.material[i].sample_mm, params.reach_mm, quiet(context));
      if (gap) struts.push_back(strut(*gap, params.strut_mm));
    }
    keep(struts);
    return !struts.empty();
  }

  /// A strut along each neck that is too thin. What leaves the window counts as reached: only what the sweep found,
  /// which lies well within, is asked about.
  bool tie_necks(const TieParams& params, bool tie, std::vector<Piece>& left, const Context& context) {
    const Shape there = capsules(made.tied.struts());
    std::vector<Capsule> struts;
    for (std::size_t i = 0; i < hanging.left.material.size(); ++i) {
      if (hanging.held[i]) continue;
      const Window around = window(hanging.boxes[i], params.reach_mm, context);
      const Shape anchor =
          unite({shell(distance_to(around.body), design.assembly.shell_mm), complement(cuboid(around.inner))});
      for (const Unreached& one : unreached(around.solid, anchor, {params.neck_mm, params.reach_mm}, quiet(context))) {
        const auto same = [&](const Piece& p) { return p.sample_mm == one.piece.sample_mm; };
        if (std::any_of(left.begin(), left.end(), same)) continue;  // seen in another window
        if (one.way && runs_in(*one.way, there)) continue;
        left.push_back(one.piece);
        if (one.way && tie) struts.push_back(strut(*one.way, params.strut_mm));
      }
    }
    made.tied.necks += static_cast<std::int64_t>(struts.size());
    keep(struts);
    return !struts.empty();
  }

  void keep(const std::vector<Capsule>& struts) {
    std::vector<Capsule>& all = made.tied.changes.back().struts;
    all.insert(all.end(), struts.begin(), struts.end());
  }

  Slab slab(std::size_t number, const Context& context) {
    Slab result{range(number), number, body(number, plan.margin_vox, quiet(context)), {}};
    context.check();
    result.solid = flipped(raw(result.body, quiet(context)), found.flips);
    context.check();
    if (!measured[number]) measure(number, result, context);
    return result;
  }

  [[nodiscard]] Shape printed(const Slab& slab, const Context& context) const {
    Mended mended = made;
    mended.tied.solid = slab.solid;
    std::vector<Vec3i> changed;
    const SampleRange known{plan.axis, slab.range.low - plan.margin_vox, slab.range.high + plan.margin_vox};
    for (const Flips::Block& block : found.flips.blocks)
      if (known.holds(block.origin)) changed.push_back(block.origin);
    return as_function(over(smooth_distance_to(slab.body)), slab.body, mended, changed, context);
  }

  /// The first pass, unless it was kept.
  void prepare(const Context& context) {
    if (kept && recall(*kept, made.tied, found.flips)) {
      for (std::size_t i = 0; i < measured.size(); ++i) {
        SlabSums slab;
        if (!recall(*kept, range(i), slab)) continue;
        sums.add(slab, print_rules);
        measured[i] = true;
      }
      context.log("resumed the first pass and what was measured of " +
                  std::to_string(std::count(measured.begin(), measured.end(), true)) + " of " +
                  std::to_string(measured.size()) + " slabs");
      return;
    }
    make(context);
    if (kept) fibrolite::keep(*kept, made.tied, found.flips);
  }

  void measure(std::size_t number, const Slab& slab, const Context& context) {
    const double shell_mm = design.assembly.shell_mm;
    SlabSums here;
    here.volumes = fibrolite::measure(slab.body, slab.solid, regions, shell_mm, slab.range, quiet(context));
    here.active_voxels = slab.solid.active_voxels(slab.range);
    if (design.recipe.print.check) {
      const Shape lumen = printed_lumen(distance_to(slab.body), shell_mm);
      here.print = print_tally(slab.solid, lumen, design.recipe.print, print_rules, slab.range, quiet(context));
    }
    if (kept) fibrolite::keep(*kept, slab.range, here);
    sums.add(here, print_rules);
    measured[number] = true;
  }

  void finish(Report& report, const Context& context) {
    for (std::size_t i = 0; i < measured.size(); ++i)
      if (!measured[i]) static_cast<void>(slab(i, context));
    const Volumes measured_all = volumes(sums.volumes, grid.voxel_mm);
    report_parts(design.parts, design.fills, measured_all.parts, design.infill, report);
    report_joints(design.interfaces, design.joints, design.demand_n, design.recipe, report);
    report.solid.active_voxels = sums.active_voxels;
    report.solid.voxel_mm = grid.voxel_mm;
    report_solid(made.tied, design.fills, measured_all, design.recipe.material, report);
    if (design.recipe.print.check) {
      report.print.found = sums.print.total(print_rules);
      report.print.checked = true;
    }
  }

  const Design design;
  const SlabPlan plan;
  const Grid grid;
  const std::shared_ptr<KeptWork> kept;
  const MeshVoxels voxels;
  std::vector<Shape> regions;
  std::vector<Sticks> sticks;
  PatchRules print_rules;
  Mended made;                           ///< The ties; the solid stays empty.
  PieceSweep::Result found, hanging;     ///< Pieces; and what a skin of half a neck cuts off.
  std::vector<StickSweep> along_sticks;  ///< One for each of sticks.
  std::vector<bool> measured;
  SlabSums sums;  ///< Of those.
};

const SlabPlan& SolidStream::plan() const { return impl_->plan; }
Grid SolidStream::grid() const { return impl_->grid; }
std::size_t SolidStream::slab_at(double mm) const {
  const std::vector<int>& borders = plan().borders;
  const auto above = std::upper_bound(borders.begin() + 1, borders.end() - 1, mm / grid().voxel_mm);
  return static_cast<std::size_t>(above - borders.begin()) - 1;
}
SolidStream::Slab SolidStream::slab(std::size_t number, const Context& context) { return impl_->slab(number, context); }
Shape SolidStream::printed(const Slab& slab, const Context& context) const { return impl_->printed(slab, context); }
void SolidStream::finish(Report& report, const Context& context) { impl_->finish(report, context); }

SolidStream stream(const Mesh& model, Design design, const SlabPlan& plan, Grid grid, std::shared_ptr<KeptWork> kept,
                   Report& report, const Context& context) {
  auto impl = std::make_shared<SolidStream::Impl>(model, std::move(design), plan, grid, std::move(kept),
                                                  context.part(0, 0.3, "body"));
  const std::vector<std::string>& repairs = impl->voxels.repairs();
  report.model.repairs.insert(report.model.repairs.end(), repairs.begin(), repairs.end());
  impl->prepare(context.part(0.3, 0.95, "one piece"));
  return SolidStream(std::move(impl));
}

}  // namespace fibrolite
