// SPDX-License-Identifier: Apache-2.0
// The zero level of a grid as a mesh that keeps the edges and corners of the mesh the grid was made from.
#pragma once

#include <openvdb/openvdb.h>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/winding.h"

namespace fibrolite {

/// Outward; closed. Where the surface bends sharply, a vertex is moved by up to a voxel to where the planes of the
/// `original` mesh's nearby triangles meet (the quadratic error of Garland and Heckbert 1997, as in dual contouring);
/// elsewhere it lies on the interpolated surface. `tree` must be of `original`. Cost: O(active voxels), parallel.
[[nodiscard]] Mesh sharp_zero_level(const openvdb::FloatTree::Ptr& level_set, double voxel_mm, const Mesh& original,
                                    const WindingTree& tree, const Context& context);

}  // namespace fibrolite
