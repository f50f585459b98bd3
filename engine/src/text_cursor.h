// SPDX-License-Identifier: Apache-2.0
// Reading text formats: words separated by blanks, numbers without a locale, errors that name the line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "fibrolite/vec.h"

namespace fibrolite {

/// The bytes of a file, and its name for messages.
struct Source {
  std::string_view bytes;
  std::string name;
};

/// @throws Error BadInput: WHAT (NAME, PLACE); HINT. `place` may be empty.
[[noreturn]] void fail(const Source& source, const std::string& what, const std::string& place,
                       const std::string& hint = {});
/// The same with the line of a byte position as the place.
[[noreturn]] void fail_at(const Source& source, std::size_t position, const std::string& what,
                          const std::string& hint = {});

class TextCursor {
 public:
  explicit TextCursor(const Source& source, std::size_t position = 0) : source_(&source), position_(position) {}

  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] bool at_end() const { return position_ >= source_->bytes.size(); }
  /// Skip blanks and line ends, and `#` comments if asked. Returns !at_end().
  bool skip_space(bool comments = false);
  /// Skip blanks within the line (a backslash at its end continues it). Returns false at the end of the line.
  bool skip_blanks();
  /// Go behind the line end.
  void next_line();
  /// The next word, on this line or a later one; empty at the end of the file.
  std::string_view word();
  /// The next word as a number that is finite as a float. @throws Error BadInput.
  float number(const char* of_what);
  Vec3f point(const char* of_what);
  /// The next word as a whole number. @throws Error BadInput.
  std::int64_t integer(const char* of_what);
  /// @throws Error BadInput: WHAT (NAME, line N).
  [[noreturn]] void fail_here(const std::string& what, const std::string& hint = {}) const {
    fail_at(*source_, position_, what, hint);
  }

 private:
  const Source* source_;
  std::size_t position_;
};

/// `word` as a whole number; false if it is anything else.
bool parse_integer(std::string_view word, std::int64_t& value);
/// Printable and short, for messages.
std::string shown(std::string_view word);
/// ASCII letters to lower case.
std::string lower(std::string_view text);

}  // namespace fibrolite
