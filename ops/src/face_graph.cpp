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
  bool forward;  // runs from the lower corner to the higher
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
      edges.push_back({std::min(u, v) << 32 | std::max(u, v), static_cast<std::uint32_t>(f), side, u < v});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.key != b.key ? a.key < b.key : a.face < b.face; });
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first;
    while (last < edges.size() && edges[last].key == edges[first].key) ++last;
    // Sheets that touch along an edge have four faces or more there: any two that run oppositely are neighbours.
    const auto turns = std::stable_partition(edges.begin() + static_cast<std::ptrdiff_t>(first),
                                             edges.begin() + static_cast<std::ptrdiff_t>(last),
                                             [](const Edge& e) { return e.forward; });
    const std::size_t forward = static_cast<std::size_t>(turns - edges.begin()) - first;
    if (2 * forward != last - first) {
      throw Error(Code::BadInput, "the surface is open or its triangles face both ways",
                  "face " + std::to_string(edges[first].face), "measure diameters on the surface of a solid");
    }
    for (std::size_t i = 0; i < forward; ++i) {
      const Edge& a = edges[first + i];
      const Edge& b = edges[first + forward + i];
      graph.neighbours[a.face][a.side] = b.face;
      graph.neighbours[b.face][b.side] = a.face;
    }
    first = last;
  }
  return graph;
}

}  // namespace fibrolite
