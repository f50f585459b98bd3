// SPDX-License-Identifier: GPL-3.0-or-later
// Component verification by finite elements (paper Sec. 4.2).
#pragma once

#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/ops/part.h"
#include "fibrolite/ops/partition.h"

namespace fibrolite {

struct VerifyParams {
  double dominance = 2.0;       ///< Column <=> mean |axial| >= dominance * max mean |transverse| in every case; > 1.
  double unloaded = 0.02;       ///< Mean von Mises below this share of the body's: unloaded, so bulk.
  double load_n = 1000;         ///< > 0. Paper Sec. 4.2.
  double azimuth_deg = 0;       ///< Direction about `up` of the 45 degree case.
  double support_share = 0.05;  ///< The lowest share of the height is fixed; the load avoids it too.
  bool world_axes = false;      ///< The paper's x, y, z instead of the part's own axis field.
  Vec3d up{0, 0, 1};            ///< Unit.
};
struct Verification {
  Parts parts;
  std::vector<int> part_of_candidate;
  std::int64_t tets = 0, dof = 0;
  double residual = 0;     ///< Relative, worst solve.
  double equilibrium = 0;  ///< |sum of reactions + sum of loads| / load, worst solve.
  std::vector<std::string> notes;
};
/// Two solves of the whole body (load from above; the same at 45 degrees), then each candidate on its own mesh with the
/// coarse displacements on its cut faces. Touching bulk parts merge.
/// @throws Error SolverFailed, BadRecipe. Cost: seconds. Source: paper Sec. 4.2.
[[nodiscard]] Verification verify(const Proxy& proxy, const Partition& partition, const VerifyParams& params = {},
                                  const Material& material = {}, const Context& context = {});

/// The whole body as one part of a given kind, for runs that skip partition and verification. A column's axis is the
/// longest principal axis of the body.
[[nodiscard]] Parts whole_body(const Proxy& proxy, Kind kind);
/// The same from a closed mesh, for runs that need no proxy. Cost: O(triangles).
[[nodiscard]] Parts whole_body(const Mesh& model, Kind kind);

}  // namespace fibrolite
