// SPDX-License-Identifier: Apache-2.0
// Does a band of signed distances fit together?
#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>

namespace fibrolite {

/// Neighbouring samples whose values differ by more than their spacing: no distance to one surface does that, so there
/// the sides contradict each other (the surface overlaps itself). Cost: O(active voxels), parallel.
[[nodiscard]] std::int64_t contradictions(const openvdb::FloatTree& tree, double voxel_mm);

}  // namespace fibrolite
