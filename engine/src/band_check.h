// SPDX-License-Identifier: Apache-2.0
// Does a band of signed distances fit together?
#pragma once

#include <openvdb/openvdb.h>

#include <vector>

namespace fibrolite {

/// Samples at neighbouring places on different sides whose distances add up to more than their spacing: no surface can
/// lie between them, so their sides contradict each other (the surface overlaps itself). Returns the samples' blocks of
/// 8, each once, sorted. Only blocks in `box` (whole blocks of 8) are held against each other. Cost: O(leaves),
/// parallel.
[[nodiscard]] std::vector<openvdb::Coord> contradictions(const openvdb::FloatTree& tree, double voxel_mm,
                                                         const openvdb::CoordBBox& box = openvdb::CoordBBox::inf());
/// After `changed` (whole blocks, none in two of them) was filled again: all that has to do with it, and maybe others.
/// Cost: O(tiles and changed leaves), parallel.
[[nodiscard]] std::vector<openvdb::Coord> contradictions_around(const std::vector<openvdb::CoordBBox>& changed,
                                                                const openvdb::FloatTree& tree, double voxel_mm);

}  // namespace fibrolite
