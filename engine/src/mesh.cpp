// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cstddef>
#include <functional>

#include "fibrolite/mesh_layers.h"

namespace fibrolite {
namespace {

using Range = tbb::blocked_range<std::size_t>;
constexpr std::size_t grain = 8192;

// parallel_deterministic_reduce splits by the grain alone, so the sum has the
// same order on any number of threads.
template <class Term>
double sum_over(const MeshLayer& layer, const Term& term) {
  return tbb::parallel_deterministic_reduce(
      Range(0, layer.triangles.size(), grain), 0.0,
      [&](const Range& range, double sum) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          const auto& t = layer.triangles[i];
          sum += term(to_double(layer.at(t[0])), to_double(layer.at(t[1])), to_double(layer.at(t[2])));
        }
        return sum;
      },
      std::plus<>{});
}

}  // namespace

Box3d bounds(const Mesh& mesh) {
  return tbb::parallel_reduce(
      Range(0, mesh.vertices.size(), grain), Box3d{},
      [&](const Range& range, Box3d box) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) box.include(to_double(mesh.vertices[i]));
        return box;
      },
      [](Box3d a, const Box3d& b) {
        if (b.empty()) return a;
        a.include(b.min);
        a.include(b.max);
        return a;
      });
}

double signed_volume(const Mesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  // Measured from the middle of the model: fewer digits are lost far from the
  // origin, and an open model's volume does not depend on where it stands.
  return signed_volume({mesh.vertices, 0, 0, mesh.triangles, {}}, bounds(mesh).center());
}

double signed_volume(const MeshLayer& layer, Vec3d from) {
  return sum_over(layer, [from](Vec3d a, Vec3d b, Vec3d c) { return dot(a - from, cross(b - from, c - from)) / 6; });
}

double area(const Mesh& mesh) {
  return sum_over({mesh.vertices, 0, 0, mesh.triangles, {}},
                  [](Vec3d a, Vec3d b, Vec3d c) { return norm(cross(b - a, c - a)) / 2; });
}

}  // namespace fibrolite
