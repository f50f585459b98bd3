// SPDX-License-Identifier: GPL-3.0-or-later
// Where the programs are that run beside this one.
#pragma once

#include <filesystem>
#include <string>

namespace fibrolite {

/// The program named in the environment, beside this one, in its libexec, in the build, or where it was to be
/// installed: the first that is there. @throws Error SolverFailed.
[[nodiscard]] std::filesystem::path helper_program(const std::string& name, const char* environment);

}  // namespace fibrolite
