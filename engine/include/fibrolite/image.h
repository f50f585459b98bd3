// SPDX-License-Identifier: Apache-2.0
// Plain raster images.
#pragma once

#include <cstdint>
#include <vector>

#include "fibrolite/mesh.h"
#include "fibrolite/vec.h"

namespace fibrolite {

/// Row-major, row 0 first. value(x, y) = pixels[y * width + x].
template <class T>
struct Image {
  int width = 0, height = 0;
  std::vector<T> pixels;

  Image() = default;
  Image(int w, int h, T fill = {})
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), fill) {}
  [[nodiscard]] T& operator()(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] const T& operator()(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};
using GrayImage = Image<std::uint8_t>;
using FloatImage = Image<float>;
using RgbImage = Image<Rgb>;

}  // namespace fibrolite
