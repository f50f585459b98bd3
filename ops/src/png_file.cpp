// SPDX-License-Identifier: GPL-3.0-or-later
#include "png_file.h"

#include <png.h>

#include <string>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/file.h"

namespace fibrolite {
namespace {

/// libpng's description of an image, let go however it ends.
struct PngImage : png_image {
  PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(this); }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
};

}  // namespace

std::optional<GrayImage> plain_gray_png(std::span<const std::byte> file) {
  PngImage png;
  if (png_image_begin_read_from_memory(&png, file.data(), file.size()) == 0 || png.format != PNG_FORMAT_GRAY)
    return std::nullopt;
  constexpr png_uint_32 most = 1U << 15;
  if (png.width > most || png.height > most) return std::nullopt;
  GrayImage image(static_cast<int>(png.width), static_cast<int>(png.height));
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) return std::nullopt;
  return image;
}

void write_png_file(const std::filesystem::path& path, int width, int height, int channels,
                    std::span<const std::uint8_t> pixels) {
  PngImage png;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  OutputFile file(path);
  std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels.data(), 0, nullptr) == 0) {
    throw Error(Code::Io, "the picture cannot be encoded: " + std::string(png.message), path.string());
  }
  file.write(std::span<const std::byte>(bytes).first(size));
  file.commit();
}

}  // namespace fibrolite
