// SPDX-License-Identifier: Apache-2.0
// The triangles around a vertex.
#pragma once

#include <array>
#include <cstdint>

namespace fibrolite {

/// Of each triangle around a vertex: where its edge out of the vertex leads, and where its edge into it comes from.
template <std::uint32_t most>
struct alignas(64) Fan {
  std::array<std::uint32_t, most> out, in;

  /// Places that are not used hold numbers that no vertex has, the same in both and each only once.
  void clear() {
    for (std::uint32_t i = 0; i < most; ++i) out[i] = in[i] = first_unused + i;
  }
  void put(std::uint32_t place, std::uint32_t to, std::uint32_t from) {
    out[place] = to;
    in[place] = from;
  }
  static constexpr std::uint32_t first_unused = 0xffffffffU - most;
};

/// Do the first `count` triangles follow each other around the vertex once, each edge in both directions? The other
/// places must be clear. Cost: O(most), all of them side by side.
[[nodiscard]] bool is_closed(const Fan<8>& fan, std::uint32_t count);
[[nodiscard]] bool is_closed(const Fan<16>& fan, std::uint32_t count);

}  // namespace fibrolite
