// SPDX-License-Identifier: GPL-3.0-or-later
// What each sample of a picture shows: a z-buffer. Private to picture.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/solid.h"
#include "picture_view.h"

namespace fibrolite {

/// One word per sample: the depth's bits above, what is seen below, so that the smallest word is the nearest surface
/// and a race between threads has one possible end.
class Raster {
 public:
  static constexpr std::uint64_t background = ~std::uint64_t{0};

  Raster(int width, int height)
      : width_(width), words_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), background) {}
  [[nodiscard]] std::uint64_t operator()(int x, int y) const { return words_[index(x, y)]; }

  [[nodiscard]] static bool empty(std::uint64_t word) { return word == background; }
  [[nodiscard]] static float depth_mm(std::uint64_t word);
  [[nodiscard]] static bool is_cap(std::uint64_t word) { return !empty(word) && id(word) >= first_cap; }
  [[nodiscard]] static std::uint32_t triangle(std::uint64_t word) { return id(word); }
  /// Of a cap: 0 at the solid's surface to 1 at the width of the outline or deeper.
  [[nodiscard]] static float cap_depth(std::uint64_t word) { return static_cast<float>(id(word) - first_cap) / 255.0F; }

  /// The parts of all front faces that the cut leaves. Parallel over triangles.
  void draw_surface(const Mesh& mesh, const View& view, const std::optional<CutPlane>& cut, const Context& context);
  /// The cut face: wherever the plane lies in the solid. `outline_mm`: width of its outline.
  void draw_cap(const Solid& solid, const Box3d& bounds, const View& view, const CutPlane& cut, double outline_mm,
                const Context& context);

 private:
  static constexpr std::uint32_t first_cap = 0xFFFFFE00;
  [[nodiscard]] static std::uint32_t id(std::uint64_t word) { return static_cast<std::uint32_t>(word); }
  [[nodiscard]] static std::uint64_t pack(float depth_mm, std::uint32_t id);
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  void put(int x, int y, std::uint64_t word);

  int width_;
  std::vector<std::uint64_t> words_;
};

}  // namespace fibrolite
