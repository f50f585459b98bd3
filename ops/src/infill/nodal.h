// SPDX-License-Identifier: GPL-3.0-or-later
// Nodal approximations of minimal surfaces, and true distances to their level sets. Private to the infills.
#pragma once

#include <vector>

#include "fibrolite/ops/infill/cell_edges.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// A minimal surface is about where one of these is zero. X = 2 pi x / cell.
enum class Surface {
  D,  ///< cos X cos Y cos Z + sin X sin Y sin Z: 1 at the nodes of the crystal, sqrt(1/2) half way along the bonds.
  Gyroid,  ///< sin X cos Y + sin Y cos Z + sin Z cos X.
};

/// Lattice coordinates, mm.
struct Nodal {
  Nodal(Surface surface, const CellEdges& cell);
  struct Value {
    double d;
    Vec3d gradient;
  };
  [[nodiscard]] Value operator()(Vec3d p) const;

  Surface of;
  Vec3d wave;  // 2 pi / cell
};

/// Where D is on the surface of a network whose neck is that thick: across a bond, from its middle along (1, -1, 0), D
/// is sqrt(1/2) cos(sqrt(2) r), r in units of the shortest wave.
[[nodiscard]] double neck_level(const CellEdges& cell, double neck_mm);
/// How thick the same network is at its nodes, mm.
[[nodiscard]] double bulge_mm(const CellEdges& cell, double neck_mm);

/// Share of space where D > level.
[[nodiscard]] double network_density(double level);
/// Area of the membrane in one cell, mm2.
[[nodiscard]] double membrane_mm2(Surface surface, const CellEdges& cell);
/// Share of space within half a wall of the membrane, by Weyl's tube formula: area times thickness, less what the
/// curvature takes. `area_mm2`: membrane_mm2(), so that a search need not measure it again.
[[nodiscard]] double sheet_density(Surface surface, const CellEdges& cell, double wall_mm, double area_mm2);

/// Distance to a level, negative where the function is above it, sampled at 64 places along the cell's edges, linear
/// between. D maps onto itself by half a cell along any two axes, so a quarter of the cell, a brick, holds it all; of a
/// gyroid the brick is the cell.
class DistanceTable {
 public:
  static constexpr int side = 64;  // samples along an edge of the cell
  /// Of the table; a distance itself has 1. Near the surface it is below 1.05; where two of its sides are equally near,
  /// linear steps may be steeper.
  static constexpr double lipschitz = 1.2;

  DistanceTable(Surface surface, const CellEdges& cell, double level);
  /// Lattice coordinates shifted by `shift`.
  void evaluate(const PointBlock& block, Vec3d shift, float* out) const;

 private:
  std::vector<float> distance_;  // one more along each edge of the brick: rims are copies, so that no index wraps
  Vec3d per_cell_;
  Surface surface_;
};

/// Both sides of the membrane, equally thick; lattice coordinates shifted by `shift`.
[[nodiscard]] Shape sheet(Surface surface, const CellEdges& cell, double wall_mm, Vec3d shift);

}  // namespace fibrolite
