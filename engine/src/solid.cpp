// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/solid.h"

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "fibrolite/blocks.h"
#include "fibrolite/clones.h"
#include "fibrolite/error.h"
#include "fibrolite/vdb.h"
#include "inner_tiles.h"
#include "leaf_bits.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using Access = openvdb::tree::ValueAccessor<const Tree, false>;  // unknown to the tree, which is not changed

Vec3d sample_mm(const openvdb::Coord& ijk, double voxel) {
  return voxel * Vec3d{1.0 * ijk.x(), 1.0 * ijk.y(), 1.0 * ijk.z()};
}

struct SolidDistance final : Shape::Function {
  explicit SolidDistance(Solid s) : solid(std::move(s)) {}

  void evaluate(const PointBlock& block, float* out) const override {
    const Solid::Impl& impl = solid.impl();
    const Tree& tree = impl.grid->tree();
    if (block.leaf != nullptr && block.voxel_mm == impl.spec.voxel_mm) {
      const openvdb::Coord origin(block.leaf->x, block.leaf->y, block.leaf->z);
      if (const Leaf* leaf = tree.probeConstLeaf(origin)) {
        std::memcpy(out, leaf->buffer().data(), sizeof(float) * Leaf::SIZE);
      } else {
        std::fill_n(out, block.count, tree.getValue(origin));
      }
      return;
    }
    const auto access = impl.grid->getConstUnsafeAccessor();
    const double scale = 1.0 / impl.spec.voxel_mm;
    for (int i = 0; i < block.count; ++i) {
      out[i] = openvdb::tools::BoxSampler::sample(
          access, openvdb::Vec3d(block.x[i] * scale, block.y[i] * scale, block.z[i] * scale));
    }
  }

  /// From the tree's topology: exact for boxes inside one leaf or tile, else from the samples that touch the box.
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Solid::Impl& impl = solid.impl();
    const Tree& tree = impl.grid->tree();
    const double h = impl.spec.voxel_mm;
    const auto low = [&](double v) { return static_cast<int>(std::floor(v / h + 1e-4)); };
    const auto high = [&](double v) { return static_cast<int>(std::ceil(v / h - 1e-4)); };
    const openvdb::CoordBBox samples(openvdb::Coord(low(box.min.x), low(box.min.y), low(box.min.z)),
                                     openvdb::Coord(high(box.max.x), high(box.max.y), high(box.max.z)));
    Interval result{far_mm, -far_mm};
    const auto take = [&](float lo, float hi) { result = {std::min(result.lo, lo), std::max(result.hi, hi)}; };
    if (samples.volume() > 4096UL * 512UL) {  // many leaves: say nothing sharper than 1-Lipschitz allows
      return Function::bound(box).lo > 0 ? Function::bound(box) : Interval{-far_mm, far_mm};
    }
    const openvdb::Coord first = samples.min() & ~7;
    for (int x = first.x(); x <= samples.max().x(); x += 8) {
      for (int y = first.y(); y <= samples.max().y(); y += 8) {
        for (int z = first.z(); z <= samples.max().z(); z += 8) {
          const openvdb::Coord at(x, y, z);
          if (const Leaf* leaf = tree.probeConstLeaf(at)) {
            const Interval all = range_of(leaf->buffer().data(), Leaf::SIZE);
            take(all.lo, all.hi);
          } else {
            const float v = tree.getValue(at);
            take(v, v);
          }
        }
      }
    }
    return result;
  }

  Solid solid;
};

/// A leaf's samples and where those next to its faces are: in other leaves, or one value that stands for all.
struct Surrounded {
  static constexpr std::array<int, 3> along{64, 8, 1};
  struct Beside {
    const float* first;  ///< The neighbour of sample (0, 0, 0), or of (7, 0, 0), (0, 7, 0), (0, 0, 7).
    std::array<int, 3> step;
  };
  const float* value;
  std::array<Beside, 3> before, after;
  std::array<std::array<float, 8>, 6> tile;

  Surrounded(const Leaf& leaf, Access& access) : value(leaf.buffer().data()) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      before[axis] = beside(leaf, axis, false, access);
      after[axis] = beside(leaf, axis, true, access);
    }
  }
  Surrounded(const Surrounded&) = delete;  // points into itself
  Surrounded& operator=(const Surrounded&) = delete;

 private:
  Beside beside(const Leaf& leaf, std::size_t axis, bool upper, Access& access) {
    openvdb::Coord place = leaf.origin();
    place[axis] += upper ? 8 : -8;
    if (const Leaf* next = access.probeConstLeaf(place))
      return {next->buffer().data() + (upper ? 0 : 7 * along[axis]), along};
    std::array<float, 8>& all = tile[2 * axis + (upper ? 1 : 0)];
    all.fill(access.getValue(place));
    return {all.data(), {0, 0, 0}};
  }
};

