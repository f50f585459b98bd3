// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <vector>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// Extent of the mesh along a direction.
struct Extent {
  double lo = 0, hi = 0;
  [[nodiscard]] double size() const { return hi - lo; }
};
Extent extent_along(const Mesh& mesh, Vec3d direction) {
  Extent e{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Vec3f& v : mesh.vertices) {
    const double t = dot(to_double(v), direction);
    e.lo = std::min(e.lo, t);
    e.hi = std::max(e.hi, t);
  }
  return e;
}

/// Two horizontal unit vectors, world axes where `up` is one, turned as in a drawing: with z up, the front is -y and
/// the side +x.
struct Horizontal {
  Vec3d front, side;
};
Horizontal horizontal(Vec3d up) {
  const Frame frame = frame_along({}, up);
  const auto towards = [](Vec3d a) { return dot(a, {1, -1, 0.5}) < 0 ? -a : a; };
  return {towards(frame.x), towards(frame.y)};
}

/// How much a cut shows: the sum over all colours of the square root of the area seen. A cut that meets legs and body
/// beats one that meets a little more of the body alone.
double shown(const Solid& solid, const PointColor& color, Vec3d point, const Frame& plane, Extent across,
             Extent along) {
  constexpr int columns = 128;
  const double step = std::max(across.size(), along.size()) / columns;
  const Shape distance = distance_to(solid);
  std::vector<Vec3d> points;
  const int rows = std::max(1, static_cast<int>(along.size() / step));
  const int width = std::max(1, static_cast<int>(across.size() / step));
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < width; ++i) {
      points.push_back(point + (across.lo + (i + 0.5) * step - dot(point, plane.x)) * plane.x +
                       (along.lo + (j + 0.5) * step - dot(point, plane.y)) * plane.y);
    }
  }
  std::vector<float> values(points.size());
  distance.evaluate(points, values);
  std::map<int, int> area;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (values[i] >= 0) continue;
    const Rgb c = color(points[i]);
    ++area[(c.r << 16) | (c.g << 8) | c.b];
  }
  double sum = 0;
  for (const auto& [key, count] : area) sum += std::sqrt(count);
  return sum;
}

}  // namespace

std::optional<CutPlane> choose_cut(const Mesh& mesh, const Solid& solid, const PointColor& color,
                                   const PictureParams& params, const Context& context) {
  if (!params.cut || mesh.vertices.empty()) return {};
  const Vec3d up = normalized(params.up);
  Vec3d normal;
  if (params.cut_normal) {
    normal = normalized(*params.cut_normal);
    if (norm(normal) == 0) throw Error(Code::BadRecipe, "the normal of the picture's cut plane is zero");
  } else {
    const Horizontal axes = horizontal(up);
    normal = extent_along(mesh, axes.side).size() < extent_along(mesh, axes.front).size() ? axes.side : axes.front;
  }
  if (params.cut_point) return CutPlane{*params.cut_point, normal};

  // In the middle half, where most of every colour shows; the middle itself wins ties.
  const Extent depth = extent_along(mesh, normal);
  Frame plane{{}, normalized(cross(up, normal)), {}, normal};
  if (norm(plane.x) == 0) plane = frame_along({}, normal);
  plane.y = cross(plane.z, plane.x);
  const Extent across = extent_along(mesh, plane.x), along = extent_along(mesh, plane.y);
  const double middle = 0.5 * (depth.lo + depth.hi);
  const Vec3d center = 0.5 * (across.lo + across.hi) * plane.x + 0.5 * (along.lo + along.hi) * plane.y;
  CutPlane best{center + middle * normal, normal};
  double most = -1;
  for (const int step : {0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5}) {
    context.check();
    const Vec3d point = center + (middle + step * 0.05 * depth.size()) * normal;
    const double seen = shown(solid, color, point, plane, across, along);
    if (seen > 1.02 * most) {
      most = seen;
      best.point = point;
    }
  }
  return best;
}

View choose_view(const Mesh& mesh, const std::optional<CutPlane>& cut, const PictureParams& params,
                 int samples_per_pixel_edge) {
  const Vec3d up = normalized(params.up);
  // A cut face is seen nearly from the front; a whole model is seen from a corner.
  const double azimuth = radians(cut ? 24 : 35), elevation = radians(cut ? 17 : 22);
  const Vec3d front = cut ? cut->normal : horizontal(up).front;
  Vec3d side = normalized(cross(up, front));
  if (norm(side) < 0.5) side = horizontal(up).side;
  const Vec3d to_camera = normalized(std::cos(elevation) * (std::cos(azimuth) * front + std::sin(azimuth) * side) +
                                     std::sin(elevation) * up);
  View view;
  view.forward = -to_camera;
  view.right = normalized(cross(up, to_camera));
  if (norm(view.right) < 0.5) view.right = side;
  view.up = cross(to_camera, view.right);
  view.width = params.width_px * samples_per_pixel_edge;
  view.height = params.height_px * samples_per_pixel_edge;

  // A cut that leaves nothing is framed as if it had left everything.
  Box3d all, kept;
  for (const Vec3f& v : mesh.vertices) {
    const Vec3d p = to_double(v), q{dot(p, view.right), dot(p, view.up), dot(p, view.forward)};
    all.include(q);
    if (!cut || cut->side(p) <= 0) kept.include(q);
  }
  if (params.focus_mm && cut) {
    const Vec3d p = cut->point, half = *params.focus_mm * Vec3d{1, 1, 1};
    const Vec3d q{dot(p, view.right), dot(p, view.up), dot(p, view.forward)};
    kept = {q - half, q + half};
  }
  const Box3d& frame = kept.empty() ? all : kept;
  if (frame.empty()) return view;
  const double free = 1 - 2 * params.margin;
  view.samples_per_mm =
      std::min(free * view.width / std::max(frame.size().x, 1e-9), free * view.height / std::max(frame.size().y, 1e-9));
  const Vec3d center = frame.center();
  const double near = all.min.z - 0.01 * all.longest_side() - 1e-6;
  view.origin = (center.x - 0.5 * view.width / view.samples_per_mm) * view.right +
                (center.y + 0.5 * view.height / view.samples_per_mm) * view.up + near * view.forward;
  return view;
}

}  // namespace fibrolite
