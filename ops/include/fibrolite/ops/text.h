// SPDX-License-Identifier: GPL-3.0-or-later
// Words and numbers in messages: "did you mean", and numbers that read the same in every locale.
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

/// Up to `digits` significant digits, 1 to 17: 0.8, 1.25e-07, nan.
[[nodiscard]] std::string number_text(double value, int digits = 6);
/// The nearest number of so many significant digits that is no more, or no less, than a positive value: for what a
/// message proposes, which must hold when it is typed as it reads.
[[nodiscard]] double rounded_down(double value, int digits = 3);
[[nodiscard]] double rounded_up(double value, int digits = 3);

}  // namespace fibrolite
