// SPDX-License-Identifier: GPL-3.0-or-later
// The files a command writes: all of them, or none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fibrolite/file.h"

namespace fibrolite::cli {

/// Every output is checked before any work, written beside its target without a name (under a hidden one where the file
/// system knows no other way), and put there by commit() together with the others. What was not committed is gone. One
/// at a time.
class Outputs {
 public:
  /// @throws UsageError: the same file twice, or the model itself; Error Io: folder missing or not writable, file
  /// exists without `overwrite`.
  Outputs(const std::vector<std::filesystem::path>& targets, const std::filesystem::path& model, bool overwrite);
  ~Outputs();
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  /// Where to write what shall become `target`, which must be one of the constructor's.
  [[nodiscard]] const std::filesystem::path& place(const std::filesystem::path& target) const;
  /// All such places.
  [[nodiscard]] std::vector<std::filesystem::path> hidden() const;
  /// @throws Error Io; then none of the outputs is there, and what they were to replace still is (where the file system
  /// cannot exchange two names, files replaced before the one that failed are gone).
  void commit();

  /// For a signal handler: remove what is written so far.
  static void discard() noexcept;
  [[nodiscard]] static bool committing() noexcept;

 private:
  struct Item {
    std::filesystem::path asked, target, hidden;
    bool existed = false;
  };
  std::vector<Item> items_;
  std::vector<HeldOutput> held_;  // under the hidden names
};

/// A message with the outputs' own names in place of the hidden ones that they are written under.
[[nodiscard]] std::string with_asked_names(std::string text);

}  // namespace fibrolite::cli
