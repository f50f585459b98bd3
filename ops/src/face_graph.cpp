// SPDX-License-Identifier: GPL-3.0-or-later
#include "face_graph.h"

#include <algorithm>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

struct Edge {
  std::uint64_t key;  // both corners, the lower one first
  std::uint32_t face;
  std::uint32_t side;
};

}  // namespace

FaceGraph make_face_graph(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  if (count == 0) throw Error(Code::BadInput, "the surface has no triangles", "diameter", "give a closed surface");
  FaceGraph graph;
  graph.neighbours.resize(count);
  graph.area_mm2.resize(count);
  graph.normal.resize(count);
  graph.centroid.resize(count);
  std::vector<Edge> edges;
  edges.reserve(3 * count);
  for (std::size_t f = 0; f < count; ++f) {
    const auto& t = mesh.triangles[f];
    const Vec3d a = to_double(mesh.vertices[t[0]]);
    const Vec3d b = to_double(mesh.vertices[t[1]]);
    const Vec3d c = to_double(mesh.vertices[t[2]]);
    const Vec3d twice = cross(b - a, c - a);
    graph.area_mm2[f] = 0.5 * norm(twice);
    graph.normal[f] = normalized(twice);
    graph.centroid[f] = (a + b + c) / 3;
    graph.total_area_mm2 += graph.area_mm2[f];
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint64_t u = t[side];
      const std::uint64_t v = t[(side + 1) % 3];
      edges.push_back({std::min(u, v) << 32 | std::max(u, v), static_cast<std::uint32_t>(f), side});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.key != b.key ? a.key < b.key : a.face < b.face; });
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    const bool pair = i + 1 < edges.size() && edges[i].key == edges[i + 1].key;
    const bool third = i + 2 < edges.size() && edges[i].key == edges[i + 2].key;
    if (!pair || third) {
      throw Error(Code::BadInput, "the surface is open or not a 2-manifold", "face " + std::to_string(edges[i].face),
                  "measure diameters on the surface of a solid");
    }
    graph.neighbours[edges[i].face][edges[i].side] = edges[i + 1].face;
    graph.neighbours[edges[i + 1].face][edges[i + 1].side] = edges[i].face;
  }
  return graph;
}

}  // namespace fibrolite
