// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fibrolite/box.h"
#include "fibrolite/clones.h"

namespace fibrolite {
namespace {

constexpr double max_turn_rad = 0.08;  // between stations; the error of the map is of fourth order in it

std::vector<Vec3d> tangents(const std::vector<Vec3d>& p, bool closed) {
  std::vector<Vec3d> t(p.size());
  for (std::size_t i = 0; i < p.size(); ++i)
    t[i] = normalized(p[std::min(i + 1, p.size() - 1)] - p[i == 0 ? 0 : i - 1]);
  if (closed) {
    t.front() = t.back() = normalized(p[1] - p[p.size() - 2]);
  } else if (p.size() > 2) {
    // One-sided differences at the ends lag half a step behind: mirror the neighbour's tangent in the end's chord
    // instead.
    const auto mirrored = [](Vec3d neighbour, Vec3d chord) {
      const Vec3d c = normalized(chord);
      return normalized(2 * dot(neighbour, c) * c - neighbour);
    };
    t.front() = mirrored(t[1], p[1] - p[0]);
    t.back() = mirrored(t[p.size() - 2], p[p.size() - 1] - p[p.size() - 2]);
  }
  return t;
}

Vec3d reflected(Vec3d a, Vec3d mirror) {
  const double length2 = dot(mirror, mirror);
  return length2 > 0 ? a - (2 * dot(mirror, a) / length2) * mirror : a;
}

std::vector<Frame> rotation_minimising(const std::vector<Vec3d>& p, bool closed) {
  const std::vector<Vec3d> t = tangents(p, closed);
  std::vector<Frame> frames{frame_along(p[0], t[0])};
  for (std::size_t i = 0; i + 1 < p.size(); ++i) {
    const Vec3d step = p[i + 1] - p[i];
    const Vec3d x = reflected(frames[i].x, step), tangent = reflected(t[i], step);
    Vec3d u = reflected(x, t[i + 1] - tangent);
    u = normalized(u - dot(u, t[i + 1]) * t[i + 1]);
    frames.push_back({p[i + 1], u, cross(t[i + 1], u), t[i + 1]});
  }
  return frames;
}

FIBROLITE_CLONES void take_where(const int* __restrict number, int wanted, int count, const float* __restrict from,
                                 float* __restrict to) {
  for (int i = 0; i < count; ++i) to[i] = number[i] == wanted ? from[i] : to[i];
}

}  // namespace

Sweep::Plane::Plane(const Frame& f)
    : cx(static_cast<float>(f.origin.x)),
      cy(static_cast<float>(f.origin.y)),
      cz(static_cast<float>(f.origin.z)),
      tx(static_cast<float>(f.z.x)),
      ty(static_cast<float>(f.z.y)),
      tz(static_cast<float>(f.z.z)),
      ux(static_cast<float>(f.x.x)),
      uy(static_cast<float>(f.x.y)),
      uz(static_cast<float>(f.x.z)),
      vx(static_cast<float>(f.y.x)),
      vy(static_cast<float>(f.y.y)),
      vz(static_cast<float>(f.y.z)) {}

Sweep::Sweep(const Axis& axis) {
  const std::vector<Vec3d>& points = axis.centre_line();
  closed_ = points.size() > 3 && norm(points.front() - points.back()) <= 1e-9 * axis.length_mm();
  line_ = rotation_minimising(points, closed_);
  if (closed_) close();
  arc_mm_.assign(1, 0);
  double turned = 0;
  stations_.push_back({line_[0]});
  for (std::size_t i = 1; i < line_.size(); ++i) {
    arc_mm_.push_back(arc_mm_.back() + norm(line_[i].origin - line_[i - 1].origin));
    turned += norm(line_[i].z - line_[i - 1].z);
    const bool next_too_far = i + 1 < line_.size() && turned + norm(line_[i + 1].z - line_[i].z) > max_turn_rad;
    if (!next_too_far && i + 1 < line_.size()) continue;
    stations_.push_back({line_[i], 0, 0, arc_mm_.back()});
    turned = 0;
  }
  double total_turn = 0;
  for (std::size_t k = 0; k + 1 < stations_.size(); ++k) {
    const Vec3d turn = stations_[k + 1].frame.z - stations_[k].frame.z;
    stations_[k].bend_u = dot(turn, normalized(stations_[k].frame.x + stations_[k + 1].frame.x));
    stations_[k].bend_v = dot(turn, normalized(stations_[k].frame.y + stations_[k + 1].frame.y));
    total_turn += norm(turn);
  }
  if (total_turn < 1e-9) stations_.resize(1);  // straight: one frame serves all of space
  for (std::size_t k = 0; k < stations_.size(); ++k) {
    planes_.emplace_back(stations_[k].frame);
    if (k > 0)
      longest_slab_mm_ = std::max(longest_slab_mm_, norm(stations_[k].frame.origin - stations_[k - 1].frame.origin));
  }
}

/// A frame carried round a ring comes back turned: turned back evenly along the way, every membrane meets itself.
void Sweep::close() {
  const Frame &first = line_.front(), &last = line_.back();
  const double turn = std::atan2(dot(last.x, first.y), dot(last.x, first.x));
  double length = 0, way = 0;
  for (std::size_t i = 1; i < line_.size(); ++i) length += norm(line_[i].origin - line_[i - 1].origin);
  twist_per_mm_ = std::abs(turn) / length;
  for (std::size_t i = 1; i < line_.size(); ++i) {
    Frame& f = line_[i];
    way += norm(f.origin - line_[i - 1].origin);
    const double back = -turn * way / length;
    const Vec3d x = std::cos(back) * f.x + std::sin(back) * f.y;
    f = {f.origin, x, cross(f.z, x), f.z};
  }
}

double Sweep::distance_to_slab(int slab, Vec3d p) const {
  const bool before = slab < 0, after = slab == last();
  const Frame& a = stations_[static_cast<std::size_t>(before ? 0 : slab)].frame;
  const Vec3d d = p - a.origin;
  if (before || after) {  // a ray along the end's tangent
    const double along = before ? std::min(0.0, dot(d, a.z)) : std::max(0.0, dot(d, a.z));
    return norm(d - along * a.z);
  }
  const Vec3d edge = stations_[static_cast<std::size_t>(slab) + 1].frame.origin - a.origin;
  return norm(d - std::clamp(dot(d, edge) / dot(edge, edge), 0.0, 1.0) * edge);
}

bool Sweep::in_slab(int slab, Vec3d p) const {
  const auto height = [&](int k) {
    const Frame& f = stations_[static_cast<std::size_t>(k)].frame;
    return dot(p - f.origin, f.z);
  };
  return (slab < 0 || height(slab) >= 0) && (slab == last() || height(slab + 1) < 0);
}

// The optimizer takes these loops apart only if it knows that answers overlap no points, and asks for no calls inside.
FIBROLITE_CLONES void Sweep::map_straight(const Plane& plane, float from, const float* __restrict x,
                                          const float* __restrict y, const float* __restrict z, int count,
                                          float* __restrict u, float* __restrict v, float* __restrict along) {
  const Plane a = plane;
  for (int i = 0; i < count; ++i) {
    const float dx = x[i] - a.cx, dy = y[i] - a.cy, dz = z[i] - a.cz;
    u[i] = dx * a.ux + dy * a.uy + dz * a.uz;
    v[i] = dx * a.vx + dy * a.vy + dz * a.vz;
    along[i] = from + dx * a.tx + dy * a.ty + dz * a.tz;
  }
}

FIBROLITE_CLONES void Sweep::map_between(const Plane& start, const Plane& end, const Stretch& stretch,
                                         const float* __restrict x, const float* __restrict y,
                                         const float* __restrict z, int count, float* __restrict u, float* __restrict v,
                                         float* __restrict along) {
  const Plane a = start, b = end;
  const Stretch over = stretch;
  for (int i = 0; i < count; ++i) {
    const float dx = x[i] - a.cx, dy = y[i] - a.cy, dz = z[i] - a.cz;
    const float ex = x[i] - b.cx, ey = y[i] - b.cy, ez = z[i] - b.cz;
    const float past = dx * a.tx + dy * a.ty + dz * a.tz, short_of = -(ex * b.tx + ey * b.ty + ez * b.tz);
    // max(0, ...) without a choice, which would make the loop one of branches.
    const float above = 0.5F * (past + std::abs(past)), below = 0.5F * (short_of + std::abs(short_of));
    const float s = above / (above + below + 1e-20F);
    // Each end's frame alone sees the limb bend away, by the sagitta; between them that is (1 - s) * above * bend / 2
    // too much.
    const float sagitta = (1 - s) * above;
    u[i] = (1 - s) * (dx * a.ux + dy * a.uy + dz * a.uz) + s * (ex * b.ux + ey * b.uy + ez * b.uz) -
           sagitta * over.half_bend_u;
    v[i] = (1 - s) * (dx * a.vx + dy * a.vy + dz * a.vz) + s * (ex * b.vx + ey * b.vy + ez * b.vz) -
           sagitta * over.half_bend_v;
    along[i] = over.from_mm + s * over.length_mm;
  }
}

FIBROLITE_CLONES void Sweep::count_passed(const Plane& plane, const float* __restrict x, const float* __restrict y,
                                          const float* __restrict z, int count, int* __restrict passed) {
  const Plane p = plane;
  for (int i = 0; i < count; ++i)
    passed[i] += (x[i] - p.cx) * p.tx + (y[i] - p.cy) * p.ty + (z[i] - p.cz) * p.tz >= 0 ? 1 : 0;
}

void Sweep::map_in_slab(int slab, const float* x, const float* y, const float* z, int count, Places out) const {
  const auto k = static_cast<std::size_t>(std::max(slab, 0));
  const Station& station = stations_[k];
  const auto from = static_cast<float>(station.at_mm);
  std::array<float, PointBlock::capacity> unasked;
  float* along = out.along != nullptr ? out.along : unasked.data();
  if (slab < 0 || slab == last()) return map_straight(planes_[k], from, x, y, z, count, out.u, out.v, along);
  const Stretch stretch{from, static_cast<float>(stations_[k + 1].at_mm) - from,
                        static_cast<float>(0.5 * station.bend_u), static_cast<float>(0.5 * station.bend_v)};
  map_between(planes_[k], planes_[k + 1], stretch, x, y, z, count, out.u, out.v, along);
}

void Sweep::map(const PointBlock& block, float* u, float* v, float* along) const {
  const Places out{u, v, along};
  if (stations_.size() == 1) return map_in_slab(0, block.x, block.y, block.z, block.count, out);
  Box3d box;
  for (int i = 0; i < block.count; ++i) box.include({block.x[i], block.y[i], block.z[i]});
  const Vec3d center = box.center();
  const double radius = 0.5 * norm(box.size());

  // Slabs that may hold the nearest stretch of line for some point of the block.
  const int lowest = closed_ ? 0 : -1, highest = closed_ ? last() - 1 : last();
  std::vector<double> distance;
  for (int slab = lowest; slab <= highest; ++slab) distance.push_back(distance_to_slab(slab, center));
  const double reach = *std::min_element(distance.begin(), distance.end()) + 2 * radius + 0.1 * longest_slab_mm_;
  std::vector<int> candidates;
  for (int slab = lowest; slab <= highest; ++slab)
    if (distance[static_cast<std::size_t>(slab - lowest)] <= reach) candidates.push_back(slab);

  if (candidates.back() - candidates.front() + 1 == static_cast<int>(candidates.size()) && candidates.size() <= 8) {
    map_in_run(candidates.front(), candidates.back(), block, center, radius, out);
  } else {
    map_by_distance(candidates, block, out);
  }
}

/// One stretch of neighbouring slabs: their planes do not cross inside the limb, so the number of planes passed is the
/// slab.
void Sweep::map_in_run(int from, int to, const PointBlock& block, Vec3d center, double radius, Places out) const {
  const auto height = [&](int k) {
    const Frame& f = stations_[static_cast<std::size_t>(k)].frame;
    return dot(center - f.origin, f.z);
  };
  while (from < to && height(from + 1) >= radius) ++from;
  while (from < to && height(to) < -radius) --to;
  if (from == to) return map_in_slab(from, block.x, block.y, block.z, block.count, out);

  std::array<int, PointBlock::capacity> passed{};
  for (int k = from + 1; k <= to; ++k)
    count_passed(planes_[static_cast<std::size_t>(k)], block.x, block.y, block.z, block.count, passed.data());
  std::array<float, PointBlock::capacity> slab_u, slab_v, slab_along;
  const bool where = out.along != nullptr;
  for (int slab = from; slab <= to; ++slab) {
    map_in_slab(slab, block.x, block.y, block.z, block.count,
                {slab_u.data(), slab_v.data(), where ? slab_along.data() : nullptr});
    take_where(passed.data(), slab - from, block.count, slab_u.data(), out.u);
    take_where(passed.data(), slab - from, block.count, slab_v.data(), out.v);
    if (where) take_where(passed.data(), slab - from, block.count, slab_along.data(), out.along);
  }
}

/// Several stretches of the limb are near: of the slabs that hold a point, the one whose stretch of line is nearest has
/// it.
void Sweep::map_by_distance(const std::vector<int>& slabs, const PointBlock& block, Places out) const {
  for (int i = 0; i < block.count; ++i) {
    const Vec3d p{block.x[i], block.y[i], block.z[i]};
    int holder = slabs.front(), any = holder;
    double holder_mm = std::numeric_limits<double>::infinity(), any_mm = holder_mm;
    for (const int slab : slabs) {
      const double d = distance_to_slab(slab, p);
      if (d < any_mm) {
        any = slab;
        any_mm = d;
      }
      if (d < holder_mm && in_slab(slab, p)) {
        holder = slab;
        holder_mm = d;
      }
    }
    if (std::isinf(holder_mm)) holder = any;
    map_in_slab(holder, block.x + i, block.y + i, block.z + i, 1, out.from(i));
  }
}

double Sweep::curvature_at(double share) const {
  if (stations_.size() < 2) return 0;
  const double at = std::clamp(share, 0.0, 1.0) * arc_mm_.back();
  std::size_t k = 0;
  while (k + 2 < stations_.size() && stations_[k + 1].at_mm < at) ++k;
  // The sharper of this stretch and its neighbours: a turn is known between stations, not where in between.
  double most = 0;
  for (std::size_t i = k == 0 ? 0 : k - 1; i <= std::min(k + 1, stations_.size() - 2); ++i)
    most = std::max(
        most, std::hypot(stations_[i].bend_u, stations_[i].bend_v) / (stations_[i + 1].at_mm - stations_[i].at_mm));
  return most;
}

Frame Sweep::frame_at(double share) const {
  const double wanted = std::clamp(share, 0.0, 1.0) * arc_mm_.back();
  std::size_t k = 0;
  while (k + 2 < arc_mm_.size() && arc_mm_[k + 1] < wanted) ++k;
  const double t = std::clamp((wanted - arc_mm_[k]) / std::max(1e-12, arc_mm_[k + 1] - arc_mm_[k]), 0.0, 1.0);
  const Frame &a = line_[k], &b = line_[k + 1];
  const Vec3d z = normalized((1 - t) * a.z + t * b.z), along_x = (1 - t) * a.x + t * b.x;
  const Vec3d x = normalized(along_x - dot(along_x, z) * z);
  return {(1 - t) * a.origin + t * b.origin, x, cross(z, x), z};
}

}  // namespace fibrolite
