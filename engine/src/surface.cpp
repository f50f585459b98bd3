// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/surface.h"

#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

using Points = std::vector<openvdb::Vec3s>;
using Quads = std::vector<openvdb::Vec4I>;

Vec3d at(const Points& points, openvdb::Index32 i) { return {points[i].x(), points[i].y(), points[i].z()}; }

double twice_area(const Points& points, openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
  return norm(cross(at(points, b) - at(points, a), at(points, c) - at(points, a)));
}

/// A mesh with its vertices on (or, as here, averaged below) a convex surface lies inside it and loses volume. To
/// second order the loss is made good by moving each vertex along its normal by the normal part of its umbrella vector,
/// mirrored: measured, spheres and cylinders three to sixteen voxels thick keep their volume within 1 to 4 %
/// (tests/engine/surface_test.cpp). Flat faces and sharp edges stay where they are.
void inflate(Points& points, const Quads& quads, double voxel) {
  constexpr double sharp = 0.72, smooth = 0.86;
  struct Umbrella {
    float x = 0, y = 0, z = 0;     // sum of edge vectors to neighbours
    float nx = 0, ny = 0, nz = 0;  // sum of quad normals
    float length = 0;              // of those normals, summed: longer than the sum where the surface bends
    std::int32_t edges = 0;
  };
  std::vector<Umbrella> umbrellas(points.size());
  for (const auto& q : quads) {
    const openvdb::Vec3s n = (points[q[2]] - points[q[0]]).cross(points[q[3]] - points[q[1]]);
    const float length = n.length();
    for (int k = 0; k < 4; ++k) {
      Umbrella& u = umbrellas[q[k]];
      const openvdb::Vec3s d = points[q[(k + 1) & 3]] + points[q[(k + 3) & 3]] - 2.0F * points[q[k]];
      u.x += d.x();
      u.y += d.y();
      u.z += d.z();
      u.nx += n.x();
      u.ny += n.y();
      u.nz += n.z();
      u.length += length;
      u.edges += 2;
    }
  }
  const double most = 0.35 * voxel;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Umbrella& u = umbrellas[i];
      const Vec3d sum{u.nx, u.ny, u.nz}, n = normalized(sum);
      const double along = dot(Vec3d{u.x, u.y, u.z}, n) / std::max(u.edges, 1);
      // 1 where flat, cos 45 degrees on the edge of a box: an edge is no curve and stays where it is.
      const double flatness = u.length > 0 ? norm(sum) / u.length : 0;
      const double share = std::clamp((flatness - sharp) / (smooth - sharp), 0.0, 1.0);
      const Vec3d move = std::clamp(-share * along, -most, most) * n;
      points[i] += openvdb::Vec3s(static_cast<float>(move.x), static_cast<float>(move.y), static_cast<float>(move.z));
    }
  });
}

/// Split each quad along its shorter diagonal, unless that leaves a triangle without area.
Mesh::Triangle* split(const Points& points, const openvdb::Vec4I& q, Mesh::Triangle* out) {
  const double d02 = norm(at(points, q[2]) - at(points, q[0])), d13 = norm(at(points, q[3]) - at(points, q[1]));
  const auto flat = [&](int a, int b, int c) { return twice_area(points, q[a], q[b], q[c]) <= 0; };
  bool first = d02 <= d13;
  if (first ? flat(0, 1, 2) || flat(0, 2, 3) : flat(0, 1, 3) || flat(1, 2, 3)) first = !first;
  // Quads of a level set wind inward: reverse.
  if (first) {
    *out++ = {q[0], q[2], q[1]};
    *out++ = {q[0], q[3], q[2]};
  } else {
    *out++ = {q[0], q[3], q[1]};
    *out++ = {q[1], q[3], q[2]};
  }
  return out;
}

bool degenerate(const Points& points, const openvdb::Vec4I& q) {
  const auto flat = [&](int a, int b, int c) { return twice_area(points, q[a], q[b], q[c]) <= 0; };
  return (flat(0, 1, 2) || flat(0, 2, 3)) && (flat(0, 1, 3) || flat(1, 2, 3));
}

/// Quads that neither diagonal saves: move a corner by a thousandth of a voxel in a random direction and look again.
void shake_degenerate(Points& points, const Quads& quads, double voxel) {
  Random random(1, "surface");
  for (int round = 0; round < 8; ++round) {
    bool found = false;
    for (const auto& q : quads) {
      if (!degenerate(points, q)) continue;
      found = true;
      for (int k = 0; k < 4; ++k) {
        const auto step = [&] { return static_cast<float>((random.uniform() - 0.5) * 4e-3 * voxel); };
        const float dx = step(), dy = step(), dz = step();
        points[q[k]] += openvdb::Vec3s(dx, dy, dz);
      }
    }
    if (!found) return;
  }
}

}  // namespace

Mesh surface(const Solid& solid, const SurfaceParams& params, const Context& context) {
  context.check();
  Points points;
  Quads quads;
  std::vector<openvdb::Vec3I> triangles;  // stays empty at adaptivity 0
  openvdb::tools::volumeToMesh(*solid.impl().grid, points, triangles, quads, 0.0, 0.0);
  context.check();
  context.progress(0.6);
  if (points.size() >= std::numeric_limits<std::uint32_t>::max()) {
    throw Error(Code::TooLarge, "the surface has more vertices than a mesh can hold", {}, "use a larger --voxel");
  }
  const double voxel = solid.grid().voxel_mm;
  if (params.keep_volume) inflate(points, quads, voxel);
  shake_degenerate(points, quads, voxel);
  context.check();

  Mesh mesh;
  mesh.triangles.resize(2 * quads.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, quads.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) split(points, quads[i], &mesh.triangles[2 * i]);
  });
  Quads().swap(quads);
  mesh.vertices.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) mesh.vertices[i] = {points[i].x(), points[i].y(), points[i].z()};
  context.progress(1);
  return mesh;
}

}  // namespace fibrolite
