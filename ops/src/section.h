// SPDX-License-Identifier: GPL-3.0-or-later
// Sections of the proxy, plane or bent: where a limb is cut off.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fibrolite/ops/bent_plane.h"
#include "voxel_body.h"

namespace fibrolite {

/// One connected section of the body in the xy plane of `frame`, or over it in a bent plane.
struct Section {
  Frame frame;  ///< Origin at the section's centroid.
  Bend bend{};
  double area_mm2 = 0;
  double radius_mm = 0;  ///< Of the disc about the centroid that covers it, seen along z.
  Vec3d mask_origin{};   ///< Centre of pixel (0, 0), local to `frame`, z = 0.
  double pixel_mm = 1;
  int side = 0;                    ///< Pixels per row and column.
  std::vector<std::uint8_t> mask;  ///< 1 in the section, grown by the width of a voxel.

  [[nodiscard]] BentPlane surface() const { return {frame, bend}; }
  [[nodiscard]] bool covers(double x_mm, double y_mm) const;
};

/// The section through the surface's origin (or the nearest inside point within `reach_mm`); nothing if it runs on
/// beyond 2.5 reaches.
[[nodiscard]] std::optional<Section> section(const VoxelBody& body, const BentPlane& surface, double reach_mm);

/// The cleanest section near `centre` across `direction`: small, near, and little tilted. `reach_mm`: radius of the
/// limb there. `side_hint`: any vector that turns with the model; it makes the search independent of the world's axes.
[[nodiscard]] std::optional<Section> cleanest_section(const VoxelBody& body, Vec3d centre, Vec3d direction,
                                                      double reach_mm, Vec3d side_hint);

/// Take away every link that crosses the section. Returns the samples next to it on the near (z < 0) and the far side.
struct Severed {
  std::vector<std::int32_t> near, far;
};
[[nodiscard]] Severed sever(const VoxelBody& body, const Section& cut, Links& links);

}  // namespace fibrolite
