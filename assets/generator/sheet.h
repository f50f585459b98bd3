// SPDX-License-Identifier: GPL-3.0-or-later
// All bundled models on one picture.
#pragma once

#include "fibrolite/context.h"
#include "fibrolite/image.h"

namespace fibrolite {

/// Four columns of tiles of `tile_px` pixels, in the order of bundled_model_names(), each model as large as its tile
/// allows.
[[nodiscard]] RgbImage contact_sheet(int tile_px, const Context& context = {});

}  // namespace fibrolite
