// SPDX-License-Identifier: Apache-2.0
// What sections of a shape share: a layer's cells (pixels), sampled block by block at their corners and, near the
// surface, at their centres. A cell there is four triangles about its centre, the surface straight in each.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "fibrolite/shape.h"
#include "fibrolite/slice.h"

namespace fibrolite {

/// Cells [x0, x1) by [y0, y1).
struct CellRange {
  int x0, y0, x1, y1;
};

/// Edge of a block, cells: 17 x 17 corners fit into one PointBlock.
constexpr int block_cells = 16;
/// Edge of the squares that are looked at in parallel, cells.
constexpr int square_cells = 8 * block_cells;

/// Counter-clockwise round a cell.
constexpr std::array<int, 4> corner_x{0, 1, 1, 0}, corner_y{0, 0, 1, 1};

/// Where along an edge the surface crosses it, 0 to 1 from a to b; one of them is negative and one is not.
inline double crossing(float a, float b) { return static_cast<double>(a) / (static_cast<double>(a) - b); }

/// One block of a layer, sampled.
class CellBlock {
 public:
  /// `z_mm`: height in the frame. No sample is exactly 0, or so near that a crossing would fall onto a corner: no two
  /// outlines touch.
  CellBlock(const Shape& shape, const SliceGrid& grid, const CellRange& cells, double z_mm) {
    std::size_t n = 0;
    for (int j = cells.y0; j <= cells.y1; ++j) {
      for (int i = cells.x0; i <= cells.x1; ++i) place(grid, i, j, z_mm, n++);
    }
    Values value;
    shape.evaluate(PointBlock{x_.data(), y_.data(), z_.data(), static_cast<int>(n)}, value.data());
    const double pixel = std::min(grid.pixel_mm.x, grid.pixel_mm.y);
    const auto nudge = static_cast<float>(1e-5 * pixel);
    const auto nudged = [nudge](float v) { return std::abs(v) < nudge ? (v < 0 ? -nudge : nudge) : v; };
    n = 0;
    for (int j = 0; j <= cells.y1 - cells.y0; ++j) {
      for (int i = 0; i <= cells.x1 - cells.x0; ++i) corner_[at(i, j)] = nudged(value[n++]);
    }

    // Nothing can be in a cell whose corners are on one side, and farther off than its middle.
    const auto reach = static_cast<float>(0.5 * std::hypot(grid.pixel_mm.x, grid.pixel_mm.y));
    std::array<std::size_t, block_cells * block_cells> which;
    n = 0;
    for (int j = 0; j < cells.y1 - cells.y0; ++j) {
      for (int i = 0; i < cells.x1 - cells.x0; ++i) {
        const std::array<float, 4> v = corners(i, j);
        const auto [low, high] = std::minmax({v[0], v[1], v[2], v[3]});
        split_[cell(i, j)] = low < reach && high > -reach;
        if (!split_[cell(i, j)]) continue;
        which[n] = cell(i, j);
        place(grid, cells.x0 + i + 0.5, cells.y0 + j + 0.5, z_mm, n++);
      }
    }
    if (n == 0) return;
    shape.evaluate(PointBlock{x_.data(), y_.data(), z_.data(), static_cast<int>(n)}, value.data());
    for (std::size_t k = 0; k < n; ++k) centre_[which[k]] = nudged(value[k]);
  }

