// SPDX-License-Identifier: GPL-3.0-or-later
// From a z-buffer to colours. Private to picture.
#pragma once

#include <optional>

#include "fibrolite/context.h"
#include "fibrolite/image.h"
#include "fibrolite/mesh.h"
#include "fibrolite/ops/picture.h"
#include "picture_raster.h"
#include "picture_view.h"

namespace fibrolite {

/// Light, occlusion, ground shadow and background; `samples` by `samples` of the raster make a pixel. Colours of a
/// surface are asked for `inset_mm` inside it.
[[nodiscard]] RgbImage shade(const Raster& raster, const Mesh& mesh, const View& view,
                             const std::optional<CutPlane>& cut, const PointColor& color, const PictureParams& params,
                             int samples, double inset_mm, const Context& context);

}  // namespace fibrolite
