// SPDX-License-Identifier: Apache-2.0
// The zero level as quads, a layer of blocks at a time.
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct QuadSurface {
  std::vector<openvdb::Vec3s> points;                        ///< mm.
  std::vector<std::array<std::uint32_t, 4>> quads;           ///< Counter-clockwise from outside.
  std::vector<std::size_t> layer_points{0}, layer_quads{0};  ///< Where each layer of blocks begins, and the end.
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
  /// The next layers: `solid` holds those of the range, and a block more on either side. The first range starts a block
  /// below the solid. Cost: O(leaves), parallel; the same bits on any number of threads and in any ranges.
  /// @throws Error TooLarge (more than 2^32 - 1 vertices), Cancelled.
  void add(const Solid& solid, const SampleRange& range, QuadSurface& out, const Context& context);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// All of a solid.
[[nodiscard]] QuadSurface dual_surface(const Solid& solid, int axis, const Context& context);

}  // namespace fibrolite
