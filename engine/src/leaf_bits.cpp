// SPDX-License-Identifier: Apache-2.0
#include "leaf_bits.h"

#include <bit>
#include <cstring>

#include "fibrolite/clones.h"

namespace fibrolite {

static_assert(std::endian::native == std::endian::little);

FIBROLITE_CLONES LeafBits bits_below(const float* value, float below) {
  LeafBits bits{};
  for (std::size_t x = 0; x < 8; ++x) {
    std::array<std::uint8_t, 64> less;
    for (std::size_t i = 0; i < 64; ++i) less[i] = value[64 * x + i] < below ? 1 : 0;
    for (std::size_t y = 0; y < 8; ++y) {
      std::uint64_t eight = 0;
      std::memcpy(&eight, less.data() + 8 * y, 8);
      bits[x] |= lowest_of_bytes(eight) << (8 * y);
    }
  }
  return bits;
}

std::uint64_t face_of(const LeafBits& bits, unsigned axis, bool upper) {
  const unsigned layer = upper ? 7 : 0;
  if (axis == 0) return bits[layer];
  std::uint64_t face = 0;
  for (unsigned x = 0; x < 8; ++x)
    face |= (axis == 1 ? bits[x] >> (8 * layer) & 255U : lowest_of_bytes(bits[x] >> layer & first_column)) << (8 * x);
  return face;
}

}  // namespace fibrolite
