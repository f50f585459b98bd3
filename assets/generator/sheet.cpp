// SPDX-License-Identifier: GPL-3.0-or-later
#include "sheet.h"

#include <string>
#include <vector>

#include "bundled_models.h"
#include "fibrolite/ops/picture.h"

namespace fibrolite {

RgbImage contact_sheet(int tile_px, const Context& context) {
  constexpr int columns = 4;
  const std::vector<std::string> names = bundled_model_names();
  const int count = static_cast<int>(names.size()), rows = (count + columns - 1) / columns;
  RgbImage sheet(columns * tile_px, rows * tile_px, Rgb{255, 255, 255});
  for (int i = 0; i < count; ++i) {
    const Mesh mesh = bundled_model(names[static_cast<std::size_t>(i)], context);
    PictureParams params;
    params.width_px = params.height_px = tile_px;
    params.cut = false;
    params.margin = 0.08;
    const RgbImage tile = picture(
        mesh, {}, [i](Vec3d) { return part_color(i, true); }, params, context);
    for (int y = 0; y < tile_px; ++y) {
      for (int x = 0; x < tile_px; ++x) sheet(i % columns * tile_px + x, i / columns * tile_px + y) = tile(x, y);
    }
  }
  return sheet;
}

}  // namespace fibrolite
