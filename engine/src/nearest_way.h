// SPDX-License-Identifier: Apache-2.0
// A wave from samples to the nearest sample of a kind, that remembers where it came from.
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

namespace fibrolite {

inline constexpr std::array<std::array<int, 3>, 6> face_steps{
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

/// Where a way runs, from one of the sources to a target.
struct SampleWay {
  openvdb::Coord from, to;
};

/// The shortest straight way, up to a voxel, from any of `sources` to a sample that may be its `target(from, to)`, such
/// that a path of samples that may be passed leads there. `seen`: never entered; grows. Cost: O(samples passed).
template <class Passable, class Target>
[[nodiscard]] std::optional<SampleWay> nearest_way(const std::vector<openvdb::Coord>& sources, openvdb::MaskTree& seen,
                                                   double reach_vox, const Passable& passable, const Target& target) {
  const auto distance2 = [](const SampleWay& w) {
    const openvdb::Coord d = w.to - w.from;
    return 1.0 * d.x() * d.x() + 1.0 * d.y() * d.y() + 1.0 * d.z() * d.z();
  };
  // First by distance, then by place, so that the answer does not depend on how the wave started.
  const auto later = [&](const SampleWay& a, const SampleWay& b) {
    const double da = distance2(a), db = distance2(b);
    return da != db ? da > db : std::pair(a.to, a.from) > std::pair(b.to, b.from);
  };
  std::vector<SampleWay> first;
  first.reserve(sources.size());
  for (const openvdb::Coord& s : sources) first.push_back({s, s});
  std::priority_queue<SampleWay, std::vector<SampleWay>, decltype(later)> queue(later, std::move(first));
  while (!queue.empty()) {
    const SampleWay way = queue.top();
    queue.pop();
    if (distance2(way) > reach_vox * reach_vox) break;
    if (target(way)) return way;
    for (const auto& s : face_steps) {
      const openvdb::Coord to = way.to.offsetBy(s[0], s[1], s[2]);
      if (seen.isValueOn(to) || !passable(to)) continue;
      seen.setValueOn(to);
      queue.push({way.from, to});
    }
  }
  return std::nullopt;
}

}  // namespace fibrolite
