// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/realize.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "fibrolite/blocks.h"
#include "fibrolite/clones.h"
#include "fibrolite/error.h"
#include "leaf_bits.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;

/// Moves values off the surface by `nudge` and limits them to what the grid tells; `depth` gets how far off it they
/// are.
FIBROLITE_CLONES void keep_in_band(float* values, float* depth, float nudge, float deepest, float highest) {
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const float v = values[i], off = v < 0 ? -nudge : nudge;
    depth[i] = std::abs(v);
    const float kept = depth[i] < nudge ? off : v, most = kept < -deepest ? -deepest : kept;
    values[i] = highest < most ? highest : most;
  }
}

/// What became of one 8x8x8 block.
struct Outcome {
  std::unique_ptr<Leaf> leaf;  // null: a tile
  bool inside = false;
};

class Blocks {
 public:
  Blocks(const Shape& shape, Grid spec, const Context& context)
      : shape_(shape),
        spec_(spec),
        band_(static_cast<float>(spec.voxel_mm) * spec.band_vox),
        deepest_(static_cast<float>(spec.voxel_mm) * std::max(spec.band_vox, spec.inside_vox)),
        context_(context) {}

  [[nodiscard]] Solid run(const std::vector<openvdb::Coord>& origins) const {
    auto grid = make_grid(spec_);
    Tree& tree = grid->tree();
    // Batches bound what waits to be put into the tree, and let progress and cancel be seen. One is put there while the
    // next is made.
    constexpr std::size_t batch = 2048;
    std::vector<Outcome> made(std::min(batch, origins.size())), put(made.size());
    tbb::task_group behind;
    for (std::size_t start = 0; start < origins.size(); start += batch) {
      context_.check();
      const std::size_t n = std::min(batch, origins.size() - start);
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 16), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) made[i] = block(origins[start + i]);
      });
      behind.wait();
      std::swap(made, put);
      behind.run([&, start, n] {
        openvdb::FloatGrid::Accessor access(tree);
        for (std::size_t i = 0; i < n; ++i) {
          if (put[i].leaf != nullptr) {
            access.addLeaf(put[i].leaf.release());
          } else if (put[i].inside) {
            access.addTile(1, origins[start + i], -band_, false);
          }
        }
      });
      context_.progress(static_cast<double>(start + n) / static_cast<double>(origins.size()));
    }
    behind.wait();
    return make_solid(grid, spec_);
  }

  /// Blocks (multiples of 8 in index space) of a box that the shape's bound does not put wholly outside, by halving.
  void near(const openvdb::CoordBBox& blocks, std::vector<openvdb::Coord>& out) const {
    if (blocks.empty()) return;
    const Interval bound = shape_.bound(box_of(blocks));
    if (bound.lo > band_) return;
    if (blocks.volume() == 1) {
      out.push_back(openvdb::Coord(blocks.min().x() * 8, blocks.min().y() * 8, blocks.min().z() * 8));
      return;
    }
    const auto axis = static_cast<int>(blocks.maxExtent());
    openvdb::CoordBBox low = blocks, high = blocks;
    const int middle = (blocks.min()[axis] + blocks.max()[axis]) >> 1;
    low.max()[axis] = middle;
    high.min()[axis] = middle + 1;
    near(low, out);
    near(high, out);
  }

 private:
  [[nodiscard]] Box3d box_of(const openvdb::CoordBBox& blocks) const {
    const double h = spec_.voxel_mm;
    const openvdb::Coord a = blocks.min(), b = blocks.max();
    return {h * Vec3d{8.0 * a.x(), 8.0 * a.y(), 8.0 * a.z()},
            h * Vec3d{8.0 * b.x() + 7, 8.0 * b.y() + 7, 8.0 * b.z() + 7}};
  }

  [[nodiscard]] Outcome block(const openvdb::Coord& origin) const {
    const openvdb::Coord index(origin.x() >> 3, origin.y() >> 3, origin.z() >> 3);
    const Interval bound = shape_.bound(box_of(openvdb::CoordBBox(index, index)));
    if (bound.lo > band_) return {};
    if (bound.hi < -band_) return {nullptr, true};

    std::array<float, PointBlock::capacity> x, y, z;
    std::array<float, 8> ax, ay, az;
    for (int i = 0; i < 8; ++i) {
      const auto k = static_cast<std::size_t>(i);
      ax[k] = static_cast<float>(spec_.voxel_mm * (origin.x() + i));
      ay[k] = static_cast<float>(spec_.voxel_mm * (origin.y() + i));
      az[k] = static_cast<float>(spec_.voxel_mm * (origin.z() + i));
    }
    for (std::size_t i = 0, n = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < 8; ++j) {
        for (std::size_t k = 0; k < 8; ++k, ++n) {
          x[n] = ax[i];
          y[n] = ay[j];
          z[n] = az[k];
        }
      }
    }
    const Vec3i leaf_origin{origin.x(), origin.y(), origin.z()};
    std::array<float, PointBlock::capacity> values;
    shape_.evaluate(PointBlock{x.data(), y.data(), z.data(), PointBlock::capacity, &leaf_origin, spec_.voxel_mm},
                    values.data());

    std::array<float, PointBlock::capacity> depth;
    keep_in_band(values.data(), depth.data(), static_cast<float>(1e-3 * spec_.voxel_mm), deepest_, band_);
    const LeafBits in_band = bits_below(depth.data(), band_), inside = bits_below(values.data(), 0);
    if (in_band == LeafBits{}) {
      if (inside == LeafBits{}) return {nullptr, false};
      if (std::all_of(inside.begin(), inside.end(), [](std::uint64_t word) { return ~word == 0; }))
        return {nullptr, true};
    }
    Leaf::NodeMaskType active;
    for (std::size_t n = 0; n < in_band.size(); ++n)
      active.getWord<std::uint64_t>(static_cast<openvdb::Index>(n)) = in_band[n];
    auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate(), origin);  // its samples not filled yet
    leaf->buffer().allocate();
    std::copy(values.begin(), values.end(), leaf->buffer().data());
    leaf->setValueMask(active);
    return {std::move(leaf), false};
  }

  const Shape& shape_;
  Grid spec_;
  float band_, deepest_;
  const Context& context_;
};

}  // namespace

Solid realize(const Shape& shape, const Box3d& region_mm, Grid grid, const Context& context) {
  if (!(grid.voxel_mm > 0) || !std::isfinite(grid.voxel_mm)) {
    throw Error(Code::BadRecipe, "the voxel must be a positive length", "voxel");
  }
  const double block = 8 * grid.voxel_mm;
  const auto low = [&](double v) { return static_cast<int>(std::floor(v / block)); };
  const openvdb::CoordBBox blocks(openvdb::Coord(low(region_mm.min.x), low(region_mm.min.y), low(region_mm.min.z)),
                                  openvdb::Coord(low(region_mm.max.x), low(region_mm.max.y), low(region_mm.max.z)));
  // What sticks out of the region is cut flat.
  const Shape bounded = intersect({shape, cuboid(region_mm)});
  const Blocks run(bounded, grid, context);
  std::vector<openvdb::Coord> origins;
  run.near(blocks, origins);
  return run.run(origins);
}

Solid realize(const Shape& shape, const Solid& body, const Context& context) {
  std::vector<openvdb::Coord> origins;
  for (const Vec3i o : blocks(body)) origins.emplace_back(o.x, o.y, o.z);
  return Blocks(shape, body.grid(), context).run(origins);
}

}  // namespace fibrolite
