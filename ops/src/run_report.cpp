// SPDX-License-Identifier: GPL-3.0-or-later
// What hybridize() measured, into the report.
#include <algorithm>
#include <cmath>
#include <limits>

#include "fibrolite/ops/text.h"
#include "fibrolite/pieces.h"
#include "fibrolite/reach.h"
#include "run.h"

namespace fibrolite {
namespace {

void append(std::vector<std::string>& to, const std::vector<std::string>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

std::string too_weak(const InterfaceReport& joint, double yield_mpa) {
  const double solid = joint.area_mm2 * yield_mpa / joint.demand_n;
  return std::string("the joint between parts ")
      .append(std::to_string(joint.a))
      .append(" and ")
      .append(std::to_string(joint.b))
      .append(" can carry only ")
      .append(number_text(joint.capacity_over_demand, 2))
      .append(" of what the load puts through it")
      .append(solid < 1 ? ", and solid no more than " + number_text(solid, 2) +
                              ": check the load (verify.load_n, loads), --up and --size"
                        : std::string(": raise shell.thickness_mm or tcs.density, lower joint.spacing_mm, or keep the "
                                      "place solid (partition.overrides)"));
}

}  // namespace

void report_decisions(const Partition& partition, const Verification& verification, Report& report) {
  report.threshold = partition.threshold;
  report.stable_from = partition.stable_from;
  report.stable_to = partition.stable_to;
  report.verification = {verification.tets,     verification.dof,         verification.iterations,
                         verification.residual, verification.equilibrium, verification.selected};
  append(report.warnings, partition.notes);
  append(report.warnings, verification.notes);
}

void report_parts(const Parts& parts, const std::vector<Fill>& fills, const std::vector<PartVolumes>& volumes,
                  InfillKind infill, Report& report) {
  for (std::size_t i = 0; i < parts.parts.size(); ++i) {
    const Part& part = parts.parts[i];
    PartReport row;
    row.id = part.id();
    row.kind = name(part.kind());
    row.infill = name(infill_of(part, infill));
    row.candidates = part.candidates();
    row.volume_mm3 = volumes[i].part_mm3;
    row.lumen_mm3 = volumes[i].lumen_mm3;
    row.infill_volume_mm3 = volumes[i].infill_mm3;
    row.fibres = fills[i].fibres;
    row.section = fills[i].section;
    row.micrograph = fills[i].micrograph;
    row.centroid_mm = volumes[i].centroid_mm;
    row.axis = part.axis().mean();
    row.diameter_mm = part.diameter_mm();
    row.stress = part.stress();
    row.reason = part.reason();
    report.parts.push_back(row);
    append(report.warnings, fills[i].warnings);
  }
}

void report_joints(const std::vector<Interface>& interfaces, const std::vector<Joint>& joints,
                   const std::vector<double>& demand_n, const Recipe& recipe, Report& report) {
  const double layer_mm = joint_params(recipe).layer_mm;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const Joint& joint = joints[i];
    InterfaceReport row;
    row.a = interfaces[i].a;
    row.b = interfaces[i].b;
    row.centroid_mm = interfaces[i].frame.to_world({0, 0, 0.5 * interfaces[i].length_mm});
    row.radius_mm = interfaces[i].length_mm > 0 ? interfaces[i].radius_mm : 0;
    row.bent = !interfaces[i].bend.flat();
    row.normal = interfaces[i].surface().normal({});
    row.area_mm2 = interfaces[i].area_mm2;
    row.regions_before = joint.layer.regions_before;
    row.regions_after = joint.layer.regions_after;
    row.columns = static_cast<int>(joint.columns.size());
    row.columns_dropped = joint.columns_dropped;
    row.union_area_mm2 = joint.layer.union_area_mm2;
    row.bridge_area_mm2 = joint.layer.bridge_area_mm2;
    row.mst_bridge_mm3 = row.bbox_bridge_mm3 = layer_mm * joint.layer.bridge_area_mm2;
    (recipe.joint.bridge == Bridge::Mst ? row.bbox_bridge_mm3 : row.mst_bridge_mm3) =
        layer_mm * joint.layer.other_bridge_area_mm2;
    // A sleeve is a wall all round, whatever the rule for bridges.
    if (row.radius_mm > 0) row.mst_bridge_mm3 = row.bbox_bridge_mm3 = std::numeric_limits<double>::quiet_NaN();
    row.layer_area_mm2 =
        joint.layer.pixel_mm * joint.layer.pixel_mm *
        static_cast<double>(std::count(joint.layer.solid.pixels.begin(), joint.layer.solid.pixels.end(), 1));
    row.contact_area_mm2 = joint.contact_area_mm2;
    row.shell_area_mm2 = joint.layer.shell_area_mm2;
    row.demand_n = demand_n[i];
    row.capacity_over_demand = (row.contact_area_mm2 + row.shell_area_mm2) * recipe.material.yield_mpa / row.demand_n;
    report.interfaces.push_back(row);
    append(report.warnings, joint.warnings);
    if (row.capacity_over_demand < 1) report.warnings.push_back(too_weak(row, recipe.material.yield_mpa));
  }
}

void report_coarse(const Box3d& model, double voxel_mm, Report& report) {
  constexpr double least_voxels = 8;
  const Vec3d size = model.size();
  const double shortest = std::min({size.x, size.y, size.z});
  if (shortest >= least_voxels * voxel_mm) return;
  report.warnings.push_back("the model's shortest side, " + number_text(shortest, 4) + " mm, is only " +
                            number_text(shortest / voxel_mm, 2) + " voxels: its shape is lost; use --voxel " +
                            number_text(rounded_down(shortest / least_voxels)) + " or less");
}

void report_necks(double thinnest_mm, Grid grid, const PrintParams& limits, Report& report) {
  const double told = 2 * skin_mm(thinnest_mm, grid);
  report.solid.neck_mm = told;
  if (thinnest_mm <= 0 || told >= limits.wall_mm * (1 - 1e-6)) return;
  const double voxel = coarsest_voxel(thinnest_mm, limits.wall_mm);
  std::string remedy = "use thicker members, or a smaller print.wall_mm";
  if (grid.voxel_mm < voxel)
    remedy = "use a coarser --voxel";
  else if (voxel > 0)
    remedy = "use --voxel " + number_text(rounded_down(voxel)) + " or less";
  report.warnings.push_back("solid.neck_mm: necks were looked for below " + number_text(told, 2) +
                            " mm only, which is thinner than print.wall_mm, " + number_text(limits.wall_mm) + " mm; " +
                            remedy);
}

void report_solid(const Tied& tied, const std::vector<Fill>& fills, const Volumes& volumes, const Material& material,
                  Report& report) {
  SolidReport& out = report.solid;
  out.volume_mm3 = volumes.solid_mm3;
  out.fill_ratio = volumes.body_mm3 > 0 ? out.volume_mm3 / volumes.body_mm3 : 0;
  out.mass_g = out.volume_mm3 * 1e-3 * material.density_g_cm3;
  out.pieces = static_cast<std::int64_t>(tied.left.material.size());
  out.cavities = static_cast<std::int64_t>(tied.left.cavities.size());
  for (const Piece& cavity : tied.left.cavities) out.cavity_volume_mm3 += cavity.volume_mm3;
  out.ties = static_cast<std::int64_t>(tied.struts().size());
  out.necks_thickened = tied.necks;
  out.tips_tied = tied.tips_tied;
  out.tips_removed = tied.tips_removed;
  out.dangling = tied.dangling;
  for (const Fill& fill : fills) out.dangling += fill.free_edges;
  out.unreached = static_cast<std::int64_t>(tied.unreached.size());
  out.specks_removed = tied.dropped;
  out.voids_filled = tied.filled;
  report.model.volume_mm3 = volumes.body_mm3;
  const auto place = [](Vec3d p) {
    return number_text(p.x, 4) + ", " + number_text(p.y, 4) + ", " + number_text(p.z, 4);
  };
  if (out.unreached > 0)
    report.warnings.push_back("solid.unreached: " + std::to_string(out.unreached) +
                              (out.unreached == 1 ? " place hangs" : " places hang") + " on less than " +
                              number_text(out.neck_mm, 2) + " mm, the largest at " +
                              place(tied.unreached.front().sample_mm) + " mm: use a smaller --voxel");
  if (out.dangling > 0)
    report.warnings.push_back("solid.dangling: " + std::to_string(out.dangling) +
                              (out.dangling == 1 ? " member ends" : " members end") +
                              " in a void: use a smaller --voxel");
  if (out.pieces > 1) {
    report.warnings.push_back("the solid has " + std::to_string(out.pieces) +
                              " pieces: the model itself has pieces too far apart to tie");
  }
}

}  // namespace fibrolite
