// SPDX-License-Identifier: Apache-2.0
#include "layer_weld.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <span>

#include "layer_sums.h"
#include "weld.h"

namespace fibrolite {
void LayerWeld::next(const MeshLayer& layer) {
  own = first_equal(layer.fresh());
  across.clear();
  const std::array<Box3d, 2> boxes{box, box_of(layer.fresh())};
  box = boxes[1];
  // Only where both boxes meet.
  const Box3d both{{std::max(boxes[0].min.x, boxes[1].min.x), std::max(boxes[0].min.y, boxes[1].min.y),
                    std::max(boxes[0].min.z, boxes[1].min.z)},
                   {std::min(boxes[0].max.x, boxes[1].max.x), std::min(boxes[0].max.y, boxes[1].max.y),
                    std::min(boxes[0].max.z, boxes[1].max.z)}};
  if (both.empty()) return;
  std::vector<Vec3f> places;
  std::vector<std::uint32_t> number;
  const auto gather = [&](std::span<const Vec3f> vertices) {
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (!both.contains(to_double(vertices[i]))) continue;
      places.push_back(vertices[i]);
      number.push_back(static_cast<std::uint32_t>(i));
    }
    return places.size();
  };
  const std::size_t before = gather(layer.vertices.first(layer.before));
  if (before == 0 || gather(layer.fresh()) == before) return;
  const std::vector<std::uint32_t> first = first_equal(places);
  for (std::size_t i = before; i < first.size(); ++i)
    if (first[i] < before) across.emplace_back(number[first[i]], number[i]);
  std::sort(across.begin(), across.end());
}

bool LayerWeld::any() const {
  using Range = tbb::blocked_range<std::size_t>;
  return !across.empty() || tbb::parallel_reduce(
                                Range(0, own.size(), 4096), false,
                                [&](const Range& range, bool found) {
                                  for (std::size_t i = range.begin(); i < range.end(); ++i) found |= own[i] != i;
                                  return found;
                                },
                                std::logical_or<>{});
}

}  // namespace fibrolite
