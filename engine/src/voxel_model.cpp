// SPDX-License-Identifier: Apache-2.0
#include "voxel_model.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <tuple>

#include "fibrolite/disjoint_sets.h"

#include "fibrolite/blocks.h"
#include "fibrolite/error.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

constexpr float least_fraction = 0.01F;
constexpr std::size_t cells = 512, places = 729;

bool before(Vec3i a, Vec3i b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

std::vector<Vec3i> block_origins(const Solid& solid, int coarsen) {
  const int span = 8 * coarsen;
  const auto down = [&](int v) { return (v >= 0 ? v / span : -((span - 1 - v) / span)) * 8; };
  std::vector<Vec3i> origins = blocks(solid);
  for (Vec3i& o : origins) o = {down(o.x), down(o.y), down(o.z)};
  std::sort(origins.begin(), origins.end(), before);
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  return origins;
}

/// False: nothing there.
bool fill_block(const Solid& solid, int coarsen, Vec3i origin, float* out) {
  const auto& tree = solid.impl().grid->tree();
  const auto inverse = static_cast<float>(1.0 / solid.grid().voxel_mm);
  const float weight = 1.0F / static_cast<float>(coarsen * coarsen * coarsen);
  std::fill_n(out, cells, 0.0F);
  for (int lx = 0; lx < coarsen; ++lx) {
    for (int ly = 0; ly < coarsen; ++ly) {
      for (int lz = 0; lz < coarsen; ++lz) {
        const openvdb::Coord at(coarsen * origin.x + 8 * lx, coarsen * origin.y + 8 * ly, coarsen * origin.z + 8 * lz);
        const auto* leaf = tree.probeConstLeaf(at);
        const float* values = leaf != nullptr ? leaf->buffer().data() : nullptr;
        const float all = values == nullptr ? tree.getValue(at) : 0;
        for (int s = 0; s < 512; ++s) {
          const float d = (values != nullptr ? values[s] : all) * inverse;
          const int x = (8 * lx + (s >> 6)) / coarsen, y = (8 * ly + ((s >> 3) & 7)) / coarsen,
                    z = (8 * lz + (s & 7)) / coarsen;
          out[64 * x + 8 * y + z] += weight * std::clamp(0.5F - d, 0.0F, 1.0F);
        }
      }
    }
  }
  bool any = false;
  for (std::size_t c = 0; c < cells; ++c) {
    if (!(out[c] >= least_fraction)) out[c] = 0;  // also what is not a number
    any |= out[c] > 0;
  }
  return any;
}

void fill(VoxelModel& model, const Solid& solid, int coarsen, const Context& context) {
  const std::vector<Vec3i> origins = block_origins(solid, coarsen);
  constexpr std::size_t batch = 2048;
  std::vector<float> values(std::min(batch, origins.size()) * cells);
  std::vector<char> any(batch);
  for (std::size_t start = 0; start < origins.size(); start += batch) {
    context.check();
    const std::size_t n = std::min(batch, origins.size() - start);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 16), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        any[i] = fill_block(solid, coarsen, origins[start + i], values.data() + i * cells) ? 1 : 0;
      }
    });
    for (std::size_t i = 0; i < n; ++i) {
      if (any[i] == 0) continue;
      model.origin.push_back(origins[start + i]);
      model.fraction.insert(model.fraction.end(), values.begin() + static_cast<std::ptrdiff_t>(i * cells),
                            values.begin() + static_cast<std::ptrdiff_t>((i + 1) * cells));
    }
  }
}

/// Join cells face to face (union-find, the smaller number is the root), number the pieces, drop the empty ones.
VoxelPieces join(VoxelModel& model, float inside, const Context& context) {
  const std::size_t n = model.blocks();
  DisjointSets sets(n * cells);
  const auto unite = [&](std::size_t i, std::size_t j) {
    if (!(model.fraction[i] > 0) || !(model.fraction[j] > 0)) return;
    sets.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
  };
  constexpr std::array<std::size_t, 3> step{64, 8, 1};
  for (std::size_t b = 0; b < n; ++b) {
    if (b % 1024 == 0) context.check();
    std::array<std::uint32_t, 3> next{};
    for (int axis = 0; axis < 3; ++axis) {
      Vec3i o = model.origin[b];
      (axis == 0 ? o.x : axis == 1 ? o.y : o.z) += 8;
      next[static_cast<std::size_t>(axis)] = model.find(o);
    }
    for (std::size_t c = 0; c < cells; ++c) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (((c / step[axis]) & 7U) < 7) {
          unite(b * cells + c, b * cells + c + step[axis]);
        } else if (next[axis] != VoxelModel::none) {
          unite(b * cells + c, next[axis] * cells + c - 7 * step[axis]);
        }
      }
    }
  }
  VoxelPieces pieces;
  std::vector<char> real;
  pieces.of_cell.assign(n * cells, VoxelModel::none);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (!(model.fraction[i] > 0)) continue;
    const std::uint32_t r = sets.root(static_cast<std::uint32_t>(i));
    if (r == i) {
      const auto c = static_cast<int>(i % cells);
      const Vec3i o = model.origin[i / cells];
      pieces.of_cell[i] = static_cast<std::uint32_t>(pieces.list.size());
      pieces.list.push_back({{o.x + (c >> 6), o.y + ((c >> 3) & 7), o.z + (c & 7)}, 0});
      real.push_back(0);
    }
    const std::uint32_t p = pieces.of_cell[i] = pieces.of_cell[r];
    pieces.list[p].cells += static_cast<double>(model.fraction[i]);
    if (model.fraction[i] > inside) real[p] = 1;
  }
  std::vector<std::uint32_t> number(pieces.list.size(), VoxelModel::none);
  std::size_t kept = 0;
  for (std::size_t p = 0; p < number.size(); ++p) {
    if (real[p] == 0) continue;
    number[p] = static_cast<std::uint32_t>(kept);
    pieces.list[kept++] = pieces.list[p];
  }
  pieces.list.resize(kept);
  for (std::size_t i = 0; i < pieces.of_cell.size(); ++i) {
    if (pieces.of_cell[i] == VoxelModel::none) continue;
    pieces.of_cell[i] = number[pieces.of_cell[i]];
    if (pieces.of_cell[i] == VoxelModel::none) model.fraction[i] = 0;
  }
  return pieces;
}

