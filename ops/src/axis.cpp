// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/partition.h"

namespace fibrolite {

struct Axis::Impl {
  std::vector<Vec3d> points;    // evenly spaced
  std::vector<Vec3d> tangents;  // unit, one per point
  double length_mm = 0;
  Vec3d mean{0, 0, 1};
};

namespace {

constexpr int max_points = 512;

std::vector<Vec3d> without_repeats(const std::vector<Vec3d>& points) {
  std::vector<Vec3d> kept;
  for (const Vec3d p : points)
    if (kept.empty() || norm(p - kept.back()) > 0) kept.push_back(p);
  if (kept.size() < 2) {
    throw Error(Code::BadInput, "an axis needs two different points", "axis", "give a line with a length above zero");
  }
  return kept;
}

std::vector<Vec3d> evenly_spaced(const std::vector<Vec3d>& points, double length) {
  if (points.size() == 2) return points;
  // The densest stretch decides, within reason: a coarser spacing would cut its corners.
  double shortest = length;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) shortest = std::min(shortest, norm(points[i + 1] - points[i]));
  const int pieces = static_cast<int>(std::clamp(std::ceil(length / shortest), static_cast<double>(points.size() - 1),
                                                 static_cast<double>(max_points)));
  std::vector<Vec3d> even{points.front()};
  std::size_t segment = 0;
  double before = 0;
  for (int i = 1; i < pieces; ++i) {
    const double wanted = length * i / pieces;
    double step = norm(points[segment + 1] - points[segment]);
    while (before + step < wanted && segment + 2 < points.size()) {
      before += step;
      ++segment;
      step = norm(points[segment + 1] - points[segment]);
    }
    const double t = std::clamp((wanted - before) / step, 0.0, 1.0);
    even.push_back((1 - t) * points[segment] + t * points[segment + 1]);
  }
  even.push_back(points.back());
  return even;
}

std::vector<Vec3d> unit_tangents(const std::vector<Vec3d>& p) {
  std::vector<Vec3d> t(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1;
    const std::size_t after = std::min(i + 1, p.size() - 1);
    t[i] = normalized(p[after] - p[before]);
    if (t[i] == Vec3d{}) t[i] = normalized(p[after] - p[i]);
  }
  return t;
}

}  // namespace

Axis::Axis() : Axis(straight({0, 0, 0}, {0, 0, 1})) {}
Axis::Axis(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Axis Axis::straight(Vec3d from, Vec3d to) { return along({from, to}); }

Axis Axis::along(const std::vector<Vec3d>& points) {
  const std::vector<Vec3d> line = without_repeats(points);
  double given = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) given += norm(line[i + 1] - line[i]);
  auto impl = std::make_shared<Impl>();
  impl->points = evenly_spaced(line, given);
  impl->tangents = unit_tangents(impl->points);
  for (std::size_t i = 0; i + 1 < impl->points.size(); ++i)
    impl->length_mm += norm(impl->points[i + 1] - impl->points[i]);
  const Vec3d chord = impl->points.back() - impl->points.front();
  // A closed line has no mean direction: its middle speaks for it, so that the answer is always a unit vector.
  impl->mean = norm(chord) > 0.05 * impl->length_mm ? normalized(chord) : impl->tangents[impl->tangents.size() / 2];
  return Axis(std::move(impl));
}

Vec3d Axis::tangent(Vec3d p) const {
  const std::vector<Vec3d>& points = impl_->points;
  double best = std::numeric_limits<double>::infinity();
  std::size_t segment = 0;
  double along = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Vec3d edge = points[i + 1] - points[i];
    const double t = std::clamp(dot(p - points[i], edge) / dot(edge, edge), 0.0, 1.0);
    const Vec3d gap = p - (points[i] + t * edge);
    const double distance2 = dot(gap, gap);
    if (distance2 < best) {
      best = distance2;
      segment = i;
      along = t;
    }
  }
  const Vec3d blend = (1 - along) * impl_->tangents[segment] + along * impl_->tangents[segment + 1];
  return norm(blend) > 0 ? normalized(blend) : impl_->tangents[segment];
}

const std::vector<Vec3d>& Axis::centre_line() const { return impl_->points; }
double Axis::length_mm() const { return impl_->length_mm; }
Vec3d Axis::mean() const { return impl_->mean; }

}  // namespace fibrolite
