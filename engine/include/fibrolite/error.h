// SPDX-License-Identifier: Apache-2.0
// The one exception type. The caller's fault is always checked and thrown as an Error; ours is an assert.
#pragma once

#include <stdexcept>
#include <string>

namespace fibrolite {

enum class Code {
  BadInput,      ///< The model is missing, unreadable or not a solid.
  BadRecipe,     ///< A recipe value is out of range or unknown.
  TooLarge,      ///< The work does not fit the memory given.
  Unsupported,   ///< A format or a feature this build does not have.
  SolverFailed,  ///< Tetrahedralisation or the linear solver gave no valid answer.
  Io,            ///< An output cannot be written.
  Cancelled,     ///< The caller asked to stop.
  Internal,      ///< A bug of ours, or a crashed child process.
};

/// One line for the user: WHAT (WHERE); TRY. `where` and `hint` may be empty.
class Error : public std::runtime_error {
 public:
  Error(Code code, const std::string& what, const std::string& where = {}, const std::string& hint = {})
      : std::runtime_error(what + (where.empty() ? "" : " (" + where + ")") + (hint.empty() ? "" : "; " + hint)),
        code_(code) {}
  [[nodiscard]] Code code() const noexcept { return code_; }

 private:
  Code code_;
};

}  // namespace fibrolite
