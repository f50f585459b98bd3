// SPDX-License-Identifier: GPL-3.0-or-later
#include "sticks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

namespace fibrolite {
namespace {

struct Lattice : Shape::Function {
  /// Distances to the nearest bond and to the nearest node, mm.
  virtual void apart(const PointBlock& block, float* bond, float* node) const = 0;
};

/// Exact distance to the diamond lattice in O(1), by folding.
///
/// In quarter cells the nodes are A, the points with even coordinates whose sum is divisible by 4, and B = A + (1,1,1);
/// each A node has bonds to A + {(1,1,1), (1,-1,-1), (-1,1,-1), (-1,-1,1)}. The lattice is mapped onto itself by moving
/// along A, by any permutation of the axes and by flipping two signs. So a point is moved into the Voronoi cell of the
/// A node at the origin and then folded to x >= y >= |z|; there the nearest bond is always the one from (0,0,0) to
/// (1,1,1). Stretched along z only x and y may be exchanged, and one of four bonds is nearest.
struct Crystal final : Lattice {
  Crystal(double edge_mm, double stretch_z, const Radii& r, Vec3d shift_mm)
      : quarter(static_cast<float>(0.25 * edge_mm)),
        stretch(static_cast<float>(stretch_z)),
        stick(static_cast<float>(r.stick_mm)),
        ball(static_cast<float>(r.ball_mm)),
        shift(shift_mm) {}

  void evaluate(const PointBlock& block, float* out) const override {
    const auto sx = static_cast<float>(shift.x), sy = static_cast<float>(shift.y), sz = static_cast<float>(shift.z);
    if (stretch == 1.0F) {
      cubic(block.x, block.y, block.z, block.count, sx, sy, sz, quarter, stick, ball, out);
    } else {
      stretched(block.x, block.y, block.z, block.count, sx, sy, sz, quarter, stretch, stick, ball, out);
    }
  }

  void apart(const PointBlock& block, float* bond, float* node) const override {
    const auto sx = static_cast<float>(shift.x), sy = static_cast<float>(shift.y), sz = static_cast<float>(shift.z);
    if (stretch == 1.0F) {
      cubic_apart(block.x, block.y, block.z, block.count, sx, sy, sz, quarter, bond, node);
    } else {
      stretched_apart(block.x, block.y, block.z, block.count, sx, sy, sz, quarter, stretch, bond, node);
    }
  }

  struct Folded {
    float a, b, c;  // |coordinate| in the Voronoi cell of the origin, quarter cells, axes in place
    float sign;     // of the product of the coordinates
  };
  /// The two ways to the nearest even number without a call: the constant pushes the fraction out of the mantissa.
  static constexpr float push = 12582912.0F;  // 1.5 * 2^23
  static float nearest_even(float v) { return 2.0F * ((0.5F * v + push) - push); }
  static Folded fold(float x, float y, float z) {
    const float ex = nearest_even(x), ey = nearest_even(y), ez = nearest_even(z);
    const float rx = x - ex, ry = y - ey, rz = z - ez;
    float a = std::abs(rx), b = std::abs(ry), c = std::abs(rz);
    float sign = (rx < 0 ? -1.0F : 1.0F) * (ry < 0 ? -1.0F : 1.0F) * (rz < 0 ? -1.0F : 1.0F);
    // Even corners with an odd half sum are no A nodes: step over along the axis with the largest remainder.
    const bool odd = (static_cast<int>(0.5F * (ex + ey + ez)) & 1) != 0;
    const float largest = std::max(a, std::max(b, c));
    const bool step_a = odd && a == largest, step_b = odd && !step_a && b == largest,
               step_c = odd && !step_a && !step_b;
    a = step_a ? 2.0F - a : a;
    b = step_b ? 2.0F - b : b;
    c = step_c ? 2.0F - c : c;
    sign = odd ? -sign : sign;
    return {a, b, c, sign};
  }

  struct Nearest {
    float bond, node;  // squared, quarter cells
  };

