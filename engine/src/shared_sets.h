// SPDX-License-Identifier: Apache-2.0
// Union-find that several threads may use at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

namespace fibrolite {

/// Sets of whole numbers. A root only ever gets a greater parent, so the greatest member of a set is its root in the
/// end, whatever the order.
class SharedSets {
 public:
  /// Numbers that are in use at once differ by less than this (a power of two, or 0), and are told apart by what is
  /// left of them.
  explicit SharedSets(std::size_t room) : parent_(room), mask_(static_cast<std::uint32_t>(room) - 1) {}

  /// A set of its own.
  void start(std::uint32_t a) { parent_[a & mask_] = a; }

  std::uint32_t root(std::uint32_t a) {
    for (;;) {
      const std::uint32_t up = parent(a);
      if (up == a) return a;
      const std::uint32_t upper = parent(up);
      if (upper == up) return up;
      // Path halving; if another thread was faster, its parent is as good.
      std::uint32_t expected = up;
      at(a).compare_exchange_weak(expected, upper, std::memory_order_relaxed);
      a = upper;
    }
  }

  [[nodiscard]] bool is_root(std::uint32_t a) const { return parent_[a & mask_] == a; }

  void join(std::uint32_t a, std::uint32_t b) {
    if (parent(a) == parent(b)) return;  // as most neighbours
    for (;;) {
      a = root(a);
      b = root(b);
      if (a == b) return;
      if (a > b) std::swap(a, b);
      std::uint32_t expected = a;
      if (at(a).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return;
    }
  }

  /// Joins one that is a root still with a greater one, while no other thread joins it. @returns whether it was.
  bool put_below(std::uint32_t a, std::uint32_t greater) {
    const bool was = parent(a) == a;
    if (was) at(a).store(greater, std::memory_order_relaxed);
    return was;
  }

 private:
  std::atomic_ref<std::uint32_t> at(std::uint32_t a) { return std::atomic_ref(parent_[a & mask_]); }
  std::uint32_t parent(std::uint32_t a) { return at(a).load(std::memory_order_relaxed); }
  std::vector<std::uint32_t> parent_;
  std::uint32_t mask_;
};

}  // namespace fibrolite
