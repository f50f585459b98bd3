// SPDX-License-Identifier: GPL-3.0-or-later
// Joining the regions of a transient layer. Private to the joints.
#pragma once

#include <cstdint>

#include "fibrolite/image.h"
#include "fibrolite/ops/joint.h"

namespace fibrolite {

/// Adds material to layer.solid and layer.distance_mm, inside `section` (1 = inside the body), until one region is left
/// or no way is found. Mst: bars of `min_wall_mm` along the shortest gaps, as a minimum spanning tree over the regions.
/// Bbox: each region but the largest gets its bounding box, extended along the shortest of the four axis directions to
/// the next region (the paper's formula is lost; this is our reading of it); what that leaves apart is joined by bars.
void join_regions(Layer& layer, const Image<std::uint8_t>& section, Bridge bridge, double min_wall_mm);

}  // namespace fibrolite
