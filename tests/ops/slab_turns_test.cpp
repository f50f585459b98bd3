// SPDX-License-Identifier: GPL-3.0-or-later
#include "slab_turns.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

/// Slabs whose making and use are watched.
struct Watched {
  explicit Watched(SlabTurns::Clock::duration stay = {}) : turns(stay) {}
  void ask(
      std::size_t wanted, const std::function<void()>& use = [] {}, const Context& context = {}) {
    turns.with(
        wanted,
        [&] {
          if (making.exchange(true) || users > 0) ++clashes;
          there = wanted;
          ++made;
          std::this_thread::yield();
          making = false;
        },
        [&] {
          ++users;
          if (making || there != wanted) ++clashes;
          use();
          if (making || there != wanted) ++clashes;
          --users;
        },
        context);
  }

  SlabTurns turns;
  std::atomic<bool> making = false;
  std::atomic<std::size_t> there = 0;
  std::atomic<int> users = 0, made = 0, clashes = 0;
};

/// Without that, threads can take slabs from each other for any length of time, and most are made for nothing.
TEST(SlabTurns, WhatIsMadeIsUsedByWhoMadeIt) {
  constexpr int threads = 6, rounds = 200;
  Watched slabs;
  std::vector<std::thread> all;
  for (int t = 0; t < threads; ++t) {
    all.emplace_back([&slabs, t] {
      for (int i = 0; i < rounds; ++i) slabs.ask(static_cast<std::size_t>((t + i) % 4));
    });
  }
  for (std::thread& thread : all) thread.join();
  EXPECT_EQ(slabs.clashes, 0);
  EXPECT_LE(slabs.made, threads * rounds);
  EXPECT_GE(slabs.made, 4);
}

TEST(SlabTurns, WhoeverWantsTheSlabThatIsThereGoesFirst) {
  Watched slabs(std::chrono::minutes(5));
  std::promise<void> used, go_on;
  std::thread one([&] {
    slabs.ask(1, [&] {
      used.set_value();
      go_on.get_future().wait();
    });
  });
  used.get_future().wait();
  std::thread other([&] { slabs.ask(2); });
  for (int i = 0; i < 20; ++i) {
    slabs.ask(1);  // would wait for `one`, which waits for this
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(slabs.made, 1);
  go_on.set_value();
  one.join();
  other.join();
  EXPECT_EQ(slabs.made, 2);
  EXPECT_EQ(slabs.clashes, 0);
}

/// Two threads that never leave the slab unused, until a third had its own.
TEST(SlabTurns, ASlabThatIsAlwaysInUseGivesWay) {
  Watched slabs;
  std::atomic<bool> had = false;
  std::atomic<int> inside = 0;
  const auto keep_busy = [&] {
    while (!had) {
      slabs.ask(1, [&] {
        ++inside;
        const auto enough = SlabTurns::Clock::now() + std::chrono::milliseconds(100);
        while (inside < 2 && SlabTurns::Clock::now() < enough) std::this_thread::yield();  // for the other to come in
        --inside;
      });
    }
  };
  std::thread a(keep_busy), b(keep_busy);
  while (slabs.made == 0) std::this_thread::yield();
  slabs.ask(2);
  had = true;
  a.join();
  b.join();
  EXPECT_EQ(slabs.clashes, 0);
}

TEST(SlabTurns, WaitingEndsWhenCancelled) {
  Watched slabs;
  const Context context;
  std::promise<void> ended;
  std::thread other;
  slabs.ask(1, [&] {
    other = std::thread([&] {
      EXPECT_THROW(slabs.ask(
                       2, [] {}, context),
                   Error);
      ended.set_value();
    });
    context.cancel();
    ended.get_future().wait();  // the slab is in use all the while
  });
  other.join();
  EXPECT_EQ(slabs.made, 1);
  slabs.ask(2);
  EXPECT_EQ(slabs.made, 2);
}

TEST(SlabTurns, WhatCouldNotBeMadeIsNotThere) {
  Watched slabs;
  slabs.ask(1);
  const auto fails = [] { throw std::runtime_error("no memory"); };
  EXPECT_THROW(slabs.turns.with(
                   2, fails, [] {}, Context()),
               std::runtime_error);
  slabs.ask(1);
  EXPECT_EQ(slabs.made, 2);
  EXPECT_THROW(slabs.ask(1, fails), std::runtime_error);
  slabs.ask(2);  // whoever failed to use it has left
  EXPECT_EQ(slabs.made, 3);
}

}  // namespace
}  // namespace fibrolite
