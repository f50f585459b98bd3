// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/surface.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "dual_surface.h"
#include "fibrolite/random.h"

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
using Quad = std::array<std::uint32_t, 4>;
using Quads = std::vector<Quad>;

Vec3d at(const Points& points, std::uint32_t i) { return {points[i].x(), points[i].y(), points[i].z()}; }

/// Without area.
bool flat(const Points& points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const Vec3d n = cross(at(points, b) - at(points, a), at(points, c) - at(points, a));
  return dot(n, n) <= 0;
}

double squared_distance(const Points& points, std::uint32_t a, std::uint32_t b) {
  const Vec3d d = at(points, b) - at(points, a);
  return dot(d, d);
}

/// Split each quad along its shorter diagonal, unless that leaves a triangle without area.
Mesh::Triangle* split(const Points& points, const Quad& q, Mesh::Triangle* out) {
  bool first = squared_distance(points, q[0], q[2]) <= squared_distance(points, q[1], q[3]);
  const auto without_area = [&](std::size_t a, std::size_t b, std::size_t c) { return flat(points, q[a], q[b], q[c]); };
  if (first ? without_area(0, 1, 2) || without_area(0, 2, 3) : without_area(0, 1, 3) || without_area(1, 2, 3))
    first = !first;
  if (first) {
    *out++ = {q[0], q[1], q[2]};
    *out++ = {q[0], q[2], q[3]};
  } else {
    *out++ = {q[0], q[1], q[3]};
    *out++ = {q[1], q[2], q[3]};
  }
  return out;
}

/// Volume that the quads enclose, each split along its shorter diagonal. Chunks are added in order: the same bits on
/// any number of threads.
double volume(const Points& points, const Quads& quads) {
  constexpr std::size_t chunk = 65536;
  std::vector<double> sums((quads.size() + chunk - 1) / chunk, 0.0);
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t c) {
    for (std::size_t i = c * chunk; i < std::min(quads.size(), (c + 1) * chunk); ++i) {
      const Vec3d a = at(points, quads[i][0]), b = at(points, quads[i][1]), p = at(points, quads[i][2]),
                  q = at(points, quads[i][3]);
      const Vec3d ap = p - a, bq = q - b;
      sums[c] += dot(ap, ap) <= dot(bq, bq) ? dot(a, cross(p, bq)) : dot(q, cross(b, ap));
    }
  });
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum / 6;
}

/// Calls work(quad) for all quads, in parallel, no two at once that share a vertex, and those of one vertex in the same
/// order on any number of threads: every other layer, since quads of a layer have their vertices in it and the one
/// below.
template <class Work>
void each_quad(const QuadSurface& surface, const Work& work) {
  const std::size_t layers = surface.layer_quads.size() - 1;
  for (const std::size_t parity : {0U, 1U}) {
    tbb::parallel_for(std::size_t{0}, (layers + 1 - parity) / 2, [&](std::size_t n) {
      const std::size_t layer = 2 * n + parity;
      for (std::size_t i = surface.layer_quads[layer]; i < surface.layer_quads[layer + 1]; ++i) work(surface.quads[i]);
    });
  }
}

/// A mesh with its vertices on (or, as here, averaged below) a convex surface lies inside it and loses volume. To
/// second order the loss is made good by moving each vertex along its normal by the normal part of its umbrella vector,
/// mirrored; how far exactly is then set by the volume of the grid. Flat faces and sharp edges stay where they are: an
/// edge is a bend beside something flat; a stick as thin as two voxels bends as much but has nothing flat around it.
void inflate(QuadSurface& surface, double voxel, double wanted_mm3) {
  Points& points = surface.points;
  const Quads& quads = surface.quads;
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
  each_quad(surface, [&](const Quad& q) {
    const openvdb::Vec3s n = (points[q[2]] - points[q[0]]).cross(points[q[3]] - points[q[1]]);
    const float length = n.length();
    for (std::size_t k = 0; k < 4; ++k) {
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
  });
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
  each_quad(surface, [&](const Quad& q) {
    float most = 0;
    for (const std::uint32_t v : q) most = std::max(most, umbrellas[v].flatness);
    for (const std::uint32_t v : q) umbrellas[v].edges = std::max(umbrellas[v].edges, most);
  });
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

bool degenerate(const Points& points, const Quad& q) {
  return (flat(points, q[0], q[1], q[2]) || flat(points, q[0], q[2], q[3])) &&
         (flat(points, q[0], q[1], q[3]) || flat(points, q[1], q[2], q[3]));
}

bool any_degenerate(const Points& points, const Quads& quads) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, quads.size(), 65536), false,
      [&](const auto& range, bool found) {
        for (std::size_t i = range.begin(); i < range.end() && !found; ++i) found = degenerate(points, quads[i]);
        return found;
      },
      [](bool a, bool b) { return a || b; });
}

/// Quads that neither diagonal saves: move a corner by a thousandth of a voxel in a random direction and look again.
void shake_degenerate(Points& points, const Quads& quads, double voxel) {
  Random random(1, "surface");
  for (int round = 0; round < 8 && any_degenerate(points, quads); ++round) {
    for (const auto& q : quads) {
      if (!degenerate(points, q)) continue;
      for (std::size_t k = 0; k < 4; ++k) {
        const auto step = [&] { return static_cast<float>((random.uniform() - 0.5) * 4e-3 * voxel); };
        const float dx = step(), dy = step(), dz = step();
        points[q[k]] += openvdb::Vec3s(dx, dy, dz);
      }
    }
  }
}

}  // namespace

Mesh surface(const Solid& solid, const SurfaceParams& params, const Context& context) {
  context.check();
  return_free_memory();
  QuadSurface zero = dual_surface(solid, params.axis, context.part(0, 0.5, ""));
  context.check();
  const double voxel = solid.grid().voxel_mm;
  if (params.keep_volume) inflate(zero, voxel, solid.volume_mm3());
  shake_degenerate(zero.points, zero.quads, voxel);
  context.check();

  Mesh mesh;
  mesh.triangles.resize(2 * zero.quads.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, zero.quads.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) split(zero.points, zero.quads[i], &mesh.triangles[2 * i]);
  });
  Quads().swap(zero.quads);
  mesh.vertices.resize(zero.points.size());
  for (std::size_t i = 0; i < zero.points.size(); ++i)
    mesh.vertices[i] = {zero.points[i].x(), zero.points[i].y(), zero.points[i].z()};
  context.progress(1);
  return mesh;
}

}  // namespace fibrolite
