// SPDX-License-Identifier: GPL-3.0-or-later
#include "nodal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>

#include "fibrolite/clones.h"

namespace fibrolite {
namespace {

constexpr double root_half = std::numbers::sqrt2 / 2;

/// Samples along x and y of a brick; along z there are DistanceTable::side.
constexpr int brick_side(Surface surface) {
  return surface == Surface::D ? DistanceTable::side / 2 : DistanceTable::side;
}
/// Bricks along x and y of a cell. A step from one to the next also goes half a cell along z if there are two.
constexpr int bricks_along(Surface surface) { return surface == Surface::D ? 2 : 1; }

/// Steps from every sample of the brick to the nearest point of a surface, found by passing them on from neighbour to
/// neighbour (Danielsson 1980) and then made exact on the smooth surface itself.
class ClosestPoints {
 public:
  static constexpr int tall = DistanceTable::side;

  ClosestPoints(Surface surface, const CellEdges& cell, double level)
      : d_(surface, cell), level_(level), n(brick_side(surface)), step_{cell.x / tall, cell.y / tall, cell.z / tall} {
    constexpr double far = std::numeric_limits<double>::max() / 4;
    to_.assign(static_cast<std::size_t>(n) * static_cast<std::size_t>(n) * tall, {std::sqrt(far), 0, 0});
    seed();
    for (int round = 0; round < 2; ++round)
      for (int direction = 0; direction < 8; ++direction) sweep(direction);
  }

  /// Signed distance of a sample.
  [[nodiscard]] double distance(int i, int j, int k) const {
    const Vec3d p = place(i, j, k), rough = to_[index(i, j, k)];
    Vec3d q = p + rough;
    for (int turn = 0; turn < 8; ++turn) {
      const Nodal::Value at = d_(q);
      const Vec3d normal = normalized(at.gradient), e = p - q;
      q = q + 0.7 * (e - dot(e, normal) * normal) - ((at.d - level_) / dot(at.gradient, at.gradient)) * at.gradient;
    }
    const Nodal::Value at = d_(q);
    q = q - ((at.d - level_) / dot(at.gradient, at.gradient)) * at.gradient;
    const double length = std::min(norm(q - p), norm(rough));
    return d_(p).d > level_ ? -length : length;
  }

 private:
  [[nodiscard]] Vec3d place(int i, int j, int k) const { return {i * step_.x, j * step_.y, k * step_.z}; }
  /// Any sample near the brick, moved into it: by half cells along two axes if two bricks make a cell's edge.
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    const int bi = (i + 2 * n) / n - 2, bj = (j + 2 * n) / n - 2;
    const int turn = n < tall ? ((bi + bj) & 1) * (tall / 2) : 0;
    const int turned = (k + 2 * tall + turn) % tall;
    return (static_cast<std::size_t>(i - bi * n) * static_cast<std::size_t>(n) + static_cast<std::size_t>(j - bj * n)) *
               tall +
           static_cast<std::size_t>(turned);
  }

  void seed() {
    const double near = 1.5 * std::max(step_.x, std::max(step_.y, step_.z));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < tall; ++k) {
          const Vec3d p = place(i, j, k);
          Vec3d q = p;
          for (int turn = 0; turn < 5; ++turn) {
            const Nodal::Value at = d_(q);
            const double steep = dot(at.gradient, at.gradient);
            if (!(std::abs(at.d - level_) < 2 * near * std::sqrt(steep))) break;
            q = q - ((at.d - level_) / steep) * at.gradient;
          }
          if (std::abs(d_(q).d - level_) < 1e-6 && norm(q - p) < 2 * near) to_[index(i, j, k)] = q - p;
        }
  }

  void sweep(int direction) {
    const int si = (direction & 1) != 0 ? -1 : 1, sj = (direction & 2) != 0 ? -1 : 1,
              sk = (direction & 4) != 0 ? -1 : 1;
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b)
        for (int c = 0; c < tall; ++c) {
          const int i = si > 0 ? a : n - 1 - a, j = sj > 0 ? b : n - 1 - b, k = sk > 0 ? c : tall - 1 - c;
          Vec3d& own = to_[index(i, j, k)];
          double best = dot(own, own);
          const auto take = [&](int di, int dj, int dk) {
            const Vec3d via = to_[index(i + di, j + dj, k + dk)] + place(di, dj, dk);
            const double length = dot(via, via);
            if (length >= best) return;
            best = length;
            own = via;
          };
          take(-si, 0, 0);
          take(0, -sj, 0);
          take(0, 0, -sk);
          take(-si, -sj, 0);
          take(-si, 0, -sk);
          take(0, -sj, -sk);
        }
  }

  Nodal d_;
  double level_;
  int n;
  Vec3d step_;
  std::vector<Vec3d> to_;
};

