// SPDX-License-Identifier: GPL-3.0-or-later
// Component verification by finite elements (paper Sec. 4.2).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/loads.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/ops/part.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/ops/stress_field.h"

namespace fibrolite {

struct VerifyParams {
  double dominance = 2.0;  ///< Column <=> mean |axial| >= dominance * max mean |transverse| in every case; > 1.
  double unloaded = 0.02;  ///< Mean von Mises below this share of the body's: unloaded, so bulk. 0 to below 1.
  double load_n = 1000;    ///< > 0. Paper Sec. 4.2.
  /// Where the 45 degree load comes from, about `up`. 0 is the next world axis after the one nearest to up (x for z, as
  /// in the paper; y for x, z for y), made level; right-handed.
  double azimuth_deg = 0;
  /// The lowest share of the height is fixed; the load avoids it too. 0 to 0.5, exclusive.
  double support_share = 0.05;
  bool world_axes = false;  ///< x, y, z, as in the paper, instead of the part's own axis field; see stance().
  Vec3d up{0, 0, 1};        ///< Any length above zero.
  /// Surface triangles of the whole body's mesh at most; a component gets its share by area, a quarter to two thirds of
  /// it. Means change by a few per cent from 3000 to 6000. 500 to 50000.
  int triangles = 4000;
  /// The load acts on the surface in here alone; default: on all that is seen from above.
  std::optional<Box3d> load_box_mm{};
  bool keep_field = false;  ///< Also give the stresses of the whole body, for files.
  /// Load cases of the user's, as the parts' frame sees them. If there are any, they take the place of the two built-in
  /// ones, and load_n, support_share and load_box_mm do nothing; `up` and azimuth_deg still say what "down" and
  /// "slanted" mean.
  std::vector<LoadCase> loads{};
};
struct Verification {
  Parts parts;
  std::vector<int> part_of_candidate;
  std::int64_t tets = 0, dof = 0;  ///< Of all solves together.
  int iterations = 0;              ///< Of the solve that took most; 0: all were direct.
  double residual = 0;             ///< Relative, worst solve.
  double equilibrium = 0;          ///< |sum of reactions + sum of loads| / load, worst solve.
  std::vector<Selected> selected;  ///< What each support and force of each load case got hold of.
  std::vector<std::string> notes;
  /// Length of the traction, MPa, on the plane through a point of the body with a unit normal, in the load case where
  /// it is largest; from the solve of the whole body, taken as solid: its stress at the nodes, linear between them.
  /// Thread-safe.
  std::function<double(Vec3d point_mm, Vec3d normal)> traction_mpa;
  /// Von Mises stress there, MPa, of the load case where it is largest; otherwise the same.
  std::function<double(Vec3d point_mm)> von_mises_mpa;
  StressField field;  ///< If asked for. In the frame of the proxy.
};
/// A solve of the whole body for each load case (params.loads; if there are none, load from above, and the same at 45
/// degrees, at the same place), then each candidate on its own mesh with the coarse displacements on its cut faces, its
/// own share of the load and of the support. A
/// candidate is a column if it is column-like and its mean stress along its axis is `dominance` times that across in
/// every load case that loads it. Across: the direction with the largest mean. Touching bulk candidates merge, but not
/// across a cut that is kept, nor with one whose infill the user chose. Parts
/// are numbered by volume, largest first. If a candidate's own mesh fails, the whole body's stresses in it decide, and
/// a note says so.
/// @throws Error SolverFailed; BadRecipe: a number out of range, a load case that check_loads() refuses, selects
/// nothing or leaves the body free to move. Cost: seconds. Cases with the same supports share one factorisation.
/// Source: paper Sec. 4.2; axis field and two levels ours.
[[nodiscard]] Verification verify(const Proxy& proxy, const Partition& partition, const VerifyParams& params = {},
                                  const Material& material = {}, const Context& context = {});

/// The load cases that verify() solves: the user's, or the two of the paper: from above, and the same at 45 degrees at
/// the same place.
[[nodiscard]] std::vector<LoadCase> load_cases(const VerifyParams& params);

/// The whole body as one part of a given kind, for runs that skip partition and verification. A column's axis is the
/// longest principal axis of the body.
[[nodiscard]] Parts whole_body(const Mesh& model, Kind kind);

}  // namespace fibrolite
