// SPDX-License-Identifier: Apache-2.0
// The only maker of voxels: evaluates a shape leaf by leaf (8x8x8 samples), in parallel, where it is needed.
#pragma once

#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Sample `shape` inside `region_mm` (it must lie wholly in there; what sticks out is cut flat). Blocks that its bound
/// shows to be far from the surface are not evaluated. Values beyond the grid's reach are clamped, exact zeros nudged
/// by 1e-3 voxel to the outside (a zero at a sample makes degenerate triangles). Cost: O(blocks near the surface),
/// parallel; the same bits on any number of threads.
/// @throws Error BadRecipe: voxel not positive; Cancelled.
[[nodiscard]] Solid realize(const Shape& shape, const Box3d& region_mm, Grid grid, const Context& context = {});

/// As above, only where `body` is not wholly outside: for shapes that lie inside the body. Uses the body's lattice.
[[nodiscard]] Solid realize(const Shape& shape, const Solid& body, const Context& context = {});

}  // namespace fibrolite
