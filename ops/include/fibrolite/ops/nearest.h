// SPDX-License-Identifier: GPL-3.0-or-later
// "Did you mean": the name closest to a misspelt one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace fibrolite {

/// Edits (insert, delete, replace, swap two neighbours) that turn `a` into `b`; letters compare without case.
/// Cost: O(|a| |b|). Source: Damerau 1964, optimal string alignment.
[[nodiscard]] int edit_distance(std::string_view a, std::string_view b);
/// The name with the smallest edit distance, the first of equals; empty if there are no names.
[[nodiscard]] std::string nearest_name(std::string_view wanted, const std::vector<std::string>& names);

}  // namespace fibrolite
