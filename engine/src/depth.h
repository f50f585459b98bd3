// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include "fibrolite/solid.h"

namespace fibrolite {

/// Whether samples are as deep as asked for, by their values or, where those may understate it, by the distance to
/// where the lattice's edges cross the surface. Of a range, nothing is known beyond its ends: what lies so near them
/// that this matters is judged by its value alone.
class Depth {
 public:
  Depth(const Solid& solid, double depth_mm, const SampleRange* range = nullptr);

  [[nodiscard]] bool inside(const openvdb::Coord& at) { return access_.getValue(at) < 0; }
  /// Cost: O(1), or O((depth / voxel)^3) where the value is not enough.
  [[nodiscard]] bool deep(const openvdb::Coord& at);

 private:
  [[nodiscard]] bool crossed(const openvdb::Coord& at, const openvdb::Coord& from);

  openvdb::FloatGrid::ConstUnsafeAccessor access_;
  const SampleRange* range_;
  float depth_mm_;
  double depth_vox_;
  int reach_;
};

}  // namespace fibrolite
