// SPDX-License-Identifier: GPL-3.0-or-later
// The method on one screen (paper Fig. 1).
#include "fibrolite/ops/hybridize.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "fibrolite/blocks.h"
#include "fibrolite/ops/assemble.h"
#include "fibrolite/ops/measure.h"
#include "fibrolite/ops/stance.h"
#include "fibrolite/ops/tie.h"
#include "fibrolite/ops/trim.h"
#include "fibrolite/reach.h"
#include "fibrolite/realize.h"
#include "fibrolite/slice.h"
#include "fibrolite/to_solid.h"
#include "fibrolite/winding.h"
#include "run.h"

namespace fibrolite {

Hybrid hybridize(const Model& model, const HybridizeParams& params, Report& report, const Context& context) {
  Recipe recipe = params.recipe;
  const double voxel = choose_voxel(bounds(model.mesh), recipe, params.infill, params.voxel_mm);
  check_recipe(recipe, voxel, params.infill);
  check_overrides(recipe.partition.overrides, bounds(model.mesh));
  report_coarse(bounds(model.mesh), voxel, report);
  if (params.fix) report.print.stretched = stretch_to_print(recipe, params.infill);
  Run run(report, context);
  Hybrid out;

  // Parts (paper Sec. 4): everything that must not depend on the voxel is decided on a proxy and on the mesh itself.
  std::function<double(Vec3d, Vec3d)> traction_mpa;
  std::function<double(Vec3d)> stress_mpa;
  if (params.infill == InfillKind::Hybrid) {
    // Decided as the model stands under its load, however both lie in the file.
    const Frame stand = stance(recipe.verify);
    const VerifyParams load = in_stance(recipe.verify);
    const Proxy proxy =
        run("proxy", 0.02, [&](const Context& c) { return make_proxy(model.mesh, {.frame = stand}, c); });
    const Partition cut = find_candidates(proxy, recipe, load, report.stages, run.part("partition", 0.12));
    const Verification verified =
        run("verify", 0.35, [&](const Context& c) { return verify(proxy, cut, load, recipe.material, c); });
    report_decisions(cut, verified, report);
    out.parts = placed(verified.parts, stand);
    out.candidates = cut.labels.placed(stand);
    out.field = verified.field;
    traction_mpa = [stand, standing = verified.traction_mpa](Vec3d p, Vec3d n) {
      return standing(stand.to_local(p), stand.to_local(n));
    };
    stress_mpa = [stand, standing = verified.von_mises_mpa](Vec3d p) { return standing(stand.to_local(p)); };
  } else {
    out.parts = whole_body(model.mesh, params.infill == InfillKind::Mfs ? Kind::Column : Kind::Bulk);
  }

  // Interiors and joints (paper Sec. 5 and 6), as distance functions.
  const bool sections = params.infill == InfillKind::Hybrid || params.infill == InfillKind::Mfs;
  std::optional<WindingTree> model_tree;
  Shape model_distance;
  std::vector<Fill> fills;
  run("infill", 0.40, [&](const Context& c) {
    if (sections || recipe.tcs.grade != TcsGrade::None)
      model_distance = distance_to(model_tree.emplace(WindingTree(model.mesh)));
    const auto thickness = grading(bounds(model.mesh), model_distance, recipe, stress_mpa, c);
    if (thickness)
      recipe.tcs =
          at_density(recipe, *thickness, out.parts, params.infill, model.mesh, model_distance, voxel, report, c);
    for (const Part& p : out.parts.parts) fills.push_back(fill(p, params.infill, recipe, model_distance, thickness));
  });
  std::vector<double> demand_n;
  run("joints", 0.45, [&](const Context& c) {
    if (!recipe.joint.enabled || out.parts.parts.size() < 2) return;
    out.interfaces = interfaces(out.parts, model_distance, section_pixel(recipe), c);
    out.joints = join_all(out.parts, out.interfaces, fills, recipe, model_distance, c);
    for (const Interface& i : out.interfaces)
      demand_n.push_back(fibrolite::demand_n(i, out.parts.labels, model_distance, traction_mpa));
  });

  // One composed shape, made into voxels once, in one piece.
  const double neck_mm = tie_params(recipe, params.infill, everything(), voxel).neck_mm;
  const Grid grid = telling(neck_mm, {.voxel_mm = voxel});
  const double shell_mm = recipe.shell.thickness_mm;
  report_necks(neck_mm, grid, recipe.print, report);
  const AssembleParams assembly{.shell_mm = shell_mm, .overlap_mm = voxel};
  if (params.slabs) {
    out.stream = run("pieces", 1.0, [&](const Context& c) {
      Design design{params.infill, recipe, assembly, out.parts, std::move(fills), out.interfaces, out.joints, demand_n};
      return stream(model.mesh, std::move(design), *params.slabs, grid, params.kept, report, c);
    });
    return out;
  }
  const Solid body = run("body", 0.60, [&](const Context& c) {
    const ToSolidParams wanted{.grid = grid,
                               .inside_band_mm = depth_for_shell(shell_mm, voxel),
                               .tree = std::move(model_tree),
                               .most_bytes = params.most_bytes};
    ToSolidResult made = to_solid(model.mesh, wanted, c);
    report.model.repairs.insert(report.model.repairs.end(), made.repairs.begin(), made.repairs.end());
    return made.solid;
  });
  out.body = distance_to(body);
  const Shape whole = compose(out.body, out.parts, fills, out.joints, params.infill, recipe, assembly);
  Solid raw = run("realize", 0.80, [&](const Context& c) { return realize(whole, body, c); });
  const std::vector<Sticks> sticks = sticks_of(out.parts, fills);
  const TieParams ties = tie_params(recipe, params.infill, out.body, voxel);
  const Tied tied = run("one piece", 0.95, [&](const Context& c) {
    Tied made = tie(params.steps ? raw : std::exchange(raw, {}), whole, body, ties, c);
    return trim(std::move(made), whole, body, sticks, shell_mm, ties, c);
  });
  const Mended mended = run("print checks", 0.97, [&](const Context& c) {
    return checked_and_mended(tied, body, out.parts, fills, sticks, ties, recipe, params.fix, report, c);
  });
  out.solid = mended.tied.solid;

  run("measure", 1.0, [&](const Context& c) {
    std::vector<Shape> regions;
    for (const Part& part : out.parts.parts) regions.push_back(part.region());
    const Volumes volumes = measure(body, out.solid, regions, shell_mm, c);
    report_parts(out.parts, fills, volumes.parts, params.infill, report);
    report_joints(out.interfaces, out.joints, demand_n, recipe, report);
    report.solid.active_voxels = out.solid.active_voxels();
    report.solid.voxel_mm = voxel;
    report_solid(mended.tied, fills, volumes, recipe.material, report);
  });
  if (params.function) {
    const Shape smooth =
        compose(smooth_distance_to(body), out.parts, fills, out.joints, params.infill, recipe, assembly);
    out.printed = as_function(smooth, body, mended, blocks(body), context);
  }
  if (params.steps) out.steps = steps(body, raw, out, fills, mended, assembly);
  return out;
}

}  // namespace fibrolite
