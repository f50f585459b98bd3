// SPDX-License-Identifier: GPL-3.0-or-later
// What the user sees while it runs: progress and log on stderr, a bar only on a terminal; and Ctrl-C.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "fibrolite/context.h"
#include "options.h"

namespace fibrolite::cli {

/// Lives as long as a command. Its context shows progress and log, and is cancelled by SIGINT, SIGTERM or SIGHUP; a
/// second signal removes unfinished outputs and ends the program at once. One at a time.
class Terminal {
 public:
  explicit Terminal(const RunOptions& options);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  [[nodiscard]] const Context& context() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// SIGINT, SIGTERM and SIGHUP cancel the running command; a second one, or one where no command runs, removes
/// unfinished outputs and ends the program at once.
void handle_signals();
/// Whether a signal asked to stop.
[[nodiscard]] bool interrupted();
/// Whether a run that ends early can be gone on with (resume.h), and what is then said; else, of a cancelled one, that
/// nothing was written.
void set_resumable(bool resumable);
[[nodiscard]] bool resumable();
[[nodiscard]] std::string_view cancelled_line();
/// Results: to standard output. @throws Error Io if it cannot be written.
void print(const std::string& text);
/// "fibrolite: error: MESSAGE" as one line on stderr.
void print_error(const std::string& message);

}  // namespace fibrolite::cli
