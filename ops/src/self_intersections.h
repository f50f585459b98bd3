// SPDX-License-Identifier: GPL-3.0-or-later
// Where a surface cuts or touches itself.
#pragma once

#include <cstdint>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"

namespace fibrolite {

/// Pairs of triangles that meet other than in a shared corner or edge; decided exactly for the float coordinates. Any
/// soup will do; triangles without area are left out. `mesh` must be welded. Cost: O(n log n) plus the pairs that meet,
/// parallel.
std::int64_t self_intersections(const Mesh& mesh, const Context& context);

}  // namespace fibrolite
