// SPDX-License-Identifier: GPL-3.0-or-later
// What the program must hold on real models: one line per requirement, with the number measured and ok or FAIL. Minutes
// to run, so not a ctest:  acceptance MODELS_FOLDER [WORK_FOLDER [SECTION...]]; rotations:MODEL is that model alone
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>

#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/prepare.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/random.h"
#include "fibrolite/winding.h"
#include "mesh_checks.h"
#include "run_program.h"

namespace {

using namespace fibrolite;
using namespace fibrolite::testing;
using nlohmann::json;
namespace fs = std::filesystem;

struct Table {
  fs::path models, work;
  std::set<std::string> only{};  ///< Names of models to which `rotations` keeps; all if empty.
  int failed = 0;

  void row(const std::string& what, const std::string& measured, bool holds) {
    std::printf("%-4s %-62s %s\n", holds ? "ok" : "FAIL", what.c_str(), measured.c_str());
    std::fflush(stdout);
    failed += holds ? 0 : 1;
  }
  void row(const std::string& what, double measured, double least, double most) {
    row(what, number_text(measured) + "  (" + number_text(least) + " to " + number_text(most) + ")",
        measured >= least && measured <= most);
  }
  void equal(const std::string& what, const json& measured, const json& wanted) {
    row(what, measured.dump() + "  (" + wanted.dump() + ")", measured == wanted);
  }