/// Farther from the surface than this, voxels, a distance is its own mean.
constexpr float near_vox = 1.5F;

/// Filled part of a leaf, voxels. A sample counts with clamp(1/2 - m, 0, 1), m the mean distance over its voxel: the
/// distance at the sample plus 1/24 of the Laplacian, which takes the error of curved surfaces from second to fourth
/// order.
FIBROLITE_CLONES double filled(const Surrounded& at, float inverse) {
  // A row side by side: written as vectors, as the compiler makes branches of the comparisons.
  using Lanes [[gnu::vector_size(32)]] = float;
  using Places [[gnu::vector_size(32)]] = std::int32_t;
  constexpr Places one_up{7, 0, 1, 2, 3, 4, 5, 6}, one_down{1, 2, 3, 4, 5, 6, 7, 0};
  const auto& [back_x, back_y, back_z] = at.before;
  const auto& [on_x, on_y, on_z] = at.after;
  Lanes sum{};
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      const float* v = at.value + 64 * x + 8 * y;
      Lanes here, back, forth, left, right;
      std::memcpy(&here, v, sizeof here);
      std::memcpy(&forth, x < 7 ? v + 64 : on_x.first + on_x.step[1] * y, sizeof forth);
      std::memcpy(&back, x > 0 ? v - 64 : back_x.first + back_x.step[1] * y, sizeof back);
      std::memcpy(&right, y < 7 ? v + 8 : on_y.first + on_y.step[0] * x, sizeof right);
      std::memcpy(&left, y > 0 ? v - 8 : back_y.first + back_y.step[0] * x, sizeof left);
      Lanes up = __builtin_shuffle(here, one_down), down = __builtin_shuffle(here, one_up);
      up[7] = on_z.first[on_z.step[0] * x + on_z.step[1] * y];
      down[0] = back_z.first[back_z.step[0] * x + back_z.step[1] * y];
      const Lanes d = here * inverse, size = d < 0 ? -d : d;
      const Lanes around = forth + back + right + left + up + down;
      const Lanes mean = d + (around * inverse - 6 * d) * (1.0F / 24.0F);
      const Lanes part = 0.5F - (size < near_vox ? mean : d), most = part < 1 ? part : Lanes{} + 1.0F;
      sum += most > 0 ? most : Lanes{};
    }
  }
  double all = 0;
  for (std::size_t z = 0; z < 8; ++z) all += static_cast<double>(sum[z]);
  return rounded_for_sums(all);
}

/// In voxels. Rounded: blocks add up to the same bits in any order.
double filled_voxels(const Leaf& leaf, Access& access, float inverse) {
  // Where no sample is near the surface, each voxel is full or empty as the sample itself says.
  const Interval range_mm = range_of(leaf.buffer().data(), Leaf::SIZE);
  if (range_mm.hi * inverse <= -near_vox) return Leaf::SIZE;
  if (range_mm.lo * inverse >= near_vox) return 0;
  return filled(Surrounded(leaf, access), inverse);
}

double filled_voxels(const Tree& tree, double voxel_mm) {
  std::vector<const Leaf*> leaves;
  leaves.reserve(tree.leafCount());
  tree.getNodes(leaves);
  std::vector<double> part(leaves.size(), 0.0);
  const auto inverse = static_cast<float>(1.0 / voxel_mm);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, part.size(), 64), [&](const auto& some) {
    Access access(tree);
    for (std::size_t i = some.begin(); i < some.end(); ++i) {
      fetch_ahead(leaves, i);
      part[i] = filled_voxels(*leaves[i], access, inverse);
    }
  });
  double voxels = 0;
  for (const double v : part) voxels += v;
  for (const openvdb::CoordBBox& tile : inner_tiles(tree)) voxels += static_cast<double>(tile.volume());
  return voxels;
}

}  // namespace

void initialize_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

openvdb::FloatGrid::Ptr make_grid(Grid spec) {
  if (!(spec.voxel_mm > 0) || !std::isfinite(spec.voxel_mm) || !(spec.band_vox >= 2)) {
    throw Error(Code::BadRecipe, "a grid needs a positive voxel and a band of 2 voxels or more", "voxel");
  }
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(static_cast<float>(spec.voxel_mm) * spec.band_vox);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(spec.voxel_mm));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

Solid make_solid(openvdb::FloatGrid::ConstPtr grid, Grid spec) {
  return Solid(std::make_shared<const Solid::Impl>(std::move(grid), spec));
}

openvdb::FloatGrid::Ptr editable(Solid&& solid) {
  const std::shared_ptr<const Solid::Impl> impl = std::exchange(solid, {}).share();
  if (impl.use_count() > 1 || impl->grid.use_count() > 1) return impl->grid->deepCopy();
  return std::const_pointer_cast<openvdb::FloatGrid>(impl->grid);
}

