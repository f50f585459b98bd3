// SPDX-License-Identifier: GPL-3.0-or-later
#include "print_scan.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>

#include "fibrolite/blocks.h"
#include "fibrolite/disjoint_sets.h"
#include "fibrolite/frame.h"

namespace fibrolite {
namespace {

/// Areas are summed in multiples of 1 / this: exact, in any order.
constexpr double exact_mm2 = 1 << 28;

/// A dense box of samples, in voxels: values, their gradient and where a ray leaves what it is in.
class Window {
 public:
  Window(const Solid& solid, Vec3i low, int edge)
      : low_(low), edge_(static_cast<std::size_t>(edge)), values_(edge_ * edge_ * edge_) {
    copy_samples(solid, low, {edge, edge, edge}, values_.data());
    const auto inverse = static_cast<float>(1 / solid.grid().voxel_mm);
    for (float& v : values_) v *= inverse;
  }
  [[nodiscard]] const float* row(Vec3i at) const {
    return values_.data() + index(at.x - low_.x, at.y - low_.y, at.z - low_.z);
  }
  [[nodiscard]] std::array<std::size_t, 3> stride() const { return {edge_ * edge_, edge_, 1}; }

  /// Linear between samples; `p` in voxels from the world's origin, at least a voxel inside the window.
  [[nodiscard]] double value(Vec3d p) const {
    const double x = p.x - low_.x, y = p.y - low_.y, z = p.z - low_.z;
    const auto i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
    const double u = x - i, v = y - j, w = z - k;
    const float* a = values_.data() + index(i, j, k);
    const float* b = a + edge_ * edge_;
    const auto face = [&](const float* f) {
      const double near = f[0] + w * (f[1] - f[0]), far = f[edge_] + w * (f[edge_ + 1] - f[edge_]);
      return near + v * (far - near);
    };
    const double low = face(a);
    return low + u * (face(b) - low);
  }
  [[nodiscard]] Vec3d normal(Vec3d p) const {
    const auto slope = [&](Vec3d step) { return value(p + step) - value(p - step); };
    return normalized(Vec3d{slope({0.5, 0, 0}), slope({0, 0.5, 0}), slope({0, 0, 0.5})});
  }
  /// How far from a surface point the sign changes again along a unit direction, voxels; infinity: not within `most`.
  /// `inside`: it runs through material.
  [[nodiscard]] double chord(Vec3d from, Vec3d along, bool inside, double most) const {
    constexpr double step = 0.4;
    double before = 0;
    for (double t = step; t < most + step; t += step) {
      const double here = inside ? value(from + t * along) : -value(from + t * along);
      if (here >= 0) return t - step * (before < 0 ? here / (here - before) : 0.5);
      before = here;
    }
    return INFINITY;
  }

 private:
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(i) * edge_ + static_cast<std::size_t>(j)) * edge_ + static_cast<std::size_t>(k);
  }

  Vec3i low_;
  std::size_t edge_;
  std::vector<float> values_;
};

