// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/report.h"

#include <sys/resource.h>

#include <charconv>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

namespace fibrolite {
namespace {

using Json = nlohmann::ordered_json;  // prints NaN and infinity as null

Json list(Vec3d v) { return {v.x, v.y, v.z}; }
template <class Item>
Json array(const std::vector<Item>& items);  // below all the to_json that it calls

Json to_json(const ModelReport& model) {
  return {{"path", model.path},
          {"triangles", model.triangles},
          {"size_mm", list(model.size_mm)},
          {"volume_mm3", model.volume_mm3},
          {"repairs", model.repairs}};
}

Json to_json(const CaseStress& c) {
  return {{"load_case", c.load_case},
          {"axial", c.axial},
          {"transverse", {c.transverse[0], c.transverse[1]}},
          {"von_mises", c.von_mises},
          {"dominance", c.dominance},
          {"p99_von_mises", c.p99_von_mises},
          {"strain_energy_nmm", c.strain_energy_nmm},
          {"principal", {c.principal[0], c.principal[1], c.principal[2]}},
          {"principal_direction", list(c.principal_direction)}};
}

/// null where there are no fibres.
Json fibres_of(const PartReport& part) {
  if (part.fibres == 0) return nullptr;
  const FibreCensus &section = part.section, &micrograph = part.micrograph;
  return {{"template",
           {{"fibres", micrograph.fibres},
            {"mean_area_px2", micrograph.mean_area},
            {"membrane_px", micrograph.membrane},
            {"porosity", micrograph.porosity}}},
          {"section",
           {{"fibres", section.fibres},
            {"mean_area_mm2", section.mean_area},
            {"membrane_mm", section.membrane},
            {"porosity", section.porosity}}}};
}

/// null where nothing was coloured.
Json color_of(const PartReport& part) {
  if (part.color_hex.empty()) return nullptr;
  return {{"name", part.color_name}, {"hex", part.color_hex}};
}

Json to_json(const PartReport& part) {
  const Json stress = {{"axial", part.stress.axial},
                       {"transverse", {part.stress.transverse[0], part.stress.transverse[1]}},
                       {"von_mises", part.stress.von_mises},
                       {"load_cases", array(part.stress.cases)}};
  return {{"id", part.id},
          {"candidates", part.candidates},
          {"kind", part.kind},
          {"infill", part.infill},
          {"color", color_of(part)},
          {"volume_mm3", part.volume_mm3},
          {"lumen_mm3", part.lumen_mm3},
          {"infill_volume_mm3", part.infill_volume_mm3},
          {"fibres", part.fibres},
          {"mfs", fibres_of(part)},
          {"centroid_mm", list(part.centroid_mm)},
          {"axis", list(part.axis)},
          {"diameter_mm", part.diameter_mm},
          {"mean_stress_mpa", stress},
          {"dominance", part.stress.dominance},
          {"reason", part.reason}};
}

Json to_json(const InterfaceReport& interface) {
  return {{"parts", {interface.a, interface.b}},
          {"centroid_mm", list(interface.centroid_mm)},
          {"normal", list(interface.normal)},
          {"border", interface.radius_mm > 0 ? "mantle"
                     : interface.bent        ? "bent"
                                             : "plane"},
          {"area_mm2", interface.area_mm2},
          {"regions_before", interface.regions_before},
          {"regions_after", interface.regions_after},
          {"columns", interface.columns},
          {"columns_dropped", interface.columns_dropped},
          {"layer_area_mm2", interface.layer_area_mm2},
          {"union_area_mm2", interface.union_area_mm2},
          {"bridge_area_mm2", interface.bridge_area_mm2},
          {"bridge_mm3", {{"mst", interface.mst_bridge_mm3}, {"bbox", interface.bbox_bridge_mm3}}},
          {"contact_area_mm2", interface.contact_area_mm2},
          {"shell_area_mm2", interface.shell_area_mm2},
          {"demand_n", interface.demand_n},
          {"capacity_over_demand", interface.capacity_over_demand}};
}

Json to_json(const SolidReport& solid) {
  return {{"volume_mm3", solid.volume_mm3},
          {"fill_ratio", solid.fill_ratio},
          {"mass_g", solid.mass_g},
          {"pieces", solid.pieces},
          {"cavities", solid.cavities},
          {"cavity_volume_mm3", solid.cavity_volume_mm3},
          {"ties", solid.ties},
          {"specks_removed", solid.specks_removed},
          {"voids_filled", solid.voids_filled},
          {"dangling", solid.dangling},
          {"unreached", solid.unreached},
          {"neck_mm", solid.neck_mm},
          {"necks_thickened", solid.necks_thickened},
          {"tips_tied", solid.tips_tied},
          {"tips_removed", solid.tips_removed},
          {"active_voxels", solid.active_voxels},
          {"voxel_mm", solid.voxel_mm}};
}

Json to_json(const Selected& selected) {
  return {
      {"key", selected.key}, {"case", selected.load_case}, {"area_mm2", selected.area_mm2}, {"faces", selected.faces}};
}

Json to_json(const MeshCheck& mesh) {
  return {{"volume_mm3", mesh.volume_mm3},
          {"triangles", mesh.triangles},
          {"vertices", mesh.vertices},
          {"boundary_edges", mesh.boundary_edges},
          {"nonmanifold_edges", mesh.nonmanifold_edges},
          {"nonmanifold_vertices", mesh.nonmanifold_vertices},
          {"degenerate_triangles", mesh.degenerate_triangles},
          {"shells", mesh.shells}};
}

Json to_json(const PlaceReport& place) {
  return {{"place", place.name},
          {"volume_mm3", place.volume_mm3},
          {"max_von_mises_mpa", place.max_von_mises_mpa},
          {"p99_von_mises_mpa", place.p99_von_mises_mpa},
          {"failure_load_n", place.failure_load_n},
          {"weakest_mm", list(place.weakest_mm)}};
}

Json to_json(const StrengthReport& s) {
  return {{"load_case", s.load_case},
          {"load_n", s.load_n},
          {"compliance_nmm", s.compliance_n_mm},
          {"max_displacement_mm", s.max_displacement_mm},
          {"max_von_mises_mpa", s.max_von_mises_mpa},
          {"p99_von_mises_mpa", s.p99_von_mises_mpa},
          {"failure_load_n", s.failure_load_n},
          {"safety_factor", s.safety_factor},
          {"weakest_mm", list(s.weakest_mm)},
          {"weakest", s.weakest},
          {"places", array(s.places)},
          {"cells", s.cells},
          {"cell_mm", s.cell_mm},
          {"iterations", s.iterations},
          {"residual", s.residual}};
}

Json to_json(const PrintPlace& place) {
  return {{"at_mm", list(place.at_mm)}, {"mm", place.mm}, {"area_mm2", place.area_mm2}};
}

Json to_json(const PrintFault& fault) {
  return {{"places", fault.places},
          {"area_mm2", fault.area_mm2},
          {"volume_mm3", fault.volume_mm3},
          {"least_mm", fault.least_mm},
          {"worst", array(fault.worst)}};
}

Json to_json(const Drain& drain) {
  return {{"place_mm", list(drain.place_mm)},
          {"direction", list(drain.direction)},
          {"diameter_mm", 2 * drain.shape.radius_mm},
          {"length_mm", drain.length_mm},
          {"outward", drain.outward}};
}

Json to_json(const PrintReport& print) {
  Json overhangs = to_json(print.found.overhangs);
  overhangs["nodes_mm2"] = print.found.node_overhang_mm2;
  overhangs["lumen_mm2"] = print.found.lumen_mm2;
  return {{"thin_walls", to_json(print.found.thin_walls)},
          {"small_gaps", to_json(print.found.small_gaps)},
          {"overhangs", overhangs},
          {"drains", array(print.drains)},
          {"mended",
           {{"balls", print.thickened},
            {"pillars", print.pillars},
            {"crystal_stretched", print.stretched},
            {"voids_filled", print.voids_filled}}}};
}

Json to_json(const PlateReport& plate) {
  return {{"name", plate.name},
          {"layers", plate.layers},
          {"layer_mm", plate.layer_mm},
          {"pixel_mm", {plate.pixel_mm.x, plate.pixel_mm.y}},
          {"size_px", {plate.width, plate.height}},
          {"volume_mm3", plate.volume_mm3},
          {"area_mm2", plate.area_mm2}};
}

Json to_json(const StageReport& stage) {
  return {{"name", stage.name}, {"wall_s", stage.wall_s}, {"cpu_s", stage.cpu_s}, {"peak_rss_mb", stage.peak_rss_mb}};
}

template <class Item>
Json array(const std::vector<Item>& items) {
  Json json = Json::array();
  for (const Item& item : items) json.push_back(to_json(item));
  return json;
}

double wall_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_now_s() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    seconds += static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
               1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  }
  return seconds;
}