/// Calls visit(value, gradient) at the midpoints of a brick, `samples` along half an edge of the cell. Returns how
/// many.
template <class Visit>
double each_sample(const Nodal& d, const CellEdges& cell, int samples, const Visit& visit) {
  const Vec3d step{cell.x / (2 * samples), cell.y / (2 * samples), cell.z / (2 * samples)};
  const int across = 2 * samples / bricks_along(d.of);
  for (int i = 0; i < across; ++i)
    for (int j = 0; j < across; ++j)
      for (int k = 0; k < 2 * samples; ++k) visit(d({(i + 0.5) * step.x, (j + 0.5) * step.y, (k + 0.5) * step.z}));
  return 2.0 * across * across * samples;
}

template <Surface surface>
[[gnu::always_inline]] inline void look_up(const float* px, const float* py, const float* pz, int count, float sx,
                                           float sy, float sz, float per_x, float per_y, float per_z,
                                           const float* table, float* out) {
  constexpr int n = brick_side(surface), tall = DistanceTable::side, row = tall + 1, plane = (n + 1) * row;
  constexpr auto bricks = static_cast<float>(bricks_along(surface));
  constexpr float turn = bricks_along(surface) == 2 ? 0.5F : 0;
  for (int i = 0; i < count; ++i) {
    const float x = (px[i] - sx) * per_x * bricks, y = (py[i] - sy) * per_y * bricks, z = (pz[i] - sz) * per_z;
    const float bx = std::floor(x), by = std::floor(y);
    const float turned = z + turn * static_cast<float>((static_cast<int>(bx) + static_cast<int>(by)) & 1);
    const float gx = (x - bx) * n, gy = (y - by) * n, gz = (turned - std::floor(turned)) * tall;
    // Just below a multiple of the cell the remainder may round up to the whole.
    const int ix = std::min(static_cast<int>(gx), n - 1), iy = std::min(static_cast<int>(gy), n - 1),
              iz = std::min(static_cast<int>(gz), tall - 1);
    const float u = gx - static_cast<float>(ix), v = gy - static_cast<float>(iy), w = gz - static_cast<float>(iz);
    const int at = ix * plane + iy * row + iz;
    const float a = table[at] + w * (table[at + 1] - table[at]);
    const float b = table[at + row] + w * (table[at + row + 1] - table[at + row]);
    const float c = table[at + plane] + w * (table[at + plane + 1] - table[at + plane]);
    const float d = table[at + plane + row] + w * (table[at + plane + row + 1] - table[at + plane + row]);
    const float e = a + v * (b - a), f = c + v * (d - c);
    out[i] = e + u * (f - e);
  }
}

FIBROLITE_CLONES void look_up_d(const float* px, const float* py, const float* pz, int count, Vec3f s, Vec3f per,
                                const float* table, float* out) {
  look_up<Surface::D>(px, py, pz, count, s.x, s.y, s.z, per.x, per.y, per.z, table, out);
}
FIBROLITE_CLONES void look_up_gyroid(const float* px, const float* py, const float* pz, int count, Vec3f s, Vec3f per,
                                     const float* table, float* out) {
  look_up<Surface::Gyroid>(px, py, pz, count, s.x, s.y, s.z, per.x, per.y, per.z, table, out);
}

struct Sheet final : Shape::Function {
  Sheet(Surface surface, const CellEdges& cell, double wall_mm, Vec3d shift_mm)
      : table(surface, cell, 0), half(static_cast<float>(0.5 * wall_mm)), shift(shift_mm) {}
  void evaluate(const PointBlock& block, float* out) const override {
    table.evaluate(block, shift, out);
    for (int i = 0; i < block.count; ++i) out[i] = std::abs(out[i]) - half;
  }
  [[nodiscard]] double lipschitz() const override { return DistanceTable::lipschitz; }
  DistanceTable table;
  float half;
  Vec3d shift;
};

}  // namespace

Nodal::Nodal(Surface surface, const CellEdges& cell)
    : of(surface), wave{2 * std::numbers::pi / cell.x, 2 * std::numbers::pi / cell.y, 2 * std::numbers::pi / cell.z} {}

