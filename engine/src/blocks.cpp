// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/blocks.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "inner_tiles.h"
#include "vdb_access.h"

namespace fibrolite {

std::vector<Vec3i> blocks(const Solid& solid) {
  using Tree = openvdb::FloatTree;
  const Tree& tree = solid.impl().grid->tree();
  std::vector<Vec3i> origins;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord o = leaf->origin();
    origins.push_back({o.x(), o.y(), o.z()});
  }
  for (const openvdb::CoordBBox& box : inner_tiles(tree)) {
    for (int x = box.min().x(); x <= box.max().x(); x += 8) {
      for (int y = box.min().y(); y <= box.max().y(); y += 8) {
        for (int z = box.min().z(); z <= box.max().z(); z += 8) origins.push_back({x, y, z});
      }
    }
  }
  return origins;
}

std::vector<Vec3i> blocks(const Solid& solid, const SampleRange& range) {
  std::vector<Vec3i> origins = blocks(solid);
  std::erase_if(origins, [&](Vec3i origin) { return !range.holds(origin); });
  return origins;
}

void for_each_block(const std::vector<Vec3i>& origins, double voxel_mm,
                    const std::function<void(std::size_t, const PointBlock&)>& visit) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size(), 16), [&](const auto& range) {
    std::array<float, PointBlock::capacity> x, y, z;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Vec3i o = origins[i];
      std::array<float, 8> ay, az;
      for (int k = 0; k < 8; ++k) {
        ay[static_cast<std::size_t>(k)] = static_cast<float>(voxel_mm * (o.y + k));
        az[static_cast<std::size_t>(k)] = static_cast<float>(voxel_mm * (o.z + k));
      }
      std::size_t n = 0;
      for (int a = 0; a < 8; ++a) {
        const auto ax = static_cast<float>(voxel_mm * (o.x + a));
        for (std::size_t b = 0; b < 8; ++b) {
          for (std::size_t c = 0; c < 8; ++c, ++n) {
            x[n] = ax;
            y[n] = ay[b];
            z[n] = az[c];
          }
        }
      }
      visit(i, PointBlock{x.data(), y.data(), z.data(), PointBlock::capacity, &o, voxel_mm});
    }
  });
}

void copy_samples(const Solid& solid, Vec3i low, Vec3i size, float* out) {
  const openvdb::FloatTree& tree = solid.impl().grid->tree();
  const Vec3i end{low.x + size.x, low.y + size.y, low.z + size.z};
  // A box at a time: what one leaf or tile of the tree shares with the samples.
  for (int bx = low.x & ~7; bx < end.x; bx += 8) {
    for (int by = low.y & ~7; by < end.y; by += 8) {
      for (int bz = low.z & ~7; bz < end.z; bz += 8) {
        const openvdb::Coord origin(bx, by, bz);
        const auto* leaf = tree.probeConstLeaf(origin);
        const float* values = leaf != nullptr ? leaf->buffer().data() : nullptr;
        const float tile = values != nullptr ? 0 : tree.getValue(origin);
        const int z0 = std::max(bz, low.z), z1 = std::min(bz + 8, end.z);
        for (int x = std::max(bx, low.x); x < std::min(bx + 8, end.x); ++x) {
          for (int y = std::max(by, low.y); y < std::min(by + 8, end.y); ++y) {
            float* row = out + (static_cast<std::size_t>(x - low.x) * static_cast<std::size_t>(size.y) +
                                static_cast<std::size_t>(y - low.y)) *
                                   static_cast<std::size_t>(size.z);
            if (values != nullptr) {
              const float* from = values + 64 * (x - bx) + 8 * (y - by);
              std::copy(from + (z0 - bz), from + (z1 - bz), row + (z0 - low.z));
            } else {
              std::fill(row + (z0 - low.z), row + (z1 - low.z), tile);
            }
          }
        }
      }
    }
  }
}

}  // namespace fibrolite
