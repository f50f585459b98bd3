// SPDX-License-Identifier: GPL-3.0-or-later
#include "level_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

namespace fibrolite {
namespace {

LevelNode& node(LevelGraph& graph, int i) { return graph.nodes[static_cast<std::size_t>(i)]; }
const LevelNode& node(const LevelGraph& graph, int i) { return graph.nodes[static_cast<std::size_t>(i)]; }

void merge(LevelGraph& graph, int host, const std::vector<int>& others) {
  LevelNode& h = node(graph, host);
  for (const int other : others) {
    if (other == host) continue;
    LevelNode& o = node(graph, other);
    h.samples.insert(h.samples.end(), o.samples.begin(), o.samples.end());
    h.cut = h.cut || o.cut;
    for (const int b : o.beside) {
      node(graph, b).beside.erase(other);
      if (b == host) continue;
      node(graph, b).beside.insert(host);
      h.beside.insert(b);
    }
    o.beside.clear();
    o.samples.clear();
    o.gone = true;
  }
  h.beside.erase(host);
}

double way(const LevelGraph& graph, const std::vector<int>& path) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    length += norm(node(graph, path[i + 1]).centroid - node(graph, path[i]).centroid);
  return length;
}

// How thick the piece is about a junction: the median of the nodes around it, since the junction itself is thicker than
// its limbs.
double thickness_at(const LevelGraph& graph, int junction) {
  std::vector<double> d;
  for (const int b : node(graph, junction).beside) d.push_back(node(graph, b).diameter_mm);
  std::sort(d.begin(), d.end());
  return d.empty() ? node(graph, junction).diameter_mm : d[d.size() / 2];
}

// A tip that stands out less than the limb is thick is no limb of its own. Shortest first.
bool merge_short_branch(LevelGraph& graph, double bin) {
  double shortest = 0;
  std::vector<int> branch;
  for (const int i : graph.alive()) {
    if (graph.degree(i) != 1) continue;
    const std::vector<int> path = graph.arc(i, *node(graph, i).beside.begin());
    const int junction = path.back();
    if (graph.degree(junction) < 3) continue;
    const double length = way(graph, path) + 0.5 * bin;
    if (length >= thickness_at(graph, junction)) continue;
    if (!branch.empty() && length >= shortest) continue;
    shortest = length;
    branch = path;
  }
  if (branch.empty()) return false;
  const int junction = branch.back();
  branch.pop_back();
  merge(graph, junction, branch);
  return true;
}

// Two ways from junction to junction that close up within the local thickness are a dent or a screw hole, not a ring.
bool merge_small_hole(LevelGraph& graph) {
  for (const int i : graph.alive()) {
    if (graph.degree(i) < 3) continue;
    std::map<int, std::vector<std::vector<int>>> by_end;
    for (const int b : node(graph, i).beside) {
      std::vector<int> path = graph.arc(i, b);
      by_end[path.back()].push_back(std::move(path));
    }
    for (auto& [end, paths] : by_end) {
      if (paths.size() < 2 || graph.degree(end) < 3) continue;
      std::sort(paths.begin(), paths.end(), [&](const auto& a, const auto& b) {
        const double la = way(graph, a);
        const double lb = way(graph, b);
        return la != lb ? la < lb : a < b;
      });
      double thickness = 0;
      for (const auto& path : {paths[0], paths[1]})
        for (std::size_t k = 1; k + 1 < path.size(); ++k)
          thickness = std::max(thickness, node(graph, path[k]).diameter_mm);
      thickness = std::max(thickness, std::min(thickness_at(graph, i), thickness_at(graph, end)));
      if (way(graph, paths[0]) + way(graph, paths[1]) >= std::numbers::pi * thickness) continue;
      std::vector<int> all = paths[0];
      all.insert(all.end(), paths[1].begin(), paths[1].end());
      std::sort(all.begin(), all.end());
      all.erase(std::unique(all.begin(), all.end()), all.end());
      merge(graph, i, all);
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<int> LevelGraph::alive() const {
  std::vector<int> list;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (!nodes[i].gone) list.push_back(static_cast<int>(i));
  return list;
}

bool LevelGraph::has_junction() const {
  return std::any_of(nodes.begin(), nodes.end(), [](const LevelNode& n) { return !n.gone && n.beside.size() > 2; });
}

bool LevelGraph::is_ring() const {
  const std::vector<int> left = alive();
  return left.size() > 2 && std::all_of(left.begin(), left.end(), [&](int i) { return degree(i) == 2; });
}

std::vector<int> LevelGraph::arc(int junction, int next) const {
  std::vector<int> path{junction, next};
  while (degree(path.back()) == 2 && path.back() != junction) {
    const auto& beside = nodes[static_cast<std::size_t>(path.back())].beside;
    const int before = path[path.size() - 2];
    path.push_back(*beside.begin() == before ? *beside.rbegin() : *beside.begin());
  }
  return path;
}

LevelGraph make_level_graph(const VoxelBody& body, const Links& links, const LimbPiece& piece,
                            const std::vector<float>& level) {
  // Wider than the longest step, so that no link skips a level set.
  const double bin = std::max(2 * body.voxel_mm, 0.25 * piece.diameter_mm);
  const auto bin_of = [&](std::int32_t s) {
    return static_cast<int>(static_cast<double>(level[static_cast<std::size_t>(s)]) / bin);
  };
  LevelGraph graph;
  std::vector<int> owner(body.count(), -1);
  std::vector<std::int32_t> stack;
  for (const std::int32_t first : piece.samples) {
    if (level[static_cast<std::size_t>(first)] < 0 || owner[static_cast<std::size_t>(first)] >= 0) continue;
    const int id = static_cast<int>(graph.nodes.size());
    graph.nodes.emplace_back();
    owner[static_cast<std::size_t>(first)] = id;
    stack.push_back(first);
    while (!stack.empty()) {
      const std::int32_t s = stack.back();
      stack.pop_back();
      node(graph, id).samples.push_back(s);
      for (int d = 0; d < VoxelBody::directions; ++d) {
        if ((links[static_cast<std::size_t>(s)] >> static_cast<unsigned>(d) & 1U) == 0) continue;
        const std::int32_t n = body.neighbour(s, d);
        if (level[static_cast<std::size_t>(n)] < 0 || bin_of(n) != bin_of(first) ||
            owner[static_cast<std::size_t>(n)] >= 0)
          continue;
        owner[static_cast<std::size_t>(n)] = id;
        stack.push_back(n);
      }
    }
  }
  for (const std::int32_t s : piece.samples) {
    const int id = owner[static_cast<std::size_t>(s)];
    if (id < 0) continue;
    for (int d = 0; d < VoxelBody::directions; ++d) {
      if ((links[static_cast<std::size_t>(s)] >> static_cast<unsigned>(d) & 1U) == 0) continue;
      const int other = owner[static_cast<std::size_t>(body.neighbour(s, d))];
      if (other >= 0 && other != id) node(graph, id).beside.insert(other);
    }
  }
  for (const auto& face : piece.faces)
    for (const std::int32_t s : face)
      if (const int id = owner[static_cast<std::size_t>(s)]; id >= 0) node(graph, id).cut = true;
  const double sample_mm3 = body.voxel_mm * body.voxel_mm * body.voxel_mm;
  for (LevelNode& n : graph.nodes) {
    for (const std::int32_t s : n.samples) {
      n.centroid = n.centroid + body.position(s);
      n.level_mm += static_cast<double>(level[static_cast<std::size_t>(s)]);
    }
    const auto count = static_cast<double>(n.samples.size());
    n.centroid = n.centroid / count;
    n.level_mm /= count;
    n.diameter_mm = 2 * std::sqrt(count * sample_mm3 / bin / std::numbers::pi);
  }
  while (merge_short_branch(graph, bin) || merge_small_hole(graph)) {
  }
  return graph;
}

std::int32_t farthest(const std::vector<std::int32_t>& samples, const std::vector<float>& distance) {
  std::int32_t best = samples.front();
  for (const std::int32_t s : samples)
    if (distance[static_cast<std::size_t>(s)] > distance[static_cast<std::size_t>(best)]) best = s;
  return best;
}

Tips sweep_tips(const VoxelBody& body, const Links& links, const std::vector<std::int32_t>& samples) {
  // The sample nearest to the centroid: a start that turns with the model.
  Vec3d centre{};
  for (const std::int32_t s : samples) centre = centre + body.position(s);
  centre = centre / static_cast<double>(samples.size());
  std::int32_t start = samples.front();
  for (const std::int32_t s : samples)
    if (norm(body.position(s) - centre) < norm(body.position(start) - centre)) start = s;
  const auto from = [&](std::int32_t s) { return geodesic(body, links, {s}, std::numeric_limits<double>::infinity()); };
  Tips tips;
  tips.from_first = from(farthest(samples, from(start)));
  tips.from_second = from(farthest(samples, tips.from_first));
  return tips;
}

LevelGraph level_graph_of(const VoxelBody& body, const Links& links, const LimbPiece& piece) {
  std::vector<std::int32_t> cuts;
  for (const auto& face : piece.faces) cuts.insert(cuts.end(), face.begin(), face.end());
  return make_level_graph(body, links, piece,
                          cuts.empty() ? sweep_tips(body, links, piece.samples).from_first
                                       : geodesic(body, links, cuts, std::numeric_limits<double>::infinity()));
}

}  // namespace fibrolite
