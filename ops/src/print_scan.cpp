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

/// Samples from `low` up to `high`, which is not among them.
struct Samples {
  Vec3i low{}, high{};
};

/// A dense box of samples, in voxels: values, their gradient and where a ray leaves what it is in.
class Window {
 public:
  /// `origin`: what places are reckoned from, so that rounding does not depend on where the box ends.
  Window(const Solid& solid, Vec3i origin, const Samples& box)
      : origin_(origin),
        box_(box),
        size_{box.high.x - box.low.x, box.high.y - box.low.y, box.high.z - box.low.z},
        row_(static_cast<std::size_t>(size_.z)),
        plane_(static_cast<std::size_t>(size_.y) * row_),
        values_(static_cast<std::size_t>(size_.x) * plane_) {
    copy_samples(solid, box.low, size_, values_.data());
    const auto inverse = static_cast<float>(1 / solid.grid().voxel_mm);
    for (float& v : values_) v *= inverse;
  }
  [[nodiscard]] const float* row(Vec3i at) const {
    return values_.data() + index(at.x - box_.low.x, at.y - box_.low.y, at.z - box_.low.z);
  }
  [[nodiscard]] std::array<std::size_t, 3> stride() const { return {plane_, row_, 1}; }

  /// Linear between samples; `p` in voxels from the world's origin, at least a voxel inside the window.
  [[nodiscard]] double value(Vec3d p) const {
    const double x = p.x - origin_.x, y = p.y - origin_.y, z = p.z - origin_.z;
    const auto i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
    const double u = x - i, v = y - j, w = z - k;
    const float* a = row({origin_.x + i, origin_.y + j, origin_.z + k});
    const float* b = a + plane_;
    const auto face = [&](const float* f) {
      const double near = f[0] + w * (f[1] - f[0]), far = f[row_] + w * (f[row_ + 1] - f[row_]);
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
  /// `inside`: it runs through material. Beyond the window there is none.
  [[nodiscard]] double chord(Vec3d from, Vec3d along, bool inside, double most) const {
    constexpr double step = 0.4;
    // No surface is nearer than the value says; somewhat less, for fields are not quite distances.
    constexpr double steps_per_value = 0.8 / step;
    double before = 0, t = 0;
    for (int steps = 1;;) {
      const double last = t;
      for (int i = 0; i < steps; ++i) t += step;
      if (!(t < most + step)) return INFINITY;
      const Vec3d p = from + t * along;
      if (!holds(p)) return INFINITY;
      const double here = inside ? value(p) : -value(p);
      if (here >= 0 && steps == 1) return t - step * (before < 0 ? here / (here - before) : 0.5);
      if (here >= 0) {  // the same way on foot
        t = last;
        steps = 1;
        continue;
      }
      before = here;
      steps = std::max(1, static_cast<int>(-here * steps_per_value));
    }
  }

 private:
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) * plane_ + static_cast<std::size_t>(j) * row_ + static_cast<std::size_t>(k);
  }
  /// All samples that value() takes for `p` are in the window.
  [[nodiscard]] bool holds(Vec3d p) const {
    const auto within = [](double v, int low, int high) { return v >= low && v < high - 1; };
    return within(p.x, box_.low.x, box_.high.x) && within(p.y, box_.low.y, box_.high.y) &&
           within(p.z, box_.low.z, box_.high.z);
  }

  Vec3i origin_;
  Samples box_;
  Vec3i size_;
  std::size_t row_, plane_;
  std::vector<float> values_;
};

struct Tiles {
  std::vector<Vec3i> origins;
  int edge = 32, margin = 0;
  Samples all;  ///< The solid, and a few voxels of void around.

  /// What the rays of a tile may need: of walls far thicker than the solid is large no more than the solid.
  [[nodiscard]] Samples around(Vec3i origin) const {
    const auto low = [&](int at, int least) { return std::max(at - margin, least); };
    const auto high = [&](int at, int most) { return std::min(at + edge + margin, most); };
    return {{low(origin.x, all.low.x), low(origin.y, all.low.y), low(origin.z, all.low.z)},
            {high(origin.x, all.high.x), high(origin.y, all.high.y), high(origin.z, all.high.z)}};
  }
  /// A tile's own samples.
  [[nodiscard]] Samples of(Vec3i origin) const {
    const Samples box = around(origin);
    constexpr int beside = 1;  // samples beside a crossing are looked at
    const auto low = [](int at, int least) { return std::max(at, least + beside); };
    const auto high = [&](int at, int most) { return std::min(at + edge, most - 2 * beside); };
    return {{low(origin.x, box.low.x), low(origin.y, box.low.y), low(origin.z, box.low.z)},
            {high(origin.x, box.high.x), high(origin.y, box.high.y), high(origin.z, box.high.z)}};
  }
};
/// Cubes that hold all blocks of the solid. The margin, as wide as a ray is long, is at most as much again.
Tiles tiles_of(const Solid& solid, double reach_vox) {
  Tiles tiles{.origins = blocks(solid), .all = {}};
  constexpr int around = 5, block = 8;  // as margins of tiles at least, and one more for the next block's samples
  if (!tiles.origins.empty()) tiles.all = {tiles.origins.front(), tiles.origins.front()};
  for (const Vec3i o : tiles.origins) {
    Samples& all = tiles.all;
    all.low = {std::min(all.low.x, o.x), std::min(all.low.y, o.y), std::min(all.low.z, o.z)};
    all.high = {std::max(all.high.x, o.x), std::max(all.high.y, o.y), std::max(all.high.z, o.z)};
  }
  tiles.all.low = {tiles.all.low.x - around, tiles.all.low.y - around, tiles.all.low.z - around};
  const int beyond = block + around;
  tiles.all.high = {tiles.all.high.x + beyond, tiles.all.high.y + beyond, tiles.all.high.z + beyond};
  constexpr double longest = 1 << 24;  // more than any solid
  tiles.margin = static_cast<int>(std::min(std::ceil(reach_vox), longest)) + 4;
  tiles.edge = std::max(32, (2 * tiles.margin + 7) / 8 * 8);
  const int edge = tiles.edge;
  const auto down = [&](int v) { return static_cast<int>(std::floor(static_cast<double>(v) / edge)) * edge; };
  for (Vec3i& o : tiles.origins) o = {down(o.x), down(o.y), down(o.z)};
  const auto order = [](Vec3i a, Vec3i b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
  std::sort(tiles.origins.begin(), tiles.origins.end(), order);
  tiles.origins.erase(std::unique(tiles.origins.begin(), tiles.origins.end()), tiles.origins.end());
  return tiles;
}

/// All crossings of the lattice's edges with the surface in one tile.
void find_crossings(const Window& window, const Samples& own, double voxel_mm, const SampleRange* range,
                    std::vector<Spot>& out) {
  const std::array<std::size_t, 3> stride = window.stride();
  for (int x = own.low.x; x < own.high.x; ++x) {
    for (int y = own.low.y; y < own.high.y; ++y) {
      const float* a = window.row({x, y, own.low.z});
      for (int z = own.low.z; z < own.high.z; ++z, ++a) {
        if (range != nullptr && !range->holds({x, y, z})) continue;
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
          const Vec3i sample{x, y, z};
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
  const int margin = tiles.margin;
  const Window window(solid, {origin.x - margin, origin.y - margin, origin.z - margin}, tiles.around(origin));
  std::vector<Spot> spots;
  find_crossings(window, tiles.of(origin), h, range, spots);
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
