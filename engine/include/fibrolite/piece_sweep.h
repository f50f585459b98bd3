// SPDX-License-Identifier: Apache-2.0
// Pieces of material and enclosed voids of a solid that comes slab by slab and is never whole in memory.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/pieces.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Samples that change sides: specks that go, pores that are filled.
struct Flips {
  struct Block {
    Vec3i origin{};                        ///< A multiple of 8.
    std::array<std::uint64_t, 8> which{};  ///< Bit 8 y + z of word x: sample origin + (x, y, z).
    bool tile = false;                     ///< One value stands for all of them.
  };
  std::vector<Block> blocks;                     ///< Sorted by origin, x first; each once.
  [[nodiscard]] bool holds(Vec3i sample) const;  ///< Cost: O(log blocks).
};
/// The solid with those of the samples that it holds turned over. Cost: a copy of the solid, if there is any flip in
/// it and something else holds it too.
[[nodiscard]] Solid flipped(Solid solid, const Flips& flips);

class PieceSweep {
 public:
  struct Params {
    int axis = 2;          ///< Along which the slabs follow each other.
    bool falling = false;  ///< From high to low.
    double skin_mm = 0;    ///< How much is taken off the material first (reach.h).
    CleanParams clean{.drop_below_vox = 0, .fill_below_vox = 0};  ///< In several slabs up to 512, a block.
  };
  PieceSweep(Grid grid, const Params& params);
  /// The next slab: the blocks of 8 with low <= sample[axis] < high; both multiples of 8, each slab next to the one
  /// before. What `solid` holds beyond is not looked at.
  /// Pieces with a sample where `anchor` is negative are held. Cost: as pieces(), plus the slab's last layer of samples
  /// in memory.
  void add(const Solid& solid, int low, int high, const Shape& anchor = nothing(), const Context& context = {});

  struct Result {
    /// But for specks that go and voids that are filled; the same, however the solid was cut. A void that is filled may
    /// have been all that kept two pieces apart: they count as two here.
    Pieces left;
    std::vector<bool> held;        ///< Of left.material, which have a sample in an anchor.
    std::vector<SampleBox> boxes;  ///< Of left.material, the blocks each reaches into.
    std::int64_t dropped = 0, filled = 0;
    Flips flips;
  };
  /// After the last slab. Once.
  [[nodiscard]] Result finish();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace fibrolite
