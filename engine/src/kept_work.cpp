// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/kept_work.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/random.h"

namespace fibrolite {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view ending = ".kept", work_name = "work";
constexpr std::size_t chunk_bytes = std::size_t{1} << 20;

/// What ends a part's file: what it should be.
struct Seal {
  std::uint64_t bytes = 0;  // before it
  std::uint32_t checksum = 0;
  static constexpr std::size_t size = 12;
};

std::uint32_t add_to_checksum(std::uint32_t checksum, std::span<const std::byte> bytes) {
  if (bytes.empty()) return checksum;  // zlib starts anew where there is no address
  return static_cast<std::uint32_t>(crc32_z(checksum, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// Calls `use` with the next `bytes` of a file, a stretch at a time. Returns whether there are as many.
template <class Use>
bool read_through(std::ifstream& in, std::uint64_t bytes, const Context& context, const Use& use) {
  std::vector<std::byte> chunk(static_cast<std::size_t>(std::min<std::uint64_t>(bytes, chunk_bytes)));
  while (bytes > 0) {
    context.check();
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, chunk.size()));
    if (!in.read(reinterpret_cast<char*>(chunk.data()), static_cast<std::streamsize>(size))) return false;
    use(std::span<const std::byte>(chunk.data(), size));
    bytes -= size;
  }
  return true;
}

using Line = std::pair<std::string, std::string>;
/// Lines of a name and a value.
std::vector<Line> lines_of(const std::string& work) {
  std::vector<Line> lines;
  std::istringstream in(work);
  for (std::string line; std::getline(in, line);) {
    const std::size_t blank = line.find(' ');
    lines.emplace_back(line.substr(0, blank), blank == std::string::npos ? "" : line.substr(blank + 1));
  }
  return lines;
}

/// In words, the first line that is not in both.
std::string difference(const std::string& here, const std::string& there) {
  const std::vector<Line> mine = lines_of(here), others = lines_of(there);
  const auto named = [](const std::vector<Line>& lines, const std::string& name) {
    return std::find_if(lines.begin(), lines.end(), [&](const Line& line) { return line.first == name; });
  };
  const auto value = [](const std::string& text) { return text.size() > 60 ? "something else" : text; };
  for (const auto& [name, text] : mine) {
    const auto other = named(others, name);
    if (other == others.end()) return name + " was not there";
    if (other->second != text) return name + " was " + value(other->second) + ", now it is " + value(text);
  }
  for (const auto& [name, text] : others)
    if (named(mine, name) == mine.end()) return name + " was " + value(text) + ", now there is none";
  return "its list of options is another";
}

}  // namespace

KeptWork::KeptWork(fs::path folder, const std::string& work, const Context& context)
    : folder_(std::move(folder)), stamp_(ContentHash().add(work).text()) {
  std::error_code error;
  fs::create_directory(folder_, error);
  if (!fs::is_directory(folder_))
    throw Error(Code::Io, "what is finished cannot be kept" + (error ? ": " + error.message() : std::string()),
                folder_.string(), "remove what has this name, or choose another output");
  lock();
  try {
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) files.push_back(entry.path());
    const bool empty = std::none_of(files.begin(), files.end(),
                                    [](const fs::path& file) { return file.filename().string().ends_with(ending); });
    if (empty) fs::remove(folder_ / work_name, error);
    check_work(work);
    for (const fs::path& file : files) {
      const std::string name = file.filename().string();
      if (name.starts_with('.') && name.ends_with(".part")) fs::remove(file, error);  // half written
      if (!name.ends_with(ending)) continue;
      const std::string part = name.substr(0, name.size() - ending.size());
      if (sound(part, context)) {
        parts_.insert(part);
        continue;
      }
      fs::remove(file, error);
      context.log("what was kept is damaged, it is made again (" + file.string() + ")");
    }
    if (!fs::exists(folder_ / work_name)) {
      OutputFile file(folder_ / work_name);
      file.write(work);
      file.commit();
    }
  } catch (...) {
    if (lock_ >= 0) ::close(lock_);
    throw;
  }
}

KeptWork::~KeptWork() {
  if (lock_ >= 0) ::close(lock_);
}

