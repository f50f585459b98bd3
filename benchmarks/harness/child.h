// SPDX-License-Identifier: GPL-3.0-or-later
// A measured child process.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fibrolite::bench {

struct ChildResult {
  int exit_code = -1;      ///< 128 + signal if it was ended by one.
  double wall_s = 0;       ///< From start to end.
  double cpu_s = 0;        ///< User and system, its own children included.
  double peak_rss_mb = 0;  ///< The largest of the process and its children, 1e6 bytes.
  std::string output;      ///< What it wrote on stdout.
};
/// Run a program, its stderr kept in `log`. @throws std::runtime_error if it cannot be started.
[[nodiscard]] ChildResult run(const std::vector<std::string>& command, const std::filesystem::path& log);

}  // namespace fibrolite::bench
