// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/surface.h"

#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "vdb_access.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace fibrolite {
namespace {

/// Trees that are gone leave their memory with the allocator, in blocks too small for what comes now.
void return_free_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

using Points = std::vector<openvdb::Vec3s>;
using Quads = std::vector<openvdb::Vec4I>;

Vec3d at(const Points& points, openvdb::Index32 i) { return {points[i].x(), points[i].y(), points[i].z()}; }

double twice_area(const Points& points, openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
  return norm(cross(at(points, b) - at(points, a), at(points, c) - at(points, a)));
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

/// Volume that the triangles enclose. Chunks are added in order: the same bits on any
/// number of threads.
double volume(const Points& points, const Quads& quads) {
  constexpr std::size_t chunk = 65536;
  std::vector<double> sums((quads.size() + chunk - 1) / chunk, 0.0);
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t c) {
    for (std::size_t i = c * chunk; i < std::min(quads.size(), (c + 1) * chunk); ++i) {
      std::array<Mesh::Triangle, 2> triangles;
      split(points, quads[i], triangles.data());
      for (const auto& t : triangles) sums[c] += dot(at(points, t[0]), cross(at(points, t[1]), at(points, t[2])));
    }
  });
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum / 6;
}

/// A mesh with its vertices on (or, as here, averaged below) a convex surface lies inside it and loses volume. To
/// second order the loss is made good by moving each vertex along its normal by the normal part of its umbrella vector,
/// mirrored; how far exactly is then set by the volume of the grid. Flat faces and sharp edges stay where they are: an
/// edge is a bend beside something flat; a stick as thin as two voxels bends as much but has nothing flat around it.
void inflate(Points& points, const Quads& quads, double voxel, double wanted_mm3) {
  constexpr float sharp = 0.72F, smooth = 0.86F;  // flatness of a vertex: 1 on a face, cos 45 degrees on a box's edge
  constexpr float bent = 0.88F, flat = 0.95F;     // of the flattest vertex around it
  const auto ramp = [](float x, float from, float to) { return std::clamp((x - from) / (to - from), 0.0F, 1.0F); };
  struct Umbrella {
    float x = 0, y = 0, z = 0;     // sum of edge vectors to neighbours; later the move
    float nx = 0, ny = 0, nz = 0;  // sum of quad normals
    float flatness = 0;  // their lengths, summed: longer than the sum where the surface bends; later the ratio
    float edges = 0;     // neighbours, counted once per quad; later the flattest vertex around
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
      u.flatness += length;
      u.edges += 2;
    }
  }
  const auto each_point = [&](const auto& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 4096), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) work(i);
    });
  };
  each_point([&](std::size_t i) {
    Umbrella& u = umbrellas[i];
    const float n = std::sqrt(u.nx * u.nx + u.ny * u.ny + u.nz * u.nz), mean = 1 / std::max(u.edges, 1.0F);
    u.x *= mean, u.y *= mean, u.z *= mean;
    u.flatness = u.flatness > 0 ? n / u.flatness : 0;
    u.edges = 0;
  });
  for (const auto& q : quads) {
    float most = 0;
    for (int k = 0; k < 4; ++k) most = std::max(most, umbrellas[q[k]].flatness);
    for (int k = 0; k < 4; ++k) umbrellas[q[k]].edges = std::max(umbrellas[q[k]].edges, most);
  }
  const double most = 0.35 * voxel;
  each_point([&](std::size_t i) {
    Umbrella& u = umbrellas[i];
    const Vec3d n = normalized(Vec3d{u.nx, u.ny, u.nz});
    const double along = dot(Vec3d{u.x, u.y, u.z}, n);
    const float edge = (1 - ramp(u.flatness, sharp, smooth)) * ramp(u.edges, bent, flat);
    const Vec3f move = to_float(std::clamp((edge - 1) * along, -most, most) * n);
    u.x = move.x, u.y = move.y, u.z = move.z;
  });
  // Two steps or so: a quad's shorter diagonal may turn on the way. A field that is no distance may hold a volume that
  // no such move can reach.
  constexpr int rounds = 4;
  constexpr double close_enough = 1e-3;
  double now = volume(points, quads), moved = 0, step = 1;
  for (int round = 0; round < rounds && step != 0; ++round) {
    const double to = std::clamp(moved + step, 0.0, 2.0);
    const auto more = static_cast<float>(to - moved);
    each_point(
        [&](std::size_t i) { points[i] += more * openvdb::Vec3s(umbrellas[i].x, umbrellas[i].y, umbrellas[i].z); });
    const double after = volume(points, quads), gained = after - now;
    const bool done = gained == 0 || std::abs(after - wanted_mm3) <= close_enough * wanted_mm3;
    step = done ? 0 : (wanted_mm3 - after) * (to - moved) / gained;
    moved = to;
    now = after;
  }
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
  return_free_memory();
  openvdb::tools::volumeToMesh(*solid.impl().grid, points, triangles, quads, 0.0, 0.0);
  return_free_memory();
  context.check();
  context.progress(0.6);
  if (points.size() >= std::numeric_limits<std::uint32_t>::max()) {
    throw Error(Code::TooLarge, "the surface has more vertices than a mesh can hold", {}, "use a larger --voxel");
  }
  const double voxel = solid.grid().voxel_mm;
  if (params.keep_volume) inflate(points, quads, voxel, solid.volume_mm3());
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