/// From the kernel's own mark; ru_maxrss would also count what a parent held before it started this program.
double peak_rss_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("VmHWM:")) continue;
    const auto digits = line.find_first_of("0123456789");
    long kib = 0;
    if (digits != std::string::npos) std::from_chars(line.data() + digits, line.data() + line.size(), kib);
    return static_cast<double>(kib) * 1024e-6;
  }
  return 0;
}

}  // namespace

double Report::sliced_mm3() const {
  double volume = 0;
  for (const PlateReport& plate : slices) volume += plate.volume_mm3;
  return volume;
}

std::string version() { return FIBROLITE_VERSION; }

std::string to_json(const Report& report) {
  Json json = {
      {"schema", 1},
      {"version", version()},
      {"command", report.command},
      {"formats", report.formats},
      {"infill", report.infill},
      {"recipe", Json::parse(to_json(with_joint_lengths(report.recipe)))},
      {"model", to_json(report.model)},
      {"partition",
       {{"threshold", report.threshold}, {"stable_from", report.stable_from}, {"stable_to", report.stable_to}}},
      {"verification",
       {{"tets", report.verification.tets},
        {"dof", report.verification.dof},
        {"iterations", report.verification.iterations},
        {"residual", report.verification.residual},
        {"equilibrium", report.verification.equilibrium},
        {"selected", array(report.verification.selected)}}},
      {"parts", array(report.parts)},
      {"interfaces", array(report.interfaces)},
      {"solid", to_json(report.solid)},
      {"mesh", to_json(report.mesh)},
      {"strength", array(report.strength)},
      {"threads", report.threads},
      {"stages", array(report.stages)},
      {"warnings", report.warnings}};
  if (report.print.checked) json["print"] = to_json(report.print);
  if (!report.slices.empty()) {
    json["slices"] = {{"volume_mm3", report.sliced_mm3()}, {"plates", array(report.slices)}};
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";  // a path need not be UTF-8
}

Stopwatch::Lap::Lap(std::vector<StageReport>& list, const char* stage)
    : out(&list), name(stage), wall0(wall_now_s()), cpu0(cpu_now_s()) {}

Stopwatch::Lap::~Lap() { out->push_back({name, wall_now_s() - wall0, cpu_now_s() - cpu0, peak_rss_mb()}); }

}  // namespace fibrolite
