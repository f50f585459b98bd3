// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/context.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>

#include "fibrolite/error.h"

namespace fibrolite {

struct Context::State {
  // A signal handler may touch nothing but a lock-free atomic.
  std::atomic<bool> cancelled{false};
  static_assert(std::atomic<bool>::is_always_lock_free);

  // Recursive, so that a callback may itself log or ask for progress without deadlock.
  std::recursive_mutex mutex;
  double last_fraction = -1;
  std::string last_stage;
  Progress progress;
  Log log;
};

Context::Context() : state_(std::make_shared<State>()) {}

Context::Context(Progress progress, Log log) : Context() {
  state_->progress = std::move(progress);
  state_->log = std::move(log);
}

void Context::cancel() const noexcept { state_->cancelled.store(true, std::memory_order_relaxed); }

bool Context::cancelled() const noexcept { return state_->cancelled.load(std::memory_order_relaxed); }

void Context::check() const {
  if (cancelled()) throw Error(Code::Cancelled, "cancelled");
}

void Context::progress(double fraction) const {
  if (!state_->progress) return;
  // from + (to - from) can miss `to` by a rounding: the end of the last part must be exactly 1.
  const double whole = fraction >= 1.0 ? to_ : from_ + (to_ - from_) * std::max(fraction, 0.0);
  const std::lock_guard lock(state_->mutex);
  // Written so that NaN is ignored too. A new stage may begin at the value at which the one before ended.
  const bool higher = whole > state_->last_fraction;
  const bool new_stage = whole == state_->last_fraction && stage_ != state_->last_stage;
  if (!higher && !new_stage) return;
  state_->last_fraction = whole;
  state_->last_stage = stage_;
  state_->progress(whole, stage_);
}

void Context::log(std::string_view line) const {
  if (!state_->log) return;
  const std::lock_guard lock(state_->mutex);
  state_->log(line);
}

Context Context::part(double from, double to, std::string_view stage) const {
  Context inner = *this;
  inner.from_ = from_ + (to_ - from_) * std::clamp(from, 0.0, 1.0);
  inner.to_ = to >= 1.0 ? to_ : from_ + (to_ - from_) * std::clamp(to, 0.0, 1.0);
  if (!stage.empty()) inner.stage_ = stage;
  return inner;
}

}  // namespace fibrolite