void number_nodes(VoxelModel& model, const Context& context) {
  const std::size_t n = model.blocks();
  constexpr std::uint32_t unset = VoxelModel::none - 1;
  std::vector<std::uint32_t> table(n * places, VoxelModel::none);
  for (std::size_t b = 0; b < n; ++b) {
    for (std::size_t c = 0; c < cells; ++c) {
      if (!(model.fraction[b * cells + c] > 0)) continue;
      const auto low = static_cast<std::size_t>(VoxelModel::lowest_corner(static_cast<int>(c)));
      for (const int k : VoxelModel::corner) table[b * places + low + static_cast<std::size_t>(k)] = unset;
    }
  }
  std::uint32_t next = 0;
  for (std::size_t b = 0; b < n; ++b) {
    if (b % 1024 == 0) context.check();
    const Vec3i o = model.origin[b];
    std::array<std::uint32_t, 27> around;
    for (int k = 0; k < 27; ++k) {
      around[static_cast<std::size_t>(k)] =
          model.find({o.x + 8 * (k / 9 - 1), o.y + 8 * (k / 3 % 3 - 1), o.z + 8 * (k % 3 - 1)});
    }
    model.node_begin.push_back(next);
    model.ref_begin.push_back(static_cast<std::uint32_t>(model.ref_node.size()));
    for (int place = 0; place < static_cast<int>(places); ++place) {
      std::uint32_t& node = table[b * places + static_cast<std::size_t>(place)];
      if (node == VoxelModel::none) continue;
      const std::array<int, 3> at{place / 81, place / 9 % 9, place % 9};
      std::uint32_t known = unset;
      // A node on a face has other names in the blocks across it.
      for (int k = 0; k < 27 && known == unset; ++k) {
        const std::uint32_t other = around[static_cast<std::size_t>(k)];
        if (k == 13 || other >= b) continue;  // none is larger than any block
        const std::array<int, 3> way{k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
        int there = 0;
        bool shared = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const int local = at[axis] - 8 * way[axis];
          shared = shared && local >= 0 && local <= 8;
          there = 9 * there + local;
        }
        if (!shared) continue;
        const std::uint32_t name = table[other * places + static_cast<std::size_t>(there)];
        if (name < unset) known = name;
      }
      node = known == unset ? next++ : known;
      if (next > 0x50000000U) throw Error(Code::TooLarge, "the solid has too many cells", {}, "coarsen it");
      model.ref_node.push_back(node);
      model.ref_local.push_back(static_cast<std::uint16_t>(place));
    }
  }
  model.node_begin.push_back(next);
  model.ref_begin.push_back(static_cast<std::uint32_t>(model.ref_node.size()));
  model.ref_node.shrink_to_fit();
  model.ref_local.shrink_to_fit();
}

}  // namespace

std::uint32_t VoxelModel::find(Vec3i o) const {
  const auto at = std::lower_bound(origin.begin(), origin.end(), o, before);
  return at != origin.end() && *at == o ? static_cast<std::uint32_t>(at - origin.begin()) : none;
}

void VoxelModel::node_table(std::size_t block, std::uint32_t* table) const {
  std::fill_n(table, places, none);
  for (std::uint32_t r = ref_begin[block]; r < ref_begin[block + 1]; ++r) table[ref_local[r]] = ref_node[r];
}

VoxelModel voxel_model(const Solid& solid, int coarsen, VoxelPieces& pieces, const Context& context) {
  VoxelModel model;
  model.edge_mm = solid.grid().voxel_mm * coarsen;
  model.half_sample_mm = 0.5 * solid.grid().voxel_mm;
  fill(model, solid, coarsen, context);
  context.check();
  pieces = join(model, 0.5F / static_cast<float>(coarsen * coarsen * coarsen), context);
  number_nodes(model, context);
  for (std::size_t b = 0; b < model.blocks(); ++b) {
    const Vec3i o = model.origin[b];
    const auto parity = static_cast<std::size_t>(((o.x >> 3) & 1) * 4 + ((o.y >> 3) & 1) * 2 + ((o.z >> 3) & 1));
    model.colour[parity].push_back(static_cast<std::uint32_t>(b));
  }
  return model;
}

}  // namespace fibrolite
