// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t buffer_bytes = std::size_t{1} << 20;

// Names of the uncommitted files of this process. Slots are only ever added,
// and whoever takes a name out of its slot (the owner or
// discard_uncommitted_files()) has it alone: no locks, so it works from a
// signal handler.
struct Slot {
  std::atomic<char*> name{nullptr};
  Slot* next = nullptr;
};
std::atomic<Slot*> slots{nullptr};

Slot* register_name(const std::string& name) {
  char* copy = new char[name.size() + 1];
  std::memcpy(copy, name.c_str(), name.size() + 1);
  for (Slot* slot = slots.load(); slot != nullptr; slot = slot->next) {
    char* none = nullptr;
    if (slot->name.compare_exchange_strong(none, copy)) return slot;
  }
  Slot* slot = new Slot;
  slot->name = copy;
  slot->next = slots.load();
  while (!slots.compare_exchange_weak(slot->next, slot)) {
  }
  return slot;
}

std::string system_reason(int error) { return std::system_category().message(error); }

// A link is followed, so that the file it points to is replaced and not the
// link.
fs::path followed(const fs::path& target) {
  std::error_code error;
  if (!fs::is_symlink(target, error)) return target;
  const fs::path real = fs::weakly_canonical(target, error);
  return error ? target : real;
}

fs::path folder_of(const fs::path& target) { return target.has_parent_path() ? target.parent_path() : fs::path("."); }

/// Returns errno, or 0.
int write_all(int fd, const std::byte* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(fd, data, std::min(size, std::size_t{1} << 30));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    data += written;
    size -= static_cast<std::size_t>(written);
  }
  return 0;
}

[[noreturn]] void fail_to_write(int error, const fs::path& target) {
  throw Error(Code::Io, "cannot write the output: " + system_reason(error), target.string(),
              error == ENOSPC || error == EDQUOT ? "free some space" : "choose another folder");
}

}  // namespace

struct OutputFile::State {
  fs::path target, hidden;
  int fd = -1;
  Slot* slot = nullptr;
  std::vector<std::byte> buffer;

  explicit State(const fs::path& asked) : target(followed(asked)) {
    const fs::path folder = folder_of(target);
    std::error_code error;
    if (!fs::is_directory(folder, error))
      throw Error(Code::Io, "the output folder does not exist", folder.string(), "make it first");
    if (!target.has_filename()) throw Error(Code::Io, "the output has no file name", target.string(), "give it one");
    const fs::file_status status = fs::status(target, error);
    if (fs::exists(status) && !fs::is_regular_file(status))
      throw Error(Code::Io, "the output exists and is not a regular file", target.string(), "choose another name");
    static std::atomic<unsigned> counter{0};
    do {
      std::string name = ".";
      name += target.filename().string();
      name += '.' + std::to_string(getpid()) + '-' + std::to_string(counter++) + ".part";
      hidden = folder / name;
      fd = ::open(hidden.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (fd < 0 && errno == EEXIST);
    if (fd < 0)
      throw Error(Code::Io, "cannot write into the output folder: " + system_reason(errno), folder.string(),
                  "choose another, or see to its permissions");
    slot = register_name(fs::absolute(hidden, error).string());
    buffer.reserve(buffer_bytes);
  }

  ~State() {
    if (fd >= 0) ::close(fd);
    if (char* name = slot == nullptr ? nullptr : slot->name.exchange(nullptr)) {
      ::unlink(name);
      delete[] name;
    }
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  [[noreturn]] void fail(int error) const { fail_to_write(error, target); }

  void put(const std::byte* data, std::size_t size) const {
    if (const int error = write_all(fd, data, size)) fail(error);
  }

  void flush() {
    put(buffer.data(), buffer.size());
    buffer.clear();
  }
};

OutputFile::OutputFile(fs::path target) : state_(std::make_unique<State>(std::move(target))) {}
OutputFile::~OutputFile() = default;
OutputFile::OutputFile(OutputFile&&) noexcept = default;
OutputFile& OutputFile::operator=(OutputFile&&) noexcept = default;

void OutputFile::write(std::span<const std::byte> bytes) {
  if (state_->buffer.size() + bytes.size() > buffer_bytes) state_->flush();
  if (bytes.size() >= buffer_bytes) return state_->put(bytes.data(), bytes.size());
  state_->buffer.insert(state_->buffer.end(), bytes.begin(), bytes.end());
}

void OutputFile::write(std::string_view text) { write(std::as_bytes(std::span(text))); }

void OutputFile::overwrite(std::uint64_t offset, std::span<const std::byte> bytes) {
  state_->flush();
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(state_->fd, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) state_->fail(errno);
    offset += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void OutputFile::commit() {
  State& state = *state_;
  state.flush();
  // Network file systems report a full disk only here or at close().
  if (::fsync(state.fd) != 0) state.fail(errno);
  if (::close(std::exchange(state.fd, -1)) != 0) state.fail(errno);
  char* name = state.slot->name.exchange(nullptr);
  if (name == nullptr) throw Error(Code::Cancelled, "the output was discarded", state.target.string());
  const int error = ::rename(name, state.target.c_str()) == 0 ? 0 : errno;
  if (error != 0) ::unlink(name);
  delete[] name;
  if (error != 0) state.fail(error);
  // The rename itself must survive a power cut; not every file system lets a
  // folder be synced, and the data is safe.
  if (const int folder = ::open(folder_of(state.target).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
}

ScratchFile::ScratchFile(const fs::path& folder) : folder_(folder) {
  const fs::path place = folder.empty() ? fs::path(".") : folder;
#ifdef O_TMPFILE
  fd_ = ::open(place.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd_ >= 0) return;
#endif
  // Not every file system has files without a name from the start.
  std::string name = (place / ".fibrolite-XXXXXX").string();
  fd_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (fd_ < 0)
    throw Error(Code::Io, "cannot write into the output folder: " + system_reason(errno), folder.string(),
                "choose another, or see to its permissions");
  ::unlink(name.c_str());
}

ScratchFile::~ScratchFile() { ::close(fd_); }

std::uint64_t ScratchFile::append(std::span<const std::byte> bytes) {
  if (const int error = write_all(fd_, bytes.data(), bytes.size())) fail_to_write(error, folder_);
  const std::uint64_t begin = size_;
  size_ += bytes.size();
  return begin;
}

void ScratchFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t got = ::pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      throw Error(Code::Io, "cannot read back what was written: " + (got < 0 ? system_reason(errno) : "it is cut off"),
                  folder_.string());
    }
    offset += static_cast<std::uint64_t>(got);
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
}

void discard_uncommitted_files() noexcept {
  for (Slot* slot = slots.load(); slot != nullptr; slot = slot->next)
    // The name is not freed: free() is not allowed in a signal handler, and the
    // process is about to end.
    if (const char* name = slot->name.exchange(nullptr)) ::unlink(name);
}

}  // namespace fibrolite
