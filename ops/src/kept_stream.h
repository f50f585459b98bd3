// SPDX-License-Identifier: GPL-3.0-or-later
// What a solid that comes in slabs has found out so far, kept for a run that goes on.
#pragma once

#include <cstdint>
#include <vector>

#include "fibrolite/kept_work.h"
#include "fibrolite/ops/measure.h"
#include "fibrolite/ops/tie.h"
#include "fibrolite/piece_sweep.h"
#include "print_patches.h"

namespace fibrolite {

/// What is measured of a slab; slabs add up to the whole's without an error.
struct SlabSums {
  VolumeSums volumes;
  std::int64_t active_voxels = 0;
  PrintTally print;
  void add(const SlabSums& other, const PatchRules& rules);
};

void keep(KeptWork& work, const SampleRange& slab, const SlabSums& sums);
/// Returns whether it was kept. @throws Error Io.
[[nodiscard]] bool recall(const KeptWork& work, const SampleRange& slab, SlabSums& sums);

/// The first pass: struts, counts, and samples that change sides. Of `tied`, the solid is not kept.
void keep(KeptWork& work, const Tied& tied, const Flips& flips);
[[nodiscard]] bool recall(const KeptWork& work, Tied& tied, Flips& flips);

}  // namespace fibrolite
