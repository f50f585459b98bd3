// SPDX-License-Identifier: GPL-3.0-or-later
// What a print scan finds, as patches: spots that hang together, across ranges that are scanned one at a time.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "fibrolite/ops/printable.h"
#include "print_scan.h"

namespace fibrolite {

/// Patches are spots whose samples touch (26 neighbours). Drops the spots of patches with less area than this.
/// Cost: O(spots log spots).
void drop_small_patches(std::vector<Spot>& spots, double least_mm2);
/// Keeps the spots of patches whose largest extent in any direction across `up` is above this.
void keep_wide_patches(std::vector<Spot>& spots, Vec3d up, double across_mm);

/// Which patches count, and as what.
struct PatchRules {
  Vec3d up{0, 0, 1};
  double node_mm = 0;                 ///< Steep patches no wider than this are undersides of nodes.
  std::array<double, 3> least_mm2{};  ///< Walls, gaps, steep: patches with less area are noise.
  int reach_vox = 0;                  ///< Spot::at lies at most so far from the edge it was found on.
};

/// A patch so far. Sums are of multiples of 2^-28, exact in any order.
struct PatchSum {
  std::int64_t area = 0, volume = 0;
  std::array<std::int64_t, 3> moment{};
  double least_mm = std::numeric_limits<double>::infinity();
  Vec3d least_at_mm{};
  std::array<double, 8> low{}, high{};  ///< Its extent in eight directions across `up`.
};
/// Patches of one kind (walls, gaps or steep) of one range.
struct PatchRun {
  struct Sample {
    std::uint64_t key;
    std::uint64_t patch;
  };
  struct Totals {
    std::int64_t places = 0, area = 0, volume = 0, node_area = 0;
    double least_mm = std::numeric_limits<double>::infinity();
    std::array<PrintPlace, 5> worst{};  ///< The first min(places, 5) of them.
  };
  Totals closed;               ///< Of patches that no other range can add to.
  std::vector<PatchSum> open;  ///< The others.
  std::vector<Sample> border;  ///< By key: samples that another range's could touch, and whose patch they are of.
};
/// What was found in some ranges along one axis. Neighbours are joined as they come, so that what it holds is bounded
/// by what lies on the borders to ranges that are not there yet. The same bits in whatever ranges, in whatever order.
struct PrintTally {
  struct Run {
    SampleRange range;
    std::array<PatchRun, 3> kinds;  ///< Walls, gaps, steep.
  };
  std::vector<Run> runs;  ///< By place; no two touch.
  double lumen_mm2 = 0;   ///< Exact in any order, as Scan::lumen_mm2.

  PrintTally() = default;
  /// Of one range. Cost: O(spots log spots).
  PrintTally(const Scan& found, const SampleRange& range, const PatchRules& rules);
  /// Adds other ranges along the same axis. Cost: O(samples at the borders where ranges meet).
  void add(const PrintTally& other, const PatchRules& rules);
  /// With all ranges there: patches still open end.
  [[nodiscard]] Printable total(const PatchRules& rules) const;
};

}  // namespace fibrolite
