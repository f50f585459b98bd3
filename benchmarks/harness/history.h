// SPDX-License-Identifier: GPL-3.0-or-later
// Results of earlier commits, and how today's compare.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace fibrolite::bench {

/// DIR/COMMIT.json: cases measured again replace their older rows, the rest stay.
void remember(const std::filesystem::path& dir, const std::string& commit, const nlohmann::json& result);
/// Whole or absent. @throws std::runtime_error: nothing was measured at that commit.
[[nodiscard]] nlohmann::json recall(const std::filesystem::path& dir, const std::string& commit);
/// For every case of both, every stage: CPU time now over then, each in units of the floor of its own run, since the
/// machine drifts; and peak memory now over then.
void print_comparison(const nlohmann::json& now, const nlohmann::json& then, const std::string& commit);

}  // namespace fibrolite::bench
