// SPDX-License-Identifier: Apache-2.0
// The zero level as quads, a layer of blocks at a time.
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/solid.h"
#include "unwritten.h"

namespace fibrolite {

using Quad = std::array<std::uint32_t, 4>;  ///< Of vertices, counter-clockwise from outside.

using Points = std::vector<openvdb::Vec3s, Unwritten<openvdb::Vec3s>>;
using Quads = std::vector<Quad, Unwritten<Quad>>;

/// Of a layer of blocks.
struct QuadLayer {
  Points points;          ///< mm.
  std::size_t first = 0;  ///< Number of its first vertex among all.
  Quads quads;            ///< Of its vertices and those of the layer before.
};

/// Cells of eight neighbouring samples get a vertex for each sheet of the surface that runs through them: the mean of
/// where it crosses the sheet's edges; each lattice edge that is crossed gets a quad of its four cells' vertices. On a
/// face with its diagonals on different sides material is kept apart, but where that would lead two quads twice over
/// the same two vertices: there it is joined. So the surface is closed and 2-manifold (each edge has two quads).
/// Sources: Nielson 2004 (dual marching cubes), Wenger 2013 (the manifold case). A quad of layer n has its vertices in
/// layers n - 1 and n.
class DualSurface {
 public:
  /// Layers follow each other along `axis`. Vertices and quads are in the order of layers, blocks and cells.
  DualSurface(Grid grid, int axis);
  ~DualSurface();
  DualSurface(const DualSurface&) = delete;
  DualSurface& operator=(const DualSurface&) = delete;
  /// The next layers, one by one: `solid` holds those of the range, and a block more on either side. The first range
  /// starts a block below the solid. Cost: O(leaves), parallel; the same bits on any number of threads and in any
  /// ranges. @throws Error TooLarge (more than 2^32 - 1 vertices), Cancelled.
  void add(const Solid& solid, const SampleRange& range, const std::function<void(QuadLayer&&)>& use,
           const Context& context);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// All that a solid's surface runs through along an axis, for DualSurface::add(); empty if there is none.
[[nodiscard]] SampleRange surface_range(const Solid& solid, int axis);

/// All of a solid, as one layer.
[[nodiscard]] QuadLayer dual_surface(const Solid& solid, int axis, const Context& context);

}  // namespace fibrolite
