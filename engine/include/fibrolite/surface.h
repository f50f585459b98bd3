// SPDX-License-Identifier: Apache-2.0
// Solid -> triangle mesh.
#pragma once

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct SurfaceParams {
  /// Move each vertex so that curved surfaces keep their volume (a mesh with its vertices on a convex surface lies
  /// inside it).
  bool keep_volume = true;
  int axis = 2;  ///< Triangles and vertices come in layers along it.
};
/// Dual surface of the zero level: closed, 2-manifold, outward, no degenerate triangle, at float coordinates.
/// Cost: O(leaves + triangles), parallel; peaks at about twice the mesh. The same bits on any number of threads.
/// Source: Nielson 2004 (dual marching cubes), Wenger 2013 (its manifold case).
/// @throws Error TooLarge (more than 2^32 - 1 vertices), Cancelled.
[[nodiscard]] Mesh surface(const Solid& solid, const SurfaceParams& params = {}, const Context& context = {});

}  // namespace fibrolite
