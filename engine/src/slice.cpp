// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/slice.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "fibrolite/blocks.h"
#include "fibrolite/error.h"
#include "layer_cells.h"

namespace fibrolite {
namespace {

bool is_length(double mm) { return std::isfinite(mm) && mm > 0; }

/// The part of a triangle that is inside, the surface a straight line through it.
double inside_share(float a, float b, float c) {
  const int inside = (a < 0 ? 1 : 0) + (b < 0 ? 1 : 0) + (c < 0 ? 1 : 0);
  if (inside == 0 || inside == 3) return inside == 3 ? 1 : 0;
  const bool lone = inside == 1;  // the sign of the one corner that the line cuts off
  if ((b < 0) == lone && (a < 0) != lone && (c < 0) != lone) std::swap(a, b);
  if ((c < 0) == lone && (a < 0) != lone && (b < 0) != lone) std::swap(a, c);
  const double cut = crossing(a, b) * crossing(a, c);
  return lone ? cut : 1 - cut;
}

/// The part of a split cell that is inside.
double inside_share(const std::array<float, 4>& v, float centre) {
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += inside_share(v[k], v[(k + 1) % 4], centre);
  return 0.25 * sum;
}

CellRange common(const CellRange& a, const CellRange& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

/// Adds the inside shares of a block's cells.
void add_shares(const CellBlock& block, const CellRange& cells, double weight,
                std::array<float, block_cells * block_cells>& share) {
  for (int j = 0; j < cells.y1 - cells.y0; ++j) {
    for (int i = 0; i < cells.x1 - cells.x0; ++i) {
      const std::array<float, 4> v = block.corners(i, j);
      const double inside = block.split(i, j) ? inside_share(v, block.centre(i, j)) : (v[0] < 0 ? 1 : 0);
      share[static_cast<std::size_t>(j * block_cells + i)] += static_cast<float>(weight * inside);
    }
  }
}

}  // namespace

SliceGrid slice_grid(const Frame& frame, const Box3d& box, Vec2d pixel_mm, double layer_mm) {
  if (!is_length(pixel_mm.x) || !is_length(pixel_mm.y))
    throw Error(Code::BadRecipe, "the pixel must be a positive length", "pixel");
  if (!is_length(layer_mm)) throw Error(Code::BadRecipe, "the layer must have a positive height", "layer");
  // A part that is a whole number of pixels long up to rounding gets just those.
  const auto steps = [](double length, double step) { return std::max(1.0, std::ceil(length / step - 1e-4)); };
  const Vec3d size = box.size();
  const double width = steps(size.x, pixel_mm.x), height = steps(size.y, pixel_mm.y), layers = steps(size.z, layer_mm);
  constexpr double most = std::numeric_limits<int>::max();
  if (!(width * height <= most))
    throw Error(Code::TooLarge, "a layer would have more than 2147483647 pixels", "pixel", "use larger pixels");
  if (!(layers <= most)) throw Error(Code::TooLarge, "more than 2147483647 layers", "layer", "use higher layers");
  SliceGrid grid{
      frame, pixel_mm, layer_mm, static_cast<int>(width), static_cast<int>(height), static_cast<int>(layers)};
  if (!box.empty()) grid.frame.origin = frame.to_world(box.min);
  return grid;
}

void check(const SliceParams& params) {
  if (params.planes < 1 || params.planes > 16) throw Error(Code::BadRecipe, "planes of a layer are 1 to 16", "planes");
}

double slice_into(std::uint8_t* rows, std::ptrdiff_t stride, const PixelRange& tile, const Shape& shape,
                  const SliceGrid& grid, int layer, const SliceParams& params, const Context& context) {
  check(params);
  if (!is_length(grid.pixel_mm.x) || !is_length(grid.pixel_mm.y) || !is_length(grid.layer_mm) || grid.width < 1 ||
      grid.height < 1)
    throw Error(Code::BadRecipe, "a layer needs pixels, and positive lengths for them and its height", "slice");
  if (tile.x < 0 || tile.y < 0 || tile.width < 1 || tile.height < 1 || tile.width > grid.width - tile.x ||
      tile.height > grid.height - tile.y)
    throw Error(Code::BadRecipe, "a tile must hold pixels, and of the layer only", "tile");
  if (stride < tile.width) throw Error(Code::BadRecipe, "rows overlap", "stride", "use the tile's width or more");
  const auto plane_mm = [&](int p) { return (layer + (p + 0.5) / params.planes) * grid.layer_mm; };
  const double weight = 1.0 / params.planes;
  const CellRange wanted{tile.x, tile.y, tile.x + tile.width, tile.y + tile.height};
  const auto row_of = [&](int x, int y) { return rows + (y - tile.y) * stride + (x - tile.x); };

  // The layer's own squares and blocks, cut off at the tile's rim: what is in a pixel does not depend on the tile.
  const int across = squares_across(grid);
  const int x0 = wanted.x0 / square_cells, x1 = (wanted.x1 - 1) / square_cells;
  const int y0 = wanted.y0 / square_cells, y1 = (wanted.y1 - 1) / square_cells;
  const int wide = x1 - x0 + 1, squares = wide * (y1 - y0 + 1);
  // One number per square, summed in order: the same bits on any number of threads.
  std::vector<double> filled(static_cast<std::size_t>(squares), 0.0);
  tbb::parallel_for(0, squares, [&](int number) {
    context.check();
    double& sum = filled[static_cast<std::size_t>(number)];
    const CellRange whole = square(grid, (y0 + number / wide) * across + x0 + number % wide);
    const CellRange empty = common(whole, wanted);
    for (int y = empty.y0; y < empty.y1; ++y) std::fill_n(row_of(empty.x0, y), empty.x1 - empty.x0, std::uint8_t{0});
    const auto full = [&](const CellRange& cells) {
      const CellRange c = common(cells, wanted);
      if (c.x0 >= c.x1 || c.y0 >= c.y1) return;
      for (int y = c.y0; y < c.y1; ++y) std::fill_n(row_of(c.x0, y), c.x1 - c.x0, std::uint8_t{255});
      sum += static_cast<double>(c.x1 - c.x0) * (c.y1 - c.y0);
    };
    const auto mixed = [&](const CellRange& cells) {
      const CellRange c = common(cells, wanted);
      if (c.x0 >= c.x1 || c.y0 >= c.y1) return;
      std::array<float, block_cells * block_cells> share{};
      for (int p = 0; p < params.planes; ++p)
        add_shares(CellBlock(shape, grid, cells, plane_mm(p)), cells, weight, share);

      for (int y = c.y0; y < c.y1; ++y) {
        for (int x = c.x0; x < c.x1; ++x) {
          const float s = share[static_cast<std::size_t>((y - cells.y0) * block_cells + x - cells.x0)];
          *row_of(x, y) = static_cast<std::uint8_t>(std::min(255.0F, 255.0F * s + 0.5F));
          sum += s;
        }
      }
    };
    visit_cells(shape, grid, whole, plane_mm(0), plane_mm(params.planes - 1), full, mixed);
  });
  double pixels = 0;
  for (const double s : filled) pixels += s;
  return pixels * grid.pixel_mm.x * grid.pixel_mm.y;
}

Slice slice(const Shape& shape, const SliceGrid& grid, int layer, const SliceParams& params) {
  Slice out{GrayImage(std::max(0, grid.width), std::max(0, grid.height)), 0};
  out.area_mm2 =
      slice_into(out.coverage.pixels.data(), grid.width, {0, 0, grid.width, grid.height}, shape, grid, layer, params);
  return out;
}

Box3d bounds_in(const Frame& frame, const Solid& solid) {
  const std::vector<Vec3i> origins = blocks(solid);
  const Shape distance = distance_to(solid);
  std::vector<Box3d> boxes(origins.size());
  for_each_block(origins, solid.grid().voxel_mm, [&](std::size_t number, const PointBlock& block) {
    std::array<float, PointBlock::capacity> value;
    distance.evaluate(block, value.data());
    for (std::size_t k = 0; k < value.size(); ++k) {
      if (value[k] >= 0) continue;
      const Vec3d p = frame.to_local({block.x[k], block.y[k], block.z[k]});
      const double r = -value[k];
      boxes[number].include(p - Vec3d{r, r, r});
      boxes[number].include(p + Vec3d{r, r, r});
    }
  });
  Box3d all;
  for (const Box3d& box : boxes) {
    if (box.empty()) continue;
    all.include(box.min);
    all.include(box.max);
  }
  return all;
}

}  // namespace fibrolite
