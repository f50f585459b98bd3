// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/diameter.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "face_graph.h"
#include "fibrolite/error.h"

namespace fibrolite {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

struct Ray {
  double x, y;    // in the disk across the cone, as a share of its radius
  double length;  // mm
};

Kernel::Point_3 point(Vec3d p) { return {p.x, p.y, p.z}; }
Vec3d vec(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

// A sunflower whose seeds crowd at the centre: rays near the normal tell most about the thickness.
std::vector<Ray> cone_samples(int count) {
  std::vector<Ray> samples;
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double radius = static_cast<double>(i) / count;
    samples.push_back({radius * std::cos(i * golden_angle), radius * std::sin(i * golden_angle), 0});
  }
  return samples;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Rays that slip into a neighbouring limb are long: those far from the median do not count.
double robust_mean(const std::vector<double>& lengths) {
  if (lengths.empty()) return -1;
  std::vector<double> sorted = lengths;
  const double centre = median(sorted);
  for (std::size_t i = 0; i < lengths.size(); ++i) sorted[i] = std::abs(lengths[i] - centre);
  const double spread = std::max(1.5 * median(sorted), 1e-9 * centre);
  double sum = 0;
  int count = 0;
  for (const double length : lengths) {
    if (std::abs(length - centre) > spread) continue;
    sum += length;
    ++count;
  }
  return count > 0 ? sum / count : centre;
}

double face_diameter(const Mesh& mesh, const FaceGraph& graph, const Tree& tree, const Triangles& triangles,
                     std::size_t face, const std::vector<Ray>& samples, double half_cone) {
  const Vec3d inward = -graph.normal[face];
  if (inward == Vec3d{}) return -1;
  const auto& t = mesh.triangles[face];
  const Vec3d u = normalized(to_double(mesh.vertices[t[1]]) - to_double(mesh.vertices[t[0]]));
  const Vec3d v = cross(inward, u);
  const auto self = triangles.begin() + static_cast<std::ptrdiff_t>(face);
  std::vector<double> lengths;
  lengths.reserve(samples.size());
  for (const Ray& sample : samples) {
    const Vec3d direction = std::cos(half_cone) * inward + std::sin(half_cone) * (sample.x * u + sample.y * v);
    const Kernel::Ray_3 ray(point(graph.centroid[face]), Kernel::Vector_3(direction.x, direction.y, direction.z));
    const auto hit = tree.first_intersection(ray, [&](const Tree::Primitive_id& id) { return id == self; });
    if (!hit) continue;
    const auto* where = boost::get<Kernel::Point_3>(&hit->first);
    if (where == nullptr) continue;
    // A wall seen from its outside is not the far side of this limb.
    if (dot(graph.normal[static_cast<std::size_t>(hit->second - triangles.begin())], direction) <= 0) continue;
    lengths.push_back(norm(vec(*where) - graph.centroid[face]));
  }
  return robust_mean(lengths);
}

// Faces that saw nothing take the mean of their neighbours, ring by ring.
void fill_gaps(const FaceGraph& graph, std::vector<double>& value) {
  for (bool changed = true; changed;) {
    changed = false;
    const std::vector<double> before = value;
    for (std::size_t f = 0; f < value.size(); ++f) {
      if (before[f] >= 0) continue;
      double sum = 0;
      int count = 0;
      for (const std::uint32_t n : graph.neighbours[f]) {
        if (before[n] < 0) continue;
        sum += before[n];
        ++count;
      }
      if (count == 0) continue;
      value[f] = sum / count;
      changed = true;
    }
  }
  for (double& v : value) v = std::max(v, 0.0);
}

// Diffusion over the faces that stops at steps of the diameter: noise goes, the border of a limb stays where it is.
void smooth(const FaceGraph& graph, std::vector<double>& value, const Context& context) {
  constexpr double edge_share = 0.25;  // a step of this share of the diameter lets little through
  const int rounds = static_cast<int>(std::clamp(static_cast<double>(graph.size()) / 1500, 4.0, 40.0));
  std::vector<double> before;
  for (int round = 0; round < rounds; ++round) {
    context.check();
    before = value;
    tbb::parallel_for(std::size_t{0}, value.size(), [&](std::size_t f) {
      double sum = graph.area_mm2[f] * before[f];
      double weight = graph.area_mm2[f];
      for (const std::uint32_t n : graph.neighbours[f]) {
        const double scale = edge_share * std::max(before[f], before[n]);
        const double step = scale > 0 ? (before[n] - before[f]) / scale : 0;
        const double w = graph.area_mm2[n] * std::exp(-0.5 * step * step);
        sum += w * before[n];
        weight += w;
      }
      if (weight > 0) value[f] = sum / weight;
    });
  }
}

// Smallest and largest, but for one face in a thousand at either end: a single sliver at an ear or between two fingers
// would move every threshold, another one in each position of the model.
std::pair<double, double> usual_range(std::vector<double> value) {
  const std::size_t beyond = value.size() / 1000;
  const auto low = value.begin() + static_cast<std::ptrdiff_t>(beyond), high = value.end() - 1 - (low - value.begin());
  std::nth_element(value.begin(), low, value.end());
  const double least = *low;
  std::nth_element(value.begin(), high, value.end());
  return {least, *high};
}

}  // namespace

DiameterField diameter(const Mesh& surface, const DiameterParams& params, const Context& context) {
  if (!(params.cone_rad > 0 && params.cone_rad < std::numbers::pi)) {
    throw Error(Code::BadRecipe, "the cone of rays must open between 0 and pi", "diameter.cone_rad", "try 2.09");
  }
  if (params.rays < 1 || params.rays > 10000) {
    throw Error(Code::BadRecipe, "the number of rays must be 1 to 10000", "diameter.rays", "try 25");
  }
  if (!(params.alpha > 0)) throw Error(Code::BadRecipe, "alpha must be above 0", "diameter.alpha", "try 4");
  const FaceGraph graph = make_face_graph(surface);
  if (!(signed_volume(surface) > 0)) {
    throw Error(Code::BadInput, "the surface faces inward", "diameter", "turn its triangles round");
  }
  Triangles triangles;
  triangles.reserve(surface.triangles.size());
  for (const auto& t : surface.triangles) {
    triangles.emplace_back(point(to_double(surface.vertices[t[0]])), point(to_double(surface.vertices[t[1]])),
                           point(to_double(surface.vertices[t[2]])));
  }
  Tree tree(triangles.begin(), triangles.end());
  tree.do_not_accelerate_distance_queries();
  tree.build();

  const std::vector<Ray> samples = cone_samples(params.rays);
  DiameterField field;
  field.diameter_mm.resize(triangles.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, triangles.size(), 256), [&](const auto& range) {
    context.check();
    for (std::size_t f = range.begin(); f < range.end(); ++f)
      field.diameter_mm[f] = face_diameter(surface, graph, tree, triangles, f, samples, 0.5 * params.cone_rad);
  });
  context.progress(0.9);
  fill_gaps(graph, field.diameter_mm);
  smooth(graph, field.diameter_mm, context);

  const auto [low, most] = usual_range(field.diameter_mm);
  const double span = most - low;
  field.normalized.resize(field.diameter_mm.size());
  for (std::size_t f = 0; f < field.normalized.size(); ++f) {
    const double linear = span > 0 ? std::clamp((field.diameter_mm[f] - low) / span, 0.0, 1.0) : 0;
    field.normalized[f] = std::log(linear * params.alpha + 1) / std::log(params.alpha + 1);
  }
  context.progress(1);
  return field;
}

}  // namespace fibrolite
