// SPDX-License-Identifier: Apache-2.0
#include "sharpen.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "dual_surface.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

/// A bend of more than about 20 degrees between a quad and the mean about a vertex.
constexpr double smooth_cosine = 0.94;
/// Directions in which the planes say less than this, relative to the best known one, stay as they are.
constexpr double least_eigenvalue = 0.1;

struct FacedSurface {
  std::vector<Vec3d> points;
  Quads quads;  ///< Counterclockwise from outside.
  std::vector<Vec3d> normals;
};

FacedSurface zero_level(const openvdb::FloatTree::Ptr& level_set, double voxel_mm) {
  const Grid spec{.voxel_mm = voxel_mm};
  auto grid = make_grid(spec);
  grid->setTree(level_set);
  const QuadLayer zero = dual_surface(make_solid(std::move(grid), spec), 2, {});
  FacedSurface surface;
  surface.points.reserve(zero.points.size());
  for (const auto& p : zero.points) surface.points.push_back({p.x(), p.y(), p.z()});
  surface.quads = zero.quads;
  surface.normals.reserve(zero.quads.size());
  for (const Quad& q : zero.quads) {
    const auto& p = surface.points;
    surface.normals.push_back(normalized(cross(p[q[2]] - p[q[0]], p[q[3]] - p[q[1]])));
  }
  return surface;
}

/// Vertices where the surface bends.
std::vector<bool> sharp_vertices(const FacedSurface& surface) {
  std::vector<Vec3d> mean(surface.points.size());
  for (std::size_t i = 0; i < surface.quads.size(); ++i) {
    for (const std::uint32_t v : surface.quads[i]) mean[v] = mean[v] + surface.normals[i];
  }
  for (Vec3d& n : mean) n = normalized(n);
  std::vector<bool> sharp(surface.points.size(), false);
  for (std::size_t i = 0; i < surface.quads.size(); ++i) {
    for (const std::uint32_t v : surface.quads[i])
      sharp[v] = sharp[v] || dot(mean[v], surface.normals[i]) < smooth_cosine;
  }
  return sharp;
}

struct Plane {
  Vec3d point, normal;
  bool found = false;
};

/// The plane of the original triangle nearest to a quad's centre, if it is near and faces the same way.
Plane plane_at(const FacedSurface& surface, std::size_t quad, double voxel_mm, const Mesh& original,
               const WindingTree& tree) {
  Vec3d center{};
  for (const std::uint32_t v : surface.quads[quad]) center = center + 0.25 * surface.points[v];
  const auto nearest = tree.nearest(center);
  if (nearest.distance_mm > voxel_mm) return {};
  const Mesh::Triangle& t = original.triangles[nearest.triangle];
  const Vec3d a = to_double(original.vertices[t[0]]);
  const Vec3d normal =
      normalized(cross(to_double(original.vertices[t[1]]) - a, to_double(original.vertices[t[2]]) - a));
  return {nearest.point, normal, dot(normal, surface.normals[quad]) > 0.3};
}

/// The sum of squared distances to planes, as a quadratic form about a point.
struct Quadric {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};

/// The shortest way to the least error, in the directions the planes determine.
Vec3d way_to_minimum(const Quadric& quadric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(quadric.a);
  const double largest = solver.eigenvalues()[2];
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const double value = solver.eigenvalues()[i];
    if (value > least_eigenvalue * largest && value > 0) {
      const Eigen::Vector3d direction = solver.eigenvectors().col(i);
      way += direction.dot(quadric.b) / value * direction;
    }
  }
  return {way.x(), way.y(), way.z()};
}

void move_to_edges(FacedSurface& surface, double voxel_mm, const Mesh& original, const WindingTree& tree) {
  const std::vector<bool> sharp = sharp_vertices(surface);
  std::vector<std::size_t> near_edge;
  for (std::size_t i = 0; i < surface.quads.size(); ++i) {
    const Quad& q = surface.quads[i];
    if (std::any_of(q.begin(), q.end(), [&](std::uint32_t v) { return sharp[v]; })) near_edge.push_back(i);
  }
  std::vector<Plane> planes(near_edge.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, planes.size(), 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      planes[i] = plane_at(surface, near_edge[i], voxel_mm, original, tree);
    }
  });
  std::vector<std::uint32_t> place(surface.points.size(), 0), vertices;
  for (std::uint32_t v = 0; v < surface.points.size(); ++v) {
    if (!sharp[v]) continue;
    place[v] = static_cast<std::uint32_t>(vertices.size());
    vertices.push_back(v);
  }
  std::vector<Quadric> quadrics(vertices.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {  // one after the other: the same sums on any number of threads
    if (!planes[i].found) continue;
    const Eigen::Vector3d n(planes[i].normal.x, planes[i].normal.y, planes[i].normal.z);
    for (const std::uint32_t v : surface.quads[near_edge[i]]) {
      if (!sharp[v]) continue;
      Quadric& quadric = quadrics[place[v]];
      quadric.a += n * n.transpose();
      quadric.b += n * dot(planes[i].normal, planes[i].point - surface.points[v]);
    }
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices.size(), 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Vec3d way = way_to_minimum(quadrics[i]);
      if (norm(way) <= voxel_mm) surface.points[vertices[i]] = surface.points[vertices[i]] + way;
    }
  });
}

}  // namespace

Mesh sharp_zero_level(const openvdb::FloatTree::Ptr& level_set, double voxel_mm, const Mesh& original,
                      const WindingTree& tree, const Context& context) {
  FacedSurface surface = zero_level(level_set, voxel_mm);
  context.check();
  move_to_edges(surface, voxel_mm, original, tree);
  context.check();
  Mesh mesh;
  mesh.vertices.reserve(surface.points.size());
  for (const Vec3d& p : surface.points) mesh.vertices.push_back(to_float(p));
  mesh.triangles.reserve(2 * surface.quads.size());
  for (const Quad& q : surface.quads) {
    // Along the shorter diagonal, so that a row of vertices on an edge stays an edge.
    const auto& p = surface.points;
    if (norm(p[q[2]] - p[q[0]]) <= norm(p[q[3]] - p[q[1]])) {
      mesh.triangles.push_back({q[0], q[1], q[2]});
      mesh.triangles.push_back({q[0], q[2], q[3]});
    } else {
      mesh.triangles.push_back({q[0], q[1], q[3]});
      mesh.triangles.push_back({q[1], q[2], q[3]});
    }
  }
  return mesh;
}

}  // namespace fibrolite
