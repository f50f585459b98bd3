// SPDX-License-Identifier: Apache-2.0
// Small fixed vectors: double for geometry, float for stored meshes, int for lattice coordinates.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace fibrolite {

struct Vec2d {
  double x = 0, y = 0;
  friend constexpr bool operator==(const Vec2d&, const Vec2d&) = default;
};

struct Vec3d {
  double x = 0, y = 0, z = 0;
  constexpr double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  friend constexpr bool operator==(const Vec3d&, const Vec3d&) = default;
};

struct Vec3f {
  float x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const Vec3f&, const Vec3f&) = default;
};

struct Vec3i {
  std::int32_t x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const Vec3i&, const Vec3i&) = default;
};

constexpr Vec2d operator+(Vec2d a, Vec2d b) { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2d operator-(Vec2d a, Vec2d b) { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2d operator*(double s, Vec2d a) { return {s * a.x, s * a.y}; }
constexpr double dot(Vec2d a, Vec2d b) { return a.x * b.x + a.y * b.y; }
inline double norm(Vec2d a) { return std::sqrt(dot(a, a)); }

constexpr Vec3d operator+(Vec3d a, Vec3d b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3d operator-(Vec3d a, Vec3d b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3d operator-(Vec3d a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3d operator*(double s, Vec3d a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr Vec3d operator/(Vec3d a, double s) { return {a.x / s, a.y / s, a.z / s}; }
constexpr double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3d cross(Vec3d a, Vec3d b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec3d a) { return std::sqrt(dot(a, a)); }
/// Unit vector along `a`; the zero vector stays zero.
inline Vec3d normalized(Vec3d a) {
  const double length = norm(a);
  return length > 0 ? a / length : Vec3d{};
}

constexpr Vec3d to_double(Vec3f a) { return {a.x, a.y, a.z}; }
constexpr Vec3f to_float(Vec3d a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

}  // namespace fibrolite
