// SPDX-License-Identifier: Apache-2.0
// Inside or outside for any triangle soup: the generalised winding number, and the distance to the nearest triangle.
#pragma once

#include <memory>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// A tree over the triangles. Immutable, thread-safe, cheap to copy.
/// Source: Barill et al. 2018 (hierarchical winding numbers), Jacobson et al. 2013.
class WindingTree {
 public:
  /// Cost: O(n log n), about 100 bytes per triangle.
  explicit WindingTree(const Mesh& mesh);
  /// About 1 inside, 0 outside; smooth across holes. Error below 0.01. Cost: O(log n).
  [[nodiscard]] double winding(Vec3d p) const;
  struct Nearest {
    double distance_mm;
    std::uint32_t triangle;
    Vec3d point;
  };
  /// Cost: O(log n).
  [[nodiscard]] Nearest nearest(Vec3d p) const;
  /// Is every edge run through as often one way as the other? Then winding() is a whole number off the surface.
  [[nodiscard]] bool closed() const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// Exact signed distance to a mesh, independent of any grid: |nearest|, sign by winding number > 1/2. Slow (about 5 us
/// per point): for sections and tests, not for filling grids.
[[nodiscard]] Shape distance_to(const WindingTree& tree);

}  // namespace fibrolite
