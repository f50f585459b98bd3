// SPDX-License-Identifier: GPL-3.0-or-later
// Who may use the one slab that there is memory for, and who makes the next.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <limits>
#include <list>
#include <mutex>

#include "fibrolite/context.h"

namespace fibrolite {

/// Threads that want the slab that is there use it together. It stays as long as making it took, and then as long as
/// nobody waits for another; who has waited longest is next. So each that is made is used by whoever made it, making
/// takes about half of the time at most, and nobody waits forever.
class SlabTurns {
 public:
  using Clock = std::chrono::steady_clock;
  /// @param stay The least time that a slab stays.
  explicit SlabTurns(Clock::duration stay = {}) : stay_(stay) {}

  /// Calls use() when slab `wanted` is there, after make(), alone, if it has to be made. Returns what use() returns.
  /// @throws Error Cancelled while it waits; what either throws. After make() has thrown there is no slab.
  template <class Make, class Use>
  auto with(std::size_t wanted, const Make& make, const Use& use, const Context& context) {
    enter(wanted, make, context);
    struct Leaving {
      ~Leaving() {
        const std::lock_guard lock(turns.mutex_);
        if (--turns.users_ == 0) turns.changed_.notify_all();
      }
      SlabTurns& turns;
    };
    const Leaving leaving{*this};
    return use();
  }

 private:
  /// A place in the line of those who wait; only touched with the lock held.
  struct Waiting {
    explicit Waiting(SlabTurns& t) : turns(t), place(t.line_.insert(t.line_.end(), this)) {}
    ~Waiting() {
      turns.line_.erase(place);
      turns.changed_.notify_all();
    }
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;
    [[nodiscard]] bool first() const { return turns.line_.front() == this; }

    SlabTurns& turns;
    std::list<const Waiting*>::iterator place;
  };

  template <class Make>
  void enter(std::size_t wanted, const Make& make, const Context& context) {
    std::unique_lock lock(mutex_);
    const Waiting me(*this);
    const auto may_use = [&] { return there_ == wanted && (me.first() || Clock::now() < stays_until_); };
    while (!may_use()) {
      if (me.first() && users_ == 0) {
        make_alone(lock, make);
        there_ = wanted;
      } else {
        changed_.wait_for(lock, std::chrono::milliseconds(50));  // nobody wakes it if it is cancelled
        context.check();
      }
    }
    ++users_;
  }

  /// Without the lock, but nobody else is first in line meanwhile.
  template <class Make>
  void make_alone(std::unique_lock<std::mutex>& lock, const Make& make) {
    there_ = none;
    lock.unlock();
    const Clock::time_point begun = Clock::now();
    try {
      make();
    } catch (...) {
      lock.lock();
      throw;
    }
    lock.lock();
    const Clock::time_point made = Clock::now();
    stays_until_ = made + std::max(stay_, made - begun);
  }

  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  const Clock::duration stay_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<const Waiting*> line_;
  std::size_t there_ = none;
  int users_ = 0;
  Clock::time_point stays_until_{};
};

}  // namespace fibrolite
