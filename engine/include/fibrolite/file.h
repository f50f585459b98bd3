// SPDX-License-Identifier: Apache-2.0
// Output files that are whole or absent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace fibrolite {

/// Writes to a hidden file beside `target`; commit() flushes it to disk and renames it over the target. If it is
/// destroyed uncommitted, nothing stays behind. Buffered. Not thread-safe.
class OutputFile {
 public:
  /// @throws Error Io: folder missing or not writable.
  explicit OutputFile(std::filesystem::path target);
  ~OutputFile();
  OutputFile(OutputFile&&) noexcept;
  OutputFile& operator=(OutputFile&&) noexcept;

  /// @throws Error Io: disk full or any other failure of the system.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);
  /// Replace bytes that were already written, at most as far as the file goes.
  void overwrite(std::uint64_t offset, std::span<const std::byte> bytes);
  /// @throws Error Io; Cancelled, if discard_uncommitted_files() came first.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Bytes that wait outside of memory, in a file without a name: gone with this object, however the process ends. Not
/// thread-safe.
class ScratchFile {
 public:
  /// @throws Error Io: the folder is missing or not writable.
  explicit ScratchFile(const std::filesystem::path& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  /// Returns where the bytes begin. @throws Error Io: disk full or any other failure of the system.
  std::uint64_t append(std::span<const std::byte> bytes);
  /// Bytes that were appended. @throws Error Io.
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;

 private:
  std::filesystem::path folder_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

/// Remove every uncommitted file of this process; for a signal handler's orderly end.
void discard_uncommitted_files() noexcept;

}  // namespace fibrolite
