// SPDX-License-Identifier: GPL-3.0-or-later
#include "section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fibrolite {
namespace {

constexpr double widest_reaches = 2.5;  // a section wider than this many limb radii is the body's, not the limb's

struct Pixels {
  int side = 0;
  double pixel_mm = 1;
  double first_mm = 0;  // centre of pixel 0 on both axes
  std::vector<std::uint8_t> filled;
  int count = 0;
};

Pixels pixels_for(const VoxelBody& body, double reach) {
  Pixels p;
  p.pixel_mm = std::max(0.5 * body.voxel_mm, reach / 16);
  const int half = static_cast<int>(std::ceil((widest_reaches * reach + 2 * body.voxel_mm) / p.pixel_mm));
  p.side = 2 * half + 1;
  p.first_mm = -half * p.pixel_mm;
  return p;
}

// Flood from the pixel nearest to the middle; false if there is nothing to flood within reach or the flood meets the
// rim.
bool flood(const VoxelBody& body, const BentPlane& surface, double reach, Pixels& p) {
  const auto n = static_cast<std::size_t>(p.side);
  std::vector<std::int8_t> state(n * n, -1);  // -1 not asked yet, 0 outside, 1 inside
  const auto inside = [&](int i, int j) {
    std::int8_t& s = state[static_cast<std::size_t>(j) * n + static_cast<std::size_t>(i)];
    if (s < 0) {
      const Vec2d local{p.first_mm + i * p.pixel_mm, p.first_mm + j * p.pixel_mm};
      s = body.distance_at(surface.at(local)) < 0 ? 1 : 0;
    }
    return s == 1;
  };
  const int middle = p.side / 2;
  int start_i = -1;
  int start_j = -1;
  double best = reach * reach;
  const int search = std::min(middle, static_cast<int>(reach / p.pixel_mm));
  if (inside(middle, middle)) {
    start_i = start_j = middle;
  } else {
    for (int j = middle - search; j <= middle + search; ++j) {
      for (int i = middle - search; i <= middle + search; ++i) {
        const double d = p.pixel_mm * p.pixel_mm * ((i - middle) * (i - middle) + (j - middle) * (j - middle));
        if (d >= best || !inside(i, j)) continue;
        best = d;
        start_i = i;
        start_j = j;
      }
    }
  }
  if (start_i < 0) return false;
  p.filled.assign(n * n, 0);
  std::vector<std::array<int, 2>> stack{{start_i, start_j}};
  p.filled[static_cast<std::size_t>(start_j) * n + static_cast<std::size_t>(start_i)] = 1;
  p.count = 0;
  while (!stack.empty()) {
    const auto [i, j] = stack.back();
    stack.pop_back();
    ++p.count;
    if (i == 0 || j == 0 || i == p.side - 1 || j == p.side - 1) return false;
    for (const auto& [di, dj] : {std::array{1, 0}, std::array{-1, 0}, std::array{0, 1}, std::array{0, -1}}) {
      std::uint8_t& f = p.filled[static_cast<std::size_t>(j + dj) * n + static_cast<std::size_t>(i + di)];
      if (f != 0 || !inside(i + di, j + dj)) continue;
      f = 1;
      stack.push_back({i + di, j + dj});
    }
  }
  return true;
}

// The mask must cover the links at its rim: they may cross just outside of the last pixel.
std::vector<std::uint8_t> grown(const Pixels& p, double by_mm) {
  const int reach = static_cast<int>(std::ceil(by_mm / p.pixel_mm));
  std::vector<std::uint8_t> wide(p.filled.size(), 0);
  for (int j = 0; j < p.side; ++j) {
    for (int i = 0; i < p.side; ++i) {
      if (p.filled[static_cast<std::size_t>(j * p.side + i)] == 0) continue;
      for (int b = std::max(j - reach, 0); b <= std::min(j + reach, p.side - 1); ++b)
        for (int a = std::max(i - reach, 0); a <= std::min(i + reach, p.side - 1); ++a)
          wide[static_cast<std::size_t>(b * p.side + a)] = 1;
    }
  }
  return wide;
}

double area_of(const Pixels& p) { return p.count * p.pixel_mm * p.pixel_mm; }

// `z` tilted by `angle` towards the direction `azimuth` in the plane of (x, y).
Frame tilted(const Frame& frame, Vec3d centre, double angle, double azimuth, double along) {
  const Vec3d side = std::cos(azimuth) * frame.x + std::sin(azimuth) * frame.y;
  const Vec3d z = normalized(std::cos(angle) * frame.z + std::sin(angle) * side);
  const Vec3d x = normalized(frame.x - dot(frame.x, z) * z);
  return {centre + along * frame.z, x, cross(z, x), z};
}

}  // namespace

