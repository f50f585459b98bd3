// SPDX-License-Identifier: Apache-2.0
// Connected components: each 8x8x8 block is labelled on its own, in parallel, then labels are joined across block
// faces.
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/pieces.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"
#include "leaf_bits.h"
#include "vdb_access.h"

namespace fibrolite {

/// Samples of one label.
struct LeafSet {
  LeafBits bits;
  std::uint16_t voxels;
  std::uint16_t first;  ///< Its first sample: 64 x + 8 y + z.
  bool inside;
};

/// One leaf's labels, dense from 0 in scan order.
struct LeafLabels {
  static constexpr std::size_t size = 512;
  std::span<const LeafSet> sets;

  /// Of sample 64 x + 8 y + z.
  [[nodiscard]] std::size_t at(std::size_t sample) const {
    std::size_t k = 0;
    while ((sets[k].bits[sample >> 6] >> (sample & 63U) & 1U) == 0) ++k;
    return k;
  }
};

/// All 8x8x8 blocks of the solid's box and one layer around it, with globally joined labels. Inside is what reads less
/// than `below`, 0 or a depth within the band. Of a range, only its blocks are looked at, and there is no layer beyond
/// its two ends: what lies there is not known.
class Components {
 public:
  using Tree = openvdb::FloatTree;
  using Leaf = Tree::LeafNodeType;
  using Id = std::uint32_t;

  Components(const Solid& solid, const Context& context, float below = 0, const SampleRange* range = nullptr);

  [[nodiscard]] bool empty() const { return offset_.empty(); }

  struct Component {
    Id id;
    bool inside;
    std::int64_t voxels;
    openvdb::Coord first;
  };
  static constexpr Id exterior = 0;
  /// Joined components in scan order of their first voxel, each at the place of its id. The exterior is the first of
  /// all.
  [[nodiscard]] const std::vector<Component>& list() const { return list_; }

  /// Component of a sample; samples outside the box belong to the exterior.
  [[nodiscard]] Id at(const openvdb::Coord& ijk) const;
  [[nodiscard]] bool inside(const openvdb::Coord& ijk) const {
    return solid_.impl().grid->tree().getValue(ijk) < below_;
  }

  /// Calls visit(origin, leaf labels or null for a tile, component of each label) for each block that is not all
  /// exterior, in scan order.
  template <class Visit>
  void each_block(const Visit& visit) const {
    for (std::size_t b = 0; b < block_.size(); ++b) {
      const std::span<const Id> of(component_.data() + offset_[b], offset_[b + 1] - offset_[b]);
      if (of.size() == 1 && of[0] == exterior) continue;
      const LeafLabels labels = block_[b] >= 0 ? labels_of(block_[b]) : LeafLabels{};
      visit(origin(b), block_[b] >= 0 ? &labels : nullptr, of);
    }
  }

 private:
  static constexpr std::int32_t void_tile = -1, full_tile = -2;
  /// Labels of neighbouring leaves: two or three for most of them, 72 bytes each.
  static constexpr std::size_t chunk_size = 64;
  struct Chunk {
    std::vector<LeafSet> sets;
    std::array<std::uint16_t, chunk_size + 1> start{};
  };

  [[nodiscard]] std::size_t index(const openvdb::Coord& b) const {
    return (static_cast<std::size_t>(b.x()) * static_cast<std::size_t>(n_.y()) + static_cast<std::size_t>(b.y())) *
               static_cast<std::size_t>(n_.z()) +
           static_cast<std::size_t>(b.z());
  }
  [[nodiscard]] openvdb::Coord origin(std::size_t b) const;
  [[nodiscard]] LeafLabels labels_of(std::int32_t leaf) const {
    const auto n = static_cast<std::size_t>(leaf);
    const Chunk& chunk = chunks_[n / chunk_size];
    const std::size_t from = chunk.start[n % chunk_size], to = chunk.start[n % chunk_size + 1];
    return {{chunk.sets.data() + from, to - from}};
  }
  void find_blocks(const Tree& tree, const std::vector<openvdb::CoordBBox>& tiles);
  void label(const Context& context);
  void join();
  void join_across(int x);
  void join_to_next(int x);
  void join_faces(std::size_t a, std::size_t b, unsigned axis);
  void unite(Id a, Id b);
  Id root_of(Id i);
  void number();
  void count_voxels();

  Solid solid_;
  float below_;
  openvdb::Coord low_, n_;
  std::vector<std::int32_t> block_;  // leaf number or a tile kind
  std::vector<const Leaf*> tree_leaves_;
  std::vector<Chunk> chunks_;
  std::vector<Id> offset_;     // first label of each block
  std::vector<Id> component_;  // of each label; while they are joined, one that it hangs together with
  std::vector<Component> list_;
};

[[nodiscard]] Vec3d world_mm(const openvdb::Coord& c, double voxel_mm);
/// Is a shape negative at any of them?
[[nodiscard]] bool any_inside(const Shape& shape, const std::vector<openvdb::Coord>& samples, double voxel_mm);
/// Material and cavities; the first of the list is the exterior and in neither.
[[nodiscard]] Pieces summarize(const std::vector<Components::Component>& list, double voxel_mm);

}  // namespace fibrolite
