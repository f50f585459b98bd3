// SPDX-License-Identifier: GPL-3.0-or-later
#include "summary.h"

#include <algorithm>
#include <cmath>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "terminal.h"

namespace fibrolite::cli {
namespace {

using Row = std::vector<std::string>;

/// Columns as wide as their widest cell; the last one is not padded.
std::string table(const std::vector<Row>& rows) {
  std::vector<std::size_t> width(rows.front().size(), 0);
  for (const Row& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], row[i].size());
  std::string text;
  for (const Row& row : rows) {
    for (std::size_t i = 0; i + 1 < row.size(); ++i) text += row[i] + std::string(width[i] - row[i].size() + 2, ' ');
    text += row.back() + "\n";
  }
  return text;
}

std::string measured(double value, int digits = 4) { return std::isfinite(value) ? number_text(value, digits) : "-"; }

std::string share(double part, double whole) {
  return whole > 0 && std::isfinite(part) ? number_text(100 * part / whole, 3) + " %" : "-";
}

std::string counted(std::int64_t number, const std::string& thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

std::string joints_line(const std::vector<InterfaceReport>& interfaces) {
  if (interfaces.empty()) return {};
  int columns = 0, dropped = 0;
  for (const InterfaceReport& interface : interfaces) {
    columns += interface.columns;
    dropped += interface.columns_dropped;
  }
  return "joints    " + std::to_string(interfaces.size()) + ", with " + counted(columns, "support column") + " (" +
         std::to_string(dropped) + " found no crystal)\n";
}

std::string parts_table(const std::vector<PartReport>& parts) {
  if (parts.empty()) return {};
  const bool coloured =
      std::any_of(parts.begin(), parts.end(), [](const PartReport& part) { return !part.color_hex.empty(); });
  std::vector<Row> rows{{"part", "kind", "infill", "volume mm3", "filled", "fibres", "diameter mm", "reason"}};
  if (coloured) rows.front().insert(rows.front().begin() + 2, "colour");
  for (const PartReport& part : parts) {
    rows.push_back({std::to_string(part.id), part.kind, part.infill.empty() ? "-" : part.infill,
                    measured(part.volume_mm3), share(part.infill_volume_mm3, part.lumen_mm3),
                    part.fibres > 0 ? std::to_string(part.fibres) : "-", measured(part.diameter_mm, 3), part.reason});
    if (coloured) rows.back().insert(rows.back().begin() + 2, part.color_name + " " + part.color_hex);
  }
  return table(rows) + "\n";
}

std::string strength_table(const std::vector<StrengthReport>& cases) {
  if (cases.empty()) return {};
  std::vector<Row> rows{{"load case", "load N", "fails at N", "safety", "p99 MPa", "compliance N mm", "breaks first"}};
  for (const StrengthReport& s : cases)
    rows.push_back({s.load_case, measured(s.load_n), measured(s.failure_load_n), measured(s.safety_factor, 3),
                    measured(s.p99_von_mises_mpa, 3), measured(s.compliance_n_mm), s.weakest});
  std::vector<Row> weak{{"load case", "place", "p99 MPa", "yields at N"}};
  for (const StrengthReport& s : cases) {
    for (std::size_t i = 0; i < std::min<std::size_t>(s.places.size(), 6); ++i)
      weak.push_back({s.load_case, s.places[i].name, measured(s.places[i].p99_von_mises_mpa, 3),
                      measured(s.places[i].failure_load_n)});
  }
  return table(rows) + "\n" + table(weak) + "\n";
}

std::string print_line(const PrintReport& print, const PrintParams& limits) {
  if (!print.checked) return {};
  const Printable& found = print.found;
  std::string text = "print     " + counted(found.thin_walls.places, "place") + " thinner than ";
  text += measured(limits.wall_mm) + " mm, " + counted(found.small_gaps.places, "gap") + " below ";
  text += measured(limits.gap_mm) + " mm";
  if (found.lumen_mm2 > 0)
    text += ", " + share(found.overhangs.area_mm2, found.lumen_mm2) + " of the faces inside overhang";
  if (!print.drains.empty()) text += ", " + counted(static_cast<std::int64_t>(print.drains.size()), "drain hole");
  return text + "\n";
}

std::string run_line(const Report& report) {
  double wall_s = 0, cpu_s = 0, peak_mb = 0;
  for (const StageReport& stage : report.stages) {
    wall_s += stage.wall_s;
    cpu_s += stage.cpu_s;
    peak_mb = std::max(peak_mb, stage.peak_rss_mb);
  }
  return "run       " + measured(wall_s, 3) + " s (" + measured(cpu_s, 3) + " s of CPU), " + measured(peak_mb, 3) +
         " MB of memory\n";
}

/// Warnings and files, and out with it. The outputs are what was asked for, and they are in place: a failing stdout is
/// let be.
void finish(std::string text, const Report& report, const std::vector<std::filesystem::path>& files) {
  for (const std::string& warning : report.warnings) text += "warning   " + warning + "\n";
  for (const std::filesystem::path& file : files) text += "wrote     " + file.string() + "\n";
  try {
    print(text);
  } catch (const Error&) {
  }
}

}  // namespace

void print_parts(const Report& report, const std::vector<std::filesystem::path>& files) {
  const std::string threshold = "threshold " + measured(report.threshold) + "\n";
  finish(parts_table(report.parts) + threshold + strength_table(report.strength), report, files);
}

void print_summary(const Report& report, const std::vector<std::filesystem::path>& files) {
  std::string text = parts_table(report.parts) + joints_line(report.interfaces);
  const SolidReport& solid = report.solid;
  text += "solid     " + measured(solid.mass_g) + " g, " + measured(solid.volume_mm3, 6) + " mm3, " +
          measured(100 * solid.fill_ratio, 3) + " % of the full model, " + counted(solid.pieces, "piece") + ", " +
          counted(solid.cavities, "closed void") + "\n";
  text += "mesh      " + std::to_string(report.mesh.triangles) + " triangles, " +
          (report.mesh.closed() ? "closed" : std::to_string(report.mesh.boundary_edges) + " open edges") + "; voxel " +
          measured(solid.voxel_mm) + " mm\n" + print_line(report.print, report.recipe.print);
  finish(text + run_line(report), report, files);
}

std::string layers_text(const std::vector<PlateReport>& plates) {
  const PlateReport& first = plates.front();
  std::int64_t layers = 0;
  for (const PlateReport& plate : plates) layers += plate.layers;
  std::string text = "layers    " + std::to_string(layers) + " of " + number_text(first.layer_mm) + " mm";
  if (plates.size() > 1) text += " on " + std::to_string(plates.size()) + " plates";
  text += "\npixels    " + std::to_string(first.width) + " x " + std::to_string(first.height) + " of ";
  return text + number_text(first.pixel_mm.x, 5) + " x " + number_text(first.pixel_mm.y, 5) + " mm\n";
}

void print_layers(const Report& report, const std::vector<std::filesystem::path>& files) {
  std::string text = layers_text(report.slices) + "volume    " + measured(report.sliced_mm3(), 6);
  text += " mm3 in the layers, " + measured(report.solid.volume_mm3, 6) + " mm3 of the solid\n";
  finish(text + run_line(report), report, files);
}

}  // namespace fibrolite::cli