  /// Squared distances to the nearest bond and node, quarter cells, eight points at a time: fold() written so that
  /// nothing branches, which the compiler does not find by itself.
  [[gnu::always_inline]] static inline void nearest_cubic(const float* px, const float* py, const float* pz, int count,
                                                          float sx, float sy, float sz, float quarter, float* bond,
                                                          float* node) {
    using Lanes [[gnu::vector_size(32)]] = float;
    using Mask [[gnu::vector_size(32)]] = std::int32_t;  // a lane is all ones or zero
    constexpr int lanes = 8;
    const float inverse = 1.0F / quarter;
    std::array<float, 3 * lanes> rest{};
    for (int i = 0; i < count; i += lanes) {
      const std::size_t n = sizeof(float) * static_cast<std::size_t>(std::min(lanes, count - i));
      const bool whole = i + lanes <= count;
      if (!whole) {
        std::memcpy(rest.data(), px + i, n);
        std::memcpy(rest.data() + lanes, py + i, n);
        std::memcpy(rest.data() + 2 * lanes, pz + i, n);
      }
      Lanes x, y, z;
      std::memcpy(&x, whole ? px + i : rest.data(), sizeof x);
      std::memcpy(&y, whole ? py + i : rest.data() + lanes, sizeof y);
      std::memcpy(&z, whole ? pz + i : rest.data() + 2 * lanes, sizeof z);
      x = (x - sx) * inverse, y = (y - sy) * inverse, z = (z - sz) * inverse;
      const Lanes ex = 2.0F * ((0.5F * x + push) - push), ey = 2.0F * ((0.5F * y + push) - push),
                  ez = 2.0F * ((0.5F * z + push) - push);
      x -= ex, y -= ey, z -= ez;
      const Lanes half_sum = 0.5F * (ex + ey + ez);
      const Mask odd = half_sum != 2.0F * ((0.5F * half_sum + push) - push);
      const Mask flip = (x < 0) ^ (y < 0) ^ (z < 0) ^ odd;
      Lanes a = x < 0 ? -x : x, b = y < 0 ? -y : y, c = z < 0 ? -z : z;
      const Lanes bc = b < c ? c : b, largest = a < bc ? bc : a;
      const Mask step_a = odd & (a == largest), step_b = odd & ~step_a & (b == largest),
                 step_c = odd & ~step_a & ~step_b;
      a = step_a ? 2.0F - a : a;
      b = step_b ? 2.0F - b : b;
      c = step_c ? 2.0F - c : c;

      const Lanes most = b < c ? c : b, least = b < c ? b : c;
      const Lanes high = a < most ? most : a, low = least < a ? least : a;
      const Lanes u = high, v = a + b + c - high - low, w = flip ? -low : low;
      Lanes t = (u + v + w) * (1.0F / 3.0F);
      t = t < 0 ? Lanes{} : t;
      t = t > 1 ? Lanes{} + 1.0F : t;
      const Lanes to_bond = (u - t) * (u - t) + (v - t) * (v - t) + (w - t) * (w - t);
      const Lanes first = u * u + v * v + w * w, second = (u - 1) * (u - 1) + (v - 1) * (v - 1) + (w - 1) * (w - 1);
      const Lanes to_node = second < first ? second : first;
      std::memcpy(bond + i, &to_bond, n);
      std::memcpy(node + i, &to_node, n);
    }
  }

  [[gnu::target_clones("avx2", "default")]] static void cubic(const float* px, const float* py, const float* pz,
                                                              int count, float sx, float sy, float sz, float quarter,
                                                              float stick, float ball, float* out) {
    std::array<float, PointBlock::capacity> bond, node;
    nearest_cubic(px, py, pz, count, sx, sy, sz, quarter, bond.data(), node.data());
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      out[i] = std::min(std::sqrt(bond[k]) * quarter - stick, std::sqrt(node[k]) * quarter - ball);
    }
  }
  [[gnu::target_clones("avx2", "default")]] static void cubic_apart(const float* px, const float* py, const float* pz,
                                                                    int count, float sx, float sy, float sz,
                                                                    float quarter, float* bond, float* node) {
    nearest_cubic(px, py, pz, count, sx, sy, sz, quarter, bond, node);
    for (int i = 0; i < count; ++i) {
      bond[i] = std::sqrt(bond[i]) * quarter;
      node[i] = std::sqrt(node[i]) * quarter;
    }
  }

  /// Squared distance from p to the bond from a along d, z stretched by k.
  static float bond2(float x, float y, float z, float ax, float ay, float az, float dx, float dy, float dz, float k) {
    const float px = x - ax, py = y - ay, pz = (z - az) * k, qz = dz * k;
    const float t = std::min(std::max((px * dx + py * dy + pz * qz) / (dx * dx + dy * dy + qz * qz), 0.0F), 1.0F);
    const float ux = px - t * dx, uy = py - t * dy, uz = pz - t * qz;
    return ux * ux + uy * uy + uz * uz;
  }

