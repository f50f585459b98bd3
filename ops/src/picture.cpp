// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/picture.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/file.h"
#include "picture_raster.h"
#include "picture_shade.h"
#include "picture_view.h"
#include "png_file.h"

namespace fibrolite {
namespace {

void check_params(const PictureParams& params) {
  const auto in_range = [](int px) { return px >= 16 && px <= 8192; };
  if (!in_range(params.width_px) || !in_range(params.height_px)) {
    throw Error(Code::BadRecipe, "a picture has 16 to 8192 pixels along each side");
  }
  if (norm(params.up) == 0) throw Error(Code::BadRecipe, "the picture's up direction is zero");
  if (!(params.margin >= 0 && params.margin < 0.5))
    throw Error(Code::BadRecipe, "the picture's margin is 0 to below 0.5");
  if (params.focus_mm && !(*params.focus_mm > 0))
    throw Error(Code::BadRecipe, "what a picture looks at closely is above 0 mm wide");
}

/// As many samples per pixel edge as about 150 MB of buffers allow, at most 3.
int samples_per_pixel_edge(const PictureParams& params) {
  const double pixels = static_cast<double>(params.width_px) * params.height_px;
  return pixels <= 2.1e6 ? 3 : pixels <= 4.5e6 ? 2 : 1;
}

struct Tone {
  Rgb shade;
  std::string name;
};

// From the palette of Okabe and Ito (2008), made for colour-blind readers: cool colours for columns, warm and earthen
// ones for bulk. Its vermilion is left to the joints. When all are used they come once more, darker.
Tone tone_of(int id, bool column) {
  struct Named {
    Rgb shade;
    const char* name;
  };
  static constexpr std::array<Named, 5> columns{{{{0, 114, 178}, "blue"},
                                                 {{86, 180, 233}, "sky blue"},
                                                 {{0, 158, 115}, "green"},
                                                 {{204, 121, 167}, "pink"},
                                                 {{96, 96, 190}, "violet"}}};
  static constexpr std::array<Named, 3> bulks{
      {{{238, 196, 72}, "yellow"}, {{164, 140, 88}, "brown"}, {{196, 206, 110}, "lime"}}};
  constexpr double darker = 0.6;
  const auto pick = [id](const auto& list) -> Tone {
    const int n = static_cast<int>(list.size()), place = ((id % (2 * n)) + 2 * n) % (2 * n);
    const auto& [shade, name] = list[static_cast<std::size_t>(place % n)];
    if (place < n) return {shade, name};
    const auto less = [](std::uint8_t channel) { return static_cast<std::uint8_t>(darker * channel); };
    return {{less(shade.r), less(shade.g), less(shade.b)}, std::string("dark ") + name};
  };
  return column ? pick(columns) : pick(bulks);
}

}  // namespace

RgbImage picture(const Mesh& surface, const Solid& solid, const PointColor& color, const PictureParams& params,
                 const Context& context) {
  check_params(params);
  const int samples = samples_per_pixel_edge(params);
  const std::optional<CutPlane> cut = choose_cut(surface, solid, color, params, context.part(0, 0.1, ""));
  const View view = choose_view(surface, cut, params, samples);
  Raster raster(view.width, view.height);
  raster.draw_surface(surface, view, cut, context.part(0.1, 0.3, ""));
  context.progress(0.3);
  if (cut) {
    const double outline_mm = 1.7 * samples / view.samples_per_mm;
    raster.draw_cap(solid, bounds(surface), view, *cut, outline_mm, context.part(0.3, 0.5, ""));
  }
  context.progress(0.5);
  const double inset_mm = 0.5 * solid.grid().voxel_mm;
  return shade(raster, surface, view, cut, color, params, samples, inset_mm, context.part(0.5, 1, ""));
}

void write_png(const std::filesystem::path& path, const RgbImage& image) {
  static_assert(sizeof(Rgb) == 3);
  const auto bytes = std::as_bytes(std::span(image.pixels));
  write_png_file(path, image.width, image.height, 3,
                 {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

Rgb part_color(int id, bool column) { return tone_of(id, column).shade; }

std::string color_name(int id, bool column) { return tone_of(id, column).name; }

std::string hex(Rgb color) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text = "#";
  for (const std::uint8_t channel : {color.r, color.g, color.b}) {
    text += digits[channel / 16];
    text += digits[channel % 16];
  }
  return text;
}

}  // namespace fibrolite
