// SPDX-License-Identifier: GPL-3.0-or-later
#include "limb.h"

#include <Eigen/Eigenvalues>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "centre_line.h"
#include "level_graph.h"

namespace fibrolite {
namespace {

constexpr double anywhere = std::numeric_limits<double>::infinity();

double largest(const std::vector<std::int32_t>& samples, const std::vector<float>& distance) {
  return static_cast<double>(distance[static_cast<std::size_t>(farthest(samples, distance))]);
}

// All samples of a piece within `depth` of the farthest one: a tip as a whole, be it round or flat.
std::vector<std::int32_t> far_end(const std::vector<std::int32_t>& samples, const std::vector<float>& distance,
                                  double depth) {
  const double limit = largest(samples, distance) - depth;
  std::vector<std::int32_t> end;
  for (const std::int32_t s : samples)
    if (static_cast<double>(distance[static_cast<std::size_t>(s)]) >= limit) end.push_back(s);
  return end;
}

// Potential 0 on `zero`, 1 on `one`, harmonic between: its level sets stand square on the walls, so they cut a limb
// across.
std::vector<double> harmonic(const VoxelBody& body, const Links& links, const std::vector<std::int32_t>& samples,
                             const std::vector<std::int32_t>& zero, const std::vector<std::int32_t>& one) {
  std::vector<double> u(body.count(), -1);
  for (const std::int32_t s : one) u[static_cast<std::size_t>(s)] = 1;
  for (const std::int32_t s : zero) u[static_cast<std::size_t>(s)] = 0;
  std::vector<int> row(body.count(), -1);
  std::vector<std::int32_t> unknowns;
  for (const std::int32_t s : samples) {
    if (u[static_cast<std::size_t>(s)] >= 0) continue;
    row[static_cast<std::size_t>(s)] = static_cast<int>(unknowns.size());
    unknowns.push_back(s);
  }
  if (unknowns.empty()) return u;
  const auto n = static_cast<Eigen::Index>(unknowns.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(unknowns.size() * 27);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::int32_t s = unknowns[static_cast<std::size_t>(r)];
    double diagonal = 0;
    for (int d = 0; d < VoxelBody::directions; ++d) {
      if ((links[static_cast<std::size_t>(s)] >> static_cast<unsigned>(d) & 1U) == 0) continue;
      const auto other = static_cast<std::size_t>(body.neighbour(s, d));
      const double length = static_cast<double>(body.length_mm[static_cast<std::size_t>(d)]) / body.voxel_mm;
      const double weight = 1 / (length * length);
      diagonal += weight;
      if (row[other] >= 0) {
        entries.emplace_back(static_cast<int>(r), row[other], -weight);
      } else {
        right[r] += weight * std::max(u[other], 0.0);
      }
    }
    entries.emplace_back(static_cast<int>(r), static_cast<int>(r), std::max(diagonal, 1e-12));
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  // Centroids of level sets need no more than three digits.
  solver.setTolerance(1e-5);
  solver.setMaxIterations(2000);
  solver.compute(matrix);
  const Eigen::VectorXd solution = solver.solve(right);
  for (Eigen::Index r = 0; r < n; ++r) u[static_cast<std::size_t>(unknowns[static_cast<std::size_t>(r)])] = solution[r];
  return u;
}

struct Ends {
  std::vector<std::int32_t> first, second;
  bool first_is_cut = false, second_is_cut = false;
};

// The cut of the piece that touches a node, -1 if none does.
int cut_at(const LevelNode& node, const LimbPiece& piece) {
  for (std::size_t f = 0; f < piece.faces.size(); ++f)
    for (const std::int32_t s : node.samples)
      if (std::binary_search(piece.faces[f].begin(), piece.faces[f].end(), s)) return static_cast<int>(f);
  return -1;
}

// Where the centre line starts and ends. A cut in the middle of a limb (a branch was taken off there) is not an end.
Ends find_ends(const VoxelBody& body, const Links& links, const LimbPiece& piece, const LevelGraph& graph) {
  const double depth = std::max(1.5 * body.voxel_mm, 0.15 * piece.diameter_mm);
  std::vector<int> at_end;
  for (const int i : graph.alive())
    if (graph.degree(i) <= 1) at_end.push_back(i);
  std::vector<int> cuts;
  int tips = 0;
  for (const int i : at_end) {
    const int cut = cut_at(graph.nodes[static_cast<std::size_t>(i)], piece);
    if (cut >= 0) {
      cuts.push_back(cut);
    } else {
      ++tips;
    }
  }
  Ends ends;
  if (!cuts.empty()) {
    ends.first = piece.faces[static_cast<std::size_t>(cuts[0])];
    ends.first_is_cut = true;
    if (cuts.size() > 1) {
      ends.second = piece.faces[static_cast<std::size_t>(cuts[1])];
      ends.second_is_cut = true;
      // The line runs from the larger cut to the smaller one.
      if (ends.second.size() > ends.first.size()) std::swap(ends.first, ends.second);
    } else {
      ends.second = far_end(piece.samples, geodesic(body, links, ends.first, anywhere), depth);
    }
    return ends;
  }
  const Tips sweep = sweep_tips(body, links, piece.samples);
  ends.first = far_end(piece.samples, sweep.from_second, depth);
  ends.second = far_end(piece.samples, sweep.from_first, depth);
  return ends;
}

// The farthest samples of a flat tip lie at its rim, and a potential held there leans. Seen along the centre line the
// tip is all that lies farthest ahead.
void square_tips(const VoxelBody& body, const std::vector<std::int32_t>& samples, const CentreLine& line, Ends& ends) {
  const std::vector<Vec3d>& p = line.points;
  const std::size_t tail = p.size() / 3 + 1;
  const auto cap = [&](Vec3d end, Vec3d outward, std::vector<std::int32_t>& set) {
    // Only what is nearer to this end of the line than to its rest: a limb may bend back beside its own tip.
    const double reach = line.width_mm;
    double farthest = -anywhere;
    std::vector<std::pair<double, std::int32_t>> ahead;
    for (const std::int32_t s : samples) {
      const Vec3d gap = body.position(s) - end;
      const double along = dot(gap, outward);
      if (norm(gap - along * outward) > reach || along < -line.width_mm) continue;
      ahead.emplace_back(along, s);
      farthest = std::max(farthest, along);
    }
    std::vector<std::int32_t> found;
    for (const auto& [along, s] : ahead)
      if (along >= farthest - 1.25 * body.voxel_mm) found.push_back(s);
    if (!found.empty()) set = std::move(found);
  };
  if (!ends.first_is_cut) cap(p.front(), normalized(p.front() - p[tail]), ends.first);
  if (!ends.second_is_cut) cap(p.back(), normalized(p.back() - p[p.size() - 1 - tail]), ends.second);
}

Ends ring_ends(const VoxelBody& body, const LevelGraph& graph, Links& links) {
  const std::vector<int> around = graph.alive();
  int thinnest = around.front();
  for (const int i : around)
    if (graph.nodes[static_cast<std::size_t>(i)].diameter_mm <
        graph.nodes[static_cast<std::size_t>(thinnest)].diameter_mm)
      thinnest = i;
  const LevelNode& node = graph.nodes[static_cast<std::size_t>(thinnest)];
  const Vec3d along = graph.nodes[static_cast<std::size_t>(*node.beside.rbegin())].centroid -
                      graph.nodes[static_cast<std::size_t>(*node.beside.begin())].centroid;
  Vec3d middle{};
  for (const int i : around) middle = middle + graph.nodes[static_cast<std::size_t>(i)].centroid;
  middle = middle / static_cast<double>(around.size());
  const auto cut = cleanest_section(body, node.centroid, along, 0.65 * node.diameter_mm, node.centroid - middle);
  if (!cut) return {};
  Severed sides = sever(body, *cut, links);
  return {std::move(sides.far), std::move(sides.near), false, false};
}

std::vector<std::int32_t> by_value(const std::vector<std::int32_t>& samples, const std::vector<double>& value) {
  std::vector<std::int32_t> order = samples;
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    const double va = value[static_cast<std::size_t>(a)];
    const double vb = value[static_cast<std::size_t>(b)];
    return va != vb ? va < vb : a < b;
  });
  return order;
}

}  // namespace

