// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture_raster.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

/// Twice the signed area of (a, b, c) on the screen; y runs down, so front faces are positive this way round.
double turn(Vec3d a, Vec3d b, Vec3d c) { return (c.x - a.x) * (b.y - a.y) - (c.y - a.y) * (b.x - a.x); }

int first_center(double from) { return static_cast<int>(std::ceil(from - 0.5)); }
int last_center(double to) { return static_cast<int>(std::floor(to - 0.5)); }

}  // namespace

// Positive floats sort like their bits.
float Raster::depth_mm(std::uint64_t word) { return std::bit_cast<float>(static_cast<std::uint32_t>(word >> 32)); }
std::uint64_t Raster::pack(float depth_mm, std::uint32_t id) {
  return (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(depth_mm)) << 32) | id;
}

void Raster::put(int x, int y, std::uint64_t word) {
  std::atomic_ref<std::uint64_t> cell(words_[index(x, y)]);
  std::uint64_t seen = cell.load(std::memory_order_relaxed);
  while (word < seen && !cell.compare_exchange_weak(seen, word, std::memory_order_relaxed)) {
  }
}

void Raster::draw_surface(const Mesh& mesh, const View& view, const std::optional<CutPlane>& cut,
                          const Context& context) {
  if (mesh.triangles.size() >= first_cap) throw Error(Code::TooLarge, "too many triangles for a picture");
  const auto draw = [&](std::uint32_t id) {
    std::array<Vec3d, 3> p, s;
    std::array<double, 3> side{-1, -1, -1};
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = to_double(mesh.vertices[mesh.triangles[id][k]]);
      s[k] = view.project(p[k]);
      if (cut) side[k] = cut->side(p[k]);
    }
    const double whole = turn(s[0], s[1], s[2]);
    // Back faces can be seen only through a cut, and there the cap covers them.
    if (whole <= 0 || std::min({side[0], side[1], side[2]}) > 0) return;
    const int x0 = std::max(0, first_center(std::min({s[0].x, s[1].x, s[2].x})));
    const int x1 = std::min(view.width - 1, last_center(std::max({s[0].x, s[1].x, s[2].x})));
    const int y0 = std::max(0, first_center(std::min({s[0].y, s[1].y, s[2].y})));
    const int y1 = std::min(view.height - 1, last_center(std::max({s[0].y, s[1].y, s[2].y})));
    // Both neighbours may claim a sample on their common edge (the nearer or the lower id wins); neither may miss it.
    const double slack = -1e-9 * (whole + 1);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const Vec3d c{x + 0.5, y + 0.5, 0};
        const double a = turn(s[1], s[2], c), b = turn(s[2], s[0], c), d = turn(s[0], s[1], c);
        if (a < slack || b < slack || d < slack) continue;
        if ((a * side[0] + b * side[1] + d * side[2]) > 0) continue;
        const double depth = (a * s[0].z + b * s[1].z + d * s[2].z) / whole;
        put(x, y, pack(static_cast<float>(std::max(depth, 0.0)), id));
      }
    }
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), [&](const auto& range) {
    context.check();
    for (std::size_t i = range.begin(); i != range.end(); ++i) draw(static_cast<std::uint32_t>(i));
  });
}

void Raster::draw_cap(const Solid& solid, const Box3d& bounds, const View& view, const CutPlane& cut, double outline_mm,
                      const Context& context) {
  const double slope = dot(view.forward, cut.normal);
  if (slope >= 0) return;  // seen from behind or edge on
  const Shape distance = distance_to(solid);
  const Box3d box = bounds.grown(solid.grid().voxel_mm);
  tbb::parallel_for(tbb::blocked_range<int>(0, view.height, 8), [&](const auto& rows) {
    context.check();
    std::array<Vec3d, PointBlock::capacity> points;
    std::array<float, PointBlock::capacity> values;
    std::array<int, PointBlock::capacity> at;
    for (int y = rows.begin(); y != rows.end(); ++y) {
      std::size_t count = 0;
      const auto flush = [&] {
        distance.evaluate({points.data(), count}, {values.data(), count});
        for (std::size_t i = 0; i < count; ++i) {
          if (values[i] >= 0) continue;
          const double inside = std::min(-values[i] / outline_mm, 1.0);
          const auto shade = static_cast<std::uint32_t>(std::lround(255 * inside));
          put(at[i], y, pack(static_cast<float>(view.project(points[i]).z), first_cap + shade));
        }
        count = 0;
      };
      for (int x = 0; x < view.width; ++x) {
        const Vec3d eye = view.unproject(x + 0.5, y + 0.5, 0);
        const double depth = -cut.side(eye) / slope;
        const Vec3d p = eye + depth * view.forward;
        if (depth <= 0 || !box.contains(p)) continue;
        points[count] = p;
        at[count] = x;
        if (++count == points.size()) flush();
      }
      flush();
    }
  });
}

}  // namespace fibrolite
