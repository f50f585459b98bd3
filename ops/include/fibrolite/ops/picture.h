// SPDX-License-Identifier: GPL-3.0-or-later
// A picture of the solid, cut open.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "fibrolite/context.h"
#include "fibrolite/image.h"
#include "fibrolite/mesh.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct PictureParams {
  int width_px = 1600, height_px = 1200;  ///< 16 to 8192.
  Vec3d up{0, 0, 1};                      ///< Unit.
  /// Cut plane: material on the side the normal points to is taken away, and the picture is taken from there. Default:
  /// vertical, across the smaller horizontal extent, in the middle half of it where most of every colour shows.
  std::optional<Vec3d> cut_point{}, cut_normal{};
  bool cut = true;
  /// If given: only this much about the cut point fills the picture, not all that the cut leaves; > 0.
  std::optional<double> focus_mm{};
  double margin = 0.05;  ///< Share of the picture left free on each side; 0 to below 0.5.
};
/// Colour of the material at a point (by part, shell, joint).
using PointColor = std::function<Rgb(Vec3d)>;

/// Render the surface of `solid` with everything in front of the cut plane taken away, the cut face filled where the
/// solid is. Orthographic. `color` must be thread-safe; it is asked about once per pixel. Cost: seconds for millions of
/// triangles, about 250 MB beside the mesh. The same bytes on any number of threads.
/// @throws Error BadRecipe (a range above), Cancelled.
[[nodiscard]] RgbImage picture(const Mesh& surface, const Solid& solid, const PointColor& color,
                               const PictureParams& params = {}, const Context& context = {});
/// PNG, whole or absent. @throws Error Io.
void write_png(const std::filesystem::path& path, const RgbImage& image);

/// Distinct, print-friendly colours for part ids: ten for columns, six for bulk, then they come again; shell and joint
/// have their own.
[[nodiscard]] Rgb part_color(int id, bool column);
/// What to call it, for a legend: "sky blue", "dark yellow". Different for each of the ten and the six.
[[nodiscard]] std::string color_name(int id, bool column);
/// "#0072b2".
[[nodiscard]] std::string hex(Rgb color);
inline constexpr Rgb shell_color{214, 210, 202};
inline constexpr Rgb joint_color{236, 112, 20};

}  // namespace fibrolite
