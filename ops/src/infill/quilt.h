// SPDX-License-Identifier: GPL-3.0-or-later
// Image quilting (Efros and Freeman 2001, "Image quilting for texture synthesis and transfer"). Private to the fibre
// infill.
#pragma once

#include "fibrolite/image.h"
#include "fibrolite/random.h"

namespace fibrolite {

struct QuiltParams {
  int block_px = 56;       ///< Side of a patch; at most the texture's smaller side.
  int overlap_px = 18;     ///< Shared by neighbouring patches; less than half a patch.
  int candidates = 1500;   ///< Places of the texture tried per patch.
  double tolerance = 0.1;  ///< A patch is drawn from those whose error is within this share of the best.
};
/// A tile-free texture of width x height that looks like `texture` everywhere. Integer errors and a named random
/// stream: the same bits on any number of threads. Cost: O(patches * candidates * overlap pixels) at most.
[[nodiscard]] GrayImage quilt(const GrayImage& texture, int width, int height, const QuiltParams& params,
                              Random random);

}  // namespace fibrolite
