// SPDX-License-Identifier: Apache-2.0
// Vertices of eight triangles or quads side by side, for functions that are cloned (clones.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "fibrolite/vec.h"

namespace fibrolite {

constexpr std::size_t lanes = 8;
using Lanes [[gnu::vector_size(32)]] = float;
using Mask [[gnu::vector_size(32)]] = std::int32_t;  // a lane is all ones or zero
using Doubles [[gnu::vector_size(64)]] = double;

using EightPlaces = std::array<Lanes, 3>;  ///< By axis.

/// A corner of eight faces. `first`: number of places[0].
template <class Face>
[[gnu::always_inline]] inline void gather(const Face* faces, std::size_t corner, const Vec3f* places, std::size_t first,
                                          EightPlaces& at) {
  std::array<std::array<float, lanes>, 3> flat;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const Vec3f& p = places[faces[lane][corner] - first];
    flat[0][lane] = p.x;
    flat[1][lane] = p.y;
    flat[2][lane] = p.z;
  }
  std::memcpy(&at, &flat, sizeof flat);
}

/// u x v, and where rounding leaves no doubt that it is not zero: its products are right to 2e-7 of themselves.
[[gnu::always_inline]] inline void cross(const EightPlaces& u, const EightPlaces& v, EightPlaces& n, Mask& clear) {
  clear = Mask{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t y = (axis + 1) % 3, z = (axis + 2) % 3;
    const Lanes n1 = u[y] * v[z], n2 = u[z] * v[y];
    // Twice the greater one: no less than their sum.
    const Lanes greatest = n1 * n1 > n2 * n2 ? n1 * n1 : n2 * n2;
    n[axis] = n1 - n2;
    clear |= n[axis] * n[axis] > 4e-12F * greatest + 1e-36F;
  }
}

}  // namespace fibrolite
