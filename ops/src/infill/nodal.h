// SPDX-License-Identifier: GPL-3.0-or-later
// The D nodal approximation, and true distances to its level sets. Private to the crystal.
#pragma once

#include <memory>
#include <vector>

#include "fibrolite/ops/infill/tcs.h"

namespace fibrolite {

/// D(x, y, z) = cos X cos Y cos Z + sin X sin Y sin Z, X = 2 pi x / cell: 1 at the nodes of the crystal, 0 on the
/// membrane, sqrt(1/2) half way along the bonds. Lattice coordinates, mm.
struct Nodal {
  explicit Nodal(const CellEdges& cell);
  struct Value {
    double d;
    Vec3d gradient;
  };
  [[nodiscard]] Value operator()(Vec3d p) const;

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
[[nodiscard]] double membrane_mm2(const CellEdges& cell);

/// Distance to D = level, negative where D is above it, sampled at 64 places along the cell's edges, linear between.
/// The lattice maps onto itself by half a cell along any two axes, so a quarter of the cell, a brick, holds it all.
class DistanceTable {
 public:
  static constexpr int side = 32;  // samples along x and y of the brick, twice as many along z
  /// Of the table; a distance itself has 1. Near the surface it is below 1.05; where two of its sides are equally near,
  /// linear steps may be steeper.
  static constexpr double lipschitz = 1.2;

  DistanceTable(const CellEdges& cell, double level);
  /// Lattice coordinates shifted by `shift`.
  void evaluate(const PointBlock& block, Vec3d shift, float* out) const;

 private:
  std::vector<float> distance_;  // (side + 1) x (side + 1) x (2 side + 1): rims are copies, so that no index wraps
  Vec3d per_cell_;
};

}  // namespace fibrolite
