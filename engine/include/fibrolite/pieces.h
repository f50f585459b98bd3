// SPDX-License-Identifier: Apache-2.0
// Connected pieces of material and enclosed voids of a solid.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Material is 6-connected; so is void.
struct Piece {
  std::int64_t voxels = 0;
  double volume_mm3 = 0;  ///< voxels * voxel^3.
  Vec3d sample_mm{};      ///< A sample inside the piece (the first in scan order).
};
struct Pieces {
  std::vector<Piece> material;  ///< Largest first; ties by scan order.
  std::vector<Piece> cavities;  ///< Voids that do not reach the outside, largest first.
};
/// Cost: O(leaves + active voxels), parallel; the same bits on any number of threads.
[[nodiscard]] Pieces pieces(const Solid& solid, const Context& context = {});

/// Which void a sample lies in. Immutable; copies are cheap.
class VoidMap {
 public:
  static constexpr int material = -1, outside = 0;
  /// Cost: as pieces().
  explicit VoidMap(const Solid& solid, const Context& context = {});
  /// Of sample (i, j, k), at voxel * (i, j, k): material, outside, or 1 + its place in cavities(). Cost: O(log
  /// cavities).
  [[nodiscard]] int at(Vec3i sample) const;
  [[nodiscard]] const std::vector<Piece>& cavities() const;  ///< As in Pieces.

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

struct CleanParams {
  std::int64_t drop_below_vox = 32;  ///< Loose pieces smaller than this are removed.
  std::int64_t fill_below_vox = 32;  ///< Voids smaller than this are filled.
};
struct CleanResult {
  Solid solid;
  std::int64_t dropped = 0, filled = 0;
  Pieces left;
};
/// Remove loose specks and fill micro-voids; the largest piece always stays.
[[nodiscard]] CleanResult clean(Solid solid, const CleanParams& params = {}, const Context& context = {});

/// A way from a loose piece to the nearest other material.
struct Gap {
  Vec3d from_mm, to_mm;
};
/// For each loose piece (all but the largest): the shortest found straight gap to material of another piece, through
/// void, searched within `reach_mm`. Pieces with none are left out. Cost: O(loose voxels * reach^2) at worst.
[[nodiscard]] std::vector<Gap> gaps(const Solid& solid, double reach_mm, const Context& context = {});
/// The same of the piece that this sample belongs to. Cost: as pieces(), and that search.
[[nodiscard]] std::optional<Gap> gap_from(const Solid& solid, Vec3d sample_mm, double reach_mm,
                                          const Context& context = {});

}  // namespace fibrolite
