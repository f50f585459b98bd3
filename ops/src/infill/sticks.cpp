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

#include "fibrolite/clones.h"

namespace fibrolite {
namespace {

struct Lattice : Shape::Function {
  /// Distances to the nearest bond and to the nearest node, mm.
  virtual void apart(const PointBlock& block, float* bond, float* node) const = 0;
};

// Eight points at a time, written as vectors so that nothing branches, which the compiler does not find by itself. All
// of it is inlined into functions that exist for AVX2 too.
using Lanes [[gnu::vector_size(32)]] = float;
using Mask [[gnu::vector_size(32)]] = std::int32_t;  // a lane is all ones or zero
constexpr int lanes = 8;

/// To the nearest integer without a call: the constant pushes the fraction out of the mantissa.
constexpr float push = 12582912.0F;  // 1.5 * 2^23

/// |coordinates| in the Voronoi cell of the nearest A node, quarter cells, axes in place; whether the product of the
/// coordinates is negative.
struct Folded {
  Lanes a, b, c;
  Mask negative;
};

[[gnu::always_inline]] inline void smaller(Lanes& of, const Lanes& other) { of = other < of ? other : of; }
[[gnu::always_inline]] inline void take_root(Lanes& of) {
  for (int k = 0; k < lanes; ++k) of[k] = std::sqrt(of[k]);
}
[[gnu::always_inline]] inline void fold(Lanes x, Lanes y, Lanes z, Folded& to) {
  const Lanes ex = 2.0F * ((0.5F * x + push) - push), ey = 2.0F * ((0.5F * y + push) - push),
              ez = 2.0F * ((0.5F * z + push) - push);
  x -= ex, y -= ey, z -= ez;
  // Even corners with an odd half sum are no A nodes: step over along the axis with the largest remainder.
  const Lanes half_sum = 0.5F * (ex + ey + ez);
  const Mask odd = half_sum != 2.0F * ((0.5F * half_sum + push) - push);
  to.negative = (x < 0) ^ (y < 0) ^ (z < 0) ^ odd;
  const Lanes a = x < 0 ? -x : x, b = y < 0 ? -y : y, c = z < 0 ? -z : z;
  const Lanes bc = b < c ? c : b, largest = a < bc ? bc : a;
  const Mask step_a = odd & (a == largest), step_b = odd & ~step_a & (b == largest), step_c = odd & ~step_a & ~step_b;
  to.a = step_a ? 2.0F - a : a;
  to.b = step_b ? 2.0F - b : b;
  to.c = step_c ? 2.0F - c : c;
}

/// Of all points of a block, eight at a time: `nearest` gets them folded and gives squared distances to the nearest
/// bond and node; `use` gets those, as roots, with the number of the first point and how many bytes of them there are.
/// @param cells  Quarter cells to a mm.
template <class Nearest, class Use>
[[gnu::always_inline]] inline void each_eight(const PointBlock& block, Vec3f shift, Vec3f cells, const Nearest& nearest,
                                              const Use& use) {
  std::array<float, 3 * lanes> rest{};
  for (int i = 0; i < block.count; i += lanes) {
    const std::size_t n = sizeof(float) * static_cast<std::size_t>(std::min(lanes, block.count - i));
    const bool whole = i + lanes <= block.count;
    if (!whole) {
      std::memcpy(rest.data(), block.x + i, n);
      std::memcpy(rest.data() + lanes, block.y + i, n);
      std::memcpy(rest.data() + 2 * lanes, block.z + i, n);
    }
    Lanes x, y, z, to_bond, to_node;
    std::memcpy(&x, whole ? block.x + i : rest.data(), sizeof x);
    std::memcpy(&y, whole ? block.y + i : rest.data() + lanes, sizeof y);
    std::memcpy(&z, whole ? block.z + i : rest.data() + 2 * lanes, sizeof z);
    Folded folded;
    fold((x - shift.x) * cells.x, (y - shift.y) * cells.y, (z - shift.z) * cells.z, folded);
    nearest(folded, to_bond, to_node);
    take_root(to_bond);
    take_root(to_node);
    use(i, n, to_bond, to_node);
  }
}

/// What each_eight() gives, in mm.
[[gnu::always_inline]] inline auto both_into(float* bond, float* node, float unit) {
  return [=](int i, std::size_t bytes, const Lanes& to_bond, const Lanes& to_node) __attribute__((always_inline)) {
    const Lanes b = to_bond * unit, n = to_node * unit;
    std::memcpy(bond + i, &b, bytes);
    std::memcpy(node + i, &n, bytes);
  };
}

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
        shift(to_float(shift_mm)) {}

