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

/// Writes to a file without a name in the target's folder; commit() flushes it to disk and makes it the target. Until
/// then it is gone with this object or with the process, however that ends. Where the system has no such files (outside
/// of Linux, and on some network file systems) it has a hidden name meanwhile, which stays if the process is killed.
/// Buffered. Not thread-safe.
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

/// While it lives, an OutputFile that is committed to `target` keeps no name until release(): so several outputs
/// appear together. Destroyed before, there is none. Where files cannot be without a name, it has its own from
/// commit() on.
class HeldOutput {
 public:
  explicit HeldOutput(std::filesystem::path target);
  ~HeldOutput();
  HeldOutput(HeldOutput&&) noexcept;
  HeldOutput& operator=(HeldOutput&&) noexcept;

  /// Nothing happens if nothing was committed; sync_folder_of() is the caller's. @throws Error Io.
  void release();

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

/// Names that were given or changed in a file's folder survive a power cut from here on, where the system can do so.
void sync_folder_of(const std::filesystem::path& file);

/// Remove every uncommitted file of this process; for a signal handler's orderly end.
void discard_uncommitted_files() noexcept;

}  // namespace fibrolite
