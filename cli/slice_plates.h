// SPDX-License-Identifier: GPL-3.0-or-later
// Where a part's layers and pixels lie: round the part, or on a printer's plate.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/frame.h"
#include "fibrolite/slice_io.h"

namespace fibrolite::cli {

struct Printer {
  Vec3d size_mm{};
  int pixels_x = 0, pixels_y = 0;
  Screen screen{};
};
/// "sl1", "sl1s", or "WxHxD:PXxPY", e.g. "120.96x68.04x150:2560x1440". @throws UsageError.
[[nodiscard]] Printer parse_printer(const std::string& text);

struct PlateOptions {
  double layer_mm = 0.05;
  double pixel_mm = 0.05;
  std::optional<Printer> printer;
  bool tile = false;
};
/// `box`: of the part in the frame's coordinates. Without a printer: one plate that just holds the part. With one: the
/// whole plate, the part in its middle; with `tile`, as many plates as the part needs.
/// @throws UsageError: the part is larger than the printer, without `tile`; Error TooLarge: too many pixels or layers.
[[nodiscard]] std::vector<SlicePlate> make_plates(const Frame& frame, const Box3d& box, const PlateOptions& options);

}  // namespace fibrolite::cli
