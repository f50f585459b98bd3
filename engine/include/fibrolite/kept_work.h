// SPDX-License-Identifier: Apache-2.0
// Finished parts of a long run, kept in a folder for a later run that goes on with it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/file.h"

namespace fibrolite {

/// A file for each part, with its length and checksum. However a process ends, a part is whole or absent; one that was
/// damaged since counts as absent. Kept on the machine that made it: values are written as it holds them. Of one
/// process at a time; not thread-safe.
class KeptWork {
 public:
  /// Opens the folder, or makes it. `work`: all that the parts depend on, a line each: a name, a blank, a value. Parts
  /// that are damaged, or half written by a process that was killed, are removed; what was is logged. Cost: all that is
  /// kept is read once.
  /// @throws Error BadInput: it is the folder of other work (says which line differs), and stays as it is; Io: it
  /// cannot be written, or another process is at it; Cancelled.
  KeptWork(std::filesystem::path folder, const std::string& work, const Context& context = {});
  ~KeptWork();
  KeptWork(const KeptWork&) = delete;
  KeptWork& operator=(const KeptWork&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const std::set<std::string>& parts() const { return parts_; }
  [[nodiscard]] bool holds(const std::string& part) const { return parts_.contains(part); }

  /// What is read from a part, in the order in which it was written.
  class Reader {
   public:
    /// @throws Error Io: not as much is left, or the system fails.
    void read(std::span<std::byte> bytes);
    template <class T>
    void get(T& value) {
      static_assert(std::is_trivially_copyable_v<T>);
      read(std::as_writable_bytes(std::span(&value, 1)));
    }
    template <class T>
    void get_list(T& list) {  // a vector or a string
      std::uint64_t size = 0;
      get(size);
      check_left(size, sizeof list[0]);
      list.resize(static_cast<std::size_t>(size));
      read(std::as_writable_bytes(std::span(list.data(), list.size())));
    }

   private:
    friend class KeptWork;
    Reader(const std::filesystem::path& file, std::uint64_t bytes)
        : path_(file), in_(file, std::ios::binary), left_(bytes) {}
    void check_left(std::uint64_t count, std::size_t each) const;
    std::filesystem::path path_;
    std::ifstream in_;
    std::uint64_t left_;
  };
  /// What is written to a part; there is none before commit().
  class Writer {
   public:
    /// @throws Error Io.
    void write(std::span<const std::byte> bytes);
    template <class T>
    void put(const T& value) {
      static_assert(std::is_trivially_copyable_v<T>);
      write(std::as_bytes(std::span(&value, 1)));
    }
    template <class T>
    void put_list(const T& list) {  // a vector or a string
      put(static_cast<std::uint64_t>(list.size()));
      write(std::as_bytes(std::span(list.data(), list.size())));
    }
    /// @throws Error Io, Cancelled.
    void commit();

   private:
    friend class KeptWork;
    Writer(KeptWork& work, std::string part);
    KeptWork* work_;
    std::string part_;
    OutputFile file_;
    std::uint64_t bytes_ = 0;
    std::uint32_t checksum_ = 0;
  };
  /// Of a part that it holds. @throws Error Io.
  [[nodiscard]] Reader read(const std::string& part) const;
  /// A part, new or in place of the one of that name: letters, digits, - and _.
  [[nodiscard]] Writer write(const std::string& part);
  /// Removes the folder with all parts.
  void discard() noexcept;

 private:
  [[nodiscard]] std::filesystem::path file_of(const std::string& part) const;
  void lock();
  void check_work(const std::string& work) const;
  [[nodiscard]] bool sound(const std::string& part, const Context& context) const;
  std::filesystem::path folder_;
  std::string stamp_;  ///< Of the work; in each part.
  std::set<std::string> parts_;
  int lock_ = -1;
};

/// A number that names these bytes: any change of them changes it, but for one in 2^64. Not for secrets.
class ContentHash {
 public:
  ContentHash& add(std::span<const std::byte> bytes);
  ContentHash& add(std::string_view text) { return add(std::as_bytes(std::span(text))); }
  /// A file's content. @throws Error BadInput: it cannot be read.
  ContentHash& add_file(const std::filesystem::path& file, const Context& context = {});
  [[nodiscard]] std::string text() const;  ///< 16 hexadecimal digits.

 private:
  std::uint64_t state_ = 0;
};

}  // namespace fibrolite
