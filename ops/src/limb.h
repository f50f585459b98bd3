// SPDX-License-Identifier: GPL-3.0-or-later
// One connected piece of the body as a limb: how it branches, where its centre line runs, how long and wide it is.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fibrolite/ops/partition.h"
#include "section.h"

namespace fibrolite {

/// A connected set of inside samples and where it was cut off from the rest.
struct LimbPiece {
  std::vector<std::int32_t> samples;             ///< Ascending.
  std::vector<std::vector<std::int32_t>> faces;  ///< Per cut: the samples beside it.
  double diameter_mm = 0;                        ///< Typical thickness.
};

/// A section to cut along, from the limb (z < 0) into the rest.
using Split = Section;

struct LimbShape {
  Axis axis;
  double length_mm = 0;  ///< From cut or tip to cut or tip.
  double width_mm = 0;   ///< Larger principal diameter of its sections, 90th percentile.
  int free_ends = 0;     ///< Tips: 0 to 2.
  bool ring = false;
  /// Length over width, half a width per tip taken off: a ball has none, however it is measured.
  [[nodiscard]] double slenderness() const;
};

/// Sections that part a branching piece into its limbs; empty if it is one limb (or a ring).
[[nodiscard]] std::vector<Split> branch_cuts(const VoxelBody& body, const Links& links, const LimbPiece& piece);

/// Centre line from the cut to the tip, cut to cut, tip to tip, or round a ring. A piece that is clearly below
/// `least_slenderness` gets its principal axis.
[[nodiscard]] LimbShape limb_shape(const VoxelBody& body, const Links& links, const LimbPiece& piece,
                                   double least_slenderness, const Context& context);

/// From geodesic distances to its first cut alone; quick. The piece must have a cut.
struct QuickShape {
  double slenderness = 0, width_mm = 0;
};
[[nodiscard]] QuickShape quick_shape(const VoxelBody& body, const Links& links, const LimbPiece& piece);

/// A straight axis along the longest principal axis.
[[nodiscard]] Axis principal_axis(const VoxelBody& body, const std::vector<std::int32_t>& samples);

}  // namespace fibrolite
