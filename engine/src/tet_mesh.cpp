// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/tet_mesh.h"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <utility>

namespace fibrolite {
namespace {

constexpr std::array<std::array<std::size_t, 2>, 6> edges{{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
/// Faces opposite corner 3, 2, 1, 0, outward: corners, then the middles of their edges in turn.
constexpr std::array<std::array<std::size_t, 6>, 4> faces{
    {{0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {0, 3, 2, 7, 9, 6}, {1, 2, 3, 5, 9, 8}}};

}  // namespace

TetMesh ten_node(std::vector<Vec3d> corners, const std::vector<std::array<std::uint32_t, 4>>& tets) {
  struct Edge {
    std::uint64_t ends;  // low end, high end
    std::uint32_t tet;
    std::uint32_t slot;
  };
  std::vector<Edge> all;
  all.reserve(tets.size() * edges.size());
  TetMesh mesh{std::move(corners), std::vector<std::array<std::uint32_t, 10>>(tets.size())};
  for (std::size_t t = 0; t < tets.size(); ++t) {
    std::copy(tets[t].begin(), tets[t].end(), mesh.tets[t].begin());
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto [low, high] = std::minmax(tets[t][edges[e][0]], tets[t][edges[e][1]]);
      all.push_back(
          {(std::uint64_t{low} << 32U) | high, static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(4 + e)});
    }
  }
  std::sort(all.begin(), all.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.ends, a.tet, a.slot) < std::tie(b.ends, b.tet, b.slot);
  });
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i == 0 || all[i].ends != all[i - 1].ends) {
      const Vec3d a = mesh.nodes[all[i].ends >> 32U];
      const Vec3d b = mesh.nodes[all[i].ends & 0xffffffffU];
      mesh.nodes.push_back(0.5 * (a + b));
    }
    mesh.tets[all[i].tet][all[i].slot] = static_cast<std::uint32_t>(mesh.nodes.size() - 1);
  }
  return mesh;
}

std::vector<TetFace> boundary(const TetMesh& mesh) {
  struct Side {
    std::array<std::uint32_t, 3> corners;  // sorted
    std::uint32_t tet;
    std::uint32_t face;
  };
  std::vector<Side> all;
  all.reserve(mesh.tets.size() * faces.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
      Side side{{mesh.tets[t][faces[f][0]], mesh.tets[t][faces[f][1]], mesh.tets[t][faces[f][2]]},
                static_cast<std::uint32_t>(t),
                static_cast<std::uint32_t>(f)};
      std::sort(side.corners.begin(), side.corners.end());
      all.push_back(side);
    }
  }
  std::sort(all.begin(), all.end(),
            [](const Side& a, const Side& b) { return std::tie(a.corners, a.tet) < std::tie(b.corners, b.tet); });
  std::vector<Side> single;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool before = i > 0 && all[i - 1].corners == all[i].corners;
    const bool after = i + 1 < all.size() && all[i + 1].corners == all[i].corners;
    if (!before && !after) single.push_back(all[i]);
  }
  std::sort(single.begin(), single.end(),
            [](const Side& a, const Side& b) { return std::tie(a.tet, a.face) < std::tie(b.tet, b.face); });
  std::vector<TetFace> result;
  result.reserve(single.size());
  for (const Side& side : single) {
    TetFace face{side.tet, {}};
    for (std::size_t k = 0; k < 6; ++k) face.nodes[k] = mesh.tets[side.tet][faces[side.face][k]];
    result.push_back(face);
  }
  return result;
}

double volume_mm3(const TetMesh& mesh) {
  double six_volumes = 0;
  for (const auto& tet : mesh.tets) {
    const Vec3d a = mesh.nodes[tet[0]];
    six_volumes += dot(cross(mesh.nodes[tet[1]] - a, mesh.nodes[tet[2]] - a), mesh.nodes[tet[3]] - a);
  }
  return six_volumes / 6;
}

}  // namespace fibrolite
