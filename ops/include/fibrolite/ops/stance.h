// SPDX-License-Identifier: GPL-3.0-or-later
// How the model stands under its load. Parts are decided in that frame, so that they do not depend on how model and
// load lie in the file.
#pragma once

#include "fibrolite/frame.h"
#include "fibrolite/mesh.h"
#include "fibrolite/ops/part.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/ops/verify.h"

namespace fibrolite {

/// z is `params.up`, x where the slanted load comes from. Load cases whose first force is more than 45 degrees off
/// straight down have been turned with the model: then z is against that force, and x points level to where the next
/// one comes from that is not parallel to it; a single force leaves x to the world, as azimuth 0 does. The origin
/// stays. World axes exactly where they are that up to rounding: a quarter turn then changes no bit of what is decided.
/// @throws Error BadRecipe: up has no direction.
[[nodiscard]] Frame stance(const VerifyParams& params);
/// The same load as `params`, seen in its stance: up is z and the azimuth 0, unless the load cases say otherwise.
[[nodiscard]] VerifyParams in_stance(const VerifyParams& params);

/// A mesh in a frame's coordinates. Cost: O(vertices).
[[nodiscard]] Mesh seen_from(const Frame& frame, Mesh mesh);

// From a frame's coordinates back to the world's. Cost: O(parts), one more turn of each point asked for.
[[nodiscard]] Axis placed(const Axis& axis, const Frame& frame);
[[nodiscard]] Cut placed(Cut cut, const Frame& frame);
[[nodiscard]] Core placed(Core core, const Frame& frame);
[[nodiscard]] Partition placed(Partition partition, const Frame& frame);
[[nodiscard]] Parts placed(const Parts& parts, const Frame& frame);

}  // namespace fibrolite
