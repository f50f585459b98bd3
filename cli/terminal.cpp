// SPDX-License-Identifier: GPL-3.0-or-later
#include "terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>

#include "exit_codes.h"
#include "fibrolite/file.h"
#include "outputs.h"

namespace fibrolite::cli {
namespace {

using Clock = std::chrono::steady_clock;

std::atomic<const Context*> running{nullptr};
std::atomic<bool> asked_to_stop{false}, can_go_on{false};

/// Only lock-free atomics and system calls in here.
extern "C" void on_signal(int) {
  const Context* context = running.load();
  if (!asked_to_stop.exchange(true) && context != nullptr) return context->cancel();
  if (Outputs::committing()) return;  // all outputs are in place in a moment
  discard_uncommitted_files();
  Outputs::discard();
  for (const std::string_view text : {std::string_view("fibrolite: error: "), cancelled_line(), std::string_view("\n")})
    static_cast<void>(!::write(STDERR_FILENO, text.data(), text.size()));
  _exit(Interrupted);
}

std::string one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  return text;
}

std::string json_line(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void to_stderr(const std::string& text) { std::fputs(text.c_str(), stderr); }

int terminal_columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

struct Terminal::State {
  std::mutex mutex;
  bool json = false, bar_shown = false;
  Clock::time_point last_time{};
  std::string last_stage;
  Context context;

  void erase_bar() {
    if (bar_shown) to_stderr("\r\x1b[K");
    bar_shown = false;
  }

  /// At most ten times a second, but always when the stage changes.
  bool due(double fraction, std::string_view stage) {
    const auto now = Clock::now();
    if (stage == last_stage && fraction < 1 && now - last_time < std::chrono::milliseconds(100)) return false;
    last_time = now;
    last_stage = stage;
    return true;
  }

  void show_bar(double fraction, std::string_view stage) {
    const int width = std::clamp(terminal_columns() - 40, 10, 50);
    const auto filled = static_cast<std::size_t>(std::lround(fraction * width));
    const std::string bar = std::string(filled, '#') + std::string(static_cast<std::size_t>(width) - filled, '.');
    to_stderr("\r\x1b[K[" + bar + "] " + std::to_string(std::lround(100 * fraction)) + " % " +
              std::string(stage.substr(0, 30)));
    bar_shown = true;
  }

  void on_progress(double fraction, std::string_view stage) {
    const std::lock_guard lock(mutex);
    if (!due(fraction, stage)) return;
    if (json) {
      to_stderr(json_line({{"event", "progress"}, {"stage", stage}, {"fraction", fraction}}));
    } else {
      show_bar(fraction, stage);
    }
  }

  void on_log(std::string_view line) {
    const std::lock_guard lock(mutex);
    erase_bar();
    to_stderr(json ? json_line({{"event", "log"}, {"line", line}})
                   : "fibrolite: " + one_line(std::string(line)) + "\n");
  }
};

Terminal::Terminal(const RunOptions& options) : state_(std::make_unique<State>()) {
  State* state = state_.get();
  state->json = options.log == LogFormat::Json;
  Context::Progress progress;
  Context::Log log;
  if (!options.quiet) {
    if (state->json || isatty(STDERR_FILENO) != 0)
      progress = [state](double fraction, std::string_view stage) { state->on_progress(fraction, stage); };
    log = [state](std::string_view line) { state->on_log(line); };
  }
  state->context = Context(progress, log);
  running = &state->context;
}

Terminal::~Terminal() {
  state_->erase_bar();
  running = nullptr;
}

const Context& Terminal::context() const { return state_->context; }

void handle_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // A program started with nohup, or in the background of a script, keeps ignoring what it was told to ignore.
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
  // A child that crashed, a closed stdout and a file-size limit are errors to report, not ends.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

bool interrupted() { return asked_to_stop; }

void set_resumable(bool resumable) { can_go_on = resumable; }
bool resumable() { return can_go_on; }

std::string_view cancelled_line() {
  return can_go_on ? "cancelled (by a signal); run again with --resume to go on"
                   : "cancelled (by a signal); nothing was written";
}

void print(const std::string& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (!written)
    throw Error(Code::Io, "the result cannot be written", "standard output", "check where it is redirected to");
}

void print_error(const std::string& message) { to_stderr("fibrolite: error: " + one_line(message) + "\n"); }

}  // namespace fibrolite::cli
