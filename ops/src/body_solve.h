// SPDX-License-Identifier: GPL-3.0-or-later
// The whole body, taken as solid, under the load cases that decide about parts.
#pragma once

#include <string>
#include <vector>

#include "applied_load.h"
#include "elasticity.h"
#include "fibrolite/ops/verify.h"
#include "locate.h"
#include "solve_cases.h"

namespace fibrolite {

/// What all solves share: the loads, the material.
struct LoadedSetting {
  Material material;
  double voxel_mm = 1;
  std::vector<LoadCase> cases;
  std::vector<AppliedLoad> loads;  // the same, found on the body
};

struct SolvedMesh {
  TetMesh mesh;
  std::vector<HeldCase> cases;
  std::vector<fem::Solution> solutions;  // one per load case
};

/// The solved body and the way to a place in it.
struct SolvedBody {
  SolvedBody(SolvedMesh solved, LoadedSetting loaded);
  SolvedBody(const SolvedBody&) = delete;
  SolvedBody& operator=(const SolvedBody&) = delete;

  /// Calls visit(stress) for each load case with its stress at a point, MPa: that at the nodes, linear between them.
  template <class Visit>
  void each_stress(Vec3d p, const Visit& visit) const {
    const fem::Locator::Place at = locator.find(p);
    const auto& corners = model.mesh.tets[at.tet];
    for (const auto& nodal : nodal_stress) {
      fem::Stress stress{};
      for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t c = 0; c < stress.size(); ++c) stress[c] += at.barycentric[k] * nodal[corners[k]][c];
      visit(stress);
    }
  }
  /// As Verification::traction_mpa.
  [[nodiscard]] double traction_mpa(Vec3d p, Vec3d n) const;
  /// As Verification::von_mises_mpa.
  [[nodiscard]] double von_mises_mpa(Vec3d p) const;

  const LoadedSetting setting;
  const SolvedMesh model;
  const std::vector<std::vector<fem::Stress>> nodal_stress;  // [load case][node]
  const fem::Locator locator;
};

/// @throws Error BadRecipe: a number out of range.
void check_params(const VerifyParams& params);

/// The body as tetrahedra: TetGen's where it can, else the staircase of a coarse lattice, which never fails; a note
/// then says so.
[[nodiscard]] TetMesh body_mesh(const Proxy& proxy, int triangles, std::vector<std::string>& notes,
                                const Context& context);

/// All load cases that decide (LoadCase::unplanned does not) on a mesh of the whole body. `labels` are what
/// Selection::label speaks of. @throws Error as verify().
[[nodiscard]] std::shared_ptr<const SolvedBody> solve_body(const Proxy& proxy, TetMesh mesh, const Labels& labels,
                                                           const VerifyParams& params, const Material& material,
                                                           const Context& context);

}  // namespace fibrolite
