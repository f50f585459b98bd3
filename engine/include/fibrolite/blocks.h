// SPDX-License-Identifier: Apache-2.0
// Visiting a solid block by block, for measurements that need more than one shape at the same samples.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Index-space origins (multiples of 8) of all 8x8x8 blocks that hold a sample inside or a band sample of the solid, in
/// the tree's order. Cost: O(blocks).
[[nodiscard]] std::vector<Vec3i> blocks(const Solid& solid);

/// Those in a range. Cost: as of all.
[[nodiscard]] std::vector<Vec3i> blocks(const Solid& solid, const SampleRange& range);

/// Sums of such values are exact, and so the same in any order, up to 10^11: to the nearest multiple of 2^-16.
[[nodiscard]] inline double rounded_for_sums(double value) { return std::nearbyint(value * 65536) / 65536; }

/// Call visit(number, block) for every origin, in parallel; `block` carries the 512 sample points of its lattice.
void for_each_block(const std::vector<Vec3i>& origins, double voxel_mm,
                    const std::function<void(std::size_t number, const PointBlock& block)>& visit);

/// The samples low + (i, j, k), each index below `size`, as one dense array, k (z) fastest: out[(i * size.y + j) *
/// size.z
/// + k], distance in mm. `out` holds size.x * size.y * size.z values. Cost: O(samples).
void copy_samples(const Solid& solid, Vec3i low, Vec3i size, float* out);

}  // namespace fibrolite
