// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: the same (seed, op, id, counter) gives the same number on any number of threads.
#pragma once

#include <cstdint>
#include <string_view>

namespace fibrolite {

/// SplitMix64 finaliser (Steele, Lea, Flood 2014).
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// A stream of uniform numbers named by (seed, op, id).
class Random {
 public:
  constexpr Random(std::uint64_t seed, std::string_view op, std::uint64_t id = 0) : key_(mix(seed)) {
    for (const char c : op) key_ = mix(key_ ^ static_cast<unsigned char>(c));
    key_ = mix(key_ ^ id);
  }
  constexpr std::uint64_t bits() { return mix(key_ ^ ++counter_); }
  /// In [0, 1).
  constexpr double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  /// In [0, n); n > 0. The bias is below n / 2^53.
  constexpr std::uint64_t below(std::uint64_t n) {
    return static_cast<std::uint64_t>(uniform() * static_cast<double>(n));
  }

 private:
  std::uint64_t key_;
  std::uint64_t counter_ = 0;
};

}  // namespace fibrolite
