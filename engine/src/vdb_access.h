// SPDX-License-Identifier: Apache-2.0
// The one private door to OpenVDB.
#pragma once

#include <openvdb/openvdb.h>

#include <memory>

#include "fibrolite/solid.h"

namespace fibrolite {

/// The tree's background is +band (outside); voxels and tiles inside are negative. Index (i, j, k) lies at voxel_mm *
/// (i, j, k).
struct Solid::Impl {
  openvdb::FloatGrid::ConstPtr grid;
  Grid spec;
};

/// Registers OpenVDB's types, once per process, thread-safe.
void initialize_openvdb();

/// An empty level-set grid on the lattice of `spec`.
[[nodiscard]] openvdb::FloatGrid::Ptr make_grid(Grid spec);
[[nodiscard]] Solid make_solid(openvdb::FloatGrid::ConstPtr grid, Grid spec);
/// The solid's grid to change: its own if nothing else holds it, else a copy.
[[nodiscard]] openvdb::FloatGrid::Ptr editable(Solid&& solid);

}  // namespace fibrolite
