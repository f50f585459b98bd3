// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "fibrolite/clones.h"
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

/// The cell of each coordinate, voxels.
FIBROLITE_CLONES void cells_of(const float* mm, int count, double scale, int* cell) {
  for (int k = 0; k < count; ++k) {
    const double v = static_cast<double>(mm[k]) * scale;
    const int toward_zero = static_cast<int>(v);
    cell[k] = toward_zero - (v < toward_zero ? 1 : 0);
  }
}

/// to[i] = ((w0 a0[i] + w1 a1[i]) + w2 a2[i]) + w3 a3[i], a_n the n-th of the runs of samples that lie `apart`.
void blend(const float* from, std::ptrdiff_t apart, const Weights& w, std::ptrdiff_t count, float* to) {
  const float *a = from, *b = a + apart, *c = b + apart, *d = c + apart;
  for (std::ptrdiff_t i = 0; i < count; ++i) to[i] = w[0] * a[i] + w[1] * b[i] + w[2] * c[i] + w[3] * d[i];
}

/// The cells of a block's points, each with the first of its 4 x 4 x 4 samples one below.
struct Cells {
  std::array<int, PointBlock::capacity> x, y, z;

  Cells(const PointBlock& block, double scale) {
    cells_of(block.x, block.count, scale, x.data());
    cells_of(block.y, block.count, scale, y.data());
    cells_of(block.z, block.count, scale, z.data());
  }
  /// Of the samples about points [first, last).
  [[nodiscard]] openvdb::CoordBBox box(std::size_t first, std::size_t last) const {
    openvdb::Coord low(x[first], y[first], z[first]), high = low;
    for (std::size_t k = first + 1; k < last; ++k) {
      low = {std::min(low.x(), x[k]), std::min(low.y(), y[k]), std::min(low.z(), z[k])};
      high = {std::max(high.x(), x[k]), std::max(high.y(), y[k]), std::max(high.z(), z[k])};
    }
    return {low.offsetBy(-1), high.offsetBy(2)};
  }
};

/// The samples about some points, in one piece, x fastest: each is fetched from the tree once, and not 64 times for
/// every point.
class Samples {
 public:
  /// The value of all of them, if they are in tiles of one value; else they are fetched.
  std::optional<float> fetch(const Tree& tree, const openvdb::CoordBBox& box) {
    low_ = box.min();
    nx_ = box.dim().x();
    plane_ = static_cast<std::ptrdiff_t>(nx_) * box.dim().y();
    value_.resize(box.volume());
    const openvdb::tree::ValueAccessor<const Tree> access(tree);
    const openvdb::Coord first = box.min() & ~7;
    const float tile = access.getValue(box.min());
    bool uniform = true;
    for (int x = first.x(); x <= box.max().x(); x += 8) {
      for (int y = first.y(); y <= box.max().y(); y += 8) {
        for (int z = first.z(); z <= box.max().z(); z += 8) {
          openvdb::CoordBBox part(openvdb::Coord(x, y, z), openvdb::Coord(x + 7, y + 7, z + 7));
          const Tree::LeafNodeType* leaf = access.probeConstLeaf(part.min());
          const float all = leaf != nullptr ? 0 : access.getValue(part.min());
          uniform = uniform && leaf == nullptr && all == tile;
          part.intersect(box);
          copy(leaf, all, part);
        }
      }
    }
    return uniform ? std::optional(tile) : std::nullopt;
  }

