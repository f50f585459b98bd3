// SPDX-License-Identifier: GPL-3.0-or-later
#include "region.h"

#include <algorithm>
#include <cmath>

namespace fibrolite {
namespace {

/// What is left of a polygon where a linear function (given at the face's corners) is at most 0 (Sutherland and Hodgman
/// 1974).
std::vector<Corner> clipped(const std::vector<Corner>& polygon, const Corner& value) {
  const auto at = [&](const Corner& c) { return c[0] * value[0] + c[1] * value[1] + c[2] * value[2]; };
  std::vector<Corner> rest;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double va = at(a), vb = at(b);
    if (va <= 0) rest.push_back(a);
    if ((va < 0 && vb > 0) || (va > 0 && vb < 0)) rest.push_back(between(a, b, va / (va - vb)));
  }
  return rest;
}

}  // namespace

bool Region::contains(Vec3d p, const Labels& labels) const {
  return std::all_of(planes.begin(), planes.end(),
                     [&](const Plane& plane) { return dot(p, plane.normal) <= plane.offset + plane.tolerance; }) &&
         (!label || labels.label(p) == *label) && (!paint || static_cast<double>((*paint)(p)) <= paint_mm);
}

Corner between(const Corner& a, const Corner& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

void cover(const TetMesh& mesh, const std::vector<TetFace>& faces, const Region& region, const Labels& labels,
           double below_mm, const std::function<void(const TetFace&, Vec3d, const CornerTriangle&, double)>& visit) {
  constexpr std::size_t pieces_along = 4;
  for (const TetFace& face : faces) {
    const std::array<Vec3d, 3> p{mesh.nodes[face.nodes[0]], mesh.nodes[face.nodes[1]], mesh.nodes[face.nodes[2]]};
    const Vec3d double_area = cross(p[1] - p[0], p[2] - p[0]);
    const double area = 0.5 * norm(double_area);
    if (!(area > 0)) continue;
    const Vec3d normal = normalized(double_area);
    std::vector<Corner> polygon{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const Plane& plane : region.planes) {
      // The surface may lie that much off along its own normal; planes across it have nothing to forgive.
      const double limit = plane.offset + plane.tolerance * std::abs(dot(normal, plane.normal));
      Corner value{};
      for (std::size_t k = 0; k < 3; ++k) value[k] = dot(p[k], plane.normal) - limit;
      polygon = clipped(polygon, value);
      if (polygon.size() < 3) break;
    }
    const auto place = [&](const Corner& c) { return c[0] * p[0] + c[1] * p[1] + c[2] * p[2]; };
    const auto give = [&](const CornerTriangle& t) {
      const double share =
          std::abs((t[1][1] - t[0][1]) * (t[2][2] - t[0][2]) - (t[2][1] - t[0][1]) * (t[1][2] - t[0][2]));
      if (share > 0) visit(face, normal, t, share * area);
    };
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const CornerTriangle whole{polygon[0], polygon[i - 1], polygon[i]};
      bool whole_is_painted = true;
      if (region.paint) {
        const Vec3d a = place(whole[0]), b = place(whole[1]), c = place(whole[2]), m = (a + b + c) / 3;
        const double reach = std::max({norm(a - m), norm(b - m), norm(c - m)});
        const auto off = static_cast<double>((*region.paint)(m));
        if (off > region.paint_mm + reach) continue;
        whole_is_painted = off + reach <= region.paint_mm;
      }
      if (!region.label && whole_is_painted) {
        give(whole);
        continue;
      }
      const auto corner = [&](std::size_t u, std::size_t v) {
        const double step = 1.0 / pieces_along;
        const double s = step * static_cast<double>(u), t = step * static_cast<double>(v);
        Corner c{};
        for (std::size_t k = 0; k < 3; ++k) c[k] = (1 - s - t) * whole[0][k] + s * whole[1][k] + t * whole[2][k];
        return c;
      };
      const auto ask = [&](const CornerTriangle& piece) {
        Corner middle{};
        for (std::size_t k = 0; k < 3; ++k) middle[k] = (piece[0][k] + piece[1][k] + piece[2][k]) / 3;
        // Asked below the surface: a cut that runs in the surface itself would answer at random.
        if (region.label && labels.label(place(middle) - below_mm * normal) != *region.label) return;
        if (whole_is_painted || static_cast<double>((*region.paint)(place(middle))) <= region.paint_mm) give(piece);
      };
      for (std::size_t u = 0; u < pieces_along; ++u) {
        for (std::size_t v = 0; u + v < pieces_along; ++v) {
          ask({corner(u, v), corner(u + 1, v), corner(u, v + 1)});
          if (u + v + 1 < pieces_along) ask({corner(u + 1, v + 1), corner(u, v + 1), corner(u + 1, v)});
        }
      }
    }
  }
}

}  // namespace fibrolite
