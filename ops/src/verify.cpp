// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/verify.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "component_stress.h"
#include "elasticity.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/tetrahedralize.h"
#include "fibrolite/ops/text.h"
#include "load.h"
#include "locate.h"
#include "part_maker.h"
#include "voxel_tets.h"

namespace fibrolite {
namespace {

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

/// What both levels share: the load, the support, the material.
struct Setting {
  Vec3d up;
  std::vector<Vec3d> forces_n;          // one per load case
  std::vector<std::string> case_names;  // one per load case
  Material material;
  double voxel_mm;
  Support support;
  Footprint footprint;
};

struct Model {
  TetMesh mesh;
  std::vector<fem::Fixed> fixed;
  std::vector<fem::LoadCase> cases;
  std::vector<fem::Solution> solutions;  // one per load case
};

/// The solved body and the way to a place in it.
struct Whole {
  explicit Whole(Model solved) : model(std::move(solved)), locator(model.mesh) {}
  Whole(const Whole&) = delete;
  Whole& operator=(const Whole&) = delete;

  [[nodiscard]] double traction_mpa(Vec3d p, Vec3d n) const {
    const std::uint32_t tet = locator.find(p).tet;
    double most = 0;
    for (const fem::Solution& s : model.solutions) {
      const fem::Stress& t = s.centroid_stress[tet];
      most = std::max(most, norm(Vec3d{t[0] * n.x + t[3] * n.y + t[5] * n.z, t[3] * n.x + t[1] * n.y + t[4] * n.z,
                                       t[5] * n.x + t[4] * n.y + t[2] * n.z}));
    }
    return most;
  }

  const Model model;
  const fem::Locator locator;
};

std::vector<fem::LoadCase> load_cases(const TetMesh& mesh, const Setting& setting,
                                      const std::function<bool(Vec3d)>& mine) {
  const std::vector<double> shares = nodal_shares(mesh, setting.footprint, 2 * setting.voxel_mm, mine);
  std::vector<fem::LoadCase> cases;
  for (const Vec3d& force : setting.forces_n) {
    fem::LoadCase load;
    load.force_n.reserve(shares.size());
    for (const double share : shares) load.force_n.push_back(share * force);
    cases.push_back(std::move(load));
  }
  return cases;
}

/// Stage 1: the whole body on a coarse mesh.
Model solve_body(TetMesh mesh, const VerifyParams& params, Setting& setting, const Context& context) {
  setting.support = Support::of(mesh, setting.up, params.support_share);
  setting.footprint = seen_from_above(mesh, setting.up, setting.support, params.load_box_mm);
  if (setting.footprint.points.empty()) {
    throw Error(Code::BadRecipe, "nothing of the model is seen from above where the load should act", "verify",
                "look at up, load_box_mm and support_share");
  }
  std::vector<fem::Fixed> fixed;
  for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
    if (dot(mesh.nodes[node], setting.up) > setting.support.limit_mm) continue;
    for (int axis = 0; axis < 3; ++axis) fixed.push_back({node, axis});
  }
  auto cases = load_cases(mesh, setting, [](Vec3d) { return true; });
  auto solutions = fem::solve(mesh, setting.material, fixed, cases, context);
  return {std::move(mesh), std::move(fixed), std::move(cases), std::move(solutions)};
}

/// Stage 2: a candidate on its own mesh. On its cut faces it follows the body's coarse displacements.
Model solve_component(TetMesh mesh, const Model& body, const fem::Locator& locator, const Partition& partition, int id,
                      const Setting& setting, const Context& context) {
  std::vector<float> distance(mesh.nodes.size());
  partition.labels.region(id).evaluate(mesh.nodes, distance);
  // Asked a voxel below the surface: a cut that runs in the surface itself would give the points to either side at
  // random.
  auto cases = load_cases(mesh, setting,
                          [&](Vec3d p) { return partition.labels.label(p - setting.voxel_mm * setting.up) == id; });
  std::vector<bool> on_cut(mesh.nodes.size(), false);
  for (const TetFace& face : boundary(mesh)) {
    for (const std::uint32_t node : face.nodes) {
      on_cut[node] = static_cast<double>(distance[node]) > -setting.voxel_mm;
    }
  }
  std::vector<fem::Fixed> fixed;
  for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
    const Vec3d p = mesh.nodes[node];
    const bool supported = dot(p, setting.up) <= setting.support.limit_mm;
    if (!supported && !on_cut[node]) continue;
    for (int axis = 0; axis < 3; ++axis) fixed.push_back({node, axis});
    for (std::size_t c = 0; c < cases.size(); ++c) {
      const Vec3d u = supported ? Vec3d{} : locator.interpolate(body.solutions[c].displacement_mm, p);
      cases[c].fixed_mm.insert(cases[c].fixed_mm.end(), {u.x, u.y, u.z});
    }
  }
  auto solutions = fem::solve(mesh, setting.material, fixed, cases, context);
  return {std::move(mesh), std::move(fixed), std::move(cases), std::move(solutions)};
}

