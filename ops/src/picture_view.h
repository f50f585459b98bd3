// SPDX-License-Identifier: GPL-3.0-or-later
// Where a picture is taken from, and where the model is cut. Private to picture.
#pragma once

#include <optional>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/ops/picture.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// Material at p is taken away where side(p) > 0.
struct CutPlane {
  Vec3d point, normal;  ///< Unit.
  [[nodiscard]] double side(Vec3d p) const { return dot(p - point, normal); }
};

/// An orthographic camera over `width` x `height` samples; sample (i, j) is seen at its centre (i + 1/2, j + 1/2).
struct View {
  Vec3d right, up, forward;  ///< Orthonormal; forward points into the picture.
  Vec3d origin;              ///< Seen at sample coordinates (0, 0) and depth 0; all that is drawn has a depth above 0.
  double samples_per_mm = 1;
  int width = 0, height = 0;

  /// Sample coordinates (x right, y down) and depth in mm.
  [[nodiscard]] Vec3d project(Vec3d p) const {
    const Vec3d d = p - origin;
    return {samples_per_mm * dot(d, right), -samples_per_mm * dot(d, up), dot(d, forward)};
  }
  [[nodiscard]] Vec3d unproject(double x, double y, double depth) const {
    return origin + (x / samples_per_mm) * right - (y / samples_per_mm) * up + depth * forward;
  }
};

/// The cut of PictureParams, or the default one. Nothing if params.cut is false or the mesh is empty.
/// @throws Error BadRecipe: the normal is the zero vector.
[[nodiscard]] std::optional<CutPlane> choose_cut(const Mesh& mesh, const Solid& solid, const PointColor& color,
                                                 const PictureParams& params, const Context& context);

/// The camera that shows what the cut leaves as large as the margins allow.
[[nodiscard]] View choose_view(const Mesh& mesh, const std::optional<CutPlane>& cut, const PictureParams& params,
                               int samples_per_pixel_edge);

}  // namespace fibrolite
