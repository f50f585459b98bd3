// SPDX-License-Identifier: Apache-2.0
// One layer of a shape: how much of each pixel is material. A pure function of the layer's number; nothing of the
// layers below or above is held.
#pragma once

#include <cstddef>
#include <cstdint>

#include "fibrolite/box.h"
#include "fibrolite/context.h"
#include "fibrolite/frame.h"
#include "fibrolite/image.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"
#include "fibrolite/vec.h"

namespace fibrolite {

/// Where layers and pixels lie. In the frame's coordinates pixel (x, y) covers [x, x + 1] * pixel_mm.x by
/// [y, y + 1] * pixel_mm.y and layer n reaches from n * layer_mm to (n + 1) * layer_mm.
struct SliceGrid {
  Frame frame{};               ///< Origin: the outer corner of pixel (0, 0), under layer 0; z is up.
  Vec2d pixel_mm{0.05, 0.05};  ///< Edges of a pixel, mm; > 0.
  double layer_mm = 0.05;      ///< Height of a layer, mm; > 0.
  int width = 0, height = 0;   ///< Pixels along x and y; 1 or more.
  int layers = 0;
  /// At half height of a layer, above the frame's origin.
  [[nodiscard]] Vec3d middle(int layer) const { return frame.to_world({0, 0, (layer + 0.5) * layer_mm}); }
};
/// The grid that just holds a box (given in the frame's coordinates) between its bottom and its top; the frame's origin
/// moves to the box's lower corner.
/// @throws Error BadRecipe: pixel or layer not positive; TooLarge: more than 2^31 - 1 layers, pixels a layer.
[[nodiscard]] SliceGrid slice_grid(const Frame& frame, const Box3d& box, Vec2d pixel_mm, double layer_mm);

struct SliceParams {
  /// Planes a layer is sampled on, spread evenly over its height; 1 to 16. One: the section at half height. More:
  /// slopes that are flatter than the pixel is wide become grey too.
  int planes = 1;
};
/// @throws Error BadRecipe: a range above.
void check(const SliceParams& params);
struct Slice {
  /// 0 empty to 255 full, row 0 at y = 0: the share of the pixel inside, rounded. The surface is taken as straight
  /// between the pixel's corners, where the distance is sampled; what is thinner than a pixel may be missed.
  GrayImage coverage;
  double area_mm2 = 0;  ///< Sum of the shares before they are rounded.
};
/// Cost: O(pixels) memory; time in proportion to the pixels near the surface: blocks of 16 x 16 pixels and more that
/// the shape's bound shows to be full or empty are not sampled. Parallel; the same bits on any number of threads.
/// @throws Error BadRecipe: a range above.
[[nodiscard]] Slice slice(const Shape& shape, const SliceGrid& grid, int layer, const SliceParams& params = {});

/// Pixels [x, x + width) by [y, y + height) of a layer.
struct PixelRange {
  int x = 0, y = 0, width = 0, height = 0;
};
/// A part of a layer into the caller's rows: pixel (x, y) of the layer goes to rows[(y - tile.y) * stride + x -
/// tile.x]. The very bytes that slice() has there; returns the tile's area, mm2. Cost: as slice(), of the squares of
/// 128 pixels and blocks of 16 that the tile touches; no memory. Parallel, and may be called from several threads at
/// once.
/// @throws Error BadRecipe: a range above, a tile that is empty or reaches beyond the layer, a stride below its width;
/// Cancelled (the rows are then part done).
[[nodiscard]] double slice_into(std::uint8_t* rows, std::ptrdiff_t stride, const PixelRange& tile, const Shape& shape,
                                const SliceGrid& grid, int layer, const SliceParams& params = {},
                                const Context& context = {});

/// The solid's distance, interpolated by cubics through 4 x 4 x 4 samples (Catmull and Rom 1974): smooth across voxels,
/// and round sticks keep their thickness, of which distance_to() takes about voxel^2 / (8 radius). For pixels finer
/// than the voxel. Cost: O(1) per point, least for points close together.
[[nodiscard]] Shape smooth_distance_to(const Solid& solid);

/// A box, in the frame's coordinates, that holds the solid tightly: each sample inside counts as a ball of its
/// distance, so the box reaches the surface and not only the outermost samples. Empty for an empty solid.
/// Cost: O(samples inside), parallel.
[[nodiscard]] Box3d bounds_in(const Frame& frame, const Solid& solid);

}  // namespace fibrolite
