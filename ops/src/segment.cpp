// SPDX-License-Identifier: GPL-3.0-or-later
#include "segment.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace fibrolite {
namespace {

// A face whose neighbours are mostly of the other kind goes with them: the border loses its teeth.
void smooth_border(const FaceGraph& graph, std::vector<std::uint8_t>& thin) {
  constexpr int rounds = 8;
  std::vector<std::uint8_t> before;
  for (int round = 0; round < rounds; ++round) {
    before = thin;
    bool changed = false;
    for (std::size_t f = 0; f < thin.size(); ++f) {
      int others = 0;
      for (const std::uint32_t n : graph.neighbours[f]) others += before[n] != before[f] ? 1 : 0;
      if (others < 2) continue;
      thin[f] = before[f] == 0 ? 1 : 0;
      changed = true;
    }
    if (!changed) return;
  }
}

struct Regions {
  std::vector<int> of;  // per face
  std::vector<double> area;
  std::vector<std::uint8_t> thin;
  std::vector<std::set<int>> beside;
};

Regions connected(const FaceGraph& graph, const std::vector<std::uint8_t>& thin) {
  Regions r;
  r.of.assign(thin.size(), -1);
  std::vector<std::size_t> stack;
  for (std::size_t first = 0; first < thin.size(); ++first) {
    if (r.of[first] >= 0) continue;
    const int id = static_cast<int>(r.area.size());
    r.area.push_back(0);
    r.thin.push_back(thin[first]);
    r.of[first] = id;
    stack.push_back(first);
    while (!stack.empty()) {
      const std::size_t f = stack.back();
      stack.pop_back();
      r.area.back() += graph.area_mm2[f];
      for (const std::uint32_t n : graph.neighbours[f]) {
        if (r.of[n] >= 0 || thin[n] != thin[first]) continue;
        r.of[n] = id;
        stack.push_back(n);
      }
    }
  }
  r.beside.resize(r.area.size());
  for (std::size_t f = 0; f < thin.size(); ++f)
    for (const std::uint32_t n : graph.neighbours[f])
      if (r.of[n] != r.of[f]) r.beside[static_cast<std::size_t>(r.of[f])].insert(r.of[n]);
  return r;
}

// Smallest first: what is too small takes the kind of what surrounds it, so it and all its neighbours become one
// region.
void give_away_small(Regions& r, double least_area) {
  std::vector<int> into(r.area.size());
  for (std::size_t i = 0; i < into.size(); ++i) into[i] = static_cast<int>(i);
  for (;;) {
    int smallest = -1;
    for (std::size_t i = 0; i < r.area.size(); ++i) {
      if (into[i] != static_cast<int>(i) || r.area[i] >= least_area || r.beside[i].empty()) continue;
      if (smallest < 0 || r.area[i] < r.area[static_cast<std::size_t>(smallest)]) smallest = static_cast<int>(i);
    }
    if (smallest < 0) break;
    const std::set<int> around = r.beside[static_cast<std::size_t>(smallest)];
    const int host = *around.begin();
    const auto h = static_cast<std::size_t>(host);
    std::set<int> gone = around;
    gone.insert(smallest);
    std::set<int> beside;
    for (const int g : gone) {
      const auto gi = static_cast<std::size_t>(g);
      if (g != host) {
        r.area[h] += r.area[gi];
        into[gi] = host;
      }
      beside.insert(r.beside[gi].begin(), r.beside[gi].end());
    }
    for (const int g : gone) beside.erase(g);
    for (const int b : beside) {
      auto& theirs = r.beside[static_cast<std::size_t>(b)];
      for (const int g : gone) theirs.erase(g);
      theirs.insert(host);
    }
    r.beside[h] = std::move(beside);
  }
  for (int& region : r.of)
    while (into[static_cast<std::size_t>(region)] != region) region = into[static_cast<std::size_t>(region)];
}

// The direction to which the normals of a tube are all square: the least eigenvector of their spread.
Vec3d tube_direction(const FaceGraph& graph, const std::vector<int>& region, int of, Vec3d centre, double reach) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t f = 0; f < region.size(); ++f) {
    if (region[f] != of || norm(graph.centroid[f] - centre) > reach) continue;
    const Eigen::Vector3d n(graph.normal[f].x, graph.normal[f].y, graph.normal[f].z);
    spread += graph.area_mm2[f] * n * n.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Eigen::Vector3d v = solver.eigenvectors().col(0);
  return normalized({v.x(), v.y(), v.z()});
}

