// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>

#include "level_graph.h"
#include "limb.h"

namespace fibrolite {
namespace {

double arc_diameter(const LevelGraph& graph, const std::vector<int>& arc) {
  std::vector<double> d;
  for (std::size_t i = 1; i < arc.size(); ++i) d.push_back(graph.nodes[static_cast<std::size_t>(arc[i])].diameter_mm);
  std::nth_element(d.begin(), d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2), d.end());
  return d[d.size() / 2];
}

// The direction of a branch: from a place just clear of the junction to one farther out. The junction's own centroid
// says little: level sets pass it aslant.
Vec3d outward(const LevelGraph& graph, const std::vector<int>& arc) {
  const double diameter = arc_diameter(graph, arc);
  const Vec3d junction = graph.nodes[static_cast<std::size_t>(arc.front())].centroid;
  Vec3d near = junction;
  Vec3d far = junction;
  for (std::size_t i = 1; i < arc.size(); ++i) {
    const Vec3d at = graph.nodes[static_cast<std::size_t>(arc[i])].centroid;
    if (norm(at - junction) < 0.8 * diameter) near = at;
    far = at;
    if (norm(at - junction) > 2.5 * diameter) break;
  }
  return normalized(norm(far - near) > 0.3 * diameter ? far - near : far - junction);
}

// Arcs that stay with the junction: two that run straight on into each other, else the thickest.
std::vector<std::size_t> keepers(const std::vector<Vec3d>& direction, const std::vector<double>& diameter) {
  constexpr double straight_on = -0.85;  // cosine between the outward directions
  constexpr double alike = 1.5;
  double best = straight_on;
  std::vector<std::size_t> kept;
  for (std::size_t a = 0; a < direction.size(); ++a) {
    for (std::size_t b = a + 1; b < direction.size(); ++b) {
      const double ratio = std::max(diameter[a], diameter[b]) / std::min(diameter[a], diameter[b]);
      if (ratio > alike || dot(direction[a], direction[b]) >= best) continue;
      best = dot(direction[a], direction[b]);
      kept = {a, b};
    }
  }
  if (kept.empty()) {
    const auto thickest = std::max_element(diameter.begin(), diameter.end());
    kept = {static_cast<std::size_t>(thickest - diameter.begin())};
  }
  return kept;
}

// Point at a way along a line of points, straight on past its end.
Vec3d point_along(const std::vector<Vec3d>& line, double way) {
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const double step = norm(line[i + 1] - line[i]);
    if (way <= step || i + 2 == line.size()) return line[i] + way * normalized(line[i + 1] - line[i]);
    way -= step;
  }
  return line.front();
}

// The first clean section of a branch past the fork: no larger than the branch is farther out.
std::optional<Split> cut_off(const VoxelBody& body, const LevelGraph& graph, const std::vector<int>& arc) {
  constexpr double first_diameters = 0.2;
  constexpr double last_diameters = 2.5;
  constexpr double step_diameters = 0.1;
  std::vector<Vec3d> line;
  for (const int i : arc) line.push_back(graph.nodes[static_cast<std::size_t>(i)].centroid);
  const double diameter = arc_diameter(graph, arc);
  const Vec3d along = outward(graph, arc);
  std::vector<double> areas;
  std::vector<double> ways;
  for (double way = first_diameters; way < last_diameters; way += step_diameters) {
    const Vec3d at = point_along(line, way * diameter);
    if (body.distance_at(at) >= 0) break;
    Frame frame = frame_along(at, -along);
    const auto s = section(body, {frame}, 0.65 * diameter);
    ways.push_back(way);
    areas.push_back(s ? s->area_mm2 : std::numeric_limits<double>::infinity());
  }
  if (areas.empty()) return std::nullopt;
  std::vector<double> sorted = areas;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted[sorted.size() / 3];
  for (std::size_t i = 0; i < areas.size(); ++i) {
    if (areas[i] > 1.15 * usual) continue;
    const Vec3d at = point_along(line, ways[i] * diameter);
    if (auto cut = cleanest_section(body, at, -along, 0.65 * diameter, at - line.front())) return cut;
  }
  return std::nullopt;
}

}  // namespace

std::vector<Split> branch_cuts(const VoxelBody& body, const Links& links, const LimbPiece& piece) {
  const LevelGraph graph = level_graph_of(body, links, piece);
  std::vector<Split> cuts;
  for (const int junction : graph.alive()) {
    if (graph.degree(junction) < 3) continue;
    std::vector<std::vector<int>> arcs;
    std::vector<Vec3d> direction;
    std::vector<double> diameter;
    for (const int next : graph.nodes[static_cast<std::size_t>(junction)].beside) {
      arcs.push_back(graph.arc(junction, next));
      direction.push_back(outward(graph, arcs.back()));
      diameter.push_back(arc_diameter(graph, arcs.back()));
    }
    const std::vector<std::size_t> kept = keepers(direction, diameter);
    for (std::size_t a = 0; a < arcs.size(); ++a) {
      if (std::find(kept.begin(), kept.end(), a) != kept.end()) continue;
      if (auto cut = cut_off(body, graph, arcs[a])) cuts.push_back(std::move(*cut));
    }
  }
  return cuts;
}

}  // namespace fibrolite
