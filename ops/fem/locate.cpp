// SPDX-License-Identifier: GPL-3.0-or-later
#include "locate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "elasticity.h"

namespace fibrolite::fem {
namespace {

struct Barycentric {
  std::array<double, 4> value;
  double outside_mm;  // how far beyond its farthest side plane; 0 or less inside
};

Barycentric barycentric(const TetMesh& mesh, std::uint32_t tet, Vec3d p) {
  const auto& n = mesh.tets[tet];
  const Vec3d a = mesh.nodes[n[0]];
  const Vec3d u = mesh.nodes[n[1]] - a, v = mesh.nodes[n[2]] - a, w = mesh.nodes[n[3]] - a;
  const double six_volumes = dot(cross(u, v), w);
  const Vec3d g1 = cross(v, w) / six_volumes, g2 = cross(w, u) / six_volumes, g3 = cross(u, v) / six_volumes;
  const Vec3d g0 = -(g1 + g2 + g3);
  const Vec3d d = p - a;
  Barycentric result{{0, dot(g1, d), dot(g2, d), dot(g3, d)}, 0};
  result.value[0] = 1 - result.value[1] - result.value[2] - result.value[3];
  const std::array<double, 4> slope{norm(g0), norm(g1), norm(g2), norm(g3)};
  result.outside_mm = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 4; ++k) {
    result.outside_mm = std::max(result.outside_mm, -result.value[k] / slope[k]);
  }
  return result;
}

}  // namespace

Locator::Locator(const TetMesh& mesh) : mesh_(&mesh) {
  std::vector<Box3d> boxes(mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    for (std::size_t k = 0; k < 4; ++k) boxes[t].include(mesh.nodes[mesh.tets[t][k]]);
    box_.include(boxes[t].min);
    box_.include(boxes[t].max);
  }
  if (mesh.tets.empty()) box_.include({});
  const Vec3d size = box_.size();
  const double volume = std::max(size.x, 1e-9) * std::max(size.y, 1e-9) * std::max(size.z, 1e-9);
  cell_mm_ = std::max(std::cbrt(volume / static_cast<double>(mesh.tets.size() + 1)), box_.longest_side() / 256 + 1e-9);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cells_[axis] = 1 + static_cast<int>(size[static_cast<int>(axis)] / cell_mm_);
  }
  const auto each_cell = [&](const Box3d& box, const auto& visit) {
    const auto lo = cell(box.min), hi = cell(box.max);
    for (int z = lo[2]; z <= hi[2]; ++z) {
      for (int y = lo[1]; y <= hi[1]; ++y) {
        for (int x = lo[0]; x <= hi[0]; ++x) visit(static_cast<std::size_t>((z * cells_[1] + y) * cells_[0] + x));
      }
    }
  };
  first_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]) + 1, 0);
  for (const Box3d& box : boxes) each_cell(box, [&](std::size_t c) { ++first_[c + 1]; });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  tets_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t t = 0; t < boxes.size(); ++t) each_cell(boxes[t], [&](std::size_t c) { tets_[next[c]++] = t; });
}

std::array<int, 3> Locator::cell(Vec3d p) const {
  std::array<int, 3> at{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    at[a] =
        static_cast<int>(std::clamp((p[axis] - box_.min[axis]) / cell_mm_, 0.0, static_cast<double>(cells_[a] - 1)));
  }
  return at;
}

Locator::Place Locator::find(Vec3d p) const {
  const auto middle = cell(p);
  const int farthest = std::max({cells_[0], cells_[1], cells_[2]});
  Place best;
  double outside = std::numeric_limits<double>::infinity();
  // Rings of cells around the point's own, until what is found cannot be beaten by a farther ring.
  for (int ring = 0; ring <= farthest && outside > (ring - 1) * cell_mm_; ++ring) {
    for (int z = std::max(middle[2] - ring, 0); z <= std::min(middle[2] + ring, cells_[2] - 1); ++z) {
      for (int y = std::max(middle[1] - ring, 0); y <= std::min(middle[1] + ring, cells_[1] - 1); ++y) {
        for (int x = std::max(middle[0] - ring, 0); x <= std::min(middle[0] + ring, cells_[0] - 1); ++x) {
          if (std::max({std::abs(x - middle[0]), std::abs(y - middle[1]), std::abs(z - middle[2])}) != ring) continue;
          const auto c = static_cast<std::size_t>((z * cells_[1] + y) * cells_[0] + x);
          for (std::size_t k = first_[c]; k < first_[c + 1]; ++k) {
            const Barycentric b = barycentric(*mesh_, tets_[k], p);
            if (b.outside_mm < outside || (b.outside_mm == outside && tets_[k] < best.tet)) {
              best = {tets_[k], b.value};
              outside = b.outside_mm;
            }
          }
        }
      }
    }
    if (outside <= 0) break;
  }
  double sum = 0;
  for (double& b : best.barycentric) sum += b = std::max(b, 0.0);
  for (double& b : best.barycentric) b /= sum;
  return best;
}

Vec3d Locator::interpolate(const std::vector<Vec3d>& nodal, Vec3d p) const {
  const Place place = find(p);
  const auto n = shape_functions(place.barycentric);
  Vec3d value{};
  for (std::size_t k = 0; k < 10; ++k) value = value + n[k] * nodal[mesh_->tets[place.tet][k]];
  return value;
}

}  // namespace fibrolite::fem
