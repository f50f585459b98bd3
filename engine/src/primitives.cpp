// SPDX-License-Identifier: Apache-2.0
// Exact distances of simple bodies.
#include <algorithm>
#include <cmath>
#include <utility>

#include "fibrolite/shape.h"

namespace fibrolite {
namespace {

/// A distance given by a callable on a point in double precision.
template <class Distance>
struct Pointwise final : Shape::Function {
  explicit Pointwise(Distance d) : distance(std::move(d)) {}
  void evaluate(const PointBlock& block, float* out) const override {
    for (int i = 0; i < block.count; ++i) {
      out[i] = static_cast<float>(distance(Vec3d{block.x[i], block.y[i], block.z[i]}));
    }
  }
  Distance distance;
};

template <class Distance>
Shape pointwise(Distance distance) {
  return Shape(std::make_shared<const Pointwise<Distance>>(std::move(distance)));
}

double segment_distance(Vec3d p, Vec3d a, Vec3d ab, double inverse_length2) {
  const double t = std::clamp(dot(p - a, ab) * inverse_length2, 0.0, 1.0);
  return norm(p - a - t * ab);
}

}  // namespace

Shape sphere(Vec3d center, double radius_mm) {
  return pointwise([=](Vec3d p) { return norm(p - center) - radius_mm; });
}

Shape capsule(Vec3d a, Vec3d b, double radius_mm) {
  const Vec3d ab = b - a;
  const double length2 = dot(ab, ab);
  const double inverse = length2 > 0 ? 1 / length2 : 0;
  return pointwise([=](Vec3d p) { return segment_distance(p, a, ab, inverse) - radius_mm; });
}

Shape round_cone(Vec3d a, double radius_a_mm, Vec3d b, double radius_b_mm) {
  const Vec3d ab = b - a;
  const double length = norm(ab);
  if (length <= std::abs(radius_a_mm - radius_b_mm)) {  // one sphere holds the other
    return radius_a_mm > radius_b_mm ? sphere(a, radius_a_mm) : sphere(b, radius_b_mm);
  }
  const Vec3d axis = ab / length;
  const double sine = (radius_a_mm - radius_b_mm) / length;
  const double cosine = std::sqrt(1 - sine * sine);
  return pointwise([=](Vec3d p) {
    // In the half plane of the axis the surface is two arcs and their common tangent.
    const double along = dot(p - a, axis);
    const double out = norm(p - a - along * axis);
    const double foot = along * cosine - out * sine;
    if (foot <= 0) return norm(p - a) - radius_a_mm;
    if (foot >= length * cosine) return norm(p - b) - radius_b_mm;
    return out * cosine + along * sine - radius_a_mm;
  });
}

Shape cuboid(const Box3d& box) {
  const Vec3d c = box.center(), h = 0.5 * box.size();
  return pointwise([=](Vec3d p) {
    const Vec3d q{std::abs(p.x - c.x) - h.x, std::abs(p.y - c.y) - h.y, std::abs(p.z - c.z) - h.z};
    const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    return norm(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0);
  });
}

Shape cylinder(Vec3d a, Vec3d b, double radius_mm) {
  const Vec3d middle = 0.5 * (a + b), axis = normalized(b - a);
  const double half = 0.5 * norm(b - a);
  return pointwise([=](Vec3d p) {
    const double along = dot(p - middle, axis);
    const double side = norm(p - middle - along * axis) - radius_mm, end = std::abs(along) - half;
    return std::hypot(std::max(side, 0.0), std::max(end, 0.0)) + std::min(std::max(side, end), 0.0);
  });
}

Shape torus(const Frame& frame, double ring_radius_mm, double tube_radius_mm) {
  return pointwise([=](Vec3d p) {
    const Vec3d q = frame.to_local(p);
    return std::hypot(std::hypot(q.x, q.y) - ring_radius_mm, q.z) - tube_radius_mm;
  });
}

Shape half_space(Vec3d point, Vec3d outward) {
  const Vec3d n = normalized(outward);
  return pointwise([=](Vec3d p) { return dot(p - point, n); });
}

}  // namespace fibrolite
