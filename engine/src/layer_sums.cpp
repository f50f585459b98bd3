// SPDX-License-Identifier: Apache-2.0
#include "layer_sums.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "eight_places.h"
#include "fibrolite/clones.h"

namespace fibrolite {
namespace {

using Range = tbb::blocked_range<std::size_t>;

struct Eight {
  std::array<double, lanes> six_volumes{};
  std::array<std::int32_t, lanes> clear{};  ///< Has it an area, rounded as its products are?
};

FIBROLITE_CLONES void add_eight(const Mesh::Triangle* triangles, const Vec3f* vertices, std::size_t first, Vec3d from,
                                Eight& sums) {
  std::array<EightPlaces, 3> p;
  for (std::size_t corner = 0; corner < 3; ++corner) gather(triangles, corner, vertices, first, p[corner]);
  EightPlaces u, v, n;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    u[axis] = p[1][axis] - p[0][axis];
    v[axis] = p[2][axis] - p[0][axis];
  }
  Mask clear;
  cross(u, v, n, clear);
  std::array<std::array<Doubles, 3>, 3> d;
  const std::array<double, 3> zero{from.x, from.y, from.z};
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (std::size_t axis = 0; axis < 3; ++axis)
      d[corner][axis] = __builtin_convertvector(p[corner][axis], Doubles) - zero[axis];
  Doubles volume;
  std::memcpy(&volume, &sums.six_volumes, sizeof volume);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t y = (axis + 1) % 3, z = (axis + 2) % 3;
    volume += d[0][axis] * (d[1][y] * d[2][z] - d[1][z] * d[2][y]);
  }
  std::memcpy(&sums.six_volumes, &volume, sizeof volume);
  std::memcpy(&sums.clear, &clear, sizeof clear);
}

}  // namespace

Box3d box_of(std::span<const Vec3f> vertices) {
  return tbb::parallel_reduce(
      Range(0, vertices.size(), 4096), Box3d{},
      [&](const Range& range, Box3d box) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) box.include(to_double(vertices[i]));
        return box;
      },
      [](Box3d a, const Box3d& b) {
        if (b.empty()) return a;
        a.include(b.min);
        a.include(b.max);
        return a;
      });
}

LayerSums sums_of(const MeshLayer& layer, Vec3d from) {
  const auto some = [&](const Range& range, LayerSums sums) {
    Eight eight;
    for (std::size_t at = range.begin(); at < range.end(); at += lanes) {
      const std::size_t count = std::min(lanes, range.end() - at);
      const Mesh::Triangle* triangles = layer.triangles.data() + at;
      std::array<Mesh::Triangle, lanes> last;
      if (count < lanes) {  // filled up with triangles that add nothing
        const std::uint32_t corner = triangles[0][0];
        last.fill({corner, corner, corner});
        std::copy_n(triangles, count, last.begin());
        triangles = last.data();
      }
      add_eight(triangles, layer.vertices.data(), layer.first, from, eight);
      for (std::size_t lane = 0; lane < count; ++lane) {
        if (eight.clear[lane] != 0) continue;
        const auto& [a, b, c] = triangles[lane];
        const bool collapsed = a == b || b == c || c == a;
        sums.collapsed += collapsed ? 1 : 0;
        sums.degenerate += collapsed || zero_area(layer.at(a), layer.at(b), layer.at(c)) ? 1 : 0;
      }
    }
    for (const double six : eight.six_volumes) sums.volume_mm3 += six / 6;
    return sums;
  };
  return tbb::parallel_deterministic_reduce(Range(0, layer.triangles.size(), 4096), LayerSums{}, some,
                                            [](LayerSums a, const LayerSums& b) {
                                              a.volume_mm3 += b.volume_mm3;
                                              a.degenerate += b.degenerate;
                                              a.collapsed += b.collapsed;
                                              return a;
                                            });
}

}  // namespace fibrolite
