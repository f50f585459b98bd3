// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/blocks.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>

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
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile >= 0) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    for (int x = box.min().x(); x <= box.max().x(); x += 8) {
      for (int y = box.min().y(); y <= box.max().y(); y += 8) {
        for (int z = box.min().z(); z <= box.max().z(); z += 8) origins.push_back({x, y, z});
      }
    }
  }
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

}  // namespace fibrolite
