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
#include "vdb_access.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;

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

/// A leaf's samples with those next to its faces.
struct Padded {
  static constexpr std::array<int, 3> stride{100, 10, 1};
  static constexpr int first = 111;  // sample (0, 0, 0)
  std::array<float, 1000> value;     // from (-1, -1, -1) to (8, 8, 8); the corners and edges are never read

  void fetch(const Leaf& leaf, openvdb::tree::ValueAccessor<const Tree>& access) {
    const float* v = leaf.buffer().data();
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        std::copy_n(v + 64 * x + 8 * y, 8, value.data() + first + stride[0] * x + stride[1] * y);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true}) fetch_face(leaf, axis, upper, access);
  }

 private:
  void fetch_face(const Leaf& leaf, std::size_t axis, bool upper, openvdb::tree::ValueAccessor<const Tree>& access) {
    openvdb::Coord place = leaf.origin();
    place[axis] += upper ? 8 : -8;
    const Leaf* next = access.probeConstLeaf(place);
    std::array<float, 8> tile;
    if (next == nullptr) tile.fill(access.getValue(place));
    float* const to = value.data() + first + (upper ? 8 : -1) * stride[axis];
    if (axis == 2) {
      const float* const from = next != nullptr ? next->buffer().data() + (upper ? 0 : 7) : tile.data();
      const int step = next != nullptr ? 8 : 0;
      for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) to[stride[0] * x + stride[1] * y] = from[step * (8 * x + y)];
      return;
    }
    // Rows along z.
    const int other = axis == 0 ? 1 : 0, in_leaf = axis == 0 ? 8 : 64;
    const float* const from =
        next != nullptr ? next->buffer().data() + (upper ? 0 : 7 * (axis == 0 ? 64 : 8)) : tile.data();
    const int step = next != nullptr ? in_leaf : 0;
    for (int i = 0; i < 8; ++i) std::copy_n(from + step * i, 8, to + stride[static_cast<std::size_t>(other)] * i);
  }
};

/// A leaf's samples lie anywhere in memory: asked for some leaves ahead, they are there in time.
constexpr std::size_t ahead = 4;
void prefetch(const Leaf& leaf) {
  const float* v = leaf.buffer().data();
  for (int i = 0; i < 512; i += 16) __builtin_prefetch(v + i);
}

/// Filled part of a leaf, voxels. A sample counts with clamp(1/2 - m, 0, 1), m the mean distance over its voxel: the
/// distance at the sample plus 1/24 of the Laplacian, which takes the error of curved surfaces from second to fourth
/// order.
FIBROLITE_CLONES double filled(const Padded& p, float inverse) {
  // A row side by side: written as vectors, as the compiler makes branches of the comparisons.
  using Lanes [[gnu::vector_size(32)]] = float;
  constexpr int dx = Padded::stride[0], dy = Padded::stride[1];
  Lanes sum{};
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      const float* v = p.value.data() + Padded::first + dx * x + dy * y;
      Lanes here, back, forth, left, right, down, up;
      std::memcpy(&here, v, sizeof here);
      std::memcpy(&forth, v + dx, sizeof forth);
      std::memcpy(&back, v - dx, sizeof back);
      std::memcpy(&right, v + dy, sizeof right);
      std::memcpy(&left, v - dy, sizeof left);
      std::memcpy(&up, v + 1, sizeof up);
      std::memcpy(&down, v - 1, sizeof down);
      const Lanes d = here * inverse, size = d < 0 ? -d : d;
      const Lanes around = forth + back + right + left + up + down;
      const Lanes mean = d + (around * inverse - 6 * d) * (1.0F / 24.0F);
      const Lanes part = 0.5F - (size < 1.5F ? mean : d), most = part < 1 ? part : Lanes{} + 1.0F;
      sum += most > 0 ? most : Lanes{};
    }
  }
  double all = 0;
  for (std::size_t z = 0; z < 8; ++z) all += static_cast<double>(sum[z]);
  return rounded_for_sums(all);
}

bool holds(const SampleRange& range, const openvdb::Coord& at) { return range.holds({at.x(), at.y(), at.z()}); }

/// In voxels; of a range or all. Rounded for each leaf: the same bits on any number of threads, and in any parts.
double filled_voxels(const Tree& tree, double voxel_mm, const SampleRange* range) {
  const openvdb::tree::LeafManager<const Tree> leaves(tree);
  std::vector<double> part(leaves.leafCount(), 0.0);
  const auto inverse = static_cast<float>(1.0 / voxel_mm);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, part.size(), 64), [&](const auto& some) {
    openvdb::tree::ValueAccessor<const Tree> access(tree);
    Padded padded;
    for (std::size_t i = some.begin(); i < some.end(); ++i) {
      if (range != nullptr && !holds(*range, leaves.leaf(i).origin())) continue;
      if (i + ahead < some.end()) prefetch(leaves.leaf(i + ahead));
      padded.fetch(leaves.leaf(i), access);
      part[i] = filled(padded, inverse);
    }
  });
  double voxels = 0;
  for (const double v : part) voxels += v;
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile >= 0) continue;
    openvdb::CoordBBox box = tile.getBoundingBox();
    if (range != nullptr) {
      const auto axis = static_cast<std::size_t>(range->axis);
      box.min()[axis] = std::max(box.min()[axis], range->low);
      box.max()[axis] = std::min(box.max()[axis], range->high - 1);
      if (box.empty()) continue;
    }
    voxels += static_cast<double>(box.volume());
  }
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
  return Solid(std::make_shared<const Solid::Impl>(Solid::Impl{std::move(grid), spec}));
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
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile >= 0) continue;
    const openvdb::CoordBBox b = tile.getBoundingBox();
    box.include(sample_mm(b.min(), h));
    box.include(sample_mm(b.max(), h));
  }
  return box;
}

double Solid::volume_mm3() const {
  const double h = impl_->spec.voxel_mm;
  return filled_voxels(impl_->grid->tree(), h, nullptr) * h * h * h;
}

double Solid::volume_vox(const SampleRange& range) const {
  return filled_voxels(impl_->grid->tree(), impl_->spec.voxel_mm, &range);
}

std::int64_t Solid::active_voxels(const SampleRange& range) const {
  std::int64_t count = 0;
  for (auto leaf = impl_->grid->tree().cbeginLeaf(); leaf; ++leaf)
    if (holds(range, leaf->origin())) count += static_cast<std::int64_t>(leaf->onVoxelCount());
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
