// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/context.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

using Reports = std::vector<std::pair<double, std::string>>;

Context recorder(Reports& reports) {
  return {[&reports](double fraction, std::string_view stage) { reports.emplace_back(fraction, stage); }, {}};
}

TEST(Context, MapsPartsIntoTheWhole) {
  Reports reports;
  const Context whole = recorder(reports);
  const Context half = whole.part(0.5, 1.0, "second half");
  half.progress(0.5);
  half.part(0.5, 1.0, "last quarter").progress(0.5);
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_DOUBLE_EQ(reports[0].first, 0.75);
  EXPECT_EQ(reports[0].second, "second half");
  EXPECT_DOUBLE_EQ(reports[1].first, 0.875);
  EXPECT_EQ(reports[1].second, "last quarter");
}

TEST(Context, EndsAtExactlyOneThroughUnevenParts) {
  Reports reports;
  const Context whole = recorder(reports);
  whole.part(0.1, 1.0, "a").part(1.0 / 3, 1.0, "b").part(0.7, 1.0, "").progress(1.0);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].first, 1.0);
  EXPECT_EQ(reports[0].second, "b") << "a part without a name keeps the name around it";
}

TEST(Context, NeverFalls) {
  Reports reports;
  const Context whole = recorder(reports);
  whole.progress(0.4);
  whole.progress(0.3);
  whole.progress(-1);
  whole.progress(std::nan(""));
  whole.part(0.0, 0.2, "late").progress(1);
  whole.progress(0.4);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_DOUBLE_EQ(reports[0].first, 0.4);
  whole.part(0.4, 0.6, "next").progress(0);
  ASSERT_EQ(reports.size(), 2U) << "a new stage is shown even where it begins at the same value";
  whole.progress(7);
  EXPECT_EQ(reports.back().first, 1.0);
}

TEST(Context, NeverFallsWithManyThreads) {
  Reports reports;
  const Context whole = recorder(reports);
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&whole, t] {
      const Context mine = whole.part(0.1 * t, 0.1 * t + 0.3, "t" + std::to_string(t));
      for (int i = 0; i <= 1000; ++i) mine.progress(i / 1000.0);
    });
  }
  for (std::thread& thread : threads) thread.join();
  ASSERT_FALSE(reports.empty());
  for (std::size_t i = 1; i < reports.size(); ++i) ASSERT_LE(reports[i - 1].first, reports[i].first);
  EXPECT_EQ(reports.back().first, 1.0);
}

TEST(Context, CancelReachesEveryCopyAndPart) {
  const Context whole;
  const Context inner = whole.part(0, 0.5, "inner");
  EXPECT_NO_THROW(inner.check());
  whole.cancel();
  EXPECT_TRUE(inner.cancelled());
  try {
    inner.check();
    FAIL() << "check() must throw";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::Cancelled);
  }
  EXPECT_NO_THROW(Context().check()) << "other contexts go on";
}

TEST(Context, CancelStopsAWorkerThread) {
  const Context context;
  std::atomic<bool> stopped{false};
  std::thread worker([&] {
    try {
      for (;;) context.check();
    } catch (const Error&) {
      stopped = true;
    }
  });
  const auto start = std::chrono::steady_clock::now();
  context.cancel();
  worker.join();
  EXPECT_TRUE(stopped);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
}

const Context* signalled = nullptr;

TEST(Context, CancelFromASignalHandlerWhileACallbackHoldsTheLock) {
  const Context context([](double, std::string_view) { std::raise(SIGUSR1); }, {});
  signalled = &context;
  const auto before = std::signal(SIGUSR1, [](int) { signalled->cancel(); });
  context.progress(0.5);
  std::signal(SIGUSR1, before);
  signalled = nullptr;
  EXPECT_TRUE(context.cancelled());
}

TEST(Context, CallbacksMayUseTheContext) {
  std::vector<std::string> lines;
  const Context* self = nullptr;
  const Context context([&](double, std::string_view stage) { self->log("at " + std::string(stage)); },
                        [&](std::string_view line) { lines.emplace_back(line); });
  self = &context;
  context.part(0, 1, "work").progress(0.1);
  EXPECT_EQ(lines, (std::vector<std::string>{"at work"}));
}

}  // namespace
}  // namespace fibrolite
