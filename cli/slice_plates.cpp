// SPDX-License-Identifier: GPL-3.0-or-later
#include "slice_plates.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "exit_codes.h"
#include "fibrolite/ops/text.h"

namespace fibrolite::cli {
namespace {

// Facts: the printers' profiles that come with PrusaSlicer.
struct NamedPrinter {
  const char* name;
  Printer printer;
};
constexpr std::array<NamedPrinter, 2> named_printers{
    {{"sl1", {{120.96, 68.04, 150}, 2560, 1440, {.portrait = true, .mirrored = true}}},
     {"sl1s", {{128, 81, 150}, 2560, 1620, {.portrait = true, .mirrored = true}}}}};

std::string size_text(Vec3d size) {
  return number_text(size.x, 5) + " x " + number_text(size.y, 5) + " x " + number_text(size.z, 5) + " mm";
}

/// How many pieces of a length cover another; a hair more than one does not make two.
int pieces(double whole, double one) { return std::max(1, static_cast<int>(std::ceil(whole / one - 1e-6))); }

}  // namespace

Printer parse_printer(const std::string& text) {
  for (const NamedPrinter& known : named_printers)
    if (text == known.name) return known.printer;
  std::array<double, 5> value{};
  constexpr std::array<char, 5> after{'x', 'x', ':', 'x', '\0'};
  const char* at = text.data();
  const char* const end = at + text.size();
  bool good = true;
  for (std::size_t i = 0; i < value.size() && good; ++i) {
    const auto [stop, error] = std::from_chars(at, end, value[i]);
    good = error == std::errc{} && std::isfinite(value[i]) && value[i] > 0 &&
           (after[i] == '\0' ? stop == end : stop != end && *stop == after[i]);
    at = stop + 1;
  }
  constexpr double most = std::numeric_limits<int>::max();
  good = good && std::floor(value[3]) == value[3] && std::floor(value[4]) == value[4] && value[3] * value[4] <= most;
  if (!good) {
    std::string what = "--printer cannot be '";
    throw UsageError(what.append(text).append("'"), "command line",
                     "use sl1, sl1s, or width x depth x height in mm and pixels: 120.96x68.04x150:2560x1440");
  }
  return {{value[0], value[1], value[2]}, static_cast<int>(value[3]), static_cast<int>(value[4]), {}};
}

std::vector<SlicePlate> make_plates(const Frame& frame, const Box3d& box, const PlateOptions& options) {
  if (!options.printer) return {{"", slice_grid(frame, box, {options.pixel_mm, options.pixel_mm}, options.layer_mm)}};
  const Printer& printer = *options.printer;
  const Vec2d pixel{printer.size_mm.x / printer.pixels_x, printer.size_mm.y / printer.pixels_y};
  const int layers = slice_grid(frame, box, pixel, options.layer_mm).layers;
  const int layers_a_plate = static_cast<int>(std::floor(printer.size_mm.z / options.layer_mm + 1e-6));
  if (layers_a_plate < 1) throw UsageError("a layer is higher than the printer", "--layer", "use thinner layers");
  const int nx = pieces(box.size().x, printer.size_mm.x), ny = pieces(box.size().y, printer.size_mm.y),
            nz = (layers + layers_a_plate - 1) / layers_a_plate;
  if (nx * ny * nz > 1 && !options.tile) {
    std::string what = "the part, ";
    what += size_text(box.size());
    what += ", is larger than the printer, ";
    throw UsageError(what += size_text(printer.size_mm), "--printer",
                     "use --tile to cut it into plates, or --size to scale it");
  }
  const Vec3d first{box.center().x - 0.5 * nx * printer.size_mm.x, box.center().y - 0.5 * ny * printer.size_mm.y,
                    box.min.z};
  std::vector<SlicePlate> plates;
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        SlicePlate& plate = plates.emplace_back();
        if (nx * ny * nz > 1) {
          plate.name = "plate";
          for (const int n : {x, y, z}) plate.name.append("_").append(std::to_string(n + 1));
        }
        plate.grid = {frame,
                      pixel,
                      options.layer_mm,
                      printer.pixels_x,
                      printer.pixels_y,
                      std::min(layers_a_plate, layers - z * layers_a_plate)};
        plate.grid.frame.origin = frame.to_world(
            first + Vec3d{x * printer.size_mm.x, y * printer.size_mm.y, z * layers_a_plate * options.layer_mm});
      }
    }
  }
  return plates;
}

}  // namespace fibrolite::cli