struct Tiles {
  std::vector<Vec3i> origins;
  int edge, margin;
};
/// Cubes that hold all blocks of the solid. The margin, as wide as a ray is long, is at most as much again.
Tiles tiles_of(const Solid& solid, double reach_vox) {
  const int margin = static_cast<int>(std::ceil(reach_vox)) + 4;
  const int edge = std::max(32, (2 * margin + 7) / 8 * 8);
  Tiles tiles{blocks(solid), edge, margin};
  const auto down = [&](int v) { return static_cast<int>(std::floor(static_cast<double>(v) / edge)) * edge; };
  for (Vec3i& o : tiles.origins) o = {down(o.x), down(o.y), down(o.z)};
  const auto order = [](Vec3i a, Vec3i b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
  std::sort(tiles.origins.begin(), tiles.origins.end(), order);
  tiles.origins.erase(std::unique(tiles.origins.begin(), tiles.origins.end()), tiles.origins.end());
  return tiles;
}

/// All crossings of the lattice's edges with the surface in one tile.
void find_crossings(const Window& window, Vec3i origin, int edge, double voxel_mm, const SampleRange* range,
                    std::vector<Spot>& out) {
  const std::array<std::size_t, 3> stride = window.stride();
  for (int x = origin.x; x < origin.x + edge; ++x) {
    for (int y = origin.y; y < origin.y + edge; ++y) {
      const float* row = window.row({x, y, origin.z});
      for (int z = 0; z < edge; ++z) {
        if (range != nullptr && !range->holds({x, y, origin.z + z})) continue;
        const float* a = row + z;
        for (int axis = 0; axis < 3; ++axis) {
          const auto k = static_cast<std::size_t>(axis);
          const float* b = a + stride[k];
          if ((*a < 0) == (*b < 0)) continue;
          const double t = *a / (*a - *b);
          // Along the edge the difference across the surface; beside it, those at both ends.
          std::array<double, 3> g{};
          for (std::size_t m = 0; m < 3; ++m) {
            const std::size_t s = stride[m];
            g[m] = m == k ? *b - *a : 0.5 * ((1 - t) * (a[s] - *(a - s)) + t * (b[s] - *(b - s)));
          }
          const Vec3d normal = normalized({g[0], g[1], g[2]});
          const Vec3i sample{x, y, origin.z + z};
          Vec3i other = sample;
          (axis == 0 ? other.x : axis == 1 ? other.y : other.z) += 1;
          Vec3d foot{1.0 * sample.x, 1.0 * sample.y, 1.0 * sample.z};
          (axis == 0 ? foot.x : axis == 1 ? foot.y : foot.z) += t;
          // Edges along k cross a piece of surface once per h^2 / |n_k|; weighed with n_k^2 the three add up to one.
          out.push_back(
              {*a < 0 ? sample : other, voxel_mm * foot, normal, voxel_mm * voxel_mm * std::abs(normal[axis]), 0});
        }
      }
    }
  }
}

Scan scan_tile(const Solid& solid, const Shape& lumen, const ScanLimits& limits, Vec3i origin, const Tiles& tiles,
               const SampleRange* range) {
  const double h = solid.grid().voxel_mm;
  const Window window(solid, {origin.x - tiles.margin, origin.y - tiles.margin, origin.z - tiles.margin},
                      tiles.edge + 2 * tiles.margin);
  std::vector<Spot> spots;
  find_crossings(window, origin, tiles.edge, h, range, spots);
  std::vector<Vec3d> feet;
  for (const Spot& spot : spots) feet.push_back(spot.foot_mm);
  std::vector<float> depth(spots.size());
  lumen.evaluate(feet, depth);

  Scan found;
  const auto probe = [&](Spot spot, bool material, double most_mm, std::vector<Spot>& list) {
    const Vec3d along = material ? -spot.normal : spot.normal, foot = spot.foot_mm / h;
    const double length = window.chord(foot, along, material, most_mm / h);
    if (!(length < most_mm / h)) return;
    if (dot(window.normal(foot + length * along), spot.normal) > -limits.opposed) return;
    spot.mm = length * h;
    const Vec3d middle = foot + 0.5 * length * along;
    const auto near = [](double v) { return static_cast<std::int32_t>(std::lround(v)); };
    spot.at = {near(middle.x), near(middle.y), near(middle.z)};
    list.push_back(spot);
  };
  for (std::size_t i = 0; i < spots.size(); ++i) {
    if (limits.wall_mm > 0) probe(spots[i], true, limits.wall_mm, found.walls);
    if (!(depth[i] < 0)) continue;
    found.lumen_mm2 += std::nearbyint(spots[i].area_mm2 * exact_mm2) / exact_mm2;
    if (limits.gap_mm > 0) probe(spots[i], false, limits.gap_mm, found.gaps);
    if (-dot(spots[i].normal, limits.up) > limits.steep_sine) found.steep.push_back(spots[i]);
  }
  return found;
}

using Key = std::uint64_t;
constexpr Key key(int x, int y, int z) {  // neighbours differ by a constant
  constexpr int middle = 1 << 20;
  return (static_cast<Key>(x + middle) << 42) + (static_cast<Key>(y + middle) << 21) + static_cast<Key>(z + middle);
}

/// For each spot the number of its patch, by joining samples that touch.
std::vector<std::size_t> patch_numbers(const std::vector<Spot>& spots) {
  std::vector<Key> keys;
  for (const Spot& s : spots) keys.push_back(key(s.at.x, s.at.y, s.at.z));
  std::vector<Key> sorted = keys;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  DisjointSets sets(sorted.size());
  for (int n = 14; n < 27; ++n) {  // the 13 neighbours that come later
    const Key step = key(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1) - key(0, 0, 0);
    std::size_t j = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      while (j < sorted.size() && sorted[j] < sorted[i] + step) ++j;
      if (j == sorted.size()) break;
      if (sorted[j] != sorted[i] + step) continue;
      sets.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
    }
  }
  std::vector<std::size_t> number;
  for (const Key k : keys)
    number.push_back(
        sets.root(static_cast<std::uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), k) - sorted.begin())));
  return number;
}

}  // namespace

