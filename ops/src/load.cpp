// SPDX-License-Identifier: GPL-3.0-or-later
#include "load.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "elasticity.h"
#include "fibrolite/box.h"

namespace fibrolite {
namespace {

constexpr double pixels_along = 400;

/// Calls visit(pixel, face, barycentric, height) for every pixel centre covered by a face that looks up.
template <class Visit>
void rasterize(const TetMesh& mesh, const std::vector<TetFace>& faces, const Footprint& raster, const Visit& visit) {
  for (std::size_t f = 0; f < faces.size(); ++f) {
    std::array<Vec3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = raster.frame.to_local(mesh.nodes[faces[f].nodes[k]]);
    const double double_area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y);
    if (!(double_area > 0)) continue;
    const auto [x_lo, x_hi] = std::minmax({p[0].x, p[1].x, p[2].x});
    const auto [y_lo, y_hi] = std::minmax({p[0].y, p[1].y, p[2].y});
    const auto pixel = [&](double v, int count) {
      return static_cast<int>(std::clamp(v / raster.pixel_mm - 0.5, -1.0, static_cast<double>(count)));
    };
    for (int y = std::max(pixel(y_lo, raster.height), 0);
         y <= std::min(pixel(y_hi, raster.height) + 1, raster.height - 1); ++y) {
      for (int x = std::max(pixel(x_lo, raster.width), 0);
           x <= std::min(pixel(x_hi, raster.width) + 1, raster.width - 1); ++x) {
        const double px = (x + 0.5) * raster.pixel_mm, py = (y + 0.5) * raster.pixel_mm;
        std::array<double, 3> b;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3d &s = p[(k + 1) % 3], &t = p[(k + 2) % 3];
          b[k] = ((t.x - s.x) * (py - s.y) - (px - s.x) * (t.y - s.y)) / double_area;
        }
        if (b[0] < 0 || b[1] < 0 || b[2] < 0) continue;
        visit(static_cast<std::size_t>(y * raster.width + x), f, b, b[0] * p[0].z + b[1] * p[1].z + b[2] * p[2].z);
      }
    }
  }
}

}  // namespace

Vec3d Footprint::at(const Point& point) const {
  const int x = point.pixel % width, y = point.pixel / width;
  return frame.to_world({(x + 0.5) * pixel_mm, (y + 0.5) * pixel_mm, point.height});
}

Footprint seen_from_above(const TetMesh& body, Vec3d up, const std::function<bool(Vec3d)>& wanted) {
  Footprint result;
  result.frame = frame_along({}, up);
  Box3d box;
  for (const Vec3d& p : body.nodes) box.include(result.frame.to_local(p));
  result.frame.origin = result.frame.to_world({box.min.x, box.min.y, 0});
  result.pixel_mm = std::max(box.size().x, box.size().y) / pixels_along;
  result.width = static_cast<int>(box.size().x / result.pixel_mm) + 1;
  result.height = static_cast<int>(box.size().y / result.pixel_mm) + 1;

  constexpr double unseen = -std::numeric_limits<double>::infinity();
  std::vector<double> top(static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height), unseen);
  std::vector<std::size_t> seen(top.size());
  const std::vector<TetFace> faces = boundary(body);
  rasterize(body, faces, result, [&](std::size_t pixel, std::size_t face, const auto&, double height) {
    if (height <= top[pixel]) return;
    top[pixel] = height;
    seen[pixel] = face;
  });
  std::vector<bool> counted(faces.size(), false);
  for (std::size_t pixel = 0; pixel < top.size(); ++pixel) {
    if (top[pixel] == unseen) continue;
    const Footprint::Point point{static_cast<int>(pixel), top[pixel]};
    if (!wanted(result.at(point))) continue;
    result.points.push_back(point);
    result.faces += counted[seen[pixel]] ? 0 : 1;
    counted[seen[pixel]] = true;
  }
  return result;
}

std::vector<double> nodal_shares(const TetMesh& mesh, const Footprint& footprint, double tolerance_mm,
                                 const std::function<bool(Vec3d)>& mine) {
  constexpr std::size_t nobody = std::numeric_limits<std::size_t>::max();
  struct Hit {
    double height = 0;
    double off;  // from the height of the point; `tolerance_mm` at first
    std::size_t face = nobody;
    std::array<double, 3> barycentric{};
  };
  std::vector<std::size_t> wanted(
      static_cast<std::size_t>(footprint.width) * static_cast<std::size_t>(footprint.height), nobody);
  std::vector<Hit> hits;
  for (const Footprint::Point& point : footprint.points) {
    if (!mine(footprint.at(point))) continue;
    wanted[static_cast<std::size_t>(point.pixel)] = hits.size();
    hits.push_back({point.height, tolerance_mm, nobody, {}});
  }
  const std::vector<TetFace> faces = boundary(mesh);
  rasterize(mesh, faces, footprint, [&](std::size_t pixel, std::size_t face, const auto& barycentric, double height) {
    if (wanted[pixel] == nobody) return;
    Hit& hit = hits[wanted[pixel]];
    const double off = std::abs(height - hit.height);
    if (off < hit.off) hit = {hit.height, off, face, barycentric};
  });
  std::vector<double> shares(mesh.nodes.size(), 0.0);
  const double each = 1 / static_cast<double>(footprint.points.size());
  for (const Hit& hit : hits) {
    if (hit.face == nobody) continue;
    const auto n = fem::face_shape_functions(hit.barycentric);
    for (std::size_t k = 0; k < 6; ++k) shares[faces[hit.face].nodes[k]] += each * n[k];
  }
  return shares;
}

Vec3d slanted_from(Vec3d up, double azimuth_deg) {
  const std::array<Vec3d, 3> world{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  std::size_t nearest = 2;
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::abs(dot(world[k], up)) > std::abs(dot(world[nearest], up)) + 1e-12) nearest = k;
  }
  const Vec3d next = world[(nearest + 1) % 3];
  const Vec3d level = normalized(next - dot(next, up) * up);
  const double angle = azimuth_deg * std::numbers::pi / 180;
  return std::cos(angle) * level + std::sin(angle) * cross(up, level);
}

std::vector<Vec3d> load_directions(Vec3d up, double azimuth_deg) {
  return {-up, normalized(-(up + slanted_from(up, azimuth_deg)))};
}

Vec3d resolved(const Direction& direction, Vec3d up, double azimuth_deg) {
  switch (direction.of) {
    case Direction::Of::World:
      break;
    case Direction::Of::Up:
      return up;
    case Direction::Of::Down:
      return -up;
    case Direction::Of::Slanted:
      return load_directions(up, azimuth_deg)[1];
  }
  return normalized(direction.vector);
}

}  // namespace fibrolite
