// SPDX-License-Identifier: GPL-3.0-or-later
// Another program as a function: bytes in, bytes out.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "fibrolite/context.h"

namespace fibrolite {

struct ChildResult {
  std::vector<std::byte> output;  ///< All it wrote to its standard output.
  std::string failure;            ///< Empty if it exited with 0; else how it ended, in words.
};
struct ChildLimits {
  double wall_s = 60;                     ///< It is killed after this.
  std::size_t output_bytes = 1UL << 31U;  ///< It is killed if it writes more.
};
/// Runs `program` with `arguments`, feeds it `input` and collects its output; both at once, so neither side can block
/// the other. Its standard error goes nowhere. It has its own process group: Ctrl-C reaches it through `context` alone,
/// within 50 ms. However it ends, this process is safe (no SIGPIPE, no zombie, no descriptor left open).
/// @throws Error SolverFailed: it cannot be started; Cancelled.
[[nodiscard]] ChildResult run_child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                    std::span<const std::byte> input, const ChildLimits& limits,
                                    const Context& context);

}  // namespace fibrolite
