// SPDX-License-Identifier: Apache-2.0
#include "zip_writer.h"

#include <zlib.h>

#include <limits>
#include <span>
#include <utility>

#include "fibrolite/error.h"
#include "mesh_formats.h"

namespace fibrolite {
namespace {

constexpr std::uint32_t local_signature = 0x04034b50, directory_signature = 0x02014b50, end_signature = 0x06054b50,
                        end64_signature = 0x06064b50, locator_signature = 0x07064b50;
constexpr std::uint16_t version = 20, version64 = 45, method_store = 0, method_deflate = 8;
constexpr std::uint32_t in_zip64 = 0xFFFFFFFF;  ///< The field is too short: see there.
constexpr std::uint16_t time = 0, date = 0x21;  // 1980-01-01 00:00, the earliest a zip can say
// Twice the speed of the default for a twentieth more bytes on this kind of text.
constexpr int level = 4;
// An empty last block in fixed Huffman codes: ends the stream that the pieces make.
constexpr std::string_view end_of_stream{"\x03\x00", 2};

std::uint32_t narrow(std::uint64_t value) {
  if (value >= std::numeric_limits<std::uint32_t>::max())
    throw Error(Code::TooLarge, "an entry of the archive would be larger than 4 GB", "",
                "write another format, or use larger voxels or pixels");
  return static_cast<std::uint32_t>(value);
}

}  // namespace

DeflatedPiece deflate_piece(std::string_view text) {
  DeflatedPiece piece;
  piece.raw_size = text.size();
  // zlib takes bytes without const, and does not write to them.
  auto* const input = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(text.data()));
  piece.crc = static_cast<std::uint32_t>(crc32_z(0, input, text.size()));
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  piece.bytes.resize(deflateBound(&stream, static_cast<uLong>(text.size())) + 16);
  stream.next_in = input;
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(piece.bytes.data());
  stream.avail_out = static_cast<uInt>(piece.bytes.size());
  const int result = deflate(&stream, Z_SYNC_FLUSH);  // ends on a whole byte, without ending the stream
  piece.bytes.resize(piece.bytes.size() - stream.avail_out);
  deflateEnd(&stream);
  if (result != Z_OK || stream.avail_in != 0) throw Error(Code::Internal, "deflate failed");
  piece.bytes.shrink_to_fit();
  return piece;
}

DeflatedPiece stored_piece(std::string bytes) {
  DeflatedPiece piece;
  piece.raw_size = bytes.size();
  piece.crc = static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  piece.bytes = std::move(bytes);
  return piece;
}

void ZipWriter::Entry::count(const DeflatedPiece& piece) {
  crc = static_cast<std::uint32_t>(crc32_combine(crc, piece.crc, static_cast<z_off_t>(piece.raw_size)));
  size += piece.bytes.size();
  raw_size += piece.raw_size;
  // What grew too large is refused now, and not when it is done.
  static_cast<void>(narrow(size));
  static_cast<void>(narrow(raw_size));
}

std::string ZipWriter::Entry::fields(bool zip64) const {
  std::string text;
  append_bytes(text, zip64 ? version64 : version);
  append_bytes(text, std::uint16_t{0});  // flags
  append_bytes(text, method);
  append_bytes(text, time);
  append_bytes(text, date);
  append_bytes(text, crc);
  append_bytes(text, narrow(size));
  append_bytes(text, narrow(raw_size));
  append_bytes(text, static_cast<std::uint16_t>(name.size()));
  return text;
}

void ZipWriter::add(const std::string& name, const std::vector<DeflatedPiece>& pieces) {
  Entry entry{name, method_deflate, 0, end_of_stream.size(), 0};
  for (const DeflatedPiece& piece : pieces) entry.count(piece);
  begin(entry);
  for (const DeflatedPiece& piece : pieces) file_->write(piece.bytes);
  file_->write(end_of_stream);
  end(entry);
}

void ZipWriter::open(const std::string& name) {
  open_ = {name, method_deflate, 0, end_of_stream.size(), 0};
  begin(open_);
}

void ZipWriter::append(const DeflatedPiece& piece) {
  open_.count(piece);
  file_->write(piece.bytes);
}

void ZipWriter::close() {
  file_->write(end_of_stream);
  const std::string fields = open_.fields(false);
  file_->overwrite(offset_ + sizeof local_signature, std::as_bytes(std::span(fields)));
  end(open_);
}

void ZipWriter::add_stored(const std::string& name, const DeflatedPiece& piece) {
  Entry entry{name, method_store, 0, 0, 0};
  entry.count(piece);
  begin(entry);
  file_->write(piece.bytes);
  end(entry);
}

void ZipWriter::begin(const Entry& entry) {
  std::string header;
  append_bytes(header, local_signature);
  header += entry.fields(false);
  append_bytes(header, std::uint16_t{0});  // extra field
  file_->write(header + entry.name);
}

void ZipWriter::end(const Entry& entry) {
  const bool far = offset_ > most_;
  append_bytes(directory_, directory_signature);
  append_bytes(directory_, far ? version64 : version);  // made by
  directory_ += entry.fields(far);
  append_bytes(directory_, static_cast<std::uint16_t>(far ? 12 : 0));  // extra field
  directory_.append(10, '\0');                                         // comment size, disk, attributes
  append_bytes(directory_, far ? in_zip64 : static_cast<std::uint32_t>(offset_));
  directory_ += entry.name;
  if (far) {
    append_bytes(directory_, std::uint16_t{1});
    append_bytes(directory_, std::uint16_t{8});
    append_bytes(directory_, offset_);
  }
  ++entries_;
  offset_ += sizeof local_signature + entry.fields(false).size() + 2 + entry.name.size() + entry.size;
}

void ZipWriter::finish() {
  constexpr std::uint16_t many = std::numeric_limits<std::uint16_t>::max();
  std::string end;
  const bool zip64 = entries_ >= many || offset_ > most_ || directory_.size() > most_;
  if (zip64) {
    append_bytes(end, end64_signature);
    append_bytes(end, std::uint64_t{44});  // of this record, what follows
    append_bytes(end, version64);
    append_bytes(end, version64);
    append_bytes(end, std::uint64_t{0});  // disks
    append_bytes(end, entries_);
    append_bytes(end, entries_);
    append_bytes(end, std::uint64_t{directory_.size()});
    append_bytes(end, offset_);
    append_bytes(end, locator_signature);
    append_bytes(end, std::uint32_t{0});  // disk
    append_bytes(end, offset_ + directory_.size());
    append_bytes(end, std::uint32_t{1});  // disks
  }
  append_bytes(end, end_signature);
  append_bytes(end, std::uint32_t{0});  // disks
  const auto count = zip64 ? many : static_cast<std::uint16_t>(entries_);
  append_bytes(end, count);
  append_bytes(end, count);
  append_bytes(end, zip64 ? in_zip64 : static_cast<std::uint32_t>(directory_.size()));
  append_bytes(end, zip64 ? in_zip64 : static_cast<std::uint32_t>(offset_));
  append_bytes(end, std::uint16_t{0});  // comment size
  file_->write(directory_);
  file_->write(end);
}

}  // namespace fibrolite
