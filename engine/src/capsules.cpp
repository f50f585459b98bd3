// SPDX-License-Identifier: Apache-2.0
// Many capsules or cones at once: a bucket grid lists, per bucket, every one that can be the nearest there or within
// reach.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "fibrolite/shape.h"

namespace fibrolite {
namespace {

float distance(const Capsule& c, float x, float y, float z) {
  const Vec3d ab = c.b - c.a, d = Vec3d{x, y, z} - c.a;
  const double length2 = dot(ab, ab);
  const double t = length2 > 0 ? std::clamp(dot(d, ab) / length2, 0.0, 1.0) : 0.0;
  return static_cast<float>(norm(d - t * ab) - c.radius_mm);
}

/// In the half plane of the axis it is a trapezoid: the distance to its nearest side, negative inside.
float distance(const Frustum& c, float x, float y, float z) {
  const Vec3d ab = c.b - c.a, d = Vec3d{x, y, z} - c.a;
  const double length = norm(ab), along = dot(d, ab) / length;
  const double out = std::sqrt(std::max(dot(d, d) - along * along, 0.0));
  const double end = along - std::clamp(along, 0.0, length);
  const double narrower = c.radius_b_mm - c.radius_a_mm;
  const double t = std::clamp(
      (along * length + (out - c.radius_a_mm) * narrower) / (length * length + narrower * narrower), 0.0, 1.0);
  const double flank = std::hypot(along - t * length, out - c.radius_a_mm - t * narrower);
  const double face_a = std::hypot(along, std::max(out - c.radius_a_mm, 0.0));
  const double face_b = std::hypot(along - length, std::max(out - c.radius_b_mm, 0.0));
  const bool inside = end == 0 && (out - c.radius_a_mm) * length < along * narrower;
  const double nearest = std::min({flank, face_a, face_b});
  return static_cast<float>(inside ? -nearest : nearest);
}
double width(const Capsule& c) { return 2 * c.radius_mm; }
double width(const Frustum& c) { return 2 * std::max(c.radius_a_mm, c.radius_b_mm); }

template <class Item>
Box3d box_of(const Item& c) {
  Box3d box;
  box.include(c.a);
  box.include(c.b);
  return box.grown(0.5 * width(c));
}

template <class Item>
struct BucketList final : Shape::Function {
  explicit BucketList(std::vector<Item> all) : list(std::move(all)) {
    for (const Item& c : list) {
      const Box3d own = box_of(c);
      bounds.include(own.min);
      bounds.include(own.max);
    }
    fill_buckets();
  }

  /// Buckets of one mean length (at most 64 per axis); each lists the items within `reach` of it. A point whose bucket
  /// lists none is at least `reach` away from all of them.
  void fill_buckets() {
    double mean = 0;
    for (const Item& c : list) mean += norm(c.b - c.a) + width(c);
    mean /= static_cast<double>(list.size());
    edge = std::max({mean, bounds.longest_side() / 64, 1e-3});
    reach = edge;
    low = bounds.min - Vec3d{reach, reach, reach};
    const Vec3d size = bounds.size() + Vec3d{2 * reach, 2 * reach, 2 * reach};
    n = {static_cast<int>(size.x / edge) + 1, static_cast<int>(size.y / edge) + 1, static_cast<int>(size.z / edge) + 1};
    const double half_diagonal = 0.5 * std::sqrt(3.0) * edge;
    start.assign(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z) + 1, 0);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  // bucket, item
    for (std::uint32_t i = 0; i < list.size(); ++i) {
      const Item& c = list[i];
      const Box3d box = box_of(c).grown(reach);
      const Vec3i from = bucket_of(box.min), to = bucket_of(box.max);
      for (int x = from.x; x <= to.x; ++x) {
        for (int y = from.y; y <= to.y; ++y) {
          for (int z = from.z; z <= to.z; ++z) {
            const Vec3d center = low + edge * Vec3d{x + 0.5, y + 0.5, z + 0.5};
            const float d =
                distance(c, static_cast<float>(center.x), static_cast<float>(center.y), static_cast<float>(center.z));
            if (d <= reach + half_diagonal) pairs.emplace_back(index(x, y, z), i);
          }
        }
      }
    }
    std::sort(pairs.begin(), pairs.end());
    items.reserve(pairs.size());
    for (const auto& [bucket, item] : pairs) {
      ++start[bucket + 1];
      items.push_back(item);
    }
    for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  }

  [[nodiscard]] std::uint32_t index(int x, int y, int z) const {
    return static_cast<std::uint32_t>((x * n.y + y) * n.z + z);
  }
  [[nodiscard]] Vec3i bucket_of(Vec3d p) const {
    const auto cell = [&](double v, int count) { return std::clamp(static_cast<int>(v / edge), 0, count - 1); };
    return {cell(p.x - low.x, n.x), cell(p.y - low.y, n.y), cell(p.z - low.z, n.z)};
  }

  void evaluate(const PointBlock& block, float* out) const override {
    for (int k = 0; k < block.count; ++k) {
      const Vec3d p{block.x[k], block.y[k], block.z[k]};
      float best = std::numeric_limits<float>::max();
      const Vec3i b = bucket_of(p);
      const std::uint32_t at = index(b.x, b.y, b.z);
      for (std::uint32_t i = start[at]; i < start[at + 1]; ++i) {
        best = std::min(best, distance(list[items[i]], block.x[k], block.y[k], block.z[k]));
      }
      // Items beyond the reach were not looked at: the distance is then at least the reach, or that to the box.
      const Vec3d past{std::max({bounds.min.x - p.x, p.x - bounds.max.x, 0.0}),
                       std::max({bounds.min.y - p.y, p.y - bounds.max.y, 0.0}),
                       std::max({bounds.min.z - p.z, p.z - bounds.max.z, 0.0})};
      out[k] = std::min(best, static_cast<float>(std::max(reach, norm(past))));
    }
  }

  std::vector<Item> list;
  Box3d bounds;
  Vec3d low{};
  Vec3i n{};
  double edge = 1, reach = 1;
  std::vector<std::uint32_t> start, items;
};

}  // namespace

Shape capsules(std::vector<Capsule> list) {
  return list.empty() ? nothing() : Shape(std::make_shared<const BucketList<Capsule>>(std::move(list)));
}

Shape frusta(std::vector<Frustum> list) {
  return list.empty() ? nothing() : Shape(std::make_shared<const BucketList<Frustum>>(std::move(list)));
}

}  // namespace fibrolite
