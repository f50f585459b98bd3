// SPDX-License-Identifier: GPL-3.0-or-later
// From what a file holds to an oriented model in mm, with everything that was mended said in words.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/frame.h"
#include "fibrolite/mesh.h"
#include "fibrolite/mesh_io.h"

namespace fibrolite {

enum class Up { X, Y, Z, MinusX, MinusY, MinusZ };
/// The unit vector of an Up.
[[nodiscard]] Vec3d direction(Up up);
/// The frame whose z is up: the world's own for Up::Z. Layers lie across it.
[[nodiscard]] Frame upright(Up up);

/// Under 5 mm or over 2 m: the unit may be wrong.
[[nodiscard]] bool is_odd_size(double longest_mm);

struct PrepareParams {
  std::optional<double> size_mm{};  ///< Scale so that the longest side has this length; > 0.
  std::optional<double> unit_mm{};  ///< Millimetres per file unit; > 0. Default: what the file says, else 1.
};
struct Model {
  Mesh mesh;                          ///< Welded, outward by signed volume, mm.
  Mesh painted;                       ///< As read and scaled, with its colours; empty if it has none.
  std::vector<std::string> repairs;   ///< E.g. "turned inside out", "12 duplicate triangles dropped".
  std::vector<std::string> warnings;  ///< E.g. the units warning (is_odd_size()).
};
/// Scale, weld equal corners, drop zero-area and duplicate triangles, orient each component consistently where it can
/// be, and the whole by signed volume. Holes and self-intersections stay: to_solid() decides the inside by winding
/// number.
/// @throws Error BadInput: no triangles left, all in one plane, so far from the origin that coordinates are coarser
/// than a 4000th of the model, shorter than 0.01 mm; BadRecipe: a range above.
[[nodiscard]] Model prepare(const MeshFile& file, const PrepareParams& params, const Context& context = {});

}  // namespace fibrolite
