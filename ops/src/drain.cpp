// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/drain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "fibrolite/error.h"
#include "fibrolite/frame.h"
#include "fibrolite/pieces.h"
#include "print_scan.h"

namespace fibrolite {
namespace {

/// Where a wall of a void could be drilled through.
struct Candidate {
  int from = 0, to = 0;  // as VoidMap::at()
  Vec3d foot_mm{}, out{};
  double length_mm = 0, score = std::numeric_limits<double>::infinity();
};

class Driller {
 public:
  Driller(const Solid& solid, const VoidMap& voids, const DrainParams& params)
      : solid_(solid), voids_(voids), params_(params), h_(solid.grid().voxel_mm), up_(normalized(params.up)) {
    const Box3d box = solid.bounds_mm();
    for (int corner = 0; corner < 8; ++corner) {
      const double at = dot(up_, {(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                                  (corner & 4) != 0 ? box.max.z : box.min.z});
      low_ = std::min(low_, at);
      high_ = std::max(high_, at);
    }
  }

  /// The wall behind a spot: which voids it parts, and how good a place it is.
  [[nodiscard]] Candidate candidate(const Spot& spot) const {
    Candidate c{.foot_mm = spot.foot_mm, .out = -spot.normal, .length_mm = spot.mm};
    c.from = at(spot.foot_mm + h_ * spot.normal);
    c.to = at(spot.foot_mm - (spot.mm + h_) * spot.normal);
    if (c.from <= 0 || c.to < 0 || c.from == c.to) return c;
    const double r = radius(c.to);
    const Vec3d mouth = c.foot_mm + c.length_mm * c.out;
    c.score = height(mouth) + clutter(c.foot_mm - r * c.out, r) + 0.25 * c.length_mm / params_.reach_mm;
    if (c.to == VoidMap::outside) {
      c.score += unevenness(mouth, c.out, r) + 0.25 * (1 + dot(c.out, up_));
    } else {
      c.score += clutter(mouth + r * c.out, r);
    }
    return c;
  }
  /// From a point in a void straight down to the outside.
  [[nodiscard]] Candidate plumb(int from, Vec3d start) const {
    double length = h_;
    while (at(start - length * up_) != VoidMap::outside) length += 0.5 * h_;
    return {from, VoidMap::outside, start, -up_, length, 0};
  }
  [[nodiscard]] Drain drain(const Candidate& c) const {
    // Half a voxel and more beyond both faces, so that a sample of either void lies in the hole.
    const Vec3d mouth = c.foot_mm + c.length_mm * c.out;
    return {mouth,
            c.out,
            c.length_mm,
            c.to == VoidMap::outside,
            {c.foot_mm - h_ * c.out, mouth + h_ * c.out, radius(c.to)}};
  }
  [[nodiscard]] double height(Vec3d p) const { return (dot(p, up_) - low_) / std::max(high_ - low_, h_); }

 private:
  /// Of a hole into this void.
  [[nodiscard]] double radius(int to) const {
    return to == VoidMap::outside ? 0.5 * params_.hole_mm : std::max(0.25 * params_.hole_mm, h_);
  }
  [[nodiscard]] int at(Vec3d p) const {
    const auto near = [&](double v) { return static_cast<int>(std::lround(v / h_)); };
    return voids_.at({near(p.x), near(p.y), near(p.z)});
  }
  /// 0: a ball of the hole's size fits into the void there, so that the hole cuts nothing but its wall.
  [[nodiscard]] double clutter(Vec3d p, double radius) const {
    const double seen = std::min(radius, (solid_.grid().band_vox - 0.5) * h_);
    return 1 - std::clamp(solid_.distance(p) / seen, 0.0, 1.0);
  }
  /// Largest distance of the surface from its tangent plane round the mouth, in radii.
  [[nodiscard]] double unevenness(Vec3d mouth, Vec3d out, double radius) const {
    const Frame frame = frame_along(mouth, out);
    double most = 0;
    for (int k = 0; k < 8; ++k) {
      const double angle = k * std::numbers::pi / 4;
      const Vec3d p = mouth + radius * (std::cos(angle) * frame.x + std::sin(angle) * frame.y);
      most = std::max(most, std::abs(1.0 * solid_.distance(p)));
    }
    return most / radius;
  }

  const Solid& solid_;
  const VoidMap& voids_;
  const DrainParams& params_;
  double h_;
  Vec3d up_;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -low_;
};

}  // namespace

std::vector<Capsule> shapes(const std::vector<Drain>& drains) {
  std::vector<Capsule> list;
  for (const Drain& drain : drains) list.push_back(drain.shape);
  return list;
}

std::vector<Drain> drains(const Solid& solid, const DrainParams& params, const Context& context) {
  if (!(params.hole_mm >= 2 * solid.grid().voxel_mm * (1 - 1e-9)))
    throw Error(Code::BadRecipe, "a drain hole is at least two voxels wide", "print.drain_mm");
  if (!(params.reach_mm > 0)) throw Error(Code::BadRecipe, "the reach must be above 0", "reach_mm");
  const VoidMap voids(solid, context);
  const std::size_t n = voids.cavities().size() + 1;
  if (n == 1) return {};
  const Driller driller(solid, voids, params);

  // The best place through each wall, and each void's lowest point.
  std::map<std::pair<int, int>, Candidate> walls;
  std::vector<std::optional<Spot>> lowest(n);
  const Scan found = scan(solid, everything(), {.wall_mm = params.reach_mm, .opposed = 0.5}, context);
  for (const Spot& spot : found.walls) {
    const Candidate c = driller.candidate(spot);
    if (!std::isfinite(c.score) || (c.to != VoidMap::outside && c.to < c.from)) continue;
    Candidate& best = walls.try_emplace({c.from, c.to}, c).first->second;
    if (c.score < best.score) best = c;
    std::optional<Spot>& low = lowest[static_cast<std::size_t>(c.from)];
    if (!low || driller.height(spot.foot_mm) < driller.height(low->foot_mm)) low = spot;
  }

  // Voids that share a wall make groups: the least tree of holes between them (Kruskal).
  std::vector<Candidate> inner;
  for (const auto& [pair, c] : walls) {
    if (c.to != VoidMap::outside) inner.push_back(c);
  }
  std::stable_sort(inner.begin(), inner.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  std::vector<std::size_t> group(n);
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
  };
  std::vector<Drain> result;
  for (const Candidate& c : inner) {
    const std::size_t a = root(static_cast<std::size_t>(c.from)), b = root(static_cast<std::size_t>(c.to));
    if (a == b) continue;
    group[std::max(a, b)] = std::min(a, b);
    result.push_back(driller.drain(c));
  }

  // And each group one hole to the outside.
  std::vector<Candidate> outer(n);
  for (const auto& [pair, c] : walls) {
    if (c.to != VoidMap::outside) continue;
    Candidate& best = outer[root(static_cast<std::size_t>(c.from))];
    if (c.score < best.score) best = c;
  }
  for (std::size_t v = 1; v < n; ++v) {
    if (root(v) != v) continue;
    if (!std::isfinite(outer[v].score)) {
      const Vec3d start = lowest[v] ? lowest[v]->foot_mm : voids.cavities()[v - 1].sample_mm;
      outer[v] = driller.plumb(static_cast<int>(v), start);
    }
    result.push_back(driller.drain(outer[v]));
  }
  return result;
}

}  // namespace fibrolite