std::vector<std::uint32_t> all_tets(const TetMesh& mesh) {
  std::vector<std::uint32_t> tets(mesh.tets.size());
  std::iota(tets.begin(), tets.end(), 0U);
  return tets;
}

std::vector<std::uint32_t> tets_of(const TetMesh& mesh, const Labels& labels, int id) {
  std::vector<std::uint32_t> tets;
  for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
    const auto& n = mesh.tets[t];
    const Vec3d c = 0.25 * (mesh.nodes[n[0]] + mesh.nodes[n[1]] + mesh.nodes[n[2]] + mesh.nodes[n[3]]);
    if (labels.label(c) == id) tets.push_back(t);
  }
  return tets;
}

/// How a candidate carries each load case, and what is decided from that.
struct Verdict {
  std::vector<MeanStress> cases;
  Kind kind = Kind::Bulk;
  PartStress stress;
  std::string reason;
};

void measure(Verdict& verdict, const Model& model, const std::vector<std::uint32_t>& tets, const Axis& axis,
             bool world_axes) {
  for (const fem::Solution& s : model.solutions) {
    verdict.cases.push_back(world_axes ? mean_in_world(model.mesh, s.centroid_stress, tets)
                                       : mean_in_axis(model.mesh, s.centroid_stress, tets, axis));
  }
}

std::string percent(double share) { return number_text(100 * share, 3) + " %"; }

void decide(Verdict& verdict, const Candidate& candidate, const std::vector<double>& body_von_mises,
            const VerifyParams& params) {
  double strongest = 0;  // share of the body's mean stress, over all cases
  const MeanStress* worst = nullptr;
  for (std::size_t c = 0; c < verdict.cases.size(); ++c) {
    const MeanStress& mean = verdict.cases[c];
    const double share = body_von_mises[c] > 0 ? mean.von_mises / body_von_mises[c] : 0;
    strongest = std::max(strongest, share);
    if (share < params.unloaded) continue;  // the direction of next to nothing means nothing
    if (worst == nullptr || mean.dominance() < worst->dominance()) worst = &mean;
  }
  const MeanStress& shown = worst != nullptr ? *worst : verdict.cases.front();
  verdict.stress = {shown.axial,
                    {shown.transverse[0], shown.transverse[1]},
                    shown.von_mises,
                    worst != nullptr ? worst->dominance() : 0};
  const bool dominant = worst != nullptr && worst->dominance() >= params.dominance;
  verdict.kind = candidate.column_like && dominant ? Kind::Column : Kind::Bulk;

  const std::string numbers = "mean stress along the axis " + number_text(shown.axial, 3) + " MPa, across " +
                              number_text(shown.transverse[0], 3) + " MPa, ratio " +
                              number_text(verdict.stress.dominance, 3) + " in the worst load case, " +
                              number_text(params.dominance, 3) + " needed";
  if (worst == nullptr) {
    verdict.reason = "bulk: unloaded, its mean stress is " + percent(strongest) + " of the body's, " +
                     percent(params.unloaded) + " needed";
  } else if (!candidate.column_like) {
    verdict.reason = "bulk by shape: " + candidate.reason + "; " + numbers;
  } else if (dominant) {
    verdict.reason = "column: " + candidate.reason + "; " + numbers;
  } else {
    verdict.reason = "bulk: no dominant stress, " + numbers;
  }
}

/// Touching bulk candidates get one number; columns keep their own. Numbers are not yet those of the parts.
std::vector<std::size_t> merge_bulk(const Partition& partition, const std::vector<Verdict>& verdicts) {
  std::vector<std::size_t> group(verdicts.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
  };
  for (const Cut& cut : partition.cuts) {
    const auto a = static_cast<std::size_t>(cut.a), b = static_cast<std::size_t>(cut.b);
    if (verdicts[a].kind != Kind::Bulk || verdicts[b].kind != Kind::Bulk) continue;
    const std::size_t ra = find(a), rb = find(b);
    group[std::max(ra, rb)] = std::min(ra, rb);
  }
  for (std::size_t i = 0; i < group.size(); ++i) group[i] = find(i);
  return group;
}

