// SPDX-License-Identifier: Apache-2.0
#include "depth.h"

#include <cmath>

#include "vdb_access.h"

namespace fibrolite {

using openvdb::Coord;

Depth::Depth(const Solid& solid, double depth_mm, const SampleRange* range)
    : access_(solid.impl().grid->tree()),
      range_(range),
      depth_mm_(static_cast<float>(depth_mm)),
      depth_vox_(depth_mm / solid.grid().voxel_mm),
      reach_(static_cast<int>(std::ceil(depth_vox_))) {}

bool Depth::deep(const Coord& at) {
  const float value = access_.getValue(at);
  if (value < -depth_mm_ || value >= 0) return value < 0;
  if (range_ != nullptr) {
    const int along = at[static_cast<unsigned>(range_->axis)];
    if (along - reach_ - 1 < range_->low || along + reach_ + 1 >= range_->high) return false;
  }
  Coord from;
  for (from.x() = -reach_ - 1; from.x() <= reach_; ++from.x()) {
    for (from.y() = -reach_ - 1; from.y() <= reach_; ++from.y()) {
      for (from.z() = -reach_ - 1; from.z() <= reach_; ++from.z())
        if (crossed(at, from)) return false;
    }
  }
  return true;
}

/// Does one of the three edges that start at a sample cross the surface within the depth?
bool Depth::crossed(const Coord& at, const Coord& from) {
  const float a = access_.getValue(at + from);
  for (unsigned axis = 0; axis < 3; ++axis) {
    Coord to = from;
    ++to[axis];
    const float b = access_.getValue(at + to);
    if ((a < 0) == (b < 0)) continue;
    double square = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const double d = from[k] + (k == axis ? static_cast<double>(a) / (a - b) : 0);
      square += d * d;
    }
    if (square < depth_vox_ * depth_vox_) return true;
  }
  return false;
}

}  // namespace fibrolite
