// SPDX-License-Identifier: GPL-3.0-or-later
#include "part_maker.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/ops/verify.h"

namespace fibrolite {
namespace {

constexpr double most_samples = 500000;

/// Sums over samples (or integrals over volume): enough for the centroid and the covariance.
struct Moments {
  double count = 0;
  Vec3d sum{};
  std::array<double, 6> square{};  // xx yy zz xy yz zx

  void add(Vec3d p) {
    ++count;
    sum = sum + p;
    const std::array<double, 6> product{p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.y * p.z, p.z * p.x};
    for (std::size_t k = 0; k < 6; ++k) square[k] += product[k];
  }
  /// The tetrahedron (0, a, b, c), signed volume; its second moment is v/20 (sum p p' + (sum p)(sum p)').
  void add_tetrahedron(Vec3d a, Vec3d b, Vec3d c) {
    const double volume = dot(a, cross(b, c)) / 6;
    const Vec3d total = a + b + c;
    count += volume;
    sum = sum + 0.25 * volume * total;
    for (const Vec3d p : {a, b, c, total}) {
      const std::array<double, 6> product{p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.y * p.z, p.z * p.x};
      for (std::size_t k = 0; k < 6; ++k) square[k] += volume / 20 * product[k];
    }
  }
  void add(const Moments& other) {
    count += other.count;
    sum = sum + other.sum;
    for (std::size_t k = 0; k < 6; ++k) square[k] += other.square[k];
  }
};

/// The direction in which the samples reach farthest; its sign is that of its largest component.
Vec3d longest_principal_axis(const Moments& m) {
  if (!(m.count > 0)) return {0, 0, 1};
  const Vec3d c = m.sum / m.count;
  Eigen::Matrix3d covariance;
  const double xy = m.square[3] / m.count - c.x * c.y, yz = m.square[4] / m.count - c.y * c.z,
               zx = m.square[5] / m.count - c.z * c.x;
  covariance << m.square[0] / m.count - c.x * c.x, xy, zx, xy, m.square[1] / m.count - c.y * c.y, yz, zx, yz,
      m.square[2] / m.count - c.z * c.z;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const Eigen::Vector3d v = solver.eigenvectors().col(2);
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  return normalized((v[largest] < 0 ? -1.0 : 1.0) * Vec3d{v[0], v[1], v[2]});
}

/// Moments of the inside samples of each part, on a lattice about the origin of the proxy's box. Summed plane by plane,
/// then over the planes in order: the same bits on any number of threads.
std::vector<Moments> moments(const Proxy& proxy, const Labels& labels, Vec3d about) {
  const Box3d box = proxy.solid.bounds_mm();
  const Vec3d size = box.size();
  const double h = std::max(proxy.solid.grid().voxel_mm, std::cbrt(size.x * size.y * size.z / most_samples));
  const auto steps = [&](double length) { return static_cast<int>(length / h) + 1; };
  const auto parts = static_cast<std::size_t>(labels.count());
  std::vector<std::vector<Moments>> planes(static_cast<std::size_t>(steps(size.z)), std::vector<Moments>(parts));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, planes.size()), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      for (int j = 0; j < steps(size.y); ++j) {
        for (int i = 0; i < steps(size.x); ++i) {
          const Vec3d p = box.min + h * Vec3d{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
          if (proxy.solid.distance(p) < 0) planes[k][static_cast<std::size_t>(labels.label(p))].add(p - about);
        }
      }
    }
  });
  std::vector<Moments> total(parts);
  for (const auto& plane : planes) {
    for (std::size_t part = 0; part < parts; ++part) total[part].add(plane[part]);
  }
  return total;
}

}  // namespace

Part PartMaker::make(Fields fields) {
  Part part;
  part.id_ = fields.id;
  part.kind_ = fields.kind;
  part.candidates_ = std::move(fields.candidates);
  part.chosen_ = fields.chosen;
  part.region_ = std::move(fields.region);
  part.bounds_ = fields.bounds_mm;
  part.axis_ = std::move(fields.axis);
  part.diameter_ = fields.diameter_mm;
  part.volume_ = fields.volume_mm3;
  part.centroid_ = fields.centroid_mm;
  part.stress_ = fields.stress;
  part.reason_ = std::move(fields.reason);
  return part;
}

std::vector<PartGeometry> part_geometry(const Proxy& proxy, const Labels& labels) {
  const Box3d box = proxy.solid.bounds_mm();
  const std::vector<Moments> inside = moments(proxy, labels, box.center());
  std::vector<PartGeometry> result(inside.size());
  struct Reach {
    double low = std::numeric_limits<double>::infinity(), high = -low;
  };
  std::vector<Reach> reach(inside.size());
  std::vector<Vec3d> direction(inside.size());
  for (std::size_t part = 0; part < inside.size(); ++part) {
    direction[part] = longest_principal_axis(inside[part]);
    if (inside[part].count > 0) result[part].centroid_mm = box.center() + inside[part].sum / inside[part].count;
  }
  // A part is farthest out where it meets the surface of the body, cut faces included: their rims lie on it.
  for (const Vec3f& vertex : proxy.surface.vertices) {
    const Vec3d p = to_double(vertex);
    const auto part = static_cast<std::size_t>(labels.label(p));
    result[part].bounds_mm.include(p);
    const double along = dot(p - result[part].centroid_mm, direction[part]);
    reach[part] = {std::min(reach[part].low, along), std::max(reach[part].high, along)};
  }
  for (std::size_t part = 0; part < inside.size(); ++part) {
    PartGeometry& g = result[part];
    if (g.bounds_mm.empty()) g.bounds_mm.include(g.centroid_mm);
    g.bounds_mm = g.bounds_mm.grown(2 * proxy.solid.grid().voxel_mm);
    if (reach[part].low < reach[part].high) {
      g.axis = Axis::straight(g.centroid_mm + reach[part].low * direction[part],
                              g.centroid_mm + reach[part].high * direction[part]);
    }
  }
  return result;
}

Parts whole_body(const Mesh& model, Kind kind) {
  const Box3d box = bounds(model);
  Moments inside;
  for (const Mesh::Triangle& t : model.triangles) {
    inside.add_tetrahedron(to_double(model.vertices[t[0]]) - box.center(),
                           to_double(model.vertices[t[1]]) - box.center(),
                           to_double(model.vertices[t[2]]) - box.center());
  }
  const double volume = inside.count;
  const Vec3d along = longest_principal_axis(inside);
  const Vec3d centroid = volume > 0 ? box.center() + inside.sum / volume : box.center();
  double low = 0, high = 0;
  for (const Vec3f& vertex : model.vertices) {
    const double at = dot(to_double(vertex) - centroid, along);
    low = std::min(low, at);
    high = std::max(high, at);
  }
  const double length = high - low;
  const Labels labels;
  Parts parts;
  parts.parts.push_back(PartMaker::make(
      {.id = 0,
       .kind = kind,
       .region = labels.region(0),
       .bounds_mm = box,
       .axis = length > 0 ? Axis::straight(centroid + low * along, centroid + high * along) : Axis(),
       .diameter_mm = length > 0 && volume > 0 ? std::sqrt(4 * volume / (std::numbers::pi * length)) : 0,
       .volume_mm3 = volume,
       .centroid_mm = centroid,
       .stress = {},
       .reason = std::string(name(kind)) + ": chosen for the whole body"}));
  parts.labels = labels;
  return parts;
}

}  // namespace fibrolite