  static Nearest nearest_stretched(float px, float py, float pz, float k) {
    const Folded f = fold(px, py, pz);
    const float x = std::max(f.a, f.b), y = std::min(f.a, f.b), z = f.c * f.sign;
    return {std::min(std::min(bond2(x, y, z, 0, 0, 0, 1, 1, 1, k), bond2(x, y, z, 0, 0, 0, 1, -1, -1, k)),
                     std::min(bond2(x, y, z, 2, 0, -2, -1, -1, 1, k), bond2(x, y, z, 2, 0, 2, -1, 1, -1, k))),
            std::min(x * x + y * y + k * k * z * z,
                     std::min((x - 1) * (x - 1) + (y - 1) * (y - 1) + k * k * (z - 1) * (z - 1),
                              (x - 1) * (x - 1) + (y + 1) * (y + 1) + k * k * (z + 1) * (z + 1)))};
  }
  static void stretched(const float* px, const float* py, const float* pz, int count, float sx, float sy, float sz,
                        float quarter, float k, float stick, float ball, float* out) {
    const float inverse = 1.0F / quarter;
    for (int i = 0; i < count; ++i) {
      const Nearest n =
          nearest_stretched((px[i] - sx) * inverse, (py[i] - sy) * inverse, (pz[i] - sz) * inverse / k, k);
      out[i] = std::min(std::sqrt(n.bond) * quarter - stick, std::sqrt(n.node) * quarter - ball);
    }
  }
  static void stretched_apart(const float* px, const float* py, const float* pz, int count, float sx, float sy,
                              float sz, float quarter, float k, float* bond, float* node) {
    const float inverse = 1.0F / quarter;
    for (int i = 0; i < count; ++i) {
      const Nearest n =
          nearest_stretched((px[i] - sx) * inverse, (py[i] - sy) * inverse, (pz[i] - sz) * inverse / k, k);
      bond[i] = std::sqrt(n.bond) * quarter;
      node[i] = std::sqrt(n.node) * quarter;
    }
  }

  float quarter, stretch, stick, ball;
  Vec3d shift;
};

/// Exact distance for any edges of the cell, a few times slower. Folding may not exchange axes now, and which bonds can
/// be nearest to a folded point depends on the edges: they are found once.
struct AnyCell final : Lattice {
  AnyCell(const CellEdges& cell, const Radii& r, Vec3d shift_mm)
      : quarter{0.25 * cell.x, 0.25 * cell.y, 0.25 * cell.z}, radii(r), shift(shift_mm) {
    choose();
  }

  void evaluate(const PointBlock& block, float* out) const override {
    std::array<float, PointBlock::capacity> bond, node;
    apart(block, bond.data(), node.data());
    const auto stick = static_cast<float>(radii.stick_mm), ball = static_cast<float>(radii.ball_mm);
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i)
      out[i] = std::min(bond[i] - stick, node[i] - ball);
  }

  void apart(const PointBlock& block, float* bond, float* node) const override {
    const Vec3f q = to_float(quarter), s = to_float(shift);
    std::array<float, PointBlock::capacity> x, y, z;
    const auto count = static_cast<std::size_t>(block.count);
    for (std::size_t i = 0; i < count; ++i) {
      const Crystal::Folded f =
          Crystal::fold((block.x[i] - s.x) / q.x, (block.y[i] - s.y) / q.y, (block.z[i] - s.z) / q.z);
      x[i] = f.a * q.x;
      y[i] = f.b * q.y;
      z[i] = f.c * f.sign * q.z;
      bond[i] = node[i] = far_mm;
    }
    for (const Bond& b : bonds)
      for (std::size_t i = 0; i < count; ++i) {
        const float px = x[i] - b.a.x, py = y[i] - b.a.y, pz = z[i] - b.a.z;
        const float t = std::min(std::max(px * b.per.x + py * b.per.y + pz * b.per.z, 0.0F), 1.0F);
        const float ux = px - t * b.along.x, uy = py - t * b.along.y, uz = pz - t * b.along.z;
        bond[i] = std::min(bond[i], ux * ux + uy * uy + uz * uz);
      }
    for (const Vec3f& n : nodes)
      for (std::size_t i = 0; i < count; ++i) {
        const float px = x[i] - n.x, py = y[i] - n.y, pz = z[i] - n.z;
        node[i] = std::min(node[i], px * px + py * py + pz * pz);
      }
    for (std::size_t i = 0; i < count; ++i) {
      bond[i] = std::sqrt(bond[i]);
      node[i] = std::sqrt(node[i]);
    }
  }

  struct Bond {
    Vec3f a, along, per;  // from a, by `along`; per = along / |along|^2
  };

