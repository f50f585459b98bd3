// SPDX-License-Identifier: Apache-2.0
#include "read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

struct Descriptor {
  int fd;
  explicit Descriptor(const char* path) : fd(::open(path, O_RDONLY | O_CLOEXEC)) {}
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
};

}  // namespace

FileBytes read_file(const std::filesystem::path& path, const Context& context) {
  const auto unreadable = [&](int error) {
    return Error(Code::BadInput, "cannot read the file: " + std::system_category().message(error), path.string(),
                 error == EISDIR ? "give a file in it" : "check its name and permissions");
  };
  const Descriptor file(path.c_str());
  if (file.fd < 0) throw unreadable(errno);
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) throw unreadable(errno);
  if (S_ISDIR(status.st_mode)) throw unreadable(EISDIR);

  // One byte more than the size: the last read() then sees the end of the file at once.
  std::size_t capacity = std::max<std::size_t>(static_cast<std::size_t>(std::max<off_t>(status.st_size, 0)) + 1, 65536);
  std::size_t size = 0;
  auto bytes = std::make_unique_for_overwrite<char[]>(capacity);
  for (;;) {
    context.check();
    if (size == capacity) {
      auto larger = std::make_unique_for_overwrite<char[]>(2 * capacity);
      std::memcpy(larger.get(), bytes.get(), size);
      bytes = std::move(larger);
      capacity *= 2;
    }
    const ssize_t got = ::read(file.fd, bytes.get() + size, std::min(capacity - size, std::size_t{1} << 26));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw unreadable(errno);
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  if (size == 0) throw Error(Code::BadInput, "the file is empty", path.string(), "save it again");
  return {std::move(bytes), size};
}

}  // namespace fibrolite