bool Section::covers(double x_mm, double y_mm) const {
  const double i = std::round((x_mm - mask_origin.x) / pixel_mm);
  const double j = std::round((y_mm - mask_origin.y) / pixel_mm);
  if (i < 0 || j < 0 || i >= side || j >= side) return false;
  return mask[static_cast<std::size_t>(j) * static_cast<std::size_t>(side) + static_cast<std::size_t>(i)] != 0;
}

std::optional<Section> section(const VoxelBody& body, const BentPlane& surface, double reach_mm) {
  Pixels p = pixels_for(body, reach_mm);
  if (!flood(body, surface, reach_mm, p)) return std::nullopt;
  Vec3d sum{};
  for (int j = 0; j < p.side; ++j)
    for (int i = 0; i < p.side; ++i)
      if (p.filled[static_cast<std::size_t>(j * p.side + i)] != 0)
        sum = sum + Vec3d{p.first_mm + i * p.pixel_mm, p.first_mm + j * p.pixel_mm, 0};
  const Vec3d centre = sum / p.count;
  double radius2 = 0, stretch = 0;
  for (int j = 0; j < p.side; ++j) {
    for (int i = 0; i < p.side; ++i) {
      if (p.filled[static_cast<std::size_t>(j * p.side + i)] == 0) continue;
      const Vec3d at{p.first_mm + i * p.pixel_mm, p.first_mm + j * p.pixel_mm, 0}, gap = at - centre;
      stretch += surface.bend.stretch({at.x, at.y});
      radius2 = std::max(radius2, dot(gap, gap));
    }
  }
  Section s;
  s.frame = surface.frame;
  s.frame.origin = surface.at({centre.x, centre.y});
  s.bend = surface.bend.about({centre.x, centre.y});
  s.area_mm2 = stretch * p.pixel_mm * p.pixel_mm;
  s.radius_mm = std::sqrt(radius2) + p.pixel_mm;
  s.mask_origin = Vec3d{p.first_mm, p.first_mm, 0} - centre;
  s.pixel_mm = p.pixel_mm;
  s.side = p.side;
  s.mask = grown(p, 0.75 * body.voxel_mm);
  return s;
}