  /// Values at the four corners, counter-clockwise.
  [[nodiscard]] std::array<float, 4> corners(int i, int j) const {
    return {corner_[at(i, j)], corner_[at(i + 1, j)], corner_[at(i + 1, j + 1)], corner_[at(i, j + 1)]};
  }
  /// Whether the surface may be in the cell; else it is wholly on the side of its corners.
  [[nodiscard]] bool split(int i, int j) const { return split_[cell(i, j)]; }
  /// Of a split cell.
  [[nodiscard]] float centre(int i, int j) const { return centre_[cell(i, j)]; }
  /// Cut off what lies at or beyond the layer's rim, so that every outline closes.
  void close_rim(const SliceGrid& grid, const CellRange& cells) {
    const auto out = static_cast<float>(1e-5 * std::min(grid.pixel_mm.x, grid.pixel_mm.y));
    for (int j = 0; j <= cells.y1 - cells.y0; ++j) {
      for (int i = 0; i <= cells.x1 - cells.x0; ++i) {
        const int x = cells.x0 + i, y = cells.y0 + j;
        if (x > 0 && y > 0 && x < grid.width && y < grid.height) continue;
        float& v = corner_[at(i, j)];
        if (v >= 0) continue;
        v = out;
        for (const int dj : {-1, 0}) {
          for (const int di : {-1, 0}) {
            const int ci = i + di, cj = j + dj;
            if (ci < 0 || cj < 0 || ci >= cells.x1 - cells.x0 || cj >= cells.y1 - cells.y0) continue;
            // A cell that was wholly inside has no centre yet; deep inside is all that matters of it.
            if (!split_[cell(ci, cj)]) centre_[cell(ci, cj)] = static_cast<float>(-grid.pixel_mm.x);
            split_[cell(ci, cj)] = true;
          }
        }
      }
    }
  }

 private:
  using Values = std::array<float, PointBlock::capacity>;
  static constexpr int stride = block_cells + 1;
  static_assert(stride * stride <= PointBlock::capacity);
  static std::size_t at(int i, int j) { return static_cast<std::size_t>(j * stride + i); }
  static std::size_t cell(int i, int j) { return static_cast<std::size_t>(j * block_cells + i); }
  void place(const SliceGrid& grid, double i, double j, double z_mm, std::size_t n) {
    const Vec3d p = grid.frame.to_world({i * grid.pixel_mm.x, j * grid.pixel_mm.y, z_mm});
    x_[n] = static_cast<float>(p.x);
    y_[n] = static_cast<float>(p.y);
    z_[n] = static_cast<float>(p.z);
  }

  Values x_, y_, z_;
  std::array<float, stride * stride> corner_;
  std::array<float, block_cells * block_cells> centre_;
  std::array<bool, block_cells * block_cells> split_;
};

/// All values the shape takes over some cells between two heights of the frame.
inline Interval bound_of(const Shape& shape, const SliceGrid& grid, const CellRange& cells, double z0_mm,
                         double z1_mm) {
  const Box3d local{{cells.x0 * grid.pixel_mm.x, cells.y0 * grid.pixel_mm.y, z0_mm},
                    {cells.x1 * grid.pixel_mm.x, cells.y1 * grid.pixel_mm.y, z1_mm}};
  Box3d box;
  for (unsigned i = 0; i < 8; ++i) box.include(grid.frame.to_world(local.corner(i)));
  return shape.bound(box);
}

/// Halve `cells` until a part is wholly inside, wholly outside, or a block: full(range) for the first, mixed(range) for
/// the last.
template <class Full, class Mixed>
void visit_cells(const Shape& shape, const SliceGrid& grid, const CellRange& cells, double z0_mm, double z1_mm,
                 const Full& full, const Mixed& mixed) {
  const Interval bound = bound_of(shape, grid, cells, z0_mm, z1_mm);
  if (bound.lo > 0) return;
  if (bound.hi < 0) return full(cells);
  const int wide = cells.x1 - cells.x0, high = cells.y1 - cells.y0;
  if (wide <= block_cells && high <= block_cells) return mixed(cells);
  CellRange low = cells, rest = cells;
  const auto half = [](int length) { return (length / 2 + block_cells - 1) / block_cells * block_cells; };
  if (wide >= high) {
    low.x1 = rest.x0 = cells.x0 + half(wide);
  } else {
    low.y1 = rest.y0 = cells.y0 + half(high);
  }
  visit_cells(shape, grid, low, z0_mm, z1_mm, full, mixed);
  visit_cells(shape, grid, rest, z0_mm, z1_mm, full, mixed);
}

/// The squares of a layer, row by row.
inline int squares_across(const SliceGrid& grid) { return (grid.width + square_cells - 1) / square_cells; }
inline int squares_up(const SliceGrid& grid) { return (grid.height + square_cells - 1) / square_cells; }
inline CellRange square(const SliceGrid& grid, int number) {
  const int x = number % squares_across(grid) * square_cells, y = number / squares_across(grid) * square_cells;
  return {x, y, std::min(x + square_cells, grid.width), std::min(y + square_cells, grid.height)};
}

}  // namespace fibrolite
