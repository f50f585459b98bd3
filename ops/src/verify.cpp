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

#include "body_solve.h"
#include "component_stress.h"
#include "fibrolite/disjoint_sets.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/tetrahedralize.h"
#include "fibrolite/ops/text.h"
#include "part_maker.h"

namespace fibrolite {
namespace {

/// Stage 2: a candidate on its own mesh. On its cut faces it follows the body's coarse displacements.
SolvedMesh solve_component(TetMesh mesh, const SolvedMesh& body, const fem::Locator& locator,
                           const Partition& partition, int id, const LoadedSetting& setting, const Context& context) {
  std::vector<float> distance(mesh.nodes.size());
  partition.labels.region(id).evaluate(mesh.nodes, distance);
  std::vector<bool> on_cut(mesh.nodes.size(), false);
  for (const TetFace& face : boundary(mesh)) {
    for (const std::uint32_t node : face.nodes) {
      on_cut[node] = static_cast<double>(distance[node]) > -setting.voxel_mm;
    }
  }
  std::vector<HeldCase> cases;
  for (std::size_t c = 0; c < setting.loads.size(); ++c) {
    const AppliedLoad& load = setting.loads[c];
    // Asked a voxel below the surface: a cut that runs in the surface itself would give the points to either side at
    // random. Other forces need no such question: what falls on a cut acts on nodes that are prescribed.
    const auto mine = [&](Vec3d p, Vec3d to_eye) {
      return partition.labels.label(p - setting.voxel_mm * to_eye) == id;
    };
    const Frame& frame = load.held_in();
    HeldCase& held = cases.emplace_back(HeldCase{frame, {}, {load.forces_n(mesh, mine), {}}});
    const auto own = load.held(mesh);
    for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
      const auto& axes = own[node];
      if (!on_cut[node] && !axes[0] && !axes[1] && !axes[2]) continue;
      Vec3d u{};  // a support is stronger than a cut
      if (on_cut[node] && !(axes[0] && axes[1] && axes[2])) {
        const Vec3d v = locator.interpolate(body.solutions[c].displacement_mm, mesh.nodes[node]);
        u = {dot(v, frame.x), dot(v, frame.y), dot(v, frame.z)};
      }
      for (int axis = 0; axis < 3; ++axis) {
        const bool supported = axes[static_cast<std::size_t>(axis)];
        if (!supported && !on_cut[node]) continue;
        held.fixed.push_back({node, axis});
        held.load.fixed_mm.push_back(supported ? 0 : u[axis]);
      }
    }
  }
  auto solutions = solve_cases(mesh, setting.material, cases, context);
  return {std::move(mesh), std::move(cases), std::move(solutions)};
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
  std::vector<CaseStress> carried;
  Kind kind = Kind::Bulk;
  PartStress stress;
  std::string reason;
};

void measure(Verdict& verdict, const SolvedMesh& model, const std::vector<std::uint32_t>& tets, const Axis& axis,
             const LoadedSetting& setting, bool world_axes) {
  for (std::size_t c = 0; c < model.solutions.size(); ++c) {
    const std::vector<fem::Stress>& stress = model.solutions[c].centroid_stress;
    const MeanStress mean =
        world_axes ? mean_in_world(model.mesh, stress, tets) : mean_in_axis(model.mesh, stress, tets, axis);
    verdict.cases.push_back(mean);
    const ComponentSummary more = summary(model.mesh, stress, tets, setting.material);
    verdict.carried.push_back({.load_case = setting.cases[c].name,
                               .axial = mean.axial,
                               .transverse = {mean.transverse[0], mean.transverse[1]},
                               .von_mises = mean.von_mises,
                               .dominance = mean.dominance(),
                               .p99_von_mises = more.p99_von_mises,
                               .strain_energy_nmm = more.strain_energy_nmm,
                               .principal = {more.principal[0], more.principal[1], more.principal[2]},
                               .principal_direction = more.direction});
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
                    worst != nullptr ? worst->dominance() : 0,
                    verdict.carried};
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

/// Touching bulk candidates get one number, unless the user parted them; columns keep their own. Numbers are not yet
/// those of the parts.
std::vector<std::size_t> merge_bulk(const Partition& partition, const std::vector<Verdict>& verdicts) {
  DisjointSets sets(verdicts.size());
  for (const Cut& cut : partition.cuts) {
    const auto a = static_cast<std::uint32_t>(cut.a), b = static_cast<std::uint32_t>(cut.b);
    if (cut.kept || partition.candidates[a].chosen || partition.candidates[b].chosen) continue;
    if (verdicts[a].kind == Kind::Bulk && verdicts[b].kind == Kind::Bulk) sets.join(a, b);
  }
  for (const Core& core : partition.cores) {
    const auto id = static_cast<std::uint32_t>(core.id), host = static_cast<std::uint32_t>(core.host);
    if (verdicts[id].kind == Kind::Bulk && verdicts[host].kind == Kind::Bulk) sets.join(id, host);
  }
  std::vector<std::size_t> group;
  for (std::uint32_t i = 0; i < sets.size(); ++i) group.push_back(sets.root(i));
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
  for (Core core : partition.cores) {
    core.id = result.part_of_candidate[static_cast<std::size_t>(core.id)];
    core.host = result.part_of_candidate[static_cast<std::size_t>(core.host)];
    if (core.id != core.host) result.parts.cores.push_back(core);
  }
  const std::vector<PartGeometry> geometry = part_geometry(proxy, result.parts.labels);
  for (std::size_t id = 0; id < drafts.size(); ++id) {
    const Draft& draft = drafts[id];
    const std::size_t main = draft.members.front();
    const Candidate& candidate = partition.candidates[main];
    const bool merged = draft.members.size() > 1;
    std::string reason = verdicts[main].reason;
    if (candidate.chosen) reason.append("; filled with ").append(name(*candidate.chosen)).append(" as the recipe says");
    if (merged) reason += "; " + std::to_string(draft.members.size()) + " touching bulk pieces are one part";
    const std::vector<int> candidates(draft.members.begin(), draft.members.end());
    result.parts.parts.push_back(PartMaker::make({.id = static_cast<int>(id),
                                                  .kind = verdicts[main].kind,
                                                  .candidates = candidates,
                                                  .chosen = candidate.chosen,
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
StressField stress_field(const SolvedBody& whole, const Labels& labels) {
  const SolvedMesh& body = whole.model;
  const LoadedSetting& setting = whole.setting;
  StressField field{body.mesh, {}, setting.material, {}, {}};
  for (const auto& n : body.mesh.tets)
    field.part.push_back(labels.label(
        0.25 * (body.mesh.nodes[n[0]] + body.mesh.nodes[n[1]] + body.mesh.nodes[n[2]] + body.mesh.nodes[n[3]])));
  for (std::size_t c = 0; c < body.solutions.size(); ++c) {
    StressField::Case& solved = field.cases.emplace_back();
    solved.name = setting.cases[c].name;
    solved.held_in = body.cases[c].frame;
    for (const fem::Fixed& f : body.cases[c].fixed) solved.fixed.push_back({f.node, f.axis});
    solved.force_n = body.cases[c].load.force_n;
    solved.displacement_mm = body.solutions[c].displacement_mm;
    solved.stress_mpa = whole.nodal_stress[c];
  }
  return field;
}

void account(Verification& result, const SolvedMesh& model, const LoadedSetting& setting) {
  result.tets += static_cast<std::int64_t>(model.mesh.tets.size());
  result.dof += 3 * static_cast<std::int64_t>(model.mesh.nodes.size());
  for (std::size_t c = 0; c < model.solutions.size(); ++c) {
    const fem::Solution& s = model.solutions[c];
    result.iterations = std::max(result.iterations, s.iterations);
    result.residual = std::max(result.residual, s.residual);
    result.equilibrium = std::max(result.equilibrium, norm(s.imbalance_n) / setting.loads[c].magnitude_n());
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

}  // namespace

Verification verify(const Proxy& proxy, const Partition& partition, const VerifyParams& params,
                    const Material& material, const Context& context) {
  check_params(params);
  check_material(material);
  check_loads(params.loads);
  const std::size_t count = partition.candidates.size();
  const bool alone = count == 1;

  Verification result;
  // All meshes at once: the body's own, and one for each candidate.
  std::vector<Extracted> extracted(count);
  std::optional<TetMesh> whole_mesh;
  std::atomic<int> done = 0;
  tbb::parallel_for(std::size_t{0}, alone ? std::size_t{1} : count + 1, [&](std::size_t job) {
    if (job == 0) {
      whole_mesh = body_mesh(proxy, params.triangles, result.notes, context.part(0, 0, "verify"));
    } else {
      extracted[job - 1] = extract_component(proxy, partition, static_cast<int>(job - 1), params.triangles,
                                             context.part(0, 0, "verify"));
    }
    context.progress(0.4 * ++done / static_cast<double>(count + 1));
  });

  const std::shared_ptr<const SolvedBody> whole =
      solve_body(proxy, std::move(*whole_mesh), partition.labels, params, material, context.part(0.4, 0.65, "verify"));
  const LoadedSetting& setting = whole->setting;
  const SolvedMesh& body = whole->model;
  const fem::Locator& locator = whole->locator;
  result.traction_mpa = [whole](Vec3d p, Vec3d n) { return whole->traction_mpa(p, n); };
  result.von_mises_mpa = [whole](Vec3d p) { return whole->von_mises_mpa(p); };
  account(result, body, setting);
  for (const AppliedLoad& load : setting.loads)
    result.selected.insert(result.selected.end(), load.selected().begin(), load.selected().end());
  std::vector<double> body_von_mises;
  for (const fem::Solution& s : body.solutions) {
    body_von_mises.push_back(mean_in_world(body.mesh, s.centroid_stress, all_tets(body.mesh)).von_mises);
  }

  std::vector<Verdict> verdicts(count);
  std::vector<std::optional<SolvedMesh>> components(count);
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
      measure(verdicts[i], *components[i], all_tets(components[i]->mesh), candidate.axis, setting, params.world_axes);
    } else {
      const auto tets = alone ? all_tets(body.mesh) : tets_of(body.mesh, partition.labels, id);
      measure(verdicts[i], body, tets, candidate.axis, setting, params.world_axes);
    }
    decide(verdicts[i], candidate, body_von_mises, params);
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (components[i]) account(result, *components[i], setting);
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
    result.field = stress_field(*whole, result.parts.labels);
    result.field.frame = proxy.frame;
  }
  context.progress(1);
  return result;
}

}  // namespace fibrolite
