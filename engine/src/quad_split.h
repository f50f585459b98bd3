// SPDX-License-Identifier: Apache-2.0
// Quads of a dual surface into triangles.
#pragma once

#include <span>
#include <vector>

#include "dual_surface.h"
#include "fibrolite/mesh.h"

namespace fibrolite {

/// Each quad along the diagonal that is shorter, unless that leaves a triangle without area or leads into another quad
/// (quad_envelope.h).
class QuadSplit {
 public:
  /// @param stand_in  Quads may lead into each other (SurfaceParams).
  QuadSplit(double voxel_mm, bool stand_in) : voxel_mm_(voxel_mm), stand_in_(stand_in) {}

  struct Vertices {
    std::span<const Vec3f> places;
    std::span<const Vec3f> shape;  ///< By which diagonals are compared: the same, or other places.
    std::size_t first = 0;         ///< Number of the first one.
    [[nodiscard]] Vec3f at(std::uint32_t v) const { return places[v - first]; }
  };
  /// Quads whose vertices should be moved, for they have no good diagonal; in order.
  struct Left {
    std::vector<std::size_t> degenerate;  ///< Either leaves a triangle without area.
    std::vector<std::size_t> astray;      ///< Either leads into another quad.
    [[nodiscard]] bool empty() const { return degenerate.empty() && astray.empty(); }
  };
  /// @param triangles  Two for each quad: its first and second corner first, its third and fourth last.
  /// Cost: O(n), parallel; eight quads at a time.
  Left operator()(std::span<const Quad> quads, const Vertices& vertices, std::span<Mesh::Triangle> triangles) const;

 private:
  double voxel_mm_;
  bool stand_in_;
};

}  // namespace fibrolite
