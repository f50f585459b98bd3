// SPDX-License-Identifier: Apache-2.0
// A whole file in memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string_view>

#include "fibrolite/context.h"

namespace fibrolite {

class FileBytes {
 public:
  FileBytes(std::unique_ptr<char[]> bytes, std::size_t size) : bytes_(std::move(bytes)), size_(size) {}
  [[nodiscard]] std::string_view view() const { return {bytes_.get(), size_}; }

 private:
  std::unique_ptr<char[]> bytes_;
  std::size_t size_;
};

/// Read, not memory-mapped: a file that another program shortens meanwhile must not end this one. Pipes work too.
/// @throws Error BadInput: missing, a folder, unreadable, empty.
FileBytes read_file(const std::filesystem::path& path, const Context& context);

}  // namespace fibrolite
