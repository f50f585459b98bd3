// SPDX-License-Identifier: Apache-2.0
// The one private door to OpenVDB.
#pragma once

#include <openvdb/openvdb.h>

#include <atomic>
#include <memory>
#include <utility>

#include "fibrolite/solid.h"

namespace fibrolite {

/// The tree's background is +band (outside); voxels and tiles inside are negative. Index (i, j, k) lies at voxel_mm *
/// (i, j, k).
struct Solid::Impl {
  Impl(openvdb::FloatGrid::ConstPtr g, Grid s) : grid(std::move(g)), spec(s) {}

  const openvdb::FloatGrid::ConstPtr grid;
  const Grid spec;
  mutable std::atomic<double> filled_voxels{-1};  ///< Once they have been asked for; it takes a look at all of them.
};

/// Registers OpenVDB's types, once per process, thread-safe.
void initialize_openvdb();

/// An empty level-set grid on the lattice of `spec`.
[[nodiscard]] openvdb::FloatGrid::Ptr make_grid(Grid spec);
[[nodiscard]] Solid make_solid(openvdb::FloatGrid::ConstPtr grid, Grid spec);
/// The solid's grid to change: its own if nothing else holds it, else a copy.
[[nodiscard]] openvdb::FloatGrid::Ptr editable(Solid&& solid);

}  // namespace fibrolite
