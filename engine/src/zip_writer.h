// SPDX-License-Identifier: Apache-2.0
// A zip archive whose bytes depend on its content alone: fixed times, fixed blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fibrolite/file.h"

namespace fibrolite {

/// A stretch of a zip entry, deflated on its own, so that stretches can be made in parallel and put together in order.
struct DeflatedPiece {
  std::string bytes;
  std::uint32_t crc = 0;
  std::size_t raw_size = 0;
};
DeflatedPiece deflate_piece(std::string_view text);
/// As it is: for what is compressed already.
DeflatedPiece stored_piece(std::string bytes);

/// What passes 4 GB or 65535 entries is written as zip64 (APPNOTE 6.3.10, 4.3.14 and 4.5.3), any other archive without
/// a trace of it; one entry stays below 4 GB. Why not libzip: it deflates on one thread and needs the whole text at
/// once; a 3MF of 12 million triangles is 0.9 GB of text.
class ZipWriter {
 public:
  /// `most`: beyond it a place in the file is written as zip64 (lower for tests alone).
  explicit ZipWriter(OutputFile& file, std::uint64_t most = 0xFFFFFFFE) : file_(&file), most_(most) {}
  /// The pieces, in order, as one entry. @throws Error TooLarge: 4 GB.
  void add(const std::string& name, const std::vector<DeflatedPiece>& pieces);
  void add(const std::string& name, std::string_view text) { add(name, {deflate_piece(text)}); }
  /// The same piece by piece, for an entry that need not be in memory.
  void open(const std::string& name);
  void append(const DeflatedPiece& piece);
  void close();
  /// One stored_piece() as an entry.
  void add_stored(const std::string& name, const DeflatedPiece& piece);
  /// The directory. Last.
  void finish();

 private:
  struct Entry {
    std::string name;
    std::uint16_t method = 0;
    std::uint32_t crc = 0;
    std::uint64_t size = 0, raw_size = 0;

    void count(const DeflatedPiece& piece);
    /// What the local header and the directory share, up to the name's length. @throws Error TooLarge.
    [[nodiscard]] std::string fields(bool zip64) const;
  };
  void begin(const Entry& entry);
  void end(const Entry& entry);
  OutputFile* file_;
  Entry open_;
  std::uint64_t most_, offset_ = 0, entries_ = 0;
  std::string directory_;
};

}  // namespace fibrolite
