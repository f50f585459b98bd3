// SPDX-License-Identifier: Apache-2.0
// An indexed triangle mesh in mm, and what one can measure of it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/vec.h"

namespace fibrolite {

struct Rgb {
  std::uint8_t r = 0, g = 0, b = 0;
  friend constexpr bool operator==(const Rgb&, const Rgb&) = default;
};

/// Indices are below vertices.size(). `triangle_colors` is empty or one per triangle.
struct Mesh {
  using Triangle = std::array<std::uint32_t, 3>;
  std::vector<Vec3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<Rgb> triangle_colors;
};

[[nodiscard]] Box3d bounds(const Mesh& mesh);
/// Signed volume, mm3: positive if the triangles face outward. Exact sum order, so the same bits everywhere.
[[nodiscard]] double signed_volume(const Mesh& mesh);
/// Surface area, mm2.
[[nodiscard]] double area(const Mesh& mesh);

/// The same triangles in the same order on one vertex per place: equal coordinates (-0 equals 0) become one, unused
/// ones go. Cost: O(n), parallel.
[[nodiscard]] Mesh welded(const Mesh& mesh);
/// Is the area exactly zero? The differences of float coordinates are exact in double (unless coordinates of one axis
/// differ by more than 2^29 in magnitude), and their products are compared together with their rounding errors: nothing
/// is rounded.
[[nodiscard]] bool zero_area(Vec3f a, Vec3f b, Vec3f c);

/// The topology of a triangle mesh as a printer sees it: vertices with equal coordinates are one vertex.
struct MeshCheck {
  std::int64_t triangles = 0;
  std::int64_t vertices = 0;              ///< After welding equal coordinates.
  std::int64_t boundary_edges = 0;        ///< Edges with one triangle.
  std::int64_t nonmanifold_edges = 0;     ///< Edges with three or more triangles, or two that run the same way.
  std::int64_t nonmanifold_vertices = 0;  ///< Vertices whose triangles form more than one fan.
  std::int64_t degenerate_triangles = 0;  ///< Two equal corners, or area exactly zero.
  std::int64_t shells = 0;                ///< Components connected through shared edges.
  double volume_mm3 = 0;                  ///< Signed.
  [[nodiscard]] bool closed() const { return boundary_edges == 0 && nonmanifold_edges == 0; }
};
/// Cost: O(n) time, parallel, about 40 bytes per triangle. The same counts on any number of threads.
[[nodiscard]] MeshCheck check(const Mesh& mesh);

}  // namespace fibrolite
