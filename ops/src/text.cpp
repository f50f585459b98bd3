// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace fibrolite {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// What one is of the last of so many significant digits.
double last_digit(double value, int digits) { return std::pow(10.0, std::floor(std::log10(value)) + 1 - digits); }
constexpr double last_bits = 1e-10;  // 0.4 is a number of three digits, whatever its last bits say
/// To the last bit the number that one reads: 23 * 0.001 is not 0.023.
double as_read(double value, int digits) {
  const std::string text = number_text(value, digits);
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

int edit_distance(std::string_view a, std::string_view b) {
  // Three rows of the table are enough: a swap looks two rows back.
  std::vector<int> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::string nearest_name(std::string_view wanted, const std::vector<std::string>& names) {
  std::string best;
  int least = std::numeric_limits<int>::max();
  for (const std::string& name : names) {
    const int edits = edit_distance(wanted, name);
    if (edits < least) {
      least = edits;
      best = name;
    }
  }
  return best;
}

std::string number_text(double value, int digits) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, digits).ptr;
  return {buffer, end};
}

double rounded_down(double value, int digits) {
  const double step = last_digit(value, digits);
  return as_read(std::floor(value / step * (1 + last_bits)) * step, digits);
}

double rounded_up(double value, int digits) {
  const double step = last_digit(value, digits);
  return as_read(std::ceil(value / step * (1 - last_bits)) * step, digits);
}

}  // namespace fibrolite
