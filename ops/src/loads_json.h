// SPDX-License-Identifier: GPL-3.0-or-later
// Load cases as the recipe writes them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fibrolite/ops/loads.h"

namespace fibrolite {

/// A list of cases, or the name of a preset. Strict: an unknown key is an error that names the nearest. `source` is
/// where the text comes from. @throws Error BadRecipe, also for what check_loads() refuses.
[[nodiscard]] std::vector<LoadCase> loads_from(const nlohmann::ordered_json& json, const std::string& source);
/// What loads_from() reads back to the same cases; no cases are the preset paper-verify.
[[nodiscard]] nlohmann::ordered_json written(const std::vector<LoadCase>& cases);

}  // namespace fibrolite
