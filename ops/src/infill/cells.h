// SPDX-License-Identifier: GPL-3.0-or-later
// Cells of a label image. Private to the fibre infill.
#pragma once

#include <cstdint>
#include <vector>

#include "fibrolite/image.h"
#include "fibrolite/vec.h"

namespace fibrolite {

using LabelImage = Image<std::int32_t>;

struct Basins {
  LabelImage label;  ///< 0 where the height is 0, else 1..count.
  int count = 0;
  std::vector<std::uint16_t> peak;  ///< Height of the peak of basin i + 1.
};
/// Watershed by flooding from the peaks down, 4-connected. Two peaks are one if the saddle between them is higher than
/// `saddle_ratio` times the lower peak: h-maxima with an h that follows the size of the fibre. Cost: O(pixels).
[[nodiscard]] Basins basins(const Image<std::uint16_t>& height, double saddle_ratio);

/// Grow the labels into the pixels marked 0 (or less), all at the same pace, until none is left. Does nothing without a
/// label.
void fill_gaps(LabelImage& label);

/// One cell of a full partition (every pixel 1..count).
struct Cell {
  std::int64_t pixels = 0;
  double inscribed_px = 0;  ///< Radius of the largest circle inside; the frame of the image does not bound a cell.
  Vec2d center{};           ///< px
  bool at_frame = false;    ///< Touches the frame of the image, so part of it may be missing.
};
/// Index 0 is label 1.
[[nodiscard]] std::vector<Cell> measure_cells(const LabelImage& label, int count);

/// Give every cell for which `small[label - 1]` holds to the neighbour with which it shares the longest border,
/// smallest label first, and number the rest without gaps. Returns how many are left.
int merge_cells(LabelImage& label, int count, const std::vector<char>& small);

/// Mean distance between the centres of cells that share a border, px; cells at the frame do not count unless there are
/// no others.
[[nodiscard]] double mean_pitch(const LabelImage& label, const std::vector<Cell>& cells);

}  // namespace fibrolite
