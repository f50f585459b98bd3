// SPDX-License-Identifier: Apache-2.0
// Which vertices of a mesh in layers are the same point.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/mesh_layers.h"

namespace fibrolite {

/// Of one layer after another.
struct LayerWeld {
  std::vector<std::uint32_t> own;  ///< For each of its own vertices the first of those in one place.
  /// For each vertex of the layer before, numbered in that, that lies where own ones do: the first of those; sorted.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> across;
  Box3d box;  ///< Around its own vertices.

  /// The next layer. Cost: O(n), parallel.
  void next(const MeshLayer& layer);
  /// Are any two in one place?
  [[nodiscard]] bool any() const;
};

}  // namespace fibrolite
