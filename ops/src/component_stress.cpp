// SPDX-License-Identifier: GPL-3.0-or-later
#include "component_stress.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "fibrolite/frame.h"

namespace fibrolite {
namespace {

constexpr std::size_t directions = 16;  // over half a turn: the largest mean is met within 2 % of its range
constexpr double largest_dominance = 1e6;

struct Tet {
  double volume;
  Vec3d centroid;
};

Tet measure(const TetMesh& mesh, std::uint32_t t) {
  const auto& n = mesh.tets[t];
  const Vec3d a = mesh.nodes[n[0]], b = mesh.nodes[n[1]], c = mesh.nodes[n[2]], d = mesh.nodes[n[3]];
  return {dot(cross(b - a, c - a), d - a) / 6, 0.25 * (a + b + c + d)};
}

/// `frame` turned by the smallest rotation that takes its z axis to `t`.
Frame turned_to(const Frame& frame, Vec3d t) {
  const Vec3d m = frame.z;
  const double opposite = 1 + dot(m, t);
  if (opposite < 1e-3) return frame_along({}, t);  // half a turn has no smallest rotation
  const Vec3d w = cross(m, t);
  const auto turn = [&](Vec3d v) { return v + cross(w, v) + cross(w, cross(w, v)) / opposite; };
  return {{}, turn(frame.x), turn(frame.y), t};
}

}  // namespace

double MeanStress::dominance() const {
  return axial >= largest_dominance * transverse[0] ? (axial > 0 ? largest_dominance : 0) : axial / transverse[0];
}

ComponentSummary summary(const TetMesh& mesh, const std::vector<fem::Stress>& stress,
                         const std::vector<std::uint32_t>& tets, const Material& material) {
  ComponentSummary result{};
  std::vector<std::pair<double, double>> by_stress;  // von Mises, volume
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  double all = 0;
  for (const std::uint32_t t : tets) {
    const fem::Stress& s = stress[t];
    const double volume = measure(mesh, t).volume;
    all += volume;
    by_stress.emplace_back(von_mises(s), volume);
    Eigen::Matrix3d tensor;
    tensor << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    sum += volume * tensor;
    // (1 + nu) / 2E s:s - nu / 2E (tr s)^2
    const double trace = tensor.trace();
    result.strain_energy_nmm += volume *
                                ((1 + material.poisson) * tensor.squaredNorm() - material.poisson * trace * trace) /
                                (2 * material.young_mpa);
  }
  if (!(all > 0)) return result;
  std::sort(by_stress.begin(), by_stress.end());
  double below = 0;
  for (const auto& [value, volume] : by_stress) {
    below += volume;
    result.p99_von_mises = value;
    if (below >= 0.99 * all) break;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum / all);
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(solver.eigenvalues()[a]) > std::abs(solver.eigenvalues()[b]); });
  for (std::size_t k = 0; k < 3; ++k) result.principal[k] = solver.eigenvalues()[order[k]];
  const Eigen::Vector3d v = solver.eigenvectors().col(order[0]);
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  const double sign = v[largest] < 0 ? -1 : 1;
  result.direction = {sign * v[0], sign * v[1], sign * v[2]};
  return result;
}

MeanStress mean_in_axis(const TetMesh& mesh, const std::vector<fem::Stress>& stress,
                        const std::vector<std::uint32_t>& tets, const Axis& axis) {
  const Frame mean_frame = frame_along({}, axis.mean());
  std::array<double, directions> across{};
  MeanStress mean;
  for (const std::uint32_t t : tets) {
    const Tet tet = measure(mesh, t);
    const Frame f = turned_to(mean_frame, axis.tangent(tet.centroid));
    mean.volume_mm3 += tet.volume;
    mean.axial += tet.volume * std::abs(fem::normal_stress(stress[t], f.z));
    mean.von_mises += tet.volume * von_mises(stress[t]);
    // The normal stress in direction x cos + y sin, from the three components in the plane.
    const double xx = fem::normal_stress(stress[t], f.x), yy = fem::normal_stress(stress[t], f.y);
    const double xy = fem::normal_stress(stress[t], std::numbers::sqrt2 / 2 * (f.x + f.y)) - 0.5 * (xx + yy);
    for (std::size_t k = 0; k < directions; ++k) {
      const double angle = std::numbers::pi * static_cast<double>(k) / directions;
      const double c = std::cos(angle), s = std::sin(angle);
      across[k] += tet.volume * std::abs(xx * c * c + yy * s * s + 2 * xy * c * s);
    }
  }
  if (!(mean.volume_mm3 > 0)) return {};
  const auto largest = static_cast<std::size_t>(std::max_element(across.begin(), across.end()) - across.begin());
  mean.axial /= mean.volume_mm3;
  mean.von_mises /= mean.volume_mm3;
  mean.transverse[0] = across[largest] / mean.volume_mm3;
  mean.transverse[1] = across[(largest + directions / 2) % directions] / mean.volume_mm3;
  return mean;
}

MeanStress mean_in_world(const TetMesh& mesh, const std::vector<fem::Stress>& stress,
                         const std::vector<std::uint32_t>& tets) {
  std::array<double, 3> along{};
  MeanStress mean;
  for (const std::uint32_t t : tets) {
    const double volume = measure(mesh, t).volume;
    mean.volume_mm3 += volume;
    mean.von_mises += volume * von_mises(stress[t]);
    for (std::size_t k = 0; k < 3; ++k) along[k] += volume * std::abs(stress[t][k]);
  }
  if (!(mean.volume_mm3 > 0)) return {};
  mean.von_mises /= mean.volume_mm3;
  std::sort(along.begin(), along.end());
  mean.axial = along[2] / mean.volume_mm3;
  mean.transverse[0] = along[1] / mean.volume_mm3;
  mean.transverse[1] = along[0] / mean.volume_mm3;
  return mean;
}

}  // namespace fibrolite
