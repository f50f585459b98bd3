// SPDX-License-Identifier: Apache-2.0
// Quads of a dual surface into triangles.
#pragma once

#include <span>

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
  /// @param triangles  Two for each quad: its first and second corner first, its third and fourth last.
  /// @returns whether each has a diagonal that leaves no triangle without area.
  /// Cost: O(n), parallel; eight quads at a time.
  bool operator()(std::span<const Quad> quads, const Vertices& vertices, std::span<Mesh::Triangle> triangles) const;
  /// Has this one none?
  [[nodiscard]] static bool degenerate(const Quad& quad, const Vertices& vertices);

 private:
  double voxel_mm_;
  bool stand_in_;
};

}  // namespace fibrolite