  void evaluate(const PointBlock& block, float* out) const override {
    (stretch == 1.0F ? cubic : stretched)(block, shift, quarter, stretch, stick, ball, out);
  }
  void apart(const PointBlock& block, float* bond, float* node) const override {
    (stretch == 1.0F ? cubic_apart : stretched_apart)(block, shift, quarter, stretch, bond, node);
  }

  struct Cubic {
    [[gnu::always_inline]] void operator()(const Folded& f, Lanes& bond, Lanes& node) const {
      const Lanes most = f.b < f.c ? f.c : f.b, least = f.b < f.c ? f.b : f.c;
      const Lanes high = f.a < most ? most : f.a, low = least < f.a ? least : f.a;
      const Lanes u = high, v = f.a + f.b + f.c - high - low, w = f.negative ? -low : low;
      Lanes t = (u + v + w) * (1.0F / 3.0F);
      t = t < 0 ? Lanes{} : t;
      t = t > 1 ? Lanes{} + 1.0F : t;
      bond = (u - t) * (u - t) + (v - t) * (v - t) + (w - t) * (w - t);
      node = u * u + v * v + w * w;
      smaller(node, (u - 1) * (u - 1) + (v - 1) * (v - 1) + (w - 1) * (w - 1));
    }
  };

  struct Stretched {
    float k;  // of z

    /// From p to the bond from a along d.
    [[gnu::always_inline]] void to_bond(const Lanes& x, const Lanes& y, const Lanes& z, Vec3f a, Vec3f d,
                                        Lanes& least) const {
      const float dz = d.z * k, per = 1 / (d.x * d.x + d.y * d.y + dz * dz);
      const Lanes px = x - a.x, py = y - a.y, pz = (z - a.z) * k;
      Lanes t = (px * d.x + py * d.y + pz * dz) * per;
      t = t < 0 ? Lanes{} : t;
      t = t > 1 ? Lanes{} + 1.0F : t;
      const Lanes ux = px - t * d.x, uy = py - t * d.y, uz = pz - t * dz;
      smaller(least, ux * ux + uy * uy + uz * uz);
    }
    [[gnu::always_inline]] void operator()(const Folded& f, Lanes& bond, Lanes& node) const {
      const Lanes x = f.a < f.b ? f.b : f.a, y = f.a < f.b ? f.a : f.b, z = f.negative ? -f.c : f.c;
      bond = Lanes{} + far_mm;
      to_bond(x, y, z, {0, 0, 0}, {1, 1, 1}, bond);
      to_bond(x, y, z, {0, 0, 0}, {1, -1, -1}, bond);
      to_bond(x, y, z, {2, 0, -2}, {-1, -1, 1}, bond);
      to_bond(x, y, z, {2, 0, 2}, {-1, 1, -1}, bond);
      const float kk = k * k;
      node = x * x + y * y + kk * z * z;
      smaller(node, (x - 1) * (x - 1) + (y - 1) * (y - 1) + kk * (z - 1) * (z - 1));
      smaller(node, (x - 1) * (x - 1) + (y + 1) * (y + 1) + kk * (z + 1) * (z + 1));
    }
  };

