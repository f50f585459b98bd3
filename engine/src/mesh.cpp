// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cstddef>
#include <functional>

#include "layer_sums.h"

namespace fibrolite {
Box3d bounds(const Mesh& mesh) { return box_of(mesh.vertices); }

double signed_volume(const Mesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  // Measured from the middle of the model: fewer digits are lost far from the
  // origin, and an open model's volume does not depend on where it stands.
  return sums_of({mesh.vertices, 0, 0, mesh.triangles, {}}, bounds(mesh).center()).volume_mm3;
}

double area(const Mesh& mesh) {
  // Splits by the grain alone: the same order on any number of threads.
  using Range = tbb::blocked_range<std::size_t>;
  return tbb::parallel_deterministic_reduce(
      Range(0, mesh.triangles.size(), 8192), 0.0,
      [&](const Range& range, double sum) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          const auto& [i0, i1, i2] = mesh.triangles[i];
          const Vec3d a = to_double(mesh.vertices[i0]), b = to_double(mesh.vertices[i1]),
                      c = to_double(mesh.vertices[i2]);
          sum += norm(cross(b - a, c - a)) / 2;
        }
        return sum;
      },
      std::plus<>{});
}

}  // namespace fibrolite
