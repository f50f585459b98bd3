// SPDX-License-Identifier: Apache-2.0
#include "quad_envelope.h"

#include <algorithm>
#include <cmath>

namespace fibrolite {
namespace {

/// By more than about 25 degrees along its diagonal.
bool folds(const std::array<Vec3d, 4>& corners, bool first) {
  const std::size_t k = first ? 0 : 1;
  const Vec3d across = corners[k + 2] - corners[k];
  const Vec3d n = cross(corners[k + 1] - corners[k], across), m = cross(across, corners[(k + 3) & 3] - corners[k]);
  constexpr double most = 0.9;
  const double cosine = dot(n, m);
  return cosine < 0 || cosine * cosine < most * most * dot(n, n) * dot(m, m);
}

using Quadruple = std::array<Vec3d, 4>;

Quadruple cells_of(const Quadruple& corners) {
  Quadruple cell;
  for (std::size_t k = 0; k < 4; ++k)
    cell[k] = {std::floor(corners[k].x), std::floor(corners[k].y), std::floor(corners[k].z)};
  return cell;
}

/// Of the edge: along it all cells are alike. 3 if there is none.
int axis_of(const Quadruple& cell) {
  int along = 0;
  const auto alike = [&](int axis) {
    return cell[0][axis] == cell[1][axis] && cell[0][axis] == cell[2][axis] && cell[0][axis] == cell[3][axis];
  };
  while (along < 3 && !alike(along)) ++along;
  return along;
}

/// @param corners  In voxels.
bool in_envelope(const Quadruple& corners, bool first) {
  const Quadruple cell = cells_of(corners);
  const int along = axis_of(cell);
  if (along == 3) return false;
  const int u = (along + 1) % 3, w = (along + 2) % 3;
  const auto on_edge = [&](int axis) { return std::max({cell[0][axis], cell[1][axis], cell[2][axis], cell[3][axis]}); };
  const double edge_u = on_edge(u), edge_w = on_edge(w);

  struct Flat {
    double u, w, z;  // from the edge, and the share of it from its lower end
  };
  const auto flat = [&](std::size_t k) {
    const Vec3d& p = corners[k];
    return Flat{p[u] - edge_u, p[w] - edge_w, p[along] - cell[0][along]};
  };
  const auto turn = [](const Flat& a, const Flat& b) { return a.u * b.w - a.w * b.u; };
  const std::size_t begin = first ? 0 : 1;
  const Flat a = flat(begin), c = flat(begin + 2);
  // It runs between the edge and one of the other two corners: there it must cross the triangle of these.
  for (const std::size_t k : {begin + 1, (begin + 3) & 3U}) {
    const Flat b = flat(k);
    const double to_a = turn(b, a), to_c = turn(b, c);
    if ((to_a < 0) == (to_c < 0)) continue;
    const double t = to_a / (to_a - to_c);
    const Flat p{a.u + t * (c.u - a.u), a.w + t * (c.w - a.w), a.z + t * (c.z - a.z)};
    const double share = (p.u * b.u + p.w * b.w) / (b.u * b.u + b.w * b.w);
    if (share < 0) continue;  // beyond the edge
    return share <= 1 && p.z >= share * b.z && p.z <= 1 - share * (1 - b.z);
  }
  return false;
}

Quadruple in_voxels(const Quadruple& corners, double voxel_mm) {
  Quadruple voxels;
  for (std::size_t k = 0; k < 4; ++k) voxels[k] = 1 / voxel_mm * corners[k];
  return voxels;
}

}  // namespace

bool wrong_diagonal(const std::array<Vec3d, 4>& corners, double voxel_mm, bool first) {
  if (!folds(corners, first)) return false;
  const Quadruple voxels = in_voxels(corners, voxel_mm);
  return !in_envelope(voxels, first) && in_envelope(voxels, !first);
}

std::optional<int> no_diagonal(const std::array<Vec3d, 4>& corners, double voxel_mm, bool first) {
  if (!folds(corners, first)) return std::nullopt;
  const Quadruple voxels = in_voxels(corners, voxel_mm);
  const int along = axis_of(cells_of(voxels));
  if (along == 3 || in_envelope(voxels, true) || in_envelope(voxels, false)) return std::nullopt;
  return along;
}

}  // namespace fibrolite
