// SPDX-License-Identifier: GPL-3.0-or-later
#include "tet_element.h"

#include <numeric>

namespace fibrolite::fem {

Element::Element(const TetMesh& mesh, std::size_t t) {
  const auto& n = mesh.tets[t];
  const Vec3d a = mesh.nodes[n[0]];
  const Vec3d u = mesh.nodes[n[1]] - a, v = mesh.nodes[n[2]] - a, w = mesh.nodes[n[3]] - a;
  const double six_volumes = dot(cross(u, v), w);
  volume = six_volumes / 6;
  grad[1] = cross(v, w) / six_volumes;
  grad[2] = cross(w, u) / six_volumes;
  grad[3] = cross(u, v) / six_volumes;
  grad[0] = -(grad[1] + grad[2] + grad[3]);
}

Gradients Element::gradients(const Barycentric& at) const {
  Gradients g;
  for (std::size_t i = 0; i < 4; ++i) g[i] = (4 * at[i] - 1) * grad[i];
  for (std::size_t k = 0; k < 6; ++k) {
    const auto [i, j] = edges[k];
    g[4 + k] = 4 * (at[i] * grad[j] + at[j] * grad[i]);
  }
  return g;
}

Nodal Element::force(const Lame& lame, const Nodal& displacement, std::span<const Barycentric> rule) const {
  Nodal sum{};
  const double weight = volume / static_cast<double>(rule.size());
  for (const Barycentric& at : rule) {
    const Gradients g = gradients(at);
    const Stress s = stress_at(g, lame, displacement);
    for (std::size_t i = 0; i < 10; ++i) {
      const Vec3d f{g[i].x * s[0] + g[i].y * s[3] + g[i].z * s[5], g[i].x * s[3] + g[i].y * s[1] + g[i].z * s[4],
                    g[i].x * s[5] + g[i].y * s[4] + g[i].z * s[2]};
      sum[i] = sum[i] + weight * f;
    }
  }
  return sum;
}

Stress stress_at(const Gradients& g, const Lame& lame, const Nodal& displacement) {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
  for (std::size_t i = 0; i < 10; ++i) {
    const Vec3d u = displacement[i];
    xx += g[i].x * u.x;
    yy += g[i].y * u.y;
    zz += g[i].z * u.z;
    xy += g[i].y * u.x + g[i].x * u.y;
    yz += g[i].z * u.y + g[i].y * u.z;
    zx += g[i].x * u.z + g[i].z * u.x;
  }
  const double pressure = lame.lambda * (xx + yy + zz);
  return {pressure + 2 * lame.mu * xx,
          pressure + 2 * lame.mu * yy,
          pressure + 2 * lame.mu * zz,
          lame.mu * xy,
          lame.mu * yz,
          lame.mu * zx};
}

Nodal nodal(const TetMesh& mesh, std::size_t t, const std::vector<Vec3d>& of_mesh) {
  Nodal of_tet;
  for (std::size_t i = 0; i < 10; ++i) of_tet[i] = of_mesh[mesh.tets[t][i]];
  return of_tet;
}

Incidence::Incidence(const TetMesh& mesh) : first(mesh.nodes.size() + 1, 0), uses(10 * mesh.tets.size()) {
  for (const auto& tet : mesh.tets) {
    for (const std::uint32_t node : tet) ++first[node + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
    for (std::uint32_t i = 0; i < 10; ++i) uses[next[mesh.tets[t][i]]++] = {t, i};
  }
}

}  // namespace fibrolite::fem
