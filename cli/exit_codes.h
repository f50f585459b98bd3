// SPDX-License-Identifier: GPL-3.0-or-later
// The one table of exit codes.
#pragma once

#include <stdexcept>
#include <string>

#include "fibrolite/error.h"

namespace fibrolite::cli {

enum ExitCode : int {
  Done = 0,
  Usage = 2,           ///< A bad value on the command line, an unknown option or infill.
  BadModel = 3,        ///< Model missing, unreadable or not a solid.
  BadRecipeGiven = 4,  ///< Content of --recipe or --set, unknown preset.
  OutOfMemory = 5,     ///< Too large for the memory given.
  NoSolution = 6,      ///< The solver failed.
  NoOutput = 7,        ///< Output folder missing, not writable, file exists, disk full.
  Bug = 70,            ///< Ours, or a crashed child process.
  Interrupted = 130    ///< Cancelled.
};

[[nodiscard]] constexpr ExitCode exit_code(Code code) {
  switch (code) {
    case Code::BadInput:
    case Code::Unsupported:
      return BadModel;  // of a model; endings of outputs are checked as usage
    case Code::BadRecipe:
      return BadRecipeGiven;
    case Code::TooLarge:
      return OutOfMemory;
    case Code::SolverFailed:
      return NoSolution;
    case Code::Io:
      return NoOutput;
    case Code::Cancelled:
      return Interrupted;
    case Code::Internal:
      return Bug;
  }
  return Bug;
}

/// The command line itself is wrong. The same one line as an Error: WHAT (WHERE); TRY.
class UsageError : public std::runtime_error {
 public:
  UsageError(const std::string& what, const std::string& where, const std::string& hint)
      : std::runtime_error(what + (where.empty() ? "" : " (" + where + ")") + (hint.empty() ? "" : "; " + hint)) {}
};

}  // namespace fibrolite::cli
