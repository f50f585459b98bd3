// SPDX-License-Identifier: Apache-2.0
// The outlines of one layer of a shape, closed and nested.
#pragma once

#include <vector>

#include "fibrolite/shape.h"
#include "fibrolite/slice.h"
#include "fibrolite/vec.h"

namespace fibrolite {

/// One closed outline; the last point joins the first. Material lies to the left: counter-clockwise round material,
/// clockwise round a hole.
struct Contour {
  std::vector<Vec2d> points;  ///< Frame coordinates, mm; three or more.
  double area_mm2 = 0;        ///< Signed: negative for a hole.
  int depth = 0;              ///< How many outlines lie around it: even for an outer one, odd for a hole.
  int parent = -1;            ///< Index of the innermost outline around it; -1: none.
};
struct ContourParams {
  /// Points are left out where the outline stays within this of the straight line, pixels; 0 to 0.1.
  double tolerance_px = 0.01;
};
/// All outlines of the section at half height of a layer, in a fixed order. Made of the same straight pieces that
/// slice() measures, four triangles to a pixel, so no outline crosses itself or another, and their areas add up to the
/// layer's. What reaches the rim of the grid is cut off there. Parallel; the same bits on any number of threads.
/// Cost: time as slice(), memory in proportion to the length of the outlines.
/// @throws Error BadRecipe: a range above.
[[nodiscard]] std::vector<Contour> contours(const Shape& shape, const SliceGrid& grid, int layer,
                                            const ContourParams& params = {});

}  // namespace fibrolite
