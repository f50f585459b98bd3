// SPDX-License-Identifier: GPL-3.0-or-later
// Plain PNGs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "fibrolite/image.h"

namespace fibrolite {

/// A PNG of 8-bit gray values as they are; nothing if it is anything else.
[[nodiscard]] std::optional<GrayImage> plain_gray_png(std::span<const std::byte> file);
/// 8 bits a channel, one (gray) or three (red, green, blue); whole or absent. @throws Error Io.
void write_png_file(const std::filesystem::path& path, int width, int height, int channels,
                    std::span<const std::uint8_t> pixels);

}  // namespace fibrolite
