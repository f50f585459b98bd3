// SPDX-License-Identifier: GPL-3.0-or-later
// Which way the triangles of a mesh face.
#pragma once

#include <cstdint>

#include "fibrolite/mesh.h"

namespace fibrolite {

/// What orient() did.
struct Orientation {
  std::int64_t turned_triangles = 0;      ///< To match their neighbours.
  std::int64_t one_sided_components = 0;  ///< Like a Moebius band: left as they were.
  bool turned_inside_out = false;         ///< The whole, as its signed volume was negative.
  std::int64_t turned_shells = 0;         ///< Closed shells with negative volume that lie in no other.
};
/// Make each component (connected through edges of exactly two triangles) consistent by turning the smaller share of
/// its area, then turn the whole if its signed volume is negative, then each closed shell that is still inside out and
/// lies in no other. A shell inside another keeps its side: it is a cavity if it faces the other way. `mesh` must be
/// welded. A mesh and its mirror in orientation give the same result. Cost: O(n log n).
Orientation orient(Mesh& mesh);

}  // namespace fibrolite
