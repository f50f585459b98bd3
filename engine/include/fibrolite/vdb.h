// SPDX-License-Identifier: Apache-2.0
// The bridge for users who live in OpenVDB; the only public header with a third-party type.
#pragma once

#include <openvdb/openvdb.h>

#include "fibrolite/solid.h"

namespace fibrolite {

/// Shares the tree; no copy, unless values inside are told deeper than the band (narrowed()). World mm, class
/// GRID_LEVEL_SET.
[[nodiscard]] openvdb::FloatGrid::ConstPtr to_vdb(const Solid& solid);
/// Takes a level set with uniform voxels whose lattice passes through the world origin.
/// @throws Error BadInput otherwise.
[[nodiscard]] Solid from_vdb(const openvdb::FloatGrid::ConstPtr& grid);

}  // namespace fibrolite
