// SPDX-License-Identifier: Apache-2.0
#include "text_cursor.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
constexpr bool is_space(char c) { return is_blank(c) || c == '\n'; }

// std::from_chars takes no plus sign, but files have them.
std::string_view without_plus(std::string_view word) {
  return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}

template <class T>
std::errc parse(std::string_view word, T& value) {
  word = without_plus(word);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc{} && end != word.data() + word.size()) return std::errc::invalid_argument;
  return error;
}

// Too small for a double, not too large: then it is zero.
bool underflows(std::string_view word) {
  const std::size_t e = word.find_first_of("eE");
  return e != std::string_view::npos && e + 1 < word.size() && word[e + 1] == '-';
}

}  // namespace

void fail(const Source& source, const std::string& what, const std::string& place, const std::string& hint) {
  throw Error(Code::BadInput, what, source.name + (place.empty() ? "" : ", " + place),
              hint.empty() ? "the file is damaged, or not what its ending says: save it again" : hint);
}

void fail_at(const Source& source, std::size_t position, const std::string& what, const std::string& hint) {
  const std::string_view before = source.bytes.substr(0, std::min(position, source.bytes.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  fail(source, what, "line " + std::to_string(line), hint);
}

bool TextCursor::skip_space(bool comments) {
  const std::string_view text = source_->bytes;
  for (; position_ < text.size(); ++position_) {
    if (comments && text[position_] == '#') {
      position_ = std::min(text.find('\n', position_), text.size());
      if (position_ == text.size()) break;
    } else if (!is_space(text[position_])) {
      return true;
    }
  }
  return false;
}

bool TextCursor::skip_blanks() {
  const std::string_view text = source_->bytes;
  for (; position_ < text.size(); ++position_) {
    const char c = text[position_];
    if (is_blank(c)) continue;
    if (c != '\\') return c != '\n';
    std::size_t end = position_ + 1;
    if (end < text.size() && text[end] == '\r') ++end;
    if (end >= text.size() || text[end] != '\n') return true;
    position_ = end;
  }
  return false;
}

void TextCursor::next_line() {
  const std::size_t end = source_->bytes.find('\n', position_);
  position_ = end == std::string_view::npos ? source_->bytes.size() : end + 1;
}

std::string_view TextCursor::word() {
  skip_space();
  const std::string_view text = source_->bytes;
  const std::size_t begin = position_;
  while (position_ < text.size() && !is_space(text[position_])) ++position_;
  return text.substr(begin, position_ - begin);
}

float TextCursor::number(const char* of_what) {
  skip_space();
  const std::size_t begin = position_;
  const std::string_view text = word();
  float value = 0;
  std::errc error = parse(text, value);
  if (error == std::errc::result_out_of_range) {
    double wide = 0;
    error = parse(text, wide);
    if (error == std::errc::result_out_of_range && underflows(text)) error = std::errc{};
    value = static_cast<float>(wide);
  }
  if (error == std::errc{} && std::isfinite(value)) return value;
  if (text.empty()) fail_at(*source_, begin, std::string("the file ends before a ") + of_what, "is it truncated?");
  const bool not_finite = error != std::errc::invalid_argument || lower(text).find("nan") != std::string::npos;
  fail_at(
      *source_, begin,
      (not_finite ? "NaN, infinite or too large " : "not a number as ") + std::string(of_what) + ": " + shown(text));
}

Vec3f TextCursor::point(const char* of_what) {
  const float x = number(of_what), y = number(of_what), z = number(of_what);
  return {x, y, z};
}

std::int64_t TextCursor::integer(const char* of_what) {
  skip_space();
  const std::size_t begin = position_;
  const std::string_view text = word();
  std::int64_t value = 0;
  if (parse_integer(text, value)) return value;
  if (text.empty()) fail_at(*source_, begin, std::string("the file ends before a ") + of_what, "is it truncated?");
  fail_at(*source_, begin, std::string("not a whole number as ") + of_what + ": " + shown(text));
}

bool parse_integer(std::string_view word, std::int64_t& value) { return parse(word, value) == std::errc{}; }

std::string shown(std::string_view word) {
  std::string result = "'";
  for (const char c : word.substr(0, 24)) result += c >= 32 && c < 127 ? c : '?';
  return result + (word.size() > 24 ? "...'" : "'");
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

}  // namespace fibrolite