  template <class Nearest>
  [[gnu::always_inline]] static inline void apart_by(const Nearest& nearest, const PointBlock& block, Vec3f shift,
                                                     float quarter, float k, float* bond, float* node) {
    const float inverse = 1.0F / quarter;
    each_eight(block, shift, {inverse, inverse, inverse / k}, nearest, both_into(bond, node, quarter));
  }
  template <class Nearest>
  [[gnu::always_inline]] static inline void joined_by(const Nearest& nearest, const PointBlock& block, Vec3f shift,
                                                      float quarter, float k, float stick, float ball, float* out) {
    const float inverse = 1.0F / quarter;
    const auto join = [=](int i, std::size_t bytes, const Lanes& bond, const Lanes& node)
        __attribute__((always_inline)) {
      Lanes least = bond * quarter - stick;
      smaller(least, node * quarter - ball);
      std::memcpy(out + i, &least, bytes);
    };
    each_eight(block, shift, {inverse, inverse, inverse / k}, nearest, join);
  }

  FIBROLITE_CLONES static void cubic(const PointBlock& block, Vec3f shift, float quarter, float k, float stick,
                                     float ball, float* out) {
    joined_by(Cubic{}, block, shift, quarter, k, stick, ball, out);
  }
  FIBROLITE_CLONES static void stretched(const PointBlock& block, Vec3f shift, float quarter, float k, float stick,
                                         float ball, float* out) {
    joined_by(Stretched{k}, block, shift, quarter, k, stick, ball, out);
  }
  FIBROLITE_CLONES static void cubic_apart(const PointBlock& block, Vec3f shift, float quarter, float k, float* bond,
                                           float* node) {
    apart_by(Cubic{}, block, shift, quarter, k, bond, node);
  }
  FIBROLITE_CLONES static void stretched_apart(const PointBlock& block, Vec3f shift, float quarter, float k,
                                               float* bond, float* node) {
    apart_by(Stretched{k}, block, shift, quarter, k, bond, node);
  }

  float quarter, stretch, stick, ball;
  Vec3f shift;
};

/// Exact distance for any edges of the cell. Folding may not exchange axes now, and which bonds can be nearest to a
/// folded point depends on the edges: they are found once.
struct AnyCell final : Lattice {
  AnyCell(const CellEdges& cell, const Radii& r, Vec3d shift_mm)
      : quarter{0.25 * cell.x, 0.25 * cell.y, 0.25 * cell.z}, radii(r), shift(to_float(shift_mm)) {
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
    run(block, shift, {to_float(quarter), bonds.data(), bonds.size(), nodes.data(), nodes.size()}, bond, node);
  }

  struct Bond {
    Vec3f a, along, per;  // from a, by `along`; per = along / |along|^2
  };
  struct Nearest {
    Vec3f edges;  // of a quarter cell, mm
    const Bond* bonds;
    std::size_t bond_count;
    const Vec3f* nodes;
    std::size_t node_count;

    [[gnu::always_inline]] void operator()(const Folded& f, Lanes& bond, Lanes& node) const {
      const Lanes x = f.a * edges.x, y = f.b * edges.y, z = (f.negative ? -f.c : f.c) * edges.z;
      bond = node = Lanes{} + far_mm;
      for (std::size_t i = 0; i < bond_count; ++i) {
        const Bond& b = bonds[i];
        const Lanes px = x - b.a.x, py = y - b.a.y, pz = z - b.a.z;
        Lanes t = px * b.per.x + py * b.per.y + pz * b.per.z;
        t = t < 0 ? Lanes{} : t;
        t = t > 1 ? Lanes{} + 1.0F : t;
        const Lanes ux = px - t * b.along.x, uy = py - t * b.along.y, uz = pz - t * b.along.z;
        smaller(bond, ux * ux + uy * uy + uz * uz);
      }
      for (std::size_t i = 0; i < node_count; ++i) {
        const Lanes px = x - nodes[i].x, py = y - nodes[i].y, pz = z - nodes[i].z;
        smaller(node, px * px + py * py + pz * pz);
      }
    }
  };
  FIBROLITE_CLONES static void run(const PointBlock& block, Vec3f shift, const Nearest& nearest, float* bond,
                                   float* node) {
    const Vec3f& q = nearest.edges;
    each_eight(block, shift, {1 / q.x, 1 / q.y, 1 / q.z}, nearest, both_into(bond, node, 1));
  }

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
  Vec3f shift;
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
