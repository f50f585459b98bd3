// SPDX-License-Identifier: Apache-2.0
#include "leaf_bits.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <cstddef>

namespace fibrolite {

#ifdef __SSE2__
LeafBits bits_below(const float* value, float below) {
  LeafBits bits{};
  const __m128 limit = _mm_set1_ps(below);
  for (std::size_t i = 0; i < 512; i += 16) {
    const auto less = [&](std::size_t k) { return _mm_castps_si128(_mm_cmplt_ps(_mm_loadu_ps(value + i + k), limit)); };
    const __m128i bytes =
        _mm_packs_epi16(_mm_packs_epi32(less(0), less(4)), _mm_packs_epi32(less(8), less(12)));  // all ones or none
    bits[i / 64] |= static_cast<std::uint64_t>(_mm_movemask_epi8(bytes)) << (i % 64);
  }
  return bits;
}
#else
LeafBits bits_below(const float* value, float below) {
  LeafBits bits{};
  for (std::size_t i = 0; i < 512; ++i)
    bits[i / 64] |= static_cast<std::uint64_t>(value[i] < below ? 1 : 0) << (i % 64);
  return bits;
}
#endif

std::uint64_t face_of(const LeafBits& bits, unsigned axis, bool upper) {
  const unsigned layer = upper ? 7 : 0;
  if (axis == 0) return bits[layer];
  std::uint64_t face = 0;
  for (unsigned x = 0; x < 8; ++x)
    face |= (axis == 1 ? bits[x] >> (8 * layer) & 255U : lowest_of_bytes(bits[x] >> layer & first_column)) << (8 * x);
  return face;
}

}  // namespace fibrolite
