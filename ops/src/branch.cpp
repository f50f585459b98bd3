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

// Point at a way along a line of points, straight on past its end.
Vec3d point_along(const std::vector<Vec3d>& line, double way) {
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const double step = norm(line[i + 1] - line[i]);
    if (way <= step || i + 2 == line.size()) return line[i] + way * normalized(line[i + 1] - line[i]);
    way -= step;
  }
  return line.front();
}

// By level sets: from a place just clear of the junction to one farther out.
Vec3d rough_direction(const std::vector<Vec3d>& line, double diameter) {
  const Vec3d junction = line.front();
  Vec3d near = junction;
  Vec3d far = junction;
  for (const Vec3d& at : line) {
    if (norm(at - junction) < 0.8 * diameter) near = at;
    far = at;
    if (norm(at - junction) > 2.5 * diameter) break;
  }
  return normalized(norm(far - near) > 0.3 * diameter ? far - near : far - junction);
}

// Sections of a branch past the fork, across it. Where it ends, or runs on into something wide, there is none.
struct Sections {
  std::vector<double> area_mm2;  ///< Infinite where there is none.
  std::vector<Vec3d> centroid;
  std::vector<double> way_mm;
  /// Of the branch itself, without the fork.
  [[nodiscard]] double usual_mm2() const {
    std::vector<double> sorted = area_mm2;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 3];
  }
};
Sections sections(const VoxelBody& body, const std::vector<Vec3d>& line, double diameter, Vec3d along) {
  constexpr double first_diameters = 0.2;
  constexpr double last_diameters = 2.5;
  constexpr double step_diameters = 0.1;
  Sections all;
  for (double way = first_diameters; way < last_diameters; way += step_diameters) {
    const Vec3d at = point_along(line, way * diameter);
    if (body.distance_at(at) >= 0) break;
    const auto s = section(body, {frame_along(at, -along)}, 0.65 * diameter);
    all.way_mm.push_back(way * diameter);
    all.area_mm2.push_back(s ? s->area_mm2 : std::numeric_limits<double>::infinity());
    all.centroid.push_back(s ? s->frame.origin : at);
  }
  return all;
}

// The direction of a branch. Level sets pass a fork and a tip aslant, and their centroids with them: by up to 5
// degrees, another way in each position of the model. What counts are the centroids of clean sections across it.
Vec3d outward(const VoxelBody& body, const std::vector<Vec3d>& line, double diameter) {
  constexpr int rounds = 3;
  constexpr double clean = 1.1;
  Vec3d along = rough_direction(line, diameter);
  for (int round = 0; round < rounds; ++round) {
    const Sections all = sections(body, line, diameter, along);
    if (all.way_mm.empty()) return along;
    const double usual = all.usual_mm2();
    std::vector<Vec3d> kept;
    for (std::size_t i = 0; i < all.centroid.size(); ++i)
      if (all.area_mm2[i] < clean * usual && all.area_mm2[i] > usual / clean) kept.push_back(all.centroid[i]);
    if (kept.empty() || norm(kept.back() - kept.front()) < 0.3 * diameter) return along;
    along = normalized(kept.back() - kept.front());
  }
  return along;
}

/// An arc of the graph, from its junction outward.
struct Branch {
  std::vector<Vec3d> line;  ///< Centroids of its level sets, the junction's first.
  double diameter_mm = 0;
  Vec3d along{};
};

Branch branch_of(const VoxelBody& body, const LevelGraph& graph, const std::vector<int>& arc) {
  Branch branch;
  for (const int i : arc) branch.line.push_back(graph.nodes[static_cast<std::size_t>(i)].centroid);
  branch.diameter_mm = arc_diameter(graph, arc);
  branch.along = outward(body, branch.line, branch.diameter_mm);
  return branch;
}

// Which stay with the junction: two that run straight on into each other, else the thickest.
std::vector<std::size_t> keepers(const std::vector<Branch>& branches) {
  constexpr double straight_on = -0.85;  // cosine between the outward directions
  constexpr double alike = 1.5;
  double best = straight_on;
  std::vector<std::size_t> kept;
  for (std::size_t a = 0; a < branches.size(); ++a) {
    for (std::size_t b = a + 1; b < branches.size(); ++b) {
      const auto [thinner, thicker] = std::minmax(branches[a].diameter_mm, branches[b].diameter_mm);
      const double cosine = dot(branches[a].along, branches[b].along);
      if (thicker > alike * thinner || cosine >= best) continue;
      best = cosine;
      kept = {a, b};
    }
  }
  if (kept.empty()) {
    const auto thickest = std::ranges::max_element(branches, {}, &Branch::diameter_mm);
    kept = {static_cast<std::size_t>(thickest - branches.begin())};
  }
  return kept;
}

// The first clean section of a branch past the fork: no larger than the branch is farther out.
std::optional<Split> cut_off(const VoxelBody& body, const Branch& branch) {
  const Sections all = sections(body, branch.line, branch.diameter_mm, branch.along);
  if (all.way_mm.empty()) return std::nullopt;
  const double usual = all.usual_mm2();
  for (std::size_t i = 0; i < all.way_mm.size(); ++i) {
    if (all.area_mm2[i] > 1.15 * usual) continue;
    const Vec3d at = point_along(branch.line, all.way_mm[i]);
    if (auto cut = cleanest_section(body, at, -branch.along, 0.65 * branch.diameter_mm, at - branch.line.front()))
      return cut;
  }
  return std::nullopt;
}

}  // namespace

std::vector<Split> branch_cuts(const VoxelBody& body, const Links& links, const LimbPiece& piece) {
  const LevelGraph graph = level_graph_of(body, links, piece);
  std::vector<Split> cuts;
  for (const int junction : graph.alive()) {
    if (graph.degree(junction) < 3) continue;
    std::vector<Branch> branches;
    for (const int next : graph.nodes[static_cast<std::size_t>(junction)].beside)
      branches.push_back(branch_of(body, graph, graph.arc(junction, next)));
    const std::vector<std::size_t> kept = keepers(branches);
    for (std::size_t b = 0; b < branches.size(); ++b) {
      if (std::find(kept.begin(), kept.end(), b) != kept.end()) continue;
      if (auto cut = cut_off(body, branches[b])) cuts.push_back(std::move(*cut));
    }
  }
  return cuts;
}

}  // namespace fibrolite
