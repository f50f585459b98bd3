// SPDX-License-Identifier: GPL-3.0-or-later
#include "solve_cases.h"

#include <array>
#include <utility>

namespace fibrolite {
namespace {

bool same_axes(const Frame& a, const Frame& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

Vec3d into(const Frame& frame, Vec3d v) { return {dot(v, frame.x), dot(v, frame.y), dot(v, frame.z)}; }
Vec3d out_of(const Frame& frame, Vec3d v) { return v.x * frame.x + v.y * frame.y + v.z * frame.z; }

fem::Stress out_of(const Frame& frame, const fem::Stress& s) {
  const std::array<Vec3d, 3> rows{Vec3d{s[0], s[3], s[5]}, Vec3d{s[3], s[1], s[4]}, Vec3d{s[5], s[4], s[2]}};
  // R s R^T, with the frame's axes as the columns of R.
  std::array<Vec3d, 3> half;
  for (std::size_t i = 0; i < 3; ++i) half[i] = out_of(frame, rows[i]);  // s R^T
  const auto row = [&](int axis) {
    return frame.x[axis] * half[0] + frame.y[axis] * half[1] + frame.z[axis] * half[2];
  };
  const Vec3d x = row(0), y = row(1), z = row(2);
  return {x.x, y.y, z.z, x.y, y.z, z.x};
}

/// Solves in the coordinates of the frame, in which whatever is held is held along an axis.
std::vector<fem::Solution> solve_in(const Frame& frame, TetMesh mesh, const Material& material,
                                    const std::vector<fem::Fixed>& fixed, std::vector<fem::LoadCase> cases,
                                    const Context& context) {
  for (Vec3d& p : mesh.nodes) p = into(frame, p);
  for (fem::LoadCase& load : cases)
    for (Vec3d& f : load.force_n) f = into(frame, f);
  auto solutions = fem::solve(mesh, material, fixed, cases, {}, context);
  for (fem::Solution& s : solutions) {
    for (Vec3d& u : s.displacement_mm) u = out_of(frame, u);
    for (Vec3d& r : s.reaction_n) r = out_of(frame, r);
    for (fem::Stress& t : s.centroid_stress) t = out_of(frame, t);
    s.imbalance_n = out_of(frame, s.imbalance_n);
  }
  return solutions;
}

}  // namespace

std::vector<fem::Solution> solve_cases(const TetMesh& mesh, const Material& material,
                                       const std::vector<HeldCase>& cases, const Context& context) {
  std::vector<fem::Solution> solutions(cases.size());
  std::vector<bool> solved(cases.size(), false);
  std::size_t done = 0;
  for (std::size_t first = 0; first < cases.size(); ++first) {
    if (solved[first]) continue;
    const HeldCase& held = cases[first];
    std::vector<std::size_t> group;
    std::vector<fem::LoadCase> loads;
    for (std::size_t c = first; c < cases.size(); ++c) {
      if (solved[c] || !same_axes(cases[c].frame, held.frame) || cases[c].fixed != held.fixed) continue;
      group.push_back(c);
      loads.push_back(cases[c].load);
      solved[c] = true;
    }
    const auto share = [&](std::size_t count) {
      return static_cast<double>(count) / static_cast<double>(cases.size());
    };
    const Context part = context.part(share(done), share(done + group.size()), "verify");
    done += group.size();
    auto some = same_axes(held.frame, Frame{})
                    ? fem::solve(mesh, material, held.fixed, loads, {}, part)
                    : solve_in(held.frame, mesh, material, held.fixed, std::move(loads), part);
    for (std::size_t i = 0; i < group.size(); ++i) solutions[group[i]] = std::move(some[i]);
  }
  return solutions;
}

}  // namespace fibrolite
