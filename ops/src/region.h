// SPDX-License-Identifier: GPL-3.0-or-later
// A piece of a finite element mesh's surface, cut out by planes, a label and paint.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "fibrolite/ops/partition.h"
#include "fibrolite/shape.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// What lies on the inner side: dot(p, normal) <= offset.
struct Plane {
  Vec3d normal;  ///< Unit.
  double offset;
  double tolerance;  ///< How far a surface may lie off, along its own normal, mm.
};

/// What all planes, the label and the paint agree on.
struct Region {
  std::vector<Plane> planes;
  std::optional<int> label;
  std::optional<Shape> paint;  ///< Distance to the painted surface; what lies within paint_mm of it.
  double paint_mm = 0;
  /// With the whole tolerance, for a point that has no normal. Cost: O(planes).
  [[nodiscard]] bool contains(Vec3d p, const Labels& labels) const;
};

/// Barycentric coordinates on a face.
using Corner = std::array<double, 3>;
using CornerTriangle = std::array<Corner, 3>;
[[nodiscard]] Corner between(const Corner& a, const Corner& b, double t);

/// Calls visit(face, outward normal, triangle, area_mm2) for triangles that cover the part of each face that lies in
/// the region, in the order of the faces: exactly between planes (Sutherland and Hodgman 1974); label and paint are
/// asked for sixteen pieces of each, `below_mm` under the surface. Cost: O(faces * planes).
void cover(const TetMesh& mesh, const std::vector<TetFace>& faces, const Region& region, const Labels& labels,
           double below_mm, const std::function<void(const TetFace&, Vec3d, const CornerTriangle&, double)>& visit);

}  // namespace fibrolite
