// SPDX-License-Identifier: GPL-3.0-or-later
#include "body_solve.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/tetrahedralize.h"
#include "voxel_tets.h"

namespace fibrolite {

void check_params(const VerifyParams& p) {
  const auto require = [](bool holds, const char* key, const char* range) {
    if (!holds) throw Error(Code::BadRecipe, std::string("verify.") + key + " must be " + range, "recipe");
  };
  require(p.dominance > 1 && std::isfinite(p.dominance), "dominance", "above 1");
  require(p.unloaded >= 0 && p.unloaded < 1, "unloaded", "from 0 to below 1");
  require(p.load_n > 0 && std::isfinite(p.load_n), "load_n", "above 0");
  require(std::isfinite(p.azimuth_deg), "azimuth_deg", "a number");
  require(p.support_share > 0 && p.support_share < 0.5, "support_share", "between 0 and 0.5");
  require(p.triangles >= 500 && p.triangles <= 50000, "triangles", "from 500 to 50000");
  require(norm(p.up) > 0 && std::isfinite(norm(p.up)), "up", "a direction");
}

namespace {

std::vector<std::vector<fem::Stress>> nodal(const SolvedMesh& model, const Material& material) {
  std::vector<std::vector<fem::Stress>> result;
  for (const fem::Solution& s : model.solutions)
    result.push_back(fem::nodal_stress(model.mesh, material, s.displacement_mm));
  return result;
}

}  // namespace

SolvedBody::SolvedBody(SolvedMesh solved, LoadedSetting loaded)
    : setting(std::move(loaded)),
      model(std::move(solved)),
      nodal_stress(nodal(model, setting.material)),
      locator(model.mesh) {}

double SolvedBody::von_mises_mpa(Vec3d p) const {
  double most = 0;
  each_stress(p, [&](const fem::Stress& s) { most = std::max(most, von_mises(s)); });
  return most;
}

double SolvedBody::traction_mpa(Vec3d p, Vec3d n) const {
  double most = 0;
  each_stress(p, [&](const fem::Stress& t) {
    most = std::max(most, norm(Vec3d{t[0] * n.x + t[3] * n.y + t[5] * n.z, t[3] * n.x + t[1] * n.y + t[4] * n.z,
                                     t[5] * n.x + t[4] * n.y + t[2] * n.z}));
  });
  return most;
}

/// The whole body as tetrahedra: TetGen's where it can, else the staircase of a coarse lattice, which never fails.
TetMesh body_mesh(const Proxy& proxy, int triangles, std::vector<std::string>& notes, const Context& context) {
  try {
    return extract(proxy, everything(), {.max_surface_triangles = triangles}, context);
  } catch (const Error& error) {
    if (error.code() != Code::SolverFailed) throw;
    notes.push_back(std::string("the body is analysed on a coarse lattice of cubes: ") + error.what());
    return voxel_tetrahedra(distance_to(proxy.solid), proxy.solid.bounds_mm(), proxy.solid.volume_mm3());
  }
}

std::shared_ptr<const SolvedBody> solve_body(const Proxy& proxy, TetMesh mesh, const Labels& labels,
                                             const VerifyParams& given, const Material& material,
                                             const Context& context) {
  VerifyParams params = given;
  params.up = normalized(given.up);
  const double voxel = proxy.solid.grid().voxel_mm;
  const std::vector<LoadCase> all = load_cases(params);
  LoadedSetting setting{material, voxel, {}, {}};
  const LoadSetting how{.up = params.up,
                        .azimuth_deg = params.azimuth_deg,
                        .material = material,
                        .tolerance_mm = 0.5 * voxel,  // that far the simplified surface may lie off
                        .reach_mm = 2 * voxel,
                        .labels = labels,
                        .frame = proxy.frame,
                        .key = params.loads.empty() ? "verify" : "loads"};
  std::vector<HeldCase> cases;
  for (std::size_t c = 0; c < all.size(); ++c) {
    if (all[c].unplanned) continue;
    setting.cases.push_back(all[c]);
    const AppliedLoad& load = setting.loads.emplace_back(all, c, mesh, how);
    HeldCase& held =
        cases.emplace_back(HeldCase{load.held_in(), {}, {load.forces_n(mesh, [](Vec3d, Vec3d) { return true; }), {}}});
    const auto own = load.held(mesh);
    for (std::uint32_t node = 0; node < own.size(); ++node)
      for (int axis = 0; axis < 3; ++axis)
        if (own[node][static_cast<std::size_t>(axis)]) held.fixed.push_back({node, axis});
  }
  auto solutions = solve_cases(mesh, material, cases, context);
  return std::make_shared<const SolvedBody>(SolvedMesh{std::move(mesh), std::move(cases), std::move(solutions)},
                                            std::move(setting));
}

std::vector<LoadCase> load_cases(const VerifyParams& params) {
  if (!params.loads.empty()) return params.loads;
  Support foot;
  foot.where.lowest = EndShare{.share = params.support_share};
  TotalForce force{.newton = params.load_n};
  force.where.seen_from = Direction{Direction::Of::Up, {}};
  force.where.box_mm = params.load_box_mm;
  TotalForce slanted = force;
  slanted.direction = {Direction::Of::Slanted, {}};
  return {{"from above", {foot}, {force}}, {"at 45 degrees", {foot}, {slanted}}};
}

}  // namespace fibrolite