  /// Keeps what is nearest to some place a folded point can be at. Places are looked at in a raster; whatever is
  /// nearest between them is, at the place of the raster beside it, farther than the nearest by at most twice the way
  /// there.
  void choose() {
    constexpr int raster = 12;
    const double step = 2.0 / raster;
    const double slack = norm(step * quarter);  // twice half the raster's diagonal
    struct Item {
      Vec3d a, along;
      bool near = false;
    };
    std::vector<Item> all_bonds, all_nodes;
    each_diamond_bond({-6, -6, -6}, {8, 8, 8}, [&](Vec3i a, Vec3i d) {
      const Vec3d from{a.x * quarter.x, a.y * quarter.y, a.z * quarter.z};
      const Vec3d along{d.x * quarter.x, d.y * quarter.y, d.z * quarter.z};
      all_bonds.push_back({from, along});
      if (d == Vec3i{1, 1, 1}) {
        all_nodes.push_back({from, {}});
        all_nodes.push_back({from + along, {}});
      }
    });
    const auto mark = [&](std::vector<Item>& items, Vec3d p) {
      std::vector<double> distance;
      for (const Item& item : items) {
        const double length2 = dot(item.along, item.along);
        const double t = length2 > 0 ? std::clamp(dot(p - item.a, item.along) / length2, 0.0, 1.0) : 0;
        distance.push_back(norm(p - item.a - t * item.along));
      }
      const double least = *std::min_element(distance.begin(), distance.end());
      for (std::size_t i = 0; i < items.size(); ++i) items[i].near |= distance[i] <= least + slack;
    };
    for (int i = 0; i < raster; ++i)
      for (int j = 0; j < raster; ++j)
        for (int k = -raster; k < raster; ++k) {
          const Vec3d at{(i + 0.5) * step, (j + 0.5) * step, (k + 0.5) * step};
          if (at.x + at.y > 2 + step || at.x + std::abs(at.z) > 2 + step || at.y + std::abs(at.z) > 2 + step) continue;
          const Vec3d p{at.x * quarter.x, at.y * quarter.y, at.z * quarter.z};
          mark(all_bonds, p);
          mark(all_nodes, p);
        }
    for (const Item& item : all_bonds)
      if (item.near)
        bonds.push_back({to_float(item.a), to_float(item.along), to_float(item.along / dot(item.along, item.along))});
    for (const Item& item : all_nodes)
      if (item.near) nodes.push_back(to_float(item.a));
  }

  Vec3d quarter;
  Radii radii;
  Vec3d shift;
  std::vector<Bond> bonds;
  std::vector<Vec3f> nodes;
};

/// Sticks and balls whose radii are multiplied by a field.
struct Swollen final : Shape::Function {
  Swollen(std::shared_ptr<const Lattice> bonds_and_nodes, const Radii& r, Shape factors)
      : lattice(std::move(bonds_and_nodes)), radii(r), thickness(std::move(factors)) {}
  void evaluate(const PointBlock& block, float* out) const override {
    std::array<float, PointBlock::capacity> bond, node;
    thickness.evaluate(block, out);
    lattice->apart(block, bond.data(), node.data());
    const auto stick = static_cast<float>(radii.stick_mm), ball = static_cast<float>(radii.ball_mm);
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i)
      out[i] = std::min(bond[i] - stick * out[i], node[i] - ball * out[i]);
  }
  [[nodiscard]] double lipschitz() const override {
    return 1 + std::max(radii.stick_mm, radii.ball_mm) * thickness.lipschitz();
  }
  std::shared_ptr<const Lattice> lattice;
  Radii radii;
  Shape thickness;
};

std::shared_ptr<const Lattice> lattice_of(const CellEdges& cell, const Radii& radii, Vec3d shift_mm) {
  const double ratio = cell.z / cell.x;
  const bool square = cell.x == cell.y;
  for (const double known : {1.0, std::numbers::sqrt2})
    if (square && std::abs(ratio - known) < 1e-12)
      return std::make_shared<const Crystal>(cell.x, known, radii, shift_mm);
  return std::make_shared<const AnyCell>(cell, radii, shift_mm);
}

}  // namespace

void each_diamond_bond(Vec3i low, Vec3i high, const std::function<void(Vec3i node, Vec3i along)>& visit) {
  constexpr std::array<Vec3i, 4> bonds{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}};
  for (int x = low.x; x <= high.x; x += 2)
    for (int y = low.y; y <= high.y; y += 2)
      for (int z = low.z; z <= high.z; z += 2) {
        if (((x + y + z) / 2) % 2 != 0) continue;
        for (const Vec3i b : bonds) visit({x, y, z}, b);
      }
}

Shape sticks_and_balls(const CellEdges& cell, const Radii& radii, Vec3d shift_mm) {
  return Shape(lattice_of(cell, radii, shift_mm));
}

Shape sticks_and_balls(const CellEdges& cell, const Radii& radii, Vec3d shift_mm, const Shape& thickness) {
  return Shape(std::make_shared<const Swollen>(lattice_of(cell, radii, shift_mm), radii, thickness));
}

}  // namespace fibrolite