std::optional<Section> cleanest_section(const VoxelBody& body, Vec3d centre, Vec3d direction, double reach_mm,
                                        Vec3d side_hint) {
  const Vec3d z = normalized(direction);
  Frame base = frame_along(centre, z);
  const Vec3d across = side_hint - dot(side_hint, z) * z;
  if (norm(across) > 1e-3 * norm(side_hint)) {
    base.x = normalized(across);
    base.y = cross(z, base.x);
  }
  double best_cost = 0;
  std::optional<Frame> best;
  double best_angle = 0;
  double best_azimuth = 0;
  double best_along = 0;
  const auto consider = [&](double angle, double azimuth, double along) {
    const Frame frame = tilted(base, centre, angle, azimuth, along);
    Pixels p = pixels_for(body, reach_mm);
    if (!flood(body, {frame}, reach_mm, p)) return;
    // Area alone would walk down a tapering limb and lean over: moving and tilting have their price.
    const double moved = along / reach_mm;
    const double cost = area_of(p) * (1 + 0.5 * moved * moved + 0.5 * angle * angle);
    if (best && cost >= best_cost) return;
    best_cost = cost;
    best = frame;
    best_angle = angle;
    best_azimuth = azimuth;
    best_along = along;
  };
  constexpr double turn = 2 * std::numbers::pi / 8;
  for (int step = -3; step <= 3; ++step) {
    consider(0, 0, 0.2 * step * reach_mm);
    for (int azimuth = 0; azimuth < 8; ++azimuth) consider(0.26, azimuth * turn, 0.2 * step * reach_mm);
  }
  if (!best) return std::nullopt;
  for (const double fine : {0.1, 0.05}) {
    const double angle = best_angle;
    const double azimuth = best_azimuth;
    const double along = best_along;
    for (const double move : {-fine, 0.0, fine}) {
      consider(angle, azimuth, along + move * reach_mm);
      consider(angle + fine, azimuth, along + move * reach_mm);
      consider(std::max(angle - fine, 0.0), azimuth, along + move * reach_mm);
      if (angle == 0) {
        for (int a = 0; a < 8; ++a) consider(fine, a * turn, along + move * reach_mm);
      } else {
        consider(angle, azimuth + 4 * fine, along + move * reach_mm);
        consider(angle, azimuth - 4 * fine, along + move * reach_mm);
      }
    }
  }
  return section(body, {*best}, reach_mm);
}

Severed sever(const VoxelBody& body, const Section& cut, Links& links) {
  Severed severed;
  const double reach = cut.radius_mm + 2 * body.voxel_mm;
  const BentPlane surface = cut.surface();
  const Frame& f = cut.frame;
  // Half sizes of the box of the disc, and of what bends up from it.
  const double high_mm = cut.bend.steepest(reach) * reach;
  const auto extent = [&](double nx) {
    return reach * std::sqrt(std::max(1 - nx * nx, 0.0)) + high_mm * std::abs(nx) + 2 * body.voxel_mm;
  };
  const Vec3d half{extent(f.z.x), extent(f.z.y), extent(f.z.z)};
  const Vec3d low = (f.origin - half - body.origin) / body.voxel_mm;
  const Vec3d high = (f.origin + half - body.origin) / body.voxel_mm;
  const auto clamped = [](double v, std::int32_t n) {
    return std::clamp(static_cast<std::int32_t>(std::floor(v)), 1, n - 2);
  };
  const auto cross_link = [&](std::int32_t s, int d) {
    const std::int32_t n = body.neighbour(s, d);
    const Vec3d a = surface.flattened(body.position(s));
    const Vec3d b = surface.flattened(body.position(n));
    // A sample on the surface belongs to the far side.
    if ((a.z < 0) == (b.z < 0)) return;
    const double t = a.z / (a.z - b.z);
    if (!cut.covers(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y))) return;
    links[static_cast<std::size_t>(s)] &= ~(1U << static_cast<unsigned>(d));
    links[static_cast<std::size_t>(n)] &= ~(1U << static_cast<unsigned>(VoxelBody::directions - 1 - d));
    severed.near.push_back(a.z < 0 ? s : n);
    severed.far.push_back(a.z < 0 ? n : s);
  };
  for (std::int32_t k = clamped(low.z, body.size.z); k <= clamped(high.z + 1, body.size.z); ++k) {
    for (std::int32_t j = clamped(low.y, body.size.y); j <= clamped(high.y + 1, body.size.y); ++j) {
      for (std::int32_t i = clamped(low.x, body.size.x); i <= clamped(high.x + 1, body.size.x); ++i) {
        const std::int32_t s = body.inside[static_cast<std::size_t>((k * body.size.y + j) * body.size.x + i)];
        if (s < 0) continue;
        for (int d = VoxelBody::directions / 2; d < VoxelBody::directions; ++d)
          if ((links[static_cast<std::size_t>(s)] >> static_cast<unsigned>(d) & 1U) != 0) cross_link(s, d);
      }
    }
  }
  for (auto* side : {&severed.near, &severed.far}) {
    std::sort(side->begin(), side->end());
    side->erase(std::unique(side->begin(), side->end()), side->end());
  }
  return severed;
}

}  // namespace fibrolite
