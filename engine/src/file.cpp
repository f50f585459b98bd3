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
#include <mutex>
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

[[noreturn]] void fail_as_discarded(const fs::path& target) {
  throw Error(Code::Cancelled, "the output was discarded", target.string());
}

fs::path hidden_name(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  std::string name = ".";
  name += target.filename().string();
  name += '.' + std::to_string(getpid()) + '-' + std::to_string(counter++) + ".part";
  return folder_of(target) / name;
}

/// A file under a hidden name beside its target, until it is moved there or removed.
class HiddenFile {
 public:
  HiddenFile() = default;
  ~HiddenFile() {
    if (char* name = slot_ == nullptr ? nullptr : slot_->name.exchange(nullptr)) {
      ::unlink(name);
      delete[] name;
    }
  }
  HiddenFile(const HiddenFile&) = delete;
  HiddenFile& operator=(const HiddenFile&) = delete;

  /// `make` makes a file of the name that it is given and returns errno, or 0; so does this.
  template <class Make>
  int create(const fs::path& target, const Make& make) {
    fs::path name;
    int error = EEXIST;
    while (error == EEXIST) error = make((name = hidden_name(target)).c_str());
    std::error_code ignored;
    if (error == 0) slot_ = register_name(fs::absolute(name, ignored).string());
    return error;
  }

  /// Returns errno, or 0; ECANCELED if it was discarded.
  int move_to(const fs::path& target) {
    char* name = slot_->name.exchange(nullptr);
    if (name == nullptr) return ECANCELED;
    const int error = ::rename(name, target.c_str()) == 0 ? 0 : errno;
    if (error != 0) ::unlink(name);
    delete[] name;
    return error;
  }

 private:
  Slot* slot_ = nullptr;
};

/// A new file to write to, or below 0 and errno.
int open_new(const char* name) { return ::open(name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666); }

std::string path_of(int fd) { return "/proc/self/fd/" + std::to_string(fd); }

/// A file without a name in the folder of `target`, for give_name(); below 0 where there are none.
int open_nameless([[maybe_unused]] const fs::path& target) {
#ifdef O_TMPFILE
  // A name that is too long is better refused now than in the end.
  struct stat status {};
  if (::lstat(hidden_name(target).c_str(), &status) != 0 && errno == ENAMETOOLONG) return -1;
  const int fd = ::open(folder_of(target).c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
  if (fd < 0 || ::access(path_of(fd).c_str(), F_OK) == 0) return fd;
  ::close(fd);
#endif
  return -1;
}

/// Returns errno, or 0.
int link_to(int fd, const char* name) {
  return ::linkat(AT_FDCWD, path_of(fd).c_str(), AT_FDCWD, name, AT_SYMLINK_FOLLOW) == 0 ? 0 : errno;
}

/// Returns errno, or 0.
int copy_to(int fd, const char* name) {
  const int copy = open_new(name);
  if (copy < 0) return errno;
  std::vector<std::byte> bytes(buffer_bytes);
  int error = 0;
  for (off_t at = 0; error == 0;) {
    const ssize_t got = ::pread(fd, bytes.data(), bytes.size(), at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) error = errno;
    if (got <= 0) break;
    error = write_all(copy, bytes.data(), static_cast<std::size_t>(got));
    at += got;
  }
  if (error == 0 && ::fsync(copy) != 0) error = errno;
  if (::close(copy) != 0 && error == 0) error = errno;
  if (error != 0) ::unlink(name);
  return error;
}

/// A whole file of open_nameless() becomes `target`. Returns errno, or 0.
int give_name(int fd, const fs::path& target) {
  if (link_to(fd, target.c_str()) == 0) return 0;
  // A rename replaces an old file, a link does not.
  HiddenFile hidden;
  const int error = hidden.create(target, [fd](const char* name) {
    const int linked = link_to(fd, name);
    // What a process may do can be restricted so that it may not link, but may write.
    return linked == 0 || linked == EEXIST ? linked : copy_to(fd, name);
  });
  return error == 0 ? hidden.move_to(target) : error;
}

// How often discard_uncommitted_files() was called.
std::atomic<unsigned> discards{0};

/// A target that a HeldOutput holds, and the file that was committed to it.
struct Held {
  fs::path target;
  int fd = -1;
};
std::mutex held_mutex;
std::vector<Held*> all_held;

/// Returns whether somebody holds the target, and so has the file now.
bool hand_over(int& fd, const fs::path& target) {
  const std::lock_guard lock(held_mutex);
  for (Held* held : all_held) {
    if (held->target != target) continue;
    if (held->fd >= 0) ::close(held->fd);
    held->fd = std::exchange(fd, -1);
    return true;
  }
  return false;
}

}  // namespace

struct OutputFile::State {
  fs::path target;
  int fd = -1;
  bool nameless = true;
  HiddenFile hidden;  // if not
  unsigned begun = discards;
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
    fd = open_nameless(target);
    if (fd < 0) {
      nameless = false;
      const int failed = hidden.create(target, [this](const char* name) {
        fd = open_new(name);
        return fd < 0 ? errno : 0;
      });
      if (failed != 0)
        throw Error(Code::Io, "cannot write into the output folder: " + system_reason(failed), folder.string(),
                    "choose another, or see to its permissions");
    }
    buffer.reserve(buffer_bytes);
  }

  ~State() {
    if (fd >= 0) ::close(fd);
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
  if (discards != state.begun) fail_as_discarded(state.target);
  if (state.nameless && hand_over(state.fd, state.target)) return;
  int error = 0;
  if (state.nameless && (error = give_name(state.fd, state.target)) != 0) state.fail(error);
  if (::close(std::exchange(state.fd, -1)) != 0) state.fail(errno);
  if (!state.nameless) error = state.hidden.move_to(state.target);
  if (error == ECANCELED) fail_as_discarded(state.target);
  if (error != 0) state.fail(error);
  sync_folder_of(state.target);
}

struct HeldOutput::State : Held {
  explicit State(const fs::path& asked) : Held{followed(asked)} {
    const std::lock_guard lock(held_mutex);
    all_held.push_back(this);
  }
  ~State() {
    const std::lock_guard lock(held_mutex);
    std::erase(all_held, this);
    if (fd >= 0) ::close(fd);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

HeldOutput::HeldOutput(fs::path target) : state_(std::make_unique<State>(std::move(target))) {}
HeldOutput::~HeldOutput() = default;
HeldOutput::HeldOutput(HeldOutput&&) noexcept = default;
HeldOutput& HeldOutput::operator=(HeldOutput&&) noexcept = default;

void HeldOutput::release() {
  int fd = -1;
  {
    const std::lock_guard lock(held_mutex);
    fd = std::exchange(state_->fd, -1);
  }
  if (fd < 0) return;
  const int error = give_name(fd, state_->target);
  ::close(fd);
  if (error != 0) fail_to_write(error, state_->target);
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

void sync_folder_of(const fs::path& file) {
  // Not every file system lets a folder be synced.
  if (const int folder = ::open(folder_of(file).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
}

void discard_uncommitted_files() noexcept {
  ++discards;
  for (Slot* slot = slots.load(); slot != nullptr; slot = slot->next)
    // The name is not freed: free() is not allowed in a signal handler, and the
    // process is about to end.
    if (const char* name = slot->name.exchange(nullptr)) ::unlink(name);
}

}  // namespace fibrolite