void KeptWork::lock() {
  lock_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // Some network file systems have no locks: then nobody else is seen.
  if (lock_ < 0 || ::flock(lock_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(std::exchange(lock_, -1));
  throw Error(Code::Io, "another run is at work there", folder_.string(), "let it end, or choose another output");
}

void KeptWork::check_work(const std::string& work) const {
  std::ifstream in(folder_ / work_name, std::ios::binary);
  if (!in) return;
  const std::string kept{std::istreambuf_iterator<char>(in), {}};
  if (kept == work) return;
  throw Error(Code::BadInput, "what is kept there is of other work: " + difference(work, kept), folder_.string(),
              "give the command that was interrupted, or remove that folder");
}

fs::path KeptWork::file_of(const std::string& part) const { return folder_ / std::string(part).append(ending); }

bool KeptWork::sound(const std::string& part, const Context& context) const {
  const fs::path file = file_of(part);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size < Seal::size) return false;
  std::ifstream in(file, std::ios::binary);
  std::uint32_t checksum = 0;
  const auto add = [&](std::span<const std::byte> bytes) { checksum = add_to_checksum(checksum, bytes); };
  if (!read_through(in, size - Seal::size, context, add)) return false;
  Seal seal;
  in.read(reinterpret_cast<char*>(&seal.bytes), sizeof seal.bytes);
  in.read(reinterpret_cast<char*>(&seal.checksum), sizeof seal.checksum);
  if (!in || seal.bytes != size - Seal::size || seal.checksum != checksum) return false;
  try {
    Reader reader(file, seal.bytes);
    std::string stamp, name;
    reader.get_list(stamp);
    reader.get_list(name);
    return stamp == stamp_ && name == part;
  } catch (const Error&) {
    return false;
  }
}

KeptWork::Reader KeptWork::read(const std::string& part) const {
  const fs::path file = file_of(part);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size < Seal::size) throw Error(Code::Io, "cannot read back what was kept", file.string());
  Reader reader(file, size - Seal::size);
  std::string stamp, name;
  reader.get_list(stamp);
  reader.get_list(name);
  return reader;
}

KeptWork::Writer KeptWork::write(const std::string& part) { return {*this, part}; }

void KeptWork::discard() noexcept {
  std::error_code error;
  for (const std::string& part : parts_) fs::remove(file_of(part), error);
  parts_.clear();
  fs::remove(folder_ / work_name, error);
  fs::remove(folder_, error);
}

void KeptWork::Reader::check_left(std::uint64_t count, std::size_t each) const {
  if (count > left_ / each) throw Error(Code::Io, "cannot read back what was kept: it is cut off", path_.string());
}

void KeptWork::Reader::read(std::span<std::byte> bytes) {
  check_left(bytes.size(), 1);
  if (!in_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())))
    throw Error(Code::Io, "cannot read back what was kept", path_.string());
  left_ -= bytes.size();
}

KeptWork::Writer::Writer(KeptWork& work, std::string part)
    : work_(&work), part_(std::move(part)), file_(work.file_of(part_)) {
  put_list(work.stamp_);
  put_list(part_);
}

void KeptWork::Writer::write(std::span<const std::byte> bytes) {
  file_.write(bytes);
  checksum_ = add_to_checksum(checksum_, bytes);
  bytes_ += bytes.size();
}

void KeptWork::Writer::commit() {
  const Seal seal{bytes_, checksum_};
  file_.write(std::as_bytes(std::span(&seal.bytes, 1)));
  file_.write(std::as_bytes(std::span(&seal.checksum, 1)));
  file_.commit();
  work_->parts_.insert(part_);
}

ContentHash& ContentHash::add(std::span<const std::byte> bytes) {
  state_ = mix(state_ ^ bytes.size());
  while (!bytes.empty()) {
    std::uint64_t word = 0;
    const std::size_t size = std::min(bytes.size(), sizeof word);
    std::memcpy(&word, bytes.data(), size);
    state_ = mix(state_ ^ word);
    bytes = bytes.subspan(size);
  }
  return *this;
}

ContentHash& ContentHash::add_file(const fs::path& file, const Context& context) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  if (error || !read_through(in, size, context, [&](std::span<const std::byte> bytes) { add(bytes); }))
    throw Error(Code::BadInput, "cannot read the file", file.string());
  return *this;
}

std::string ContentHash::text() const {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) text.push_back(digits[state_ >> shift & 15]);
  return text;
}

}  // namespace fibrolite
