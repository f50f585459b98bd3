// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_checks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

namespace fibrolite::testing {
namespace {

struct PointHash {
  std::size_t operator()(const std::array<float, 3>& p) const {
    std::size_t h = 1469598103934665603ULL;
    for (const float f : p) h = (h ^ std::bit_cast<std::uint32_t>(f)) * 1099511628211ULL;
    return h ^ (h >> 29);
  }
};

// How the triangles of one undirected edge {low, high} run along it.
struct EdgeUse {
  int up = 0, down = 0;
};

}  // namespace

IndependentCount count(const Mesh& mesh) {
  IndependentCount result;
  std::unordered_map<std::array<float, 3>, int, PointHash> ids;
  ids.reserve(mesh.vertices.size());
  const auto id_of = [&](std::uint32_t v) {
    const Vec3f p = mesh.vertices.at(v);
    // + 0.0f turns -0 into 0: the two are the same place.
    return ids.try_emplace({p.x + 0.0f, p.y + 0.0f, p.z + 0.0f}, static_cast<int>(ids.size())).first->second;
  };

  std::vector<std::array<int, 3>> triangles;
  triangles.reserve(mesh.triangles.size());
  std::unordered_map<std::uint64_t, EdgeUse> edges;
  edges.reserve(mesh.triangles.size() * 3 / 2);
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices.at(t[0])), b = to_double(mesh.vertices.at(t[1])),
                c = to_double(mesh.vertices.at(t[2]));
    result.volume_mm3 += dot(a, cross(b, c)) / 6;
    const std::array<int, 3> w{id_of(t[0]), id_of(t[1]), id_of(t[2])};
    const bool equal_corners = w[0] == w[1] || w[1] == w[2] || w[2] == w[0];
    if (equal_corners || cross(b - a, c - a) == Vec3d{}) ++result.degenerate_triangles;
    if (equal_corners) continue;
    triangles.push_back(w);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto from = static_cast<std::uint64_t>(w[i]), to = static_cast<std::uint64_t>(w[(i + 1) % 3]);
      EdgeUse& use = edges[(std::min(from, to) << 32) | std::max(from, to)];
      ++(from < to ? use.up : use.down);
    }
  }
  for (const auto& [edge, use] : edges) {
    if (use.up + use.down == 1) ++result.boundary_edges;
    if (use.up + use.down > 2 || use.up == 2 || use.down == 2) ++result.nonmanifold_edges;
  }

  // The link of a vertex is the graph of the edges opposite to it; each connected piece of it is one fan.
  std::vector<std::vector<std::pair<int, int>>> links(ids.size());
  for (const auto& w : triangles)
    for (std::size_t i = 0; i < 3; ++i)
      links[static_cast<std::size_t>(w[i])].emplace_back(w[(i + 1) % 3], w[(i + 2) % 3]);
  for (const auto& link : links) {
    std::map<int, int> parent;
    const auto root = [&](int v) {
      while (parent.at(v) != v) v = parent.at(v);
      return v;
    };
    std::size_t fans = 0;
    for (const auto& [a, b] : link) {
      fans += parent.try_emplace(a, a).second;
      fans += parent.try_emplace(b, b).second;
      const int ra = root(a), rb = root(b);
      if (ra == rb) continue;
      parent[ra] = rb;
      --fans;
    }
    if (fans > 1) ++result.nonmanifold_vertices;
  }
  return result;
}

}  // namespace fibrolite::testing
