// SPDX-License-Identifier: Apache-2.0
// Layers of a shape as files for printers.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/slice.h"

namespace fibrolite {

class KeptWork;  // kept_work.h

enum class SliceFormat {
  PngZip,  ///< .zip: an 8-bit grey PNG per layer (row 0 on top: y points up), and manifest.json.
  Sl1,     ///< .sl1: PNGs with config.ini and prusaslicer.ini, as PrusaSlicer and Prusa's resin printers read them.
  SvgZip,  ///< .svg.zip: an .svg per layer, in mm, and manifest.json.
  Svg,     ///< .svg: one file, a group per layer.
  Cli,     ///< .cli: Common Layer Interface 2.0, ASCII, units of 0.0001 mm; material to the left of its polylines.
  ThreeMf  ///< .3mf: a slice stack (3MF Slice Extension 1.0), with a box for a mesh; mm, four decimals.
};
/// By the ending, without case. @throws Error Unsupported: none of the above.
[[nodiscard]] SliceFormat slice_format(const std::filesystem::path& path);
/// Layers a file of this format can hold.
[[nodiscard]] int most_layers(SliceFormat format);

/// How a printer's screen shows a layer.
struct Screen {
  bool portrait = false;  ///< The picture's rows run along the printer's y axis.
  bool mirrored = false;  ///< Seen from below, through the vat.
};

/// A part of the work: one plate, one folder of the file.
struct SlicePlate {
  std::string name;  ///< Of the folder in the file; empty: none. Only a PngZip holds several plates.
  SliceGrid grid;
};
/// Layers up to `last` (which is not among them) can be cut from `shape`.
struct LayerRun {
  int last = 0;
  Shape shape;
};
struct SliceJob {
  Shape shape;
  std::vector<SlicePlate> plates;
  int planes = 1;    ///< As SliceParams.
  std::string name;  ///< Of the part; letters, digits, - and _ are kept, all else becomes _.
  Screen screen{};   ///< For Sl1.
  /// If given, what is cut instead of `shape`, for work that is never whole in memory: called for each plate with the
  /// first layer that is not yet written, in order.
  std::function<LayerRun(const SlicePlate& plate, int first)> run_from{};
  /// If given, layers are kept there as they are finished, and those that it holds are not made again. Its work must
  /// name all that a layer depends on: what is cut, plates, planes and screen.
  std::shared_ptr<KeptWork> kept{};
};
struct SlicedPlate {
  std::vector<double> area_mm2;  ///< Per layer.
  double volume_mm3 = 0;         ///< Their sum times the layer height.
};
/// Layers are made and compressed in parallel and written in order; a few are in memory at a time, whatever their
/// number. The same bytes on any number of threads. The file is whole or absent.
/// @throws Error Io: disk full or any other failure of the system; TooLarge: more layers, plates or bytes than the
/// format allows; Cancelled.
std::vector<SlicedPlate> write_slices(const std::filesystem::path& path, SliceFormat format, const SliceJob& job,
                                      const Context& context = {});

/// Memory that layers in work take at most, bytes.
[[nodiscard]] double slicing_memory(const SliceGrid& grid);

}  // namespace fibrolite