Scan scan(const Solid& solid, const Shape& lumen, const ScanLimits& limits, const Context& context,
          const SampleRange* range) {
  Tiles tiles = tiles_of(solid, std::max(limits.wall_mm, limits.gap_mm) / solid.grid().voxel_mm);
  if (range != nullptr) {
    std::erase_if(tiles.origins, [&](Vec3i o) {
      const int at = range->axis == 0 ? o.x : range->axis == 1 ? o.y : o.z;
      return at >= range->high || at + tiles.edge <= range->low;
    });
  }
  std::vector<Scan> parts(tiles.origins.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, parts.size(), 1), [&](const auto& some) {
    if (context.cancelled()) return;
    for (std::size_t i = some.begin(); i < some.end(); ++i)
      parts[i] = scan_tile(solid, lumen, limits, tiles.origins[i], tiles, range);
  });
  context.check();
  Scan all;
  for (const Scan& part : parts) add(all, part);
  return all;
}

void add(Scan& to, const Scan& from) {
  to.walls.insert(to.walls.end(), from.walls.begin(), from.walls.end());
  to.gaps.insert(to.gaps.end(), from.gaps.begin(), from.gaps.end());
  to.steep.insert(to.steep.end(), from.steep.begin(), from.steep.end());
  to.lumen_mm2 += from.lumen_mm2;
}

void sort_spots(std::vector<Spot>& spots) {
  const auto key = [](const Spot& s) {
    return std::tuple(s.at.x, s.at.y, s.at.z, s.foot_mm.x, s.foot_mm.y, s.foot_mm.z);
  };
  std::stable_sort(spots.begin(), spots.end(), [&](const Spot& a, const Spot& b) { return key(a) < key(b); });
}

void drop_small_patches(std::vector<Spot>& spots, double least_mm2) {
  const std::vector<std::size_t> number = patch_numbers(spots);
  std::vector<double> area(spots.size(), 0.0);
  for (std::size_t i = 0; i < spots.size(); ++i) area[number[i]] += spots[i].area_mm2;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < spots.size(); ++i) {
    if (area[number[i]] >= least_mm2) spots[kept++] = spots[i];
  }
  spots.resize(kept);
}

std::vector<Patch> patches(const std::vector<Spot>& spots, Vec3d up) {
  constexpr int directions = 8;
  const Frame frame = frame_along({}, up);
  std::array<Vec3d, directions> across;
  for (int d = 0; d < directions; ++d) {
    const double angle = std::numbers::pi * d / directions;
    across[static_cast<std::size_t>(d)] = std::cos(angle) * frame.x + std::sin(angle) * frame.y;
  }
  struct Sum {
    Patch patch;
    Vec3d moment{};
    std::array<double, directions> low, high;
  };
  const std::vector<std::size_t> number = patch_numbers(spots);
  std::vector<std::size_t> slot(spots.size(), spots.size());
  std::vector<Sum> sums;
  for (std::size_t i = 0; i < spots.size(); ++i) {
    const Spot& spot = spots[i];
    if (slot[number[i]] == spots.size()) {
      slot[number[i]] = sums.size();
      Sum& fresh = sums.emplace_back();
      fresh.patch.least_mm = INFINITY;
      fresh.low.fill(INFINITY);
      fresh.high.fill(-INFINITY);
    }
    Sum& sum = sums[slot[number[i]]];
    sum.patch.area_mm2 += spot.area_mm2;
    sum.patch.volume_mm3 += 0.5 * spot.area_mm2 * spot.mm;
    sum.moment = sum.moment + spot.area_mm2 * spot.foot_mm;
    if (spot.mm < sum.patch.least_mm) {
      sum.patch.least_mm = spot.mm;
      sum.patch.at_mm = spot.foot_mm;
    }
    for (std::size_t d = 0; d < directions; ++d) {
      const double at = dot(across[d], spot.foot_mm);
      sum.low[d] = std::min(sum.low[d], at);
      sum.high[d] = std::max(sum.high[d], at);
    }
  }
  std::vector<Patch> result;
  for (Sum& sum : sums) {
    for (std::size_t d = 0; d < directions; ++d)
      sum.patch.across_mm = std::max(sum.patch.across_mm, sum.high[d] - sum.low[d]);
    if (sum.patch.least_mm == 0) sum.patch.at_mm = sum.moment / sum.patch.area_mm2;
    result.push_back(sum.patch);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Patch& a, const Patch& b) { return a.area_mm2 > b.area_mm2; });
  return result;
}

}  // namespace fibrolite
