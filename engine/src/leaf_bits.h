// SPDX-License-Identifier: Apache-2.0
// Yes or no for each of a leaf's 512 samples, in eight words.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace fibrolite {

/// A leaf's samples lie anywhere in memory: asked for some leaves ahead, they are there in time. `leaves` are pointers.
template <class Leaves>
void fetch_ahead(const Leaves& leaves, std::size_t now) {
  constexpr std::size_t leaf_ahead = 12, samples_ahead = 4;
  if (now + leaf_ahead < leaves.size()) {
    const char* const leaf = reinterpret_cast<const char*>(leaves[now + leaf_ahead]);  // knows where its samples are
    __builtin_prefetch(leaf);
    __builtin_prefetch(leaf + 64);
  }
  if (now + samples_ahead >= leaves.size()) return;
  const float* const value = leaves[now + samples_ahead]->buffer().data();
  for (int i = 0; i < 512; i += 16) __builtin_prefetch(value + i);
}

/// Bit 8 y + z of word x.
using LeafBits = std::array<std::uint64_t, 8>;

/// The first bit of each row along z.
constexpr std::uint64_t first_column = 0x0101010101010101U;
/// The lowest bit of each byte, side by side; the others must be zero.
constexpr std::uint64_t lowest_of_bytes(std::uint64_t bytes) { return (bytes * 0x0102040810204080U) >> 56; }

/// Which samples are less than `below`.
[[nodiscard]] LeafBits bits_below(const float* value, float below);

/// The lowest or highest layer along an axis: bit 8 i + j, i and j along the other two axes in their order.
[[nodiscard]] std::uint64_t face_of(const LeafBits& bits, unsigned axis, bool upper);
/// Which sample of the leaf that bit `n` of a face is.
constexpr unsigned sample_of_face(unsigned n, unsigned axis, bool upper) {
  const unsigned i = n >> 3, j = n & 7U, layer = upper ? 7 : 0;
  return axis == 0 ? 64 * layer + n : axis == 1 ? 64 * i + 8 * layer + j : 64 * i + 8 * j + layer;
}

}  // namespace fibrolite