Nodal::Value Nodal::operator()(Vec3d p) const {
  const double cx = std::cos(wave.x * p.x), sx = std::sin(wave.x * p.x);
  const double cy = std::cos(wave.y * p.y), sy = std::sin(wave.y * p.y);
  const double cz = std::cos(wave.z * p.z), sz = std::sin(wave.z * p.z);
  if (of == Surface::Gyroid)
    return {sx * cy + sy * cz + sz * cx,
            {wave.x * (cx * cy - sz * sx), wave.y * (cy * cz - sx * sy), wave.z * (cz * cx - sy * sz)}};
  return {cx * cy * cz + sx * sy * sz,
          {wave.x * (cx * sy * sz - sx * cy * cz), wave.y * (sx * cy * sz - cx * sy * cz),
           wave.z * (sx * sy * cz - cx * cy * sz)}};
}

double neck_level(const CellEdges& cell, double neck) {
  return root_half * std::cos(std::numbers::sqrt2 * std::numbers::pi * neck / cell.least());
}

double bulge_mm(const CellEdges& cell, double neck) {
  return cell.least() / std::numbers::pi * std::acos(neck_level(cell, neck));  // along an axis D is a cosine
}

double network_density(double level) {
  const CellEdges unit = 1.0;  // the share does not change with the edges
  constexpr int samples = 32;
  double inside = 0;
  const double all = each_sample(Nodal(Surface::D, unit), unit, samples, [&](const Nodal::Value& v) {
    inside += std::clamp(0.5 + (v.d - level) * 2 * samples / std::max(norm(v.gradient), 1e-9), 0.0, 1.0);
  });
  return inside / all;
}

double membrane_mm2(Surface surface, const CellEdges& cell) {
  // Volume of a thin coat over its thickness; what the coat's thickness does to it is taken out by Richardson.
  constexpr int samples = 40;
  const double thin = 0.8 * cell.most() / samples, thick = 2 * thin;
  double with_thin = 0, with_thick = 0;
  const double all = each_sample(Nodal(surface, cell), cell, samples, [&](const Nodal::Value& v) {
    const double depth = std::abs(v.d) / std::max(norm(v.gradient), 1e-9);
    with_thin += std::max(0.0, 1 - depth / thin) / thin;
    with_thick += std::max(0.0, 1 - depth / thick) / thick;
  });
  return (4 * with_thin - with_thick) / 3 * cell.x * cell.y * cell.z / all;
}

double sheet_density(Surface surface, const CellEdges& cell, double wall_mm, double area_mm2) {
  // Euler number in a cell, whatever its edges: genus 3 in the smallest cell, so -4 in a quarter (D) or half of the
  // cube.
  const double curvature = 2 * std::numbers::pi * (surface == Surface::D ? -16 : -8);
  return (area_mm2 * wall_mm + curvature * wall_mm * wall_mm * wall_mm / 12) / (cell.x * cell.y * cell.z);
}

DistanceTable::DistanceTable(Surface surface, const CellEdges& cell, double level)
    : per_cell_{1 / cell.x, 1 / cell.y, 1 / cell.z}, surface_(surface) {
  const ClosestPoints closest(surface, cell, level);
  const int n = brick_side(surface);
  const auto rim = static_cast<std::size_t>(n) + 1;
  distance_.resize(rim * rim * (side + 1));
  const auto at = [&](int i, int j, int k) -> float& {
    return distance_[(static_cast<std::size_t>(i) * rim + static_cast<std::size_t>(j)) * (side + 1) +
                     static_cast<std::size_t>(k)];
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < side; ++k) at(i, j, k) = static_cast<float>(closest.distance(i, j, k));
  const int half = n < side ? side / 2 : 0;  // a step to the next brick turns the lattice along z
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      for (int k = 0; k <= side; ++k) {
        const int turned = (k + ((i == n) != (j == n) ? half : 0)) % side;
        if (i == n || j == n || k == side) at(i, j, k) = at(i % n, j % n, turned);
      }
}

void DistanceTable::evaluate(const PointBlock& block, Vec3d shift, float* out) const {
  (surface_ == Surface::D ? look_up_d : look_up_gyroid)(block.x, block.y, block.z, block.count, to_float(shift),
                                                        to_float(per_cell_), distance_.data(), out);
}

Shape sheet(Surface surface, const CellEdges& cell, double wall_mm, Vec3d shift) {
  return Shape(std::make_shared<const Sheet>(surface, cell, wall_mm, shift));
}

}  // namespace fibrolite