struct BorderEdge {
  std::uint32_t from, to;
  Vec3d middle;
  double length;
};

std::vector<std::vector<BorderEdge>> chains(const std::vector<BorderEdge>& edges) {
  std::map<std::uint32_t, std::vector<std::size_t>> at;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    at[edges[e].from].push_back(e);
    at[edges[e].to].push_back(e);
  }
  std::vector<std::vector<BorderEdge>> result;
  std::vector<std::uint8_t> seen(edges.size(), 0);
  for (std::size_t first = 0; first < edges.size(); ++first) {
    if (seen[first] != 0) continue;
    result.emplace_back();
    std::vector<std::size_t> stack{first};
    seen[first] = 1;
    while (!stack.empty()) {
      const std::size_t e = stack.back();
      stack.pop_back();
      result.back().push_back(edges[e]);
      for (const std::uint32_t corner : {edges[e].from, edges[e].to}) {
        for (const std::size_t n : at[corner]) {
          if (seen[n] != 0) continue;
          seen[n] = 1;
          stack.push_back(n);
        }
      }
    }
  }
  return result;
}

BorderLoop make_loop(const std::vector<BorderEdge>& chain, const FaceGraph& graph, const std::vector<int>& region,
                     int of) {
  BorderLoop loop;
  double length = 0;
  for (const BorderEdge& e : chain) {
    loop.centre = loop.centre + e.length * e.middle;
    length += e.length;
  }
  loop.centre = loop.centre / length;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const BorderEdge& e : chain) {
    const Vec3d gap = e.middle - loop.centre;
    loop.radius_mm += e.length * norm(gap) / length;
    const Eigen::Vector3d g(gap.x, gap.y, gap.z);
    spread += e.length * g * g.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Eigen::Vector3d v = solver.eigenvectors().col(0);
  const Vec3d across = normalized({v.x(), v.y(), v.z()});
  Vec3d along = tube_direction(graph, region, of, loop.centre, 2.5 * loop.radius_mm);
  if (dot(along, across) < 0) along = -along;
  loop.direction = normalized(along + across);
  // The limb lies on the near side.
  double side = 0;
  for (std::size_t f = 0; f < region.size(); ++f) {
    if (region[f] != of) continue;
    const Vec3d gap = graph.centroid[f] - loop.centre;
    if (norm(gap) < 2.5 * loop.radius_mm) side += graph.area_mm2[f] * dot(gap, loop.direction);
  }
  if (side > 0) loop.direction = -loop.direction;
  return loop;
}

}  // namespace

Segmentation segment(const Mesh& surface, const FaceGraph& graph, const std::vector<double>& normalized,
                     double threshold, double min_area) {
  std::vector<std::uint8_t> thin(graph.size());
  for (std::size_t f = 0; f < thin.size(); ++f) thin[f] = normalized[f] < threshold ? 1 : 0;
  smooth_border(graph, thin);
  Regions regions = connected(graph, thin);
  give_away_small(regions, min_area * graph.total_area_mm2);

  Segmentation result;
  result.region.resize(graph.size());
  std::map<int, int> name;
  for (std::size_t f = 0; f < graph.size(); ++f) {
    const auto [it, added] = name.try_emplace(regions.of[f], static_cast<int>(name.size()));
    if (added) result.regions.push_back({regions.thin[static_cast<std::size_t>(regions.of[f])] != 0, 0, {}});
    result.region[f] = it->second;
    result.regions[static_cast<std::size_t>(it->second)].area_mm2 += graph.area_mm2[f];
  }
  std::vector<std::vector<BorderEdge>> border(result.regions.size());
  for (std::size_t f = 0; f < graph.size(); ++f) {
    const auto r = static_cast<std::size_t>(result.region[f]);
    if (!result.regions[r].thin) continue;
    for (std::size_t side = 0; side < 3; ++side) {
      if (result.region[graph.neighbours[f][side]] == result.region[f]) continue;
      const std::uint32_t from = surface.triangles[f][side];
      const std::uint32_t to = surface.triangles[f][(side + 1) % 3];
      const Vec3d a = to_double(surface.vertices[from]);
      const Vec3d b = to_double(surface.vertices[to]);
      border[r].push_back({from, to, 0.5 * (a + b), norm(b - a)});
    }
  }
  for (std::size_t r = 0; r < border.size(); ++r)
    for (const auto& chain : chains(border[r]))
      result.regions[r].loops.push_back(make_loop(chain, graph, result.region, static_cast<int>(r)));
  return result;
}

}  // namespace fibrolite
