// SPDX-License-Identifier: Apache-2.0
// Grey pictures as PNG, in memory, with nothing in them but the pixels: the same bytes for the same picture.
#pragma once

#include <string>

#include "fibrolite/image.h"

namespace fibrolite {

/// 8 bits a pixel. Row 0 of the image becomes the lowest row of the picture, as y points up in a layer.
/// Source: PNG specification, ISO/IEC 15948.
[[nodiscard]] std::string png_upright(const GrayImage& image);

}  // namespace fibrolite
