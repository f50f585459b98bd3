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

constexpr std::uint32_t local_signature = 0x04034b50, directory_signature = 0x02014b50, end_signature = 0x06054b50;
constexpr std::uint16_t version = 20, method_store = 0, method_deflate = 8;
constexpr std::uint16_t time = 0, date = 0x21;  // 1980-01-01 00:00, the earliest a zip can say
// Twice the speed of the default for a twentieth more bytes on this kind of text.
constexpr int level = 4;
// An empty last block in fixed Huffman codes: ends the stream that the pieces make.
constexpr std::string_view end_of_stream{"\x03\x00", 2};

std::uint32_t narrow(std::uint64_t value) {
  if (value >= std::numeric_limits<std::uint32_t>::max())
    throw Error(Code::TooLarge, "the archive would be larger than 4 GB", "",
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

std::string ZipWriter::Entry::fields() const {
  std::string text;
  append_bytes(text, version);
  append_bytes(text, std::uint16_t{0});  // flags
  append_bytes(text, method);
  append_bytes(text, time);
  append_bytes(text, date);
  append_bytes(text, crc);
  append_bytes(text, narrow(size));
  append_bytes(text, narrow(raw_size));
  append_bytes(text, static_cast<std::uint16_t>(name.size()));
  append_bytes(text, std::uint16_t{0});  // extra field
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
  const std::string fields = open_.fields();
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
  if (entries_ == std::numeric_limits<std::uint16_t>::max())
    throw Error(Code::TooLarge, "the archive would have more than 65535 entries");
  std::string header;
  append_bytes(header, local_signature);
  file_->write(header + entry.fields() + entry.name);
}

void ZipWriter::end(const Entry& entry) {
  const std::string fields = entry.fields();
  append_bytes(directory_, directory_signature);
  append_bytes(directory_, version);
  directory_ += fields;
  directory_.append(10, '\0');  // comment size, disk, attributes
  append_bytes(directory_, narrow(offset_));
  directory_ += entry.name;
  ++entries_;
  offset_ += sizeof local_signature + fields.size() + entry.name.size() + entry.size;
}

void ZipWriter::finish() {
  std::string end;
  append_bytes(end, end_signature);
  append_bytes(end, std::uint32_t{0});  // disks
  append_bytes(end, entries_);
  append_bytes(end, entries_);
  append_bytes(end, narrow(directory_.size()));
  append_bytes(end, narrow(offset_));
  append_bytes(end, std::uint16_t{0});  // comment size
  file_->write(directory_);
  file_->write(end);
}

}  // namespace fibrolite