Solid::Solid() : Solid(make_solid(make_grid({}), {})) {}
Solid::Solid(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Grid Solid::grid() const { return impl_->spec; }
bool Solid::empty() const { return impl_->grid->empty(); }
std::int64_t Solid::active_voxels() const { return static_cast<std::int64_t>(impl_->grid->activeVoxelCount()); }
std::int64_t Solid::memory_bytes() const { return static_cast<std::int64_t>(impl_->grid->memUsage()); }

Box3d Solid::bounds_mm() const {
  Box3d box;
  const double h = impl_->spec.voxel_mm;
  const Tree& tree = impl_->grid->tree();
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord o = leaf->origin();
    if (box.contains(sample_mm(o, h)) && box.contains(sample_mm(o.offsetBy(7), h))) continue;
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
      if (leaf->getValue(i) < 0) box.include(sample_mm(leaf->offsetToGlobalCoord(i), h));
    }
  }
  for (const openvdb::CoordBBox& b : inner_tiles(tree)) {
    box.include(sample_mm(b.min(), h));
    box.include(sample_mm(b.max(), h));
  }
  return box;
}

double Solid::volume_mm3() const {
  const double h = impl_->spec.voxel_mm;
  double voxels = impl_->filled_voxels.load();
  if (voxels < 0) {
    voxels = fibrolite::filled_voxels(impl_->grid->tree(), h);
    impl_->filled_voxels.store(voxels);
  }
  return voxels * h * h * h;
}

double Solid::filled_vox(Vec3i block) const {
  const openvdb::Coord origin(block.x, block.y, block.z);
  Access access(impl_->grid->tree());
  const Leaf* leaf = access.probeConstLeaf(origin);
  if (leaf == nullptr) return access.getValue(origin) < 0 ? Leaf::SIZE : 0;
  return filled_voxels(*leaf, access, static_cast<float>(1.0 / impl_->spec.voxel_mm));
}

std::int64_t Solid::active_voxels(const SampleRange& range) const {
  std::int64_t count = 0;
  for (auto leaf = impl_->grid->tree().cbeginLeaf(); leaf; ++leaf)
    if (const openvdb::Coord o = leaf->origin(); range.holds({o.x(), o.y(), o.z()}))
      count += static_cast<std::int64_t>(leaf->onVoxelCount());
  return count;
}

float Solid::distance(Vec3d p) const {
  const double scale = 1.0 / impl_->spec.voxel_mm;
  return openvdb::tools::BoxSampler::sample(impl_->grid->tree(), openvdb::Vec3d(p.x * scale, p.y * scale, p.z * scale));
}

float Solid::at(Vec3i sample) const { return impl_->grid->tree().getValue({sample.x, sample.y, sample.z}); }

Shape distance_to(const Solid& solid) { return Shape(std::make_shared<const SolidDistance>(solid)); }

Solid narrowed(Solid solid) {
  Grid spec = solid.grid();
  if (spec.inside_vox <= spec.band_vox) return solid;
  const openvdb::FloatGrid::Ptr grid = editable(std::move(solid));
  const float deepest = -grid->background();
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid->tree());
  leaves.foreach ([deepest](auto& leaf, std::size_t) {
    float* const values = leaf.buffer().data();
    for (openvdb::Index i = 0; i < leaf.SIZE; ++i) values[i] = std::max(values[i], deepest);
  });
  spec.inside_vox = 0;
  return make_solid(grid, spec);
}

openvdb::FloatGrid::ConstPtr to_vdb(const Solid& solid) { return narrowed(solid).impl().grid; }

Solid from_vdb(const openvdb::FloatGrid::ConstPtr& grid) {
  if (grid == nullptr) throw Error(Code::BadInput, "no grid given");
  const auto voxel = grid->voxelSize();
  const openvdb::Vec3d at = grid->indexToWorld(openvdb::Vec3d(0.0));
  const bool uniform =
      std::abs(voxel.x() - voxel.y()) < 1e-9 * voxel.x() && std::abs(voxel.x() - voxel.z()) < 1e-9 * voxel.x();
  if (!uniform || !grid->transform().isLinear()) {
    throw Error(Code::BadInput, "the grid's voxels are not uniform cubes", grid->getName(), "resample it first");
  }
  if (at.length() > 1e-6 * voxel.x()) {
    throw Error(Code::BadInput, "the grid's lattice does not pass through the world origin", grid->getName(),
                "resample it first");
  }
  if (!(grid->background() > 0)) {
    throw Error(Code::BadInput, "the grid is no level set: its background is not positive", grid->getName(),
                "give a level set, negative inside");
  }
  return make_solid(grid, {voxel.x(), static_cast<float>(grid->background() / voxel.x())});
}

}  // namespace fibrolite