  /// At points [first, last), whose samples were fetched.
  void blend_at(const PointBlock& block, const Cells& cells, std::size_t first, std::size_t last, double scale,
                float* out) {
    const auto weights = [scale](float mm, int cell) { return catmull_rom(static_cast<float>(mm * scale - cell)); };
    const float* const z = block.z + first;
    const bool level = std::all_of(z, block.z + last, [z](float other) { return other == *z; });
    if (level) {  // a plane of samples serves all points, a row of them those along x
      flat_.resize(static_cast<std::size_t>(plane_));
      row_.resize(static_cast<std::size_t>(nx_));
      blend(value_.data() + (cells.z[first] - 1 - low_.z()) * plane_, plane_, weights(*z, cells.z[first]), plane_,
            flat_.data());
    }
    for (std::size_t k = first; k < last; ++k) {
      const int x = cells.x[k] - 1 - low_.x(), y = cells.y[k] - 1 - low_.y();
      const Weights wx = weights(block.x[k], cells.x[k]);
      if (!level) {
        const std::ptrdiff_t at = (cells.z[k] - 1 - low_.z()) * plane_ + y * nx_ + x;
        out[k] = blend_one(at, wx, weights(block.y[k], cells.y[k]), weights(block.z[k], cells.z[k]));
        continue;
      }
      if (k == first || block.y[k] != block.y[k - 1])
        blend(flat_.data() + y * nx_, nx_, weights(block.y[k], cells.y[k]), nx_, row_.data());
      blend(row_.data() + x, 1, wx, 1, out + k);
    }
  }

 private:
  using Lanes [[gnu::vector_size(16)]] = float;
  static Lanes lanes(const float* from) {
    Lanes v;
    std::memcpy(&v, from, sizeof v);
    return v;
  }

  /// Along z, then y, then x, as a level block is.
  [[nodiscard]] float blend_one(std::ptrdiff_t at, const Weights& wx, const Weights& wy, const Weights& wz) const {
    std::array<Lanes, 4> along_z;
    for (std::size_t j = 0; j < 4; ++j) {
      const float* v = value_.data() + at + static_cast<std::ptrdiff_t>(j) * nx_;
      along_z[j] =
          wz[0] * lanes(v) + wz[1] * lanes(v + plane_) + wz[2] * lanes(v + 2 * plane_) + wz[3] * lanes(v + 3 * plane_);
    }
    const Lanes p = wy[0] * along_z[0] + wy[1] * along_z[1] + wy[2] * along_z[2] + wy[3] * along_z[3];
    return wx[0] * p[0] + wx[1] * p[1] + wx[2] * p[2] + wx[3] * p[3];
  }

  void copy(const Tree::LeafNodeType* leaf, float tile, const openvdb::CoordBBox& part) {
    const float* const from = leaf != nullptr ? leaf->buffer().data() : nullptr;
    const int count = part.dim().x();
    for (int z = part.min().z(); z <= part.max().z(); ++z) {
      for (int y = part.min().y(); y <= part.max().y(); ++y) {
        float* to = value_.data() + (z - low_.z()) * plane_ + (y - low_.y()) * nx_ + (part.min().x() - low_.x());
        if (from == nullptr) {
          std::fill_n(to, count, tile);
          continue;
        }
        const float* v = from + Tree::LeafNodeType::coordToOffset({part.min().x(), y, z});
        for (int i = 0; i < count; ++i) to[i] = v[64 * i];
      }
    }
  }

  openvdb::Coord low_;
  std::ptrdiff_t nx_ = 0, plane_ = 0;
  std::vector<float> value_, flat_, row_;
};

struct SmoothDistance final : Shape::Function {
  explicit SmoothDistance(Solid s) : solid(std::move(s)), samples(distance_to(solid)) {}

  void evaluate(const PointBlock& block, float* out) const override {
    // At the samples themselves there is nothing to interpolate.
    if (block.leaf != nullptr && block.voxel_mm == solid.grid().voxel_mm) return samples.evaluate(block, out);
    const double scale = 1 / solid.grid().voxel_mm;
    const Cells cells(block, scale);
    thread_local Samples near;
    constexpr std::size_t most = 1 << 14;
    const auto count = static_cast<std::size_t>(block.count);
    for (std::size_t done = 0, end = 0; done < count; done = end) {
      // As many points as lie close enough together.
      end = count;
      openvdb::CoordBBox box = cells.box(done, end);
      while (end > done + 1 && box.volume() > most) {
        end = done + (end - done) / 2;
        box = cells.box(done, end);
      }
      if (const std::optional<float> same = near.fetch(solid.impl().grid->tree(), box)) {
        std::fill(out + done, out + end, *same);
      } else {
        near.blend_at(block, cells, done, end, scale, out);
      }
    }
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