void make_parts(Verification& result, const Proxy& proxy, const Partition& partition,
                const std::vector<Verdict>& verdicts) {
  const std::vector<std::size_t> group = merge_bulk(partition, verdicts);
  struct Draft {
    std::vector<std::size_t> members;  // the first has the largest volume
    double volume_mm3 = 0;
    Vec3d centroid_mm{};
  };
  std::vector<Draft> drafts;
  for (std::size_t first = 0; first < group.size(); ++first) {
    if (group[first] != first) continue;
    Draft draft;
    for (std::size_t i = first; i < group.size(); ++i) {
      if (group[i] != first) continue;
      const Candidate& candidate = partition.candidates[i];
      draft.members.push_back(i);
      draft.volume_mm3 += candidate.volume_mm3;
      draft.centroid_mm = draft.centroid_mm + candidate.volume_mm3 * candidate.centroid_mm;
    }
    if (draft.volume_mm3 > 0) draft.centroid_mm = draft.centroid_mm / draft.volume_mm3;
    std::stable_sort(draft.members.begin(), draft.members.end(), [&](std::size_t a, std::size_t b) {
      return partition.candidates[a].volume_mm3 > partition.candidates[b].volume_mm3;
    });
    drafts.push_back(std::move(draft));
  }
  std::sort(drafts.begin(), drafts.end(), [](const Draft& a, const Draft& b) {
    return std::tie(b.volume_mm3, a.centroid_mm.x, a.centroid_mm.y, a.centroid_mm.z) <
           std::tie(a.volume_mm3, b.centroid_mm.x, b.centroid_mm.y, b.centroid_mm.z);
  });

  result.part_of_candidate.assign(group.size(), 0);
  for (std::size_t id = 0; id < drafts.size(); ++id) {
    for (const std::size_t i : drafts[id].members) result.part_of_candidate[i] = static_cast<int>(id);
  }
  result.parts.labels = partition.labels.merged(result.part_of_candidate);
  for (Cut cut : partition.cuts) {
    cut.a = result.part_of_candidate[static_cast<std::size_t>(cut.a)];
    cut.b = result.part_of_candidate[static_cast<std::size_t>(cut.b)];
    if (cut.a != cut.b) result.parts.cuts.push_back(cut);
  }
  const std::vector<PartGeometry> geometry = part_geometry(proxy, result.parts.labels);
  for (std::size_t id = 0; id < drafts.size(); ++id) {
    const Draft& draft = drafts[id];
    const std::size_t main = draft.members.front();
    const Candidate& candidate = partition.candidates[main];
    const bool merged = draft.members.size() > 1;
    std::string reason = verdicts[main].reason;
    if (merged) reason += "; " + std::to_string(draft.members.size()) + " touching bulk pieces are one part";
    result.parts.parts.push_back(PartMaker::make({.id = static_cast<int>(id),
                                                  .kind = verdicts[main].kind,
                                                  .region = result.parts.labels.region(static_cast<int>(id)),
                                                  .bounds_mm = geometry[id].bounds_mm,
                                                  .axis = merged ? geometry[id].axis : candidate.axis,
                                                  .diameter_mm = candidate.diameter_mm,
                                                  .volume_mm3 = draft.volume_mm3,
                                                  .centroid_mm = draft.centroid_mm,
                                                  .stress = verdicts[main].stress,
                                                  .reason = std::move(reason)}));
  }
}

/// What was solved for the whole body, with everything that a reader of files wants to know.
StressField stress_field(const Model& body, const Setting& setting, const Labels& labels) {
  StressField field{body.mesh, {}, setting.material, {}, {}, {}};
  for (const auto& n : body.mesh.tets)
    field.part.push_back(labels.label(
        0.25 * (body.mesh.nodes[n[0]] + body.mesh.nodes[n[1]] + body.mesh.nodes[n[2]] + body.mesh.nodes[n[3]])));
  for (const fem::Fixed& f : body.fixed) field.fixed.push_back({f.node, f.axis});
  for (std::size_t c = 0; c < body.cases.size(); ++c) {
    const std::vector<Vec3d>& displacement = body.solutions[c].displacement_mm;
    field.cases.push_back({setting.case_names[c], body.cases[c].force_n, displacement,
                           fem::nodal_stress(body.mesh, setting.material, displacement)});
  }
  return field;
}

void account(Verification& result, const Model& model, double load_n) {
  result.tets += static_cast<std::int64_t>(model.mesh.tets.size());
  result.dof += 3 * static_cast<std::int64_t>(model.mesh.nodes.size());
  for (const fem::Solution& s : model.solutions) {
    result.residual = std::max(result.residual, s.residual);
    result.equilibrium = std::max(result.equilibrium, norm(s.imbalance_n) / load_n);
  }
}

/// A candidate's own mesh, or why there is none.
struct Extracted {
  std::optional<TetMesh> mesh;
  std::string failure;
};

