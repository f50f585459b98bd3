// SPDX-License-Identifier: Apache-2.0
#include "depth.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vdb_access.h"

namespace fibrolite {

using openvdb::Coord;

namespace {

std::size_t place(int x, int y, int z, int side) {
  return (static_cast<std::size_t>(x) * static_cast<std::size_t>(side) + static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(side) +
         static_cast<std::size_t>(z);
}

}  // namespace

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
  const Coord origin = at & ~(side - 1), in = at - origin;
  auto block = blocks_.find(origin);
  if (block == blocks_.end()) block = blocks_.emplace(origin, shallow_in(origin)).first;
  return !block->second.test(place(in.x(), in.y(), in.z(), side));
}

Depth::Shallow Depth::shallow_in(const Coord& origin) {
  // Edges that start further out cross nowhere near enough.
  const int first = -reach_ - 1, count = side + 2 * reach_ + 2;
  values_.resize(place(count, 0, 0, count));
  for (int x = 0; x < count; ++x)
    for (int y = 0; y < count; ++y)
      for (int z = 0; z < count; ++z)
        values_[place(x, y, z, count)] = access_.getValue(origin.offsetBy(first + x, first + y, first + z));
  Shallow shallow;
  const std::array<std::size_t, 3> step{place(1, 0, 0, count), place(0, 1, 0, count), 1};
  for (int x = 0; x + 1 < count; ++x)
    for (int y = 0; y + 1 < count; ++y)
      for (int z = 0; z + 1 < count; ++z) {
        const std::size_t here = place(x, y, z, count);
        const float a = values_[here];
        for (unsigned axis = 0; axis < 3; ++axis) {
          const float b = values_[here + step[axis]];
          if ((a < 0) != (b < 0))
            mark(shallow, {first + x, first + y, first + z}, axis, static_cast<double>(a) / (a - b));
        }
      }
  return shallow;
}

void Depth::mark(Shallow& shallow, const Coord& from, unsigned axis, double share) const {
  const double limit = depth_vox_ * depth_vox_;
  const auto low = [&](int k) { return std::max(k - reach_, 0); };
  const auto high = [&](int k) { return std::min(k + reach_ + 1, side - 1); };
  const auto square = [&](unsigned k, int at) {
    const double d = from[k] - at + (k == axis ? share : 0);
    return d * d;
  };
  for (int x = low(from.x()); x <= high(from.x()); ++x) {
    const double xx = square(0, x);
    if (xx >= limit) continue;
    for (int y = low(from.y()); y <= high(from.y()); ++y) {
      const double xy = xx + square(1, y);
      if (xy >= limit) continue;
      for (int z = low(from.z()); z <= high(from.z()); ++z)
        if (xy + square(2, z) < limit) shallow.set(place(x, y, z, side));
    }
  }
}

}  // namespace fibrolite