  /// Runs `generate`, keeps WORK/NAME.stl and gives the report; empty if it failed.
  json generate(const std::string& name, const fs::path& model, const std::vector<std::string>& options) {
    std::vector<std::string> arguments{"generate", model, "-o", work / (name + ".stl"), "--overwrite", "--quiet"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished run = run_program(FIBROLITE_PROGRAM, arguments);
    if (run.code != 0) {
      row(name + ": exit code", std::to_string(run.code) + "  " + run.err.substr(0, run.err.find('\n')), false);
      return {};
    }
    return json::parse(content(work / (name + ".report.json")));
  }
  /// Runs `verify --solid` and gives the report; empty if it failed.
  json verify(const std::string& name, const fs::path& model, const std::vector<std::string>& options) {
    const fs::path report = work / (name + ".report.json");
    std::vector<std::string> arguments{"verify", model,         "-o",     work / (name + ".vtu"), "--solid", "--report",
                                       report,   "--overwrite", "--quiet"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished run = run_program(FIBROLITE_PROGRAM, arguments);
    if (run.code != 0) {
      row(name + ": exit code", std::to_string(run.code) + "  " + run.err.substr(0, run.err.find('\n')), false);
      return {};
    }
    return json::parse(content(report));
  }
};

double number(const json& value) { return value.get<double>(); }
Vec3d vector(const json& list) { return {number(list[0]), number(list[1]), number(list[2])}; }

std::vector<json> parts_of(const json& report, const char* kind) {
  std::vector<json> parts;
  for (const json& part : report["parts"])
    if (part["kind"] == kind) parts.push_back(part);
  return parts;
}

// ---- a solid that one can print

/// PrusaSlicer's opinion, "key = value" a line; empty if it is not installed.
std::map<std::string, std::string> slicer_info(const fs::path& mesh) {
  if (!fs::exists("/usr/bin/prusa-slicer")) return {};
  std::istringstream lines(run_program("/usr/bin/prusa-slicer", {"--info", mesh}).out);
  std::map<std::string, std::string> info;
  for (std::string line; std::getline(lines, line);)
    if (const auto equals = line.find(" = "); equals != std::string::npos)
      info[line.substr(0, equals)] = line.substr(equals + 3);
  return info;
}

void check_slicer(Table& table, const std::string& name) {
  auto info = slicer_info(table.work / (name + ".stl"));
  if (info.empty()) return;
  table.equal(name + ": slicer says manifold", info["manifold"], "yes");
  for (const char* repair : {"facets_reversed", "open_edges", "degenerate_facets", "facets_removed"})
    if (info.contains(repair)) table.equal(name + ": slicer counts " + repair, info[repair], "0");
}

void check_printable(Table& table, const std::string& name, const json& report) {
  table.equal(name + ": pieces of material", report["solid"]["pieces"], 1);
  std::int64_t defects = 0;
  for (const char* defect : {"boundary_edges", "nonmanifold_edges", "nonmanifold_vertices", "degenerate_triangles"})
    defects += report["mesh"][defect].get<std::int64_t>();
  table.equal(name + ": mesh defects, by the report", defects, 0);
  const IndependentCount counted = count(read_mesh(table.work / (name + ".stl")).mesh);
  table.equal(
      name + ": mesh defects, counted again on the file",
      counted.boundary_edges + counted.nonmanifold_edges + counted.nonmanifold_vertices + counted.degenerate_triangles,
      0);
  table.row(name + ": mesh volume / grid volume", counted.volume_mm3 / number(report["solid"]["volume_mm3"]), 0.99,
            1.01);
  check_slicer(table, name);
}

/// Nothing hangs free or by a neck too thin, and every joint is one region that touches both its sides.
void check_joined(Table& table, const std::string& name, const json& report) {
  table.equal(name + ": ends in the void", report["solid"]["dangling"], 0);
  table.equal(name + ": material on too thin a neck", report["solid"]["unreached"], 0);
  std::size_t sound = 0;
  for (const json& interface : report["interfaces"])
    sound += interface["regions_after"] == 1 && number(interface["contact_area_mm2"]) > 0 ? 1 : 0;
  table.equal(name + ": joints in one region, with contact", sound, report["interfaces"].size());
}

/// How far the written mesh reaches outside the model, in voxels.
void check_inside(Table& table, const std::string& name, const fs::path& model, double size_mm, double voxel_mm) {
  const WindingTree tree(prepare(read_mesh(model), {.size_mm = size_mm, .unit_mm = {}}).mesh);
  const Mesh made = read_mesh(table.work / (name + ".stl")).mesh;
  const std::size_t step = std::max<std::size_t>(1, made.vertices.size() / 50000);
  double farthest = 0;
  for (std::size_t i = 0; i < made.vertices.size(); i += step) {
    const Vec3d p = to_double(made.vertices[i]);
    if (tree.winding(p) < 0.5) farthest = std::max(farthest, tree.nearest(p).distance_mm);
  }
  table.row(name + ": reaches outside the model, voxels", farthest / voxel_mm, 0, 0.5);
}

void models(Table& table) {
  const std::set<std::string> clean{"armadillo.obj", "hand.obj", "spot.obj", "rocker-arm.obj", "fertility.off"};
  for (const char* file : {"horse.ply", "armadillo.obj", "hand.obj", "spot.obj", "rocker-arm.obj", "fertility.off",
                           "monkey.obj", "bunny-open.obj"}) {
    for (const char* infill : {"hybrid", "tcs", "mfs", "solid"}) {
      const std::string name = fs::path(file).stem().string() + "-" + infill;
      const json report = table.generate(name, table.models / file, {"--size", "100", "--infill", infill});
      if (report.is_null()) continue;
      check_printable(table, name, report);
      check_joined(table, name, report);
      if (infill != std::string("solid"))
        table.row(name + ": fill ratio", number(report["solid"]["fill_ratio"]), 0.1, 0.8);
      if (clean.contains(file))
        check_inside(table, name, table.models / file, 100, number(report["solid"]["voxel_mm"]));
    }
  }
}

// ---- the method

void horse(Table& table) {
  const json report = table.generate("horse300", table.models / "horse.ply",
                                     {"--size", "300", "--voxel", "0.4", "--picture", table.work / "horse300.png"});
  if (report.is_null()) return;
  check_printable(table, "horse300", report);
  // Legs: the four lowest columns. The model stands along the axis in which its columns run.
  std::vector<json> legs = parts_of(report, "column");
  int up = 0;
  for (int axis = 1; axis < 3; ++axis) {
    const auto along = [&](int k) {
      double sum = 0;
      for (const json& part : legs) sum += std::abs(number(part["axis"][static_cast<std::size_t>(k)]));
      return sum;
    };
    if (along(axis) > along(up)) up = axis;
  }
  const auto height = [&](const json& part) { return number(part["centroid_mm"][static_cast<std::size_t>(up)]); };
  std::sort(legs.begin(), legs.end(), [&](const json& a, const json& b) { return height(a) < height(b); });
  table.row("horse300: columns", static_cast<double>(legs.size()), 4, 10);
  legs.resize(std::min<std::size_t>(legs.size(), 4));
  std::set<int> leg_ids, jointed;
  for (const json& leg : legs) {
    const std::string name = "horse300 leg " + leg["id"].dump();
    leg_ids.insert(leg["id"].get<int>());
    table.equal(name + ": infill", leg["infill"], "mfs");
    table.row(name + ": material in its lumen", number(leg["infill_volume_mm3"]) / number(leg["lumen_mm3"]), 0.15, 1);
    table.row(name + ": fibres in its middle section", number(leg["fibres"]), 7, 1e9);
  }
  const std::vector<json> bulk = parts_of(report, "bulk");
  table.equal("horse300: bulk parts", bulk.size(), 1);
  if (!bulk.empty()) table.equal("horse300: infill of the bulk", bulk.front()["infill"], "tcs");
  for (const json& interface : report["interfaces"])
    for (const json& id : interface["parts"])
      if (leg_ids.contains(id.get<int>()) && interface["regions_after"] == 1) jointed.insert(id.get<int>());
  table.equal("horse300: legs with a sound joint", jointed.size(), 4);
  double wall_s = 0, judged_s = 0;
  for (const json& stage : report["stages"]) {
    wall_s += number(stage["wall_s"]);
    if (std::set<std::string>{"proxy", "diameter", "partition", "verify"}.contains(stage["name"]))
      judged_s += number(stage["wall_s"]);
  }
  std::printf("     horse300: %.1f s in all, %.1f s of it partition and verification\n", wall_s, judged_s);
}

void molar(Table& table) {
  const std::filesystem::path file = asset("molar");
  const Vec3d size = bounds(read_mesh(file).mesh).size();  // the paper's box
  table.row("molar: size", number_text(size.x) + " x " + number_text(size.y) + " x " + number_text(size.z) + " mm",
            norm(size - Vec3d{50, 40, 80}) < 0.1);
  std::map<std::string, double> mass;
  for (const char* infill : {"tcs", "hybrid", "mfs", "solid"}) {
    const json report = table.generate(std::string("molar-") + infill, file, {"--infill", infill});
    mass[infill] = report.is_null() ? std::nan("") : number(report["solid"]["mass_g"]);
  }
  const std::string masses = "tcs " + number_text(mass["tcs"], 4) + ", hybrid " + number_text(mass["hybrid"], 4) +
                             ", mfs " + number_text(mass["mfs"], 4) + ", solid " + number_text(mass["solid"], 4) + " g";
  table.row("molar: mass tcs < hybrid < mfs < solid", masses,
            mass["tcs"] < mass["hybrid"] && mass["hybrid"] < mass["mfs"] && mass["mfs"] < mass["solid"]);
  table.row("molar: hybrid / solid", mass["hybrid"] / mass["solid"], 0.30, 0.55);
}

/// The same parts: count, kinds, volumes; for each its worst volume ratio.
void check_same_parts(Table& table, const std::string& name, const json& a, const json& b) {
  table.equal(name + ": number of parts", b["parts"].size(), a["parts"].size());
  if (a["parts"].size() != b["parts"].size()) return;
  // A turned model may number its parts in another order: compare sorted by kind and volume.
  const auto sorted = [](const json& report) {
    std::vector<std::pair<std::string, double>> list;
    for (const json& part : report["parts"]) list.emplace_back(part["kind"], number(part["volume_mm3"]));
    std::sort(list.begin(), list.end());
    return list;
  };
  const auto pa = sorted(a), pb = sorted(b);
  double worst = 0;
  std::string kinds_a, kinds_b;
  for (std::size_t i = 0; i < pa.size(); ++i) {
    worst = std::max(worst, std::abs(pb[i].second / pa[i].second - 1));
    kinds_a += pa[i].first + " ";
    kinds_b += pb[i].first + " ";
  }
  table.equal(name + ": kinds of parts", kinds_b, kinds_a);
  table.row(name + ": worst difference of a part's volume", worst, 0, 0.01);
}

void voxels(Table& table) {
  // At 0.5 mm the default sticks of 0.8 mm would be thinner than two voxels: both with 1 mm.
  const std::vector<std::string> thick{"--size", "100",
                                       "--set",  "tcs.stick_mm=1",
                                       "--set",  "mfs.wall_mm=1",
                                       "--set",  "joint.column_mm=1",
                                       "--set",  "joint.min_wall_mm=1"};
  const auto with_voxel = [&](const char* voxel) {
    std::vector<std::string> options = thick;
    options.insert(options.end(), {"--voxel", voxel});
    return table.generate(std::string("quadruped-") + voxel, asset("quadruped"), options);
  };
  const json half = with_voxel("0.5"), eighth = with_voxel("0.125");
  if (half.is_null() || eighth.is_null()) return;
  check_same_parts(table, "quadruped at 0.5 and 0.125", half, eighth);
  table.equal("quadruped at 0.5 and 0.125: joints", eighth["interfaces"].size(), half["interfaces"].size());
  if (half["interfaces"].size() != eighth["interfaces"].size()) return;
  double moved = 0;
  bool same_columns = true;
  for (std::size_t i = 0; i < half["interfaces"].size(); ++i) {
    const json &a = half["interfaces"][i], &b = eighth["interfaces"][i];
    moved = std::max(moved, norm(vector(a["centroid_mm"]) - vector(b["centroid_mm"])));
    same_columns = same_columns && a["columns"] == b["columns"];
  }
  table.row("quadruped at 0.5 and 0.125: joints moved, mm", moved, 0, 1e-6);
  table.row("quadruped at 0.5 and 0.125: as many columns at each joint", same_columns ? "yes" : "no", same_columns);
}

void load(Table& table) {
  const json once = table.generate("cylinder", asset("cylinder_on_box"), {"--size", "60"});
  const json tenfold =
      table.generate("cylinder-10", asset("cylinder_on_box"), {"--size", "60", "--set", "verify.load_n=10000"});
  if (once.is_null() || tenfold.is_null()) return;
  table.equal("cylinder on box: columns under axial load", parts_of(once, "column").size(), 1);
  check_same_parts(table, "cylinder on box, force x 10", once, tenfold);
}

void turned_models(Table& table) {
  const Mesh mesh = prepare(read_mesh(asset("quadruped")), {.size_mm = 100, .unit_mm = {}}).mesh;
  const fs::path straight = table.work / "straight.ply";
  write_mesh(straight, mesh);
  const json upright = table.generate("upright", straight, {});
  if (upright.is_null()) return;
  const char* names[3] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    const fs::path file = table.work / "turned.ply";
    write_mesh(file, turned(mesh, axis, 1));
    const auto moved = [&](Vec3f v) {
      Mesh one;
      one.vertices = {v};
      const Vec3d to = to_double(turned(one, axis, 1).vertices.front());
      return Vec3d{std::round(to.x), std::round(to.y), std::round(to.z)};
    };
    // The load turns with the model: from above, and from where x has gone to.
    const Vec3d z = moved({0, 0, 1}), x = moved({1, 0, 0});
    const int up = z.x != 0 ? 0 : z.y != 0 ? 1 : 2;
    const std::string direction = std::string(z[up] < 0 ? "-" : "") + names[up];
    Vec3d zero{};  // where azimuth 0 points to: the next axis
    (up == 0 ? zero.y : up == 1 ? zero.z : zero.x) = 1;
    const double azimuth = std::atan2(dot(cross(zero, x), z), dot(zero, x)) * 180 / std::numbers::pi;
    const std::string name = std::string("turned about ") + names[axis];
    const json report = table.generate(std::string("turned-") + names[axis], file,
                                       {"--up", direction, "--set", "verify.azimuth_deg=" + number_text(azimuth)});
    if (report.is_null()) continue;
    check_same_parts(table, name, upright, report);
    table.row(name + ": volume of the solid / upright",
              number(report["solid"]["volume_mm3"]) / number(upright["solid"]["volume_mm3"]), 0.99, 1.01);
  }
}

/// Each model turned at random in its file, its load turned with it.
void rotations(Table& table) {
  std::vector<fs::path> files;
  for (const char* file : {"horse.ply", "armadillo.obj", "hand.obj", "spot.obj", "rocker-arm.obj", "fertility.off",
                           "monkey.obj", "bunny-open.obj"})
    files.push_back(table.models / file);
  for (const char* name :
       {"molar", "quadruped", "torus", "y", "bent_tube", "figure", "bracket", "cylinder_on_box", "rounded_box"})
    files.push_back(asset(name));
  std::uint64_t id = 0;
  for (const fs::path& file : files) {
    if (!table.only.empty() && !table.only.contains(file.stem())) {
      id += 3;
      continue;
    }
    const Mesh mesh = prepare(read_mesh(file), {.size_mm = 100, .unit_mm = {}}).mesh;
    std::optional<std::size_t> columns;  // of the first turn
    for (int turn = 0; turn < 3; ++turn) {
      Random random(1, "rotations", id++);
      const auto unit = [&] { return 2 * random.uniform() - 1; };
      Frame frame = frame_along({}, {unit(), unit(), unit() + 0.01});
      const double angle = std::numbers::pi * unit();
      const Vec3d x = std::cos(angle) * frame.x + std::sin(angle) * frame.y;
      frame = {{}, x, cross(frame.z, x), frame.z};
      Mesh turned_mesh = mesh;
      for (Vec3f& v : turned_mesh.vertices) v = to_float(frame.to_world(to_double(v)));
      const std::string name = file.stem().string() + "-turned-" + std::to_string(turn);
      const fs::path turned_file = table.work / (name + ".ply");
      write_mesh(turned_file, turned_mesh);
      const auto listed = [](Vec3d v) { return json::array({v.x, v.y, v.z}); };
      const auto load_case = [&](const char* load_name, Vec3d force) {
        return json{{"name", load_name},
                    {"supports", {{{"where", {{"lowest", {{"share", 0.05}, {"along", listed(frame.z)}}}}}}}},
                    {"forces",
                     {{{"force_n", 1000}, {"direction", listed(force)}, {"where", {{"seen_from", listed(frame.z)}}}}}}};
      };
      const json loads = {load_case("from above", -frame.z), load_case("at 45 degrees", -frame.z - frame.x)};
      const json report = table.generate(name, turned_file, {"--set", std::string("loads=").append(loads.dump())});
      if (report.is_null()) continue;
      check_printable(table, name, report);
      check_joined(table, name, report);
      const std::size_t found = parts_of(report, "column").size();
      table.equal(name + ": columns, as in the first turn", found, columns.value_or(found));
      columns = columns.value_or(found);
      std::printf("     %s: %s necks thickened\n", name.c_str(), report["solid"]["necks_thickened"].dump().c_str());
      fs::remove(table.work / (name + ".stl"));  // a hundred megabytes each
    }
  }
}

void shapes(Table& table) {
  for (const char* name : {"torus", "y", "bent_tube", "figure", "bracket", "molar"}) {
    const json report =
        table.generate(name, asset(name), {"--size", "100", "--picture", table.work / (std::string(name) + ".png")});
    if (report.is_null()) continue;
    check_printable(table, name, report);
    check_joined(table, name, report);
    std::string parts;
    for (const json& part : report["parts"])
      parts += part["kind"].get<std::string>() + " " + number_text(number(part["volume_mm3"]), 3) + "; ";
    std::printf("     %s: %s\n", name, parts.c_str());
    for (const json& interface : report["interfaces"]) {
      const std::string joint = std::string(name) + " joint " + interface["parts"].dump();
      table.equal(joint + ": regions of the layer", interface["regions_after"], 1);
      table.row(joint + ": layer / (union + bridges)",
                number(interface["layer_area_mm2"]) /
                    (number(interface["union_area_mm2"]) + number(interface["bridge_area_mm2"])),
                0.75, 1.25);
    }
  }
}

void threads(Table& table) {
  for (const char* count : {"1", "2"})
    table.generate(std::string("threads-") + count, table.models / "armadillo.obj",
                   {"--size", "100", "--threads", count, "-o", table.work / (std::string("threads-") + count + ".3mf"),
                    "-o", table.work / (std::string("threads-") + count + ".vdb")});
  for (const char* ending : {".stl", ".3mf", ".vdb"}) {
    const std::string one = content(table.work / (std::string("threads-1") + ending));
    const bool same = !one.empty() && one == content(table.work / (std::string("threads-2") + ending));
    table.row(std::string("armadillo on 1 and 2 threads: ") + ending, same ? "same bytes" : "differ", same);
  }
  const auto measured = [&](const char* count) {
    json report = json::parse(content(table.work / (std::string("threads-") + count + ".report.json")), nullptr, false);
    report.erase("stages");
    report.erase("threads");
    return report.dump();
  };
  const bool same = measured("1") == measured("2");
  table.row("armadillo on 1 and 2 threads: report", same ? "same" : "differs", same);
}

/// The paper's Fig. 11: where the lattice lies matters little.
void shifts(Table& table) {
  std::vector<double> volume, compliance;
  for (const char* shift : {"[0,0,0]", "[1.5,0,0]", "[0,1.5,3]", "[2,1,0.7]"}) {
    const std::string name = "monkey-shift-" + std::to_string(volume.size());
    const json report = table.verify(name, table.models / "monkey.obj",
                                     {"--size", "60", "--voxel", "0.3", "--infill", "tcs", "--set",
                                      std::string("tcs.shift_mm=") + shift, "--set", "loads=paper-compare"});
    if (report.is_null()) return;
    table.equal(name + ": pieces of material", report["solid"]["pieces"], 1);
    volume.push_back(number(report["solid"]["volume_mm3"]));
    compliance.push_back(number(report["strength"][0]["compliance_nmm"]));
  }
  const auto spread = [](const std::vector<double>& list) {
    const auto [low, high] = std::minmax_element(list.begin(), list.end());
    return *high / *low - 1;
  };
  table.row("monkey, four shifts: largest volume / smallest - 1", spread(volume), 0, 0.017);
  table.row("monkey, four shifts: largest compliance / smallest - 1", spread(compliance), 0, 0.05);
}

/// Fibres under a patch of load, beside others of the same mass.
void patch(Table& table) {
  struct Rival {
    const char* name;
    std::vector<std::string> options;
  };
  const std::vector<Rival> all{{"hybrid", {}},
                               {"gyroid", {"--infill", "gyroid"}},
                               {"sheet", {"--infill", "tcs", "--set", "tcs.cell_mm=13.4"}},
                               {"shell", {"--infill", "shell", "--set", "shell.thickness_mm=2.16"}}};
  std::map<std::string, std::array<double, 3>> measured;  // mass, loads from above and from the side
  for (const Rival& rival : all) {
    std::vector<std::string> options{"--size", "40",       "--voxel",
                                     "0.3",    "--recipe", fs::path(FIBROLITE_ASSETS) / "recipes" / "patch.json"};
    options.insert(options.end(), rival.options.begin(), rival.options.end());
    const json report = table.verify(std::string("patch-") + rival.name, asset("rounded_box"), options);
    if (report.is_null()) return;
    measured[rival.name] = {number(report["solid"]["mass_g"]), number(report["strength"][0]["failure_load_n"]),
                            number(report["strength"][1]["failure_load_n"])};
  }
  const auto& [mass, above, beside] = measured["gyroid"];
  for (const Rival& rival : all) {
    const auto& [own_mass, own_above, own_beside] = measured[rival.name];
    const bool hybrid = std::string(rival.name) == "hybrid";
    const std::string name = std::string("patch, ") + rival.name;
    table.row(name + ": mass / gyroid's", own_mass / mass, 0.99, 1.01);
    table.row(name + ": patch on top / gyroid's", own_above / above, hybrid ? 1.4 : 0, 1e9);
    table.row(name + ": patch on a side / gyroid's", own_beside / beside, hybrid ? 0.9 : 0, 1e9);
  }
}

const std::vector<std::pair<std::string, std::function<void(Table&)>>> sections{
    {"horse", horse},     {"models", models},        {"molar", molar},         {"voxels", voxels},
    {"load", load},       {"turned", turned_models}, {"rotations", rotations}, {"shapes", shapes},
    {"threads", threads}, {"shifts", shifts},        {"patch", patch}};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::printf("acceptance MODELS_FOLDER [WORK_FOLDER [SECTION...]]\nsections:");
    for (const auto& [name, check] : sections) std::printf(" %s", name.c_str());
    std::printf("\n");
    return 2;
  }
  Table table{argv[1], argc > 2 ? fs::path(argv[2]) : fs::temp_directory_path() / "fibrolite-acceptance"};
  fs::create_directories(table.work);
  std::set<std::string> wanted;
  for (int i = 3; i < argc; ++i) {
    const std::string argument = argv[i];  // SECTION or SECTION:MODEL
    const auto colon = argument.find(':');
    wanted.insert(argument.substr(0, colon));
    if (colon != std::string::npos) table.only.insert(argument.substr(colon + 1));
  }
  for (const auto& [name, check] : sections)
    if (wanted.empty() || wanted.contains(name)) check(table);
  std::printf("%d requirement%s failed\n", table.failed, table.failed == 1 ? "" : "s");
  return table.failed == 0 ? 0 : 1;
}
