// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers in messages, the same in every locale.
#pragma once

#include <charconv>
#include <string>

namespace fibrolite {

/// Up to six significant digits: 0.8, 1.25e-07.
[[nodiscard]] inline std::string number_text(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 6).ptr;
  return {buffer, end};
}

}  // namespace fibrolite
