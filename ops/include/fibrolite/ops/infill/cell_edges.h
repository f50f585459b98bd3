// SPDX-License-Identifier: GPL-3.0-or-later
// The cell of a periodic infill.
#pragma once

#include <algorithm>

namespace fibrolite {

/// Edges of a periodic infill's cell, mm; one number is a cube.
struct CellEdges {
  double x, y, z;
  constexpr CellEdges(double edge) : x(edge), y(edge), z(edge) {}  // NOLINT(google-explicit-constructor)
  constexpr CellEdges(double along_x, double along_y, double along_z) : x(along_x), y(along_y), z(along_z) {}
  [[nodiscard]] constexpr double least() const { return std::min(x, std::min(y, z)); }
  [[nodiscard]] constexpr double most() const { return std::max(x, std::max(y, z)); }
  friend constexpr bool operator==(const CellEdges&, const CellEdges&) = default;
};

}  // namespace fibrolite
