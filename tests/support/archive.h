// SPDX-License-Identifier: GPL-3.0-or-later
// Reads zip archives and grey PNGs straight from their specifications, independently of the code that writes them.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

#include "fibrolite/image.h"

namespace fibrolite::testing {

inline std::uint32_t little(std::string_view bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = count - 1; i >= 0; --i)
    value = value << 8 | static_cast<unsigned char>(bytes.at(at + static_cast<std::size_t>(i)));
  return value;
}
inline std::uint64_t little64(std::string_view bytes, std::size_t at) {
  return little(bytes, at, 4) | std::uint64_t{little(bytes, at + 4, 4)} << 32;
}
inline std::uint32_t big(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes.at(at + i));
  return value;
}

/// `window`: 15 for zlib's format, -15 for bare deflate.
inline std::string inflated(std::string_view bytes, std::size_t size, int window) {
  std::string out(size, '\0');
  z_stream stream{};
  inflateInit2(&stream, window);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int result = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  if (result != Z_STREAM_END || stream.avail_out != 0) throw std::runtime_error("inflate failed");
  return out;
}

/// Entries by name, checked against their sums. Of zip64 what concerns many entries, and far ones.
inline std::map<std::string, std::string> unzipped(std::string_view zip) {
  std::map<std::string, std::string> entries;
  const std::size_t end = zip.size() - 22;
  if (little(zip, end, 4) != 0x06054b50) throw std::runtime_error("no end of directory");
  std::size_t at = little(zip, end + 16, 4);
  std::uint64_t n = little(zip, end + 10, 2);
  if (at == 0xFFFFFFFF) {
    if (little(zip, end - 20, 4) != 0x07064b50) throw std::runtime_error("no locator of zip64");
    const std::size_t end64 = little64(zip, end - 20 + 8);
    if (little(zip, end64, 4) != 0x06064b50) throw std::runtime_error("no end of directory of zip64");
    n = little64(zip, end64 + 32);
    at = little64(zip, end64 + 48);
  }
  for (; n > 0; --n) {
    if (little(zip, at, 4) != 0x02014b50) throw std::runtime_error("no entry in the directory");
    const std::uint32_t method = little(zip, at + 10, 2), crc = little(zip, at + 16, 4), size = little(zip, at + 20, 4),
                        raw = little(zip, at + 24, 4), name_size = little(zip, at + 28, 2),
                        extra_size = little(zip, at + 30, 2);
    std::size_t offset = little(zip, at + 42, 4);
    if (offset == 0xFFFFFFFF) {
      if (little(zip, at + 46 + name_size, 4) != 0x00080001) throw std::runtime_error("no place of zip64");
      offset = little64(zip, at + 46 + name_size + 4);
    }
    const std::string name(zip.substr(at + 46, name_size));
    if (zip.substr(offset + 30, name_size) != name) throw std::runtime_error("the local header has another name");
    const std::string_view data = zip.substr(offset + 30 + name_size, size);
    std::string text = method == 0 ? std::string(data) : inflated(data, raw, -15);
    if (crc32_z(0, reinterpret_cast<const Bytef*>(text.data()), text.size()) != crc || text.size() != raw)
      throw std::runtime_error("wrong sum of " + name);
    entries[name] = std::move(text);
    at += 46 + name_size + extra_size;
  }
  return entries;
}

/// Row 0 is the top one.
inline GrayImage grey_png(std::string_view png) {
  if (png.substr(0, 8) != std::string_view("\x89PNG\r\n\x1a\n", 8)) throw std::runtime_error("no PNG");
  std::string data;
  GrayImage image;
  for (std::size_t at = 8; at < png.size();) {
    const std::uint32_t size = big(png, at);
    const std::string_view name = png.substr(at + 4, 4), body = png.substr(at + 8, size);
    if (crc32_z(0, reinterpret_cast<const Bytef*>(name.data()), size + 4) != big(png, at + 8 + size))
      throw std::runtime_error("wrong sum of a chunk");
    if (name == "IHDR") {
      if (body.substr(8) != std::string_view("\x08\0\0\0\0", 5)) throw std::runtime_error("not 8-bit grey");
      image = GrayImage(static_cast<int>(big(body, 0)), static_cast<int>(big(body, 4)));
    }
    if (name == "IDAT") data += body;
    at += 12 + size;
  }
  const std::size_t stride = static_cast<std::size_t>(image.width) + 1;
  const std::string rows = inflated(data, stride * static_cast<std::size_t>(image.height), 15);
  for (int y = 0; y < image.height; ++y) {
    const std::string_view row = std::string_view(rows).substr(stride * static_cast<std::size_t>(y), stride);
    if (row[0] != 0 && row[0] != 2) throw std::runtime_error("a filter this reader does not know");
    for (int x = 0; x < image.width; ++x) {
      const int above = row[0] == 2 && y > 0 ? image(x, y - 1) : 0;
      image(x, y) = static_cast<std::uint8_t>(above + static_cast<unsigned char>(row[static_cast<std::size_t>(x) + 1]));
    }
  }
  return image;
}

}  // namespace fibrolite::testing
