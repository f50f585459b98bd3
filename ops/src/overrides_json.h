// SPDX-License-Identifier: GPL-3.0-or-later
// Overrides as the recipe writes them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "fibrolite/ops/overrides.h"

namespace fibrolite {

/// An object with "parts", "cuts" and "solid", each a list. Strict, as loads_from(). @throws Error BadRecipe, also for
/// what check_overrides() refuses.
[[nodiscard]] Overrides overrides_from(const nlohmann::ordered_json& json, const std::string& source);
/// What overrides_from() reads back to the same.
[[nodiscard]] nlohmann::ordered_json written(const Overrides& overrides);

}  // namespace fibrolite
