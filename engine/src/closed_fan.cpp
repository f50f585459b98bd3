// SPDX-License-Identifier: Apache-2.0
#include "closed_fan.h"

#include <cstddef>
#include <cstring>

#include "fibrolite/clones.h"

namespace fibrolite {
namespace {

using Lanes [[gnu::vector_size(32)]] = std::uint32_t;

[[gnu::always_inline]] inline bool none(const Lanes& lanes) {
  std::array<std::uint64_t, 4> all;
  std::memcpy(all.data(), &lanes, sizeof all);
  return (all[0] | all[1] | all[2] | all[3]) == 0;
}

/// For each triangle the one that goes before. Unless those are each of them once, some bits of `wrong`.
template <std::size_t blocks>
[[gnu::always_inline]] inline void match(const Fan<8 * blocks>& fan, std::array<Lanes, blocks>& before, Lanes& wrong) {
  std::array<Lanes, blocks> in, times{};
  std::memcpy(in.data(), fan.in.data(), sizeof in);
  before.fill(Lanes{});
  for (std::uint32_t i = 0; i < 8 * blocks; ++i) {
    for (std::size_t b = 0; b < blocks; ++b) {
      const auto same = Lanes(in[b] == fan.out[i]);
      times[b] -= same;
      before[b] |= same & i;
    }
  }
  wrong = Lanes{};
  Lanes all{};  // that go before one: each, so each before one only
  for (std::size_t b = 0; b < blocks; ++b) {
    wrong |= times[b] ^ 1U;
    all |= 1U << (before[b] & (8 * blocks - 1));
  }
  std::array<std::uint32_t, 8> some;
  std::memcpy(some.data(), &all, sizeof some);
  std::uint32_t bits = 0;
  for (const std::uint32_t one : some) bits |= one;
  if (bits != (1U << (8 * blocks)) - 1) wrong |= 1U;
}

}  // namespace

FIBROLITE_CLONES bool is_closed(const Fan<8>& fan, std::uint32_t count) {
  std::array<Lanes, 1> before;
  Lanes wrong;
  match<1>(fan, before, wrong);
  // Which come after the first one, by up to 1, 3 and 7 steps.
  const Lanes number{0, 1, 2, 3, 4, 5, 6, 7};
  Lanes steps = before[0] & 7U, seen{1, 0, 0, 0, 0, 0, 0, 0};
  for (int doubled = 0; doubled < 3; ++doubled) {
    seen |= __builtin_shuffle(seen, steps);
    steps = __builtin_shuffle(steps, steps);
  }
  return none(wrong | (seen ^ (Lanes(number < count) & 1U)));
}

FIBROLITE_CLONES bool is_closed(const Fan<16>& fan, std::uint32_t count) {
  std::array<Lanes, 2> before;
  Lanes wrong;
  match<2>(fan, before, wrong);
  std::array<std::uint32_t, 16> step;
  std::memcpy(step.data(), before.data(), sizeof step);
  std::uint32_t seen = 0, one = 0;
  for (std::uint32_t i = 0; i < 16; ++i) {
    seen |= 1U << one;
    one = step[one] & 15U;
  }
  return none(wrong) && seen == (1U << count) - 1;
}

}  // namespace fibrolite
