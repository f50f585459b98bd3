// SPDX-License-Identifier: GPL-3.0-or-later
#include "print_scan.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "fibrolite/blocks.h"

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
  /// The same within two voxels of an edge of the solid, where normal() would be a mean of both faces: along each axis
  /// the slope on the side that bends less, if the other bends far more.
  [[nodiscard]] Vec3d face_normal(Vec3d p) const {
    const double here = value(p);
    const auto slope = [&](Vec3d step) {
      const double a1 = value(p + step), a2 = value(p + 2 * step), b1 = value(p - step), b2 = value(p - 2 * step);
      const double bend_a = std::abs(here - 2 * a1 + a2), bend_b = std::abs(here - 2 * b1 + b2);
      return bend_a < 0.25 * bend_b ? a1 - here : bend_b < 0.25 * bend_a ? here - b1 : 0.5 * (a1 - b1);
    };
    return normalized(Vec3d{slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1})});
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
    // The crest of a vault between two slopes is no ceiling.
    if (-dot(spots[i].normal, limits.up) > limits.steep_sine &&
        -dot(window.face_normal(spots[i].foot_mm / h), limits.up) > limits.steep_sine)
      found.steep.push_back(spots[i]);
  }
  return found;
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
  for (const Scan& part : parts) {
    all.walls.insert(all.walls.end(), part.walls.begin(), part.walls.end());
    all.gaps.insert(all.gaps.end(), part.gaps.begin(), part.gaps.end());
    all.steep.insert(all.steep.end(), part.steep.begin(), part.steep.end());
    all.lumen_mm2 += part.lumen_mm2;
  }
  return all;
}

}  // namespace fibrolite