double LimbShape::slenderness() const { return width_mm > 0 ? length_mm / width_mm - 0.5 * free_ends : 0; }

Axis principal_axis(const VoxelBody& body, const std::vector<std::int32_t>& samples) {
  Vec3d centre{};
  for (const std::int32_t s : samples) centre = centre + body.position(s);
  centre = centre / static_cast<double>(samples.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const std::int32_t s : samples) {
    const Vec3d gap = body.position(s) - centre;
    const Eigen::Vector3d g(gap.x, gap.y, gap.z);
    spread += g * g.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Eigen::Vector3d v = solver.eigenvectors().col(2);
  Vec3d along = normalized({v.x(), v.y(), v.z()});
  if (along == Vec3d{}) along = {0, 0, 1};
  double low = 0;
  double high = 0;
  double skew = 0;
  for (const std::int32_t s : samples) {
    const double t = dot(body.position(s) - centre, along);
    low = std::min(low, t);
    high = std::max(high, t);
    skew += t * t * t;
  }
  low -= 0.5 * body.voxel_mm;
  high += 0.5 * body.voxel_mm;
  // An eigenvector has no sign of its own: the heavier end is the start.
  if (skew < 0) return Axis::straight(centre + high * along, centre + low * along);
  return Axis::straight(centre + low * along, centre + high * along);
}

LimbShape limb_shape(const VoxelBody& body, const Links& links, const LimbPiece& piece, double least_slenderness,
                     const Context& context) {
  context.check();
  const LevelGraph graph = level_graph_of(body, links, piece);
  Links open = links;
  Ends ends;
  LimbShape shape;
  if (graph.is_ring()) {
    ends = ring_ends(body, graph, open);
    shape.ring = !ends.first.empty() && !ends.second.empty();
  }
  if (!shape.ring) ends = find_ends(body, links, piece, graph);
  shape.free_ends = shape.ring ? 0 : (ends.first_is_cut ? 0 : 1) + (ends.second_is_cut ? 0 : 1);
  const std::vector<float> way = geodesic(body, open, ends.first, anywhere);
  const double way_mm = largest(piece.samples, way);
  CentreLine line;
  const auto follow = [&](const std::vector<double>& value) {
    line = centre_line(body, by_value(piece.samples, value), way_mm, shape.ring, ends.first_is_cut, ends.second_is_cut);
    shape.length_mm = line.length_mm;
    shape.width_mm = line.width_mm;
    shape.axis = line.points.size() >= 2 ? Axis::along(line.points) : principal_axis(body, piece.samples);
  };
  follow({way.begin(), way.end()});
  // A stout piece is known as one by the geodesic alone; the harmonic potential costs most in just these.
  if (line.points.size() < 2 || shape.slenderness() < 0.6 * least_slenderness) return shape;
  if (!shape.ring) square_tips(body, piece.samples, line, ends);
  follow(harmonic(body, open, piece.samples, ends.first, ends.second));
  return shape;
}

QuickShape quick_shape(const VoxelBody& body, const Links& links, const LimbPiece& piece) {
  const std::vector<float> way = geodesic(body, links, piece.faces.front(), anywhere);
  const std::vector<double> value(way.begin(), way.end());
  const bool other_cut = piece.faces.size() > 1;
  const CentreLine line =
      centre_line(body, by_value(piece.samples, value), largest(piece.samples, way), false, true, other_cut);
  if (line.width_mm <= 0) return {};
  return {line.length_mm / line.width_mm - (other_cut ? 0 : 0.5), line.width_mm};
}

}  // namespace fibrolite
