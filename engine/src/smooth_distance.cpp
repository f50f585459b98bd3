// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "fibrolite/slice.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Weights = std::array<float, 4>;

/// Of the samples at -1, 0, 1 and 2, for t in [0, 1]: exact for quadratics.
Weights catmull_rom(float t) {
  const float t2 = t * t, t3 = t2 * t;
  return {-0.5F * t + t2 - 0.5F * t3, 1 - 2.5F * t2 + 1.5F * t3, 0.5F * t + 2 * t2 - 1.5F * t3, -0.5F * t2 + 0.5F * t3};
}

/// The samples about some points, in one piece: each is fetched from the tree once, and not 64 times for every point.
struct Samples {
  openvdb::Coord low;
  int ny = 0, nz = 0;
  std::vector<float> value;

  void fetch(const Tree& tree, const openvdb::CoordBBox& box) {
    low = box.min();
    ny = box.dim().y();
    nz = box.dim().z();
    value.resize(box.volume());
    openvdb::tree::ValueAccessor<const Tree> access(tree);
    std::size_t n = 0;
    for (int x = box.min().x(); x <= box.max().x(); ++x) {
      for (int y = box.min().y(); y <= box.max().y(); ++y) {
        for (int z = box.min().z(); z <= box.max().z(); ++z) value[n++] = access.getValue({x, y, z});
      }
    }
  }
  /// `at`: the first of the 4 x 4 x 4 samples.
  [[nodiscard]] float blend(const openvdb::Coord& at, const Weights& wx, const Weights& wy, const Weights& wz) const {
    float sum = 0;
    for (int i = 0; i < 4; ++i) {
      float plane = 0;
      for (int j = 0; j < 4; ++j) {
        const float* v = value.data() + ((at.x() - low.x() + i) * ny + (at.y() - low.y() + j)) * nz + at.z() - low.z();
        plane += wy[static_cast<std::size_t>(j)] * (wz[0] * v[0] + wz[1] * v[1] + wz[2] * v[2] + wz[3] * v[3]);
      }
      sum += wx[static_cast<std::size_t>(i)] * plane;
    }
    return sum;
  }
};

struct SmoothDistance final : Shape::Function {
  explicit SmoothDistance(Solid s) : solid(std::move(s)), samples(distance_to(solid)) {}

  void evaluate(const PointBlock& block, float* out) const override {
    const double scale = 1 / solid.grid().voxel_mm;
    thread_local Samples near;
    constexpr std::size_t most = 1 << 14;
    for (int done = 0, n = 0; done < block.count; done += n) {
      // As many points as lie close enough together.
      openvdb::CoordBBox box;
      for (n = 0; done + n < block.count; ++n) {
        openvdb::CoordBBox larger = box;
        const openvdb::Coord first = cell(block, done + n, scale).offsetBy(-1);
        larger.expand(first);
        larger.expand(first.offsetBy(3));
        if (n > 0 && larger.volume() > most) break;
        box = larger;
      }
      near.fetch(solid.impl().grid->tree(), box);
      for (int k = done; k < done + n; ++k) {
        const openvdb::Coord at = cell(block, k, scale);
        out[k] = near.blend(at.offsetBy(-1), catmull_rom(static_cast<float>(block.x[k] * scale - at.x())),
                            catmull_rom(static_cast<float>(block.y[k] * scale - at.y())),
                            catmull_rom(static_cast<float>(block.z[k] * scale - at.z())));
      }
    }
  }
  static openvdb::Coord cell(const PointBlock& block, int k, double scale) {
    const auto floor = [scale](float v) { return static_cast<int>(std::floor(v * scale)); };
    return {floor(block.x[k]), floor(block.y[k]), floor(block.z[k])};
  }

  /// The weights of an axis add up to 1, and without their signs to 1.25 at most: values leave the range of the samples
  /// by less than half of it.
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Interval b = samples.bound(box.grown(solid.grid().voxel_mm));
    const float over = 0.48F * (b.hi - b.lo);
    return {b.lo - over, b.hi + over};
  }
  [[nodiscard]] double lipschitz() const override { return 2; }

  Solid solid;
  Shape samples;
};

}  // namespace

Shape smooth_distance_to(const Solid& solid) { return Shape(std::make_shared<const SmoothDistance>(solid)); }

}  // namespace fibrolite