Extracted extract_component(const Proxy& proxy, const Partition& partition, int id, int body_triangles,
                            const Context& context) {
  const Candidate& candidate = partition.candidates[static_cast<std::size_t>(id)];
  const double body = std::max(proxy.solid.volume_mm3(), candidate.volume_mm3);
  // Area goes with volume to the power of 2/3.
  const int triangles = std::clamp(static_cast<int>(body_triangles * std::pow(candidate.volume_mm3 / body, 2.0 / 3)),
                                   body_triangles / 4, 2 * body_triangles / 3);
  // A little less than the region: where a cut runs in the body's surface, flakes of no thickness would stay.
  const Shape region = offset(partition.labels.region(id), -0.1 * proxy.solid.grid().voxel_mm);
  try {
    return {extract(proxy, region, {.max_surface_triangles = triangles}, context), {}};
  } catch (const Error& error) {
    if (error.code() != Code::SolverFailed) throw;
    return {std::nullopt, error.what()};
  }
}

/// The whole body as tetrahedra: TetGen's where it can, else the staircase of a coarse lattice, which never fails.
TetMesh extract_body(const Proxy& proxy, int triangles, std::vector<std::string>& notes, const Context& context) {
  try {
    return extract(proxy, everything(), {.max_surface_triangles = triangles}, context);
  } catch (const Error& error) {
    if (error.code() != Code::SolverFailed) throw;
    notes.push_back(std::string("the body is analysed on a coarse lattice of cubes: ") + error.what());
    return voxel_tetrahedra(distance_to(proxy.solid), proxy.solid.bounds_mm(), proxy.solid.volume_mm3());
  }
}

}  // namespace

Verification verify(const Proxy& proxy, const Partition& partition, const VerifyParams& given, const Material& material,
                    const Context& context) {
  check_params(given);
  VerifyParams params = given;
  params.up = normalized(given.up);
  Setting setting{params.up, {}, {"from above", "slanted"}, material, proxy.solid.grid().voxel_mm, {}, {}};
  for (const Vec3d& direction : load_directions(params.up, params.azimuth_deg)) {
    setting.forces_n.push_back(params.load_n * direction);
  }
  const std::size_t count = partition.candidates.size();
  const bool alone = count == 1;

  Verification result;
  // All meshes at once: the body's own, and one for each candidate.
  std::vector<Extracted> extracted(count);
  std::optional<TetMesh> body_mesh;
  std::atomic<int> done = 0;
  tbb::parallel_for(std::size_t{0}, alone ? std::size_t{1} : count + 1, [&](std::size_t job) {
    if (job == 0) {
      body_mesh = extract_body(proxy, params.triangles, result.notes, context.part(0, 0, "verify"));
    } else {
      extracted[job - 1] = extract_component(proxy, partition, static_cast<int>(job - 1), params.triangles,
                                             context.part(0, 0, "verify"));
    }
    context.progress(0.4 * ++done / static_cast<double>(count + 1));
  });

  const auto whole = std::make_shared<const Whole>(
      solve_body(std::move(*body_mesh), params, setting, context.part(0.4, 0.65, "verify")));
  const Model& body = whole->model;
  const fem::Locator& locator = whole->locator;
  result.traction_mpa = [whole](Vec3d p, Vec3d n) { return whole->traction_mpa(p, n); };
  account(result, body, params.load_n);
  std::vector<double> body_von_mises;
  for (const fem::Solution& s : body.solutions) {
    body_von_mises.push_back(mean_in_world(body.mesh, s.centroid_stress, all_tets(body.mesh)).von_mises);
  }

  std::vector<Verdict> verdicts(count);
  std::vector<std::optional<Model>> components(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const auto id = static_cast<int>(i);
    const Candidate& candidate = partition.candidates[i];
    if (extracted[i].mesh) {
      try {
        components[i] = solve_component(std::move(*extracted[i].mesh), body, locator, partition, id, setting,
                                        context.part(0.65, 0.65, "verify"));
      } catch (const Error& error) {
        if (error.code() != Code::SolverFailed) throw;
        extracted[i].failure = error.what();
      }
    }
    if (components[i]) {
      measure(verdicts[i], *components[i], all_tets(components[i]->mesh), candidate.axis, params.world_axes);
    } else {
      const auto tets = alone ? all_tets(body.mesh) : tets_of(body.mesh, partition.labels, id);
      measure(verdicts[i], body, tets, candidate.axis, params.world_axes);
    }
    decide(verdicts[i], candidate, body_von_mises, params);
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (components[i]) account(result, *components[i], params.load_n);
    if (!extracted[i].failure.empty()) {
      result.notes.push_back("candidate " + std::to_string(i) +
                             " is judged by the stresses of the whole body: " + extracted[i].failure);
    }
  }
  if (!(result.equilibrium < 1e-6)) {
    throw Error(Code::SolverFailed, "the supports do not answer the load", "verify", "report this model");
  }
  make_parts(result, proxy, partition, verdicts);
  if (params.keep_field) {
    result.field = stress_field(body, setting, result.parts.labels);
    result.field.frame = proxy.frame;
  }
  context.progress(1);
  return result;
}

}  // namespace fibrolite
