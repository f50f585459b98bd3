// SPDX-License-Identifier: GPL-3.0-or-later
// Seconds of wall and of CPU, from any start.
#pragma once

#include <chrono>
#include <ctime>

namespace fibrolite::bench {

[[nodiscard]] inline double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
[[nodiscard]] inline double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace fibrolite::bench
