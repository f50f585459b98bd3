// SPDX-License-Identifier: Apache-2.0
// Progress, cancel and log travel in a Context, the last argument of every long operation. A default Context is
// silent and cannot be cancelled. Copies share the same state.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace fibrolite {

/// Contract: `progress` receives values in [0, 1] that never fall and end at 1 when the operation succeeds; a
/// cancelled operation throws Error{Code::Cancelled} within a second of cancel(). Thread-safe.
class Context {
 public:
  using Progress = std::function<void(double fraction, std::string_view stage)>;
  using Log = std::function<void(std::string_view line)>;

  Context();
  Context(Progress progress, Log log);

  /// Ask every operation that holds this context (or a part of it) to stop. Safe from a signal handler.
  void cancel() const noexcept;
  [[nodiscard]] bool cancelled() const noexcept;
  /// @throws Error Cancelled, if cancel() was called. Cheap: one relaxed atomic load.
  void check() const;

  /// Report `fraction` in [0, 1] of this context's own range; lower than before is ignored.
  void progress(double fraction) const;
  void log(std::string_view line) const;
  /// A context that maps its own [0, 1] to [from, to] of this one and names the stage.
  [[nodiscard]] Context part(double from, double to, std::string_view stage) const;

 private:
  struct State;
  std::shared_ptr<State> state_;
  double from_ = 0, to_ = 1;
  std::string stage_;
};

}  // namespace fibrolite
