// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <span>

#include "fibrolite/error.h"
#include "mesh_formats.h"

namespace fibrolite {
namespace {

using Triangle = Mesh::Triangle;

Vec3d normal(const Mesh& mesh, const Triangle& t) {
  const Vec3d a = to_double(mesh.vertices[t[0]]);
  return cross(to_double(mesh.vertices[t[1]]) - a, to_double(mesh.vertices[t[2]]) - a);
}

// Cuts one ear after the other: a convex corner whose triangle holds no other corner. A polygon that crosses itself has
// no such corner at some point; then the rest stays a fan. Cost: O(n^3) at worst.
void cut_ears(const Mesh& mesh, std::vector<std::uint32_t> ring, Vec3d up, std::span<Triangle> out) {
  const auto at = [&](std::uint32_t v) { return to_double(mesh.vertices[v]); };
  const auto turns_left = [&](Vec3d a, Vec3d b, Vec3d c) { return dot(cross(b - a, c - a), up); };
  const auto is_ear = [&](const Triangle& t) {
    const Vec3d a = at(t[0]), b = at(t[1]), c = at(t[2]);
    if (turns_left(a, b, c) <= 0) return false;
    return std::none_of(ring.begin(), ring.end(), [&](std::uint32_t v) {
      const Vec3d p = at(v);
      return v != t[0] && v != t[1] && v != t[2] && turns_left(a, b, p) >= 0 && turns_left(b, c, p) >= 0 &&
             turns_left(c, a, p) >= 0;
    });
  };
  for (Triangle& triangle : out) {
    std::size_t ear = 1;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const std::size_t n = ring.size();
      if (is_ear({ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]})) {
        ear = i;
        break;
      }
    }
    const std::size_t n = ring.size();
    triangle = {ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]};
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
}

}  // namespace

std::size_t PolygonSink::add(const std::vector<std::uint32_t>& corners) {
  if (corners.size() < 3) {
    ++too_few_corners_;
    return 0;
  }
  auto& triangles = file_->mesh.triangles;
  const std::size_t count = corners.size() - 2;
  if (triangles.size() + count > 0xffffffffu / 3)
    throw Error(Code::TooLarge, "the model has over 1,431,655,765 triangles");
  if (count > 1) fans_.push_back({static_cast<std::uint32_t>(triangles.size()), static_cast<std::uint32_t>(count)});
  for (std::size_t i = 0; i < count; ++i) triangles.push_back({corners[0], corners[i + 1], corners[i + 2]});
  return count;
}

void PolygonSink::finish() {
  // Beyond this a polygon is not worth the cubic time; nothing real comes near.
  constexpr std::uint32_t most_triangles = 2000;
  Mesh& mesh = file_->mesh;
  for (const Fan& fan : fans_) {
    const std::span<Triangle> triangles = std::span(mesh.triangles).subspan(fan.first_triangle, fan.triangles);
    Vec3d up{};
    for (const Triangle& t : triangles) up = up + normal(mesh, t);
    const bool convex = std::all_of(triangles.begin(), triangles.end(),
                                    [&](const Triangle& t) { return dot(normal(mesh, t), up) >= 0; });
    if (convex || fan.triangles > most_triangles) continue;
    std::vector<std::uint32_t> ring{triangles[0][0], triangles[0][1]};
    for (const Triangle& t : triangles) ring.push_back(t[2]);
    cut_ears(mesh, std::move(ring), up, triangles);
  }
  if (too_few_corners_ > 0)
    file_->notes.push_back(std::to_string(too_few_corners_) + " polygons with fewer than 3 corners left out");
}

}  // namespace fibrolite
