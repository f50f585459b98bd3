// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/tcs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

/// Exact distance to the diamond lattice in O(1), by folding.
///
/// In quarter cells the nodes are A, the points with even coordinates whose sum is divisible by 4, and B = A + (1,1,1);
/// each A node has bonds to A + {(1,1,1), (1,-1,-1), (-1,1,-1), (-1,-1,1)}. The lattice is mapped onto itself by moving
/// along A, by any permutation of the axes and by flipping two signs. So a point is moved into the Voronoi cell of the
/// A node at the origin and then folded to x >= y >= |z|; there the nearest bond is always the one from (0,0,0) to
/// (1,1,1). Stretched along z only x and y may be exchanged, and one of four bonds is nearest.
struct Crystal final : Shape::Function {
  explicit Crystal(const TcsParams& p)
      : quarter(static_cast<float>(0.25 * p.cell_mm)),
        stretch(p.stretch_z ? std::numbers::sqrt2_v<float> : 1.0F),
        stick(static_cast<float>(0.5 * p.stick_mm)),
        ball(static_cast<float>(0.5 * p.ball_mm)),
        shift(p.shift_mm) {}

  void evaluate(const PointBlock& block, float* out) const override {
    const auto sx = static_cast<float>(shift.x), sy = static_cast<float>(shift.y), sz = static_cast<float>(shift.z);
    if (stretch == 1.0F) {
      cubic(block.x, block.y, block.z, block.count, sx, sy, sz, quarter, stick, ball, out);
    } else {
      stretched(block.x, block.y, block.z, block.count, sx, sy, sz, quarter, stretch, stick, ball, out);
    }
  }

  struct Folded {
    float a, b, c;  // |coordinate| in the Voronoi cell of the origin, quarter cells, axes in place
    float sign;     // of the product of the coordinates
  };
  /// The two ways to the nearest even number without a call: the constant pushes the fraction out of the mantissa.
  static float nearest_even(float v) {
    constexpr float push = 12582912.0F;  // 1.5 * 2^23
    return 2.0F * ((0.5F * v + push) - push);
  }
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

  [[gnu::target_clones("avx2", "default")]] static void cubic(const float* px, const float* py, const float* pz,
                                                              int count, float sx, float sy, float sz, float quarter,
                                                              float stick, float ball, float* out) {
    const float inverse = 1.0F / quarter;
    for (int i = 0; i < count; ++i) {
      const Folded f = fold((px[i] - sx) * inverse, (py[i] - sy) * inverse, (pz[i] - sz) * inverse);
      const float high = std::max(f.a, std::max(f.b, f.c)), low = std::min(f.a, std::min(f.b, f.c));
      const float x = high, y = f.a + f.b + f.c - high - low, z = low * f.sign;
      const float t = std::min(std::max((x + y + z) * (1.0F / 3.0F), 0.0F), 1.0F);
      const float bond = (x - t) * (x - t) + (y - t) * (y - t) + (z - t) * (z - t);
      const float node = std::min(x * x + y * y + z * z, (x - 1) * (x - 1) + (y - 1) * (y - 1) + (z - 1) * (z - 1));
      out[i] = std::min(std::sqrt(bond) * quarter - stick, std::sqrt(node) * quarter - ball);
    }
  }

  /// Squared distance from p to the bond from a along d, z stretched by k.
  static float bond2(float x, float y, float z, float ax, float ay, float az, float dx, float dy, float dz, float k) {
    const float px = x - ax, py = y - ay, pz = (z - az) * k, qz = dz * k;
    const float t = std::min(std::max((px * dx + py * dy + pz * qz) / (dx * dx + dy * dy + qz * qz), 0.0F), 1.0F);
    const float ux = px - t * dx, uy = py - t * dy, uz = pz - t * qz;
    return ux * ux + uy * uy + uz * uz;
  }

  static void stretched(const float* px, const float* py, const float* pz, int count, float sx, float sy, float sz,
                        float quarter, float k, float stick, float ball, float* out) {
    const float inverse = 1.0F / quarter;
    for (int i = 0; i < count; ++i) {
      const Folded f = fold((px[i] - sx) * inverse, (py[i] - sy) * inverse, (pz[i] - sz) * inverse / k);
      const float x = std::max(f.a, f.b), y = std::min(f.a, f.b), z = f.c * f.sign;
      const float bond =
          std::min(std::min(bond2(x, y, z, 0, 0, 0, 1, 1, 1, k), bond2(x, y, z, 0, 0, 0, 1, -1, -1, k)),
                   std::min(bond2(x, y, z, 2, 0, -2, -1, -1, 1, k), bond2(x, y, z, 2, 0, 2, -1, 1, -1, k)));
      const float node = std::min(x * x + y * y + k * k * z * z,
                                  std::min((x - 1) * (x - 1) + (y - 1) * (y - 1) + k * k * (z - 1) * (z - 1),
                                           (x - 1) * (x - 1) + (y + 1) * (y + 1) + k * k * (z + 1) * (z + 1)));
      out[i] = std::min(std::sqrt(bond) * quarter - stick, std::sqrt(node) * quarter - ball);
    }
  }

  float quarter, stretch, stick, ball;
  Vec3d shift;
};

void check(const TcsParams& p) {
  if (!(p.stick_mm > 0)) throw Error(Code::BadRecipe, "the stick diameter must be positive", "tcs.stick_mm");
  if (!(p.ball_mm >= p.stick_mm)) {
    throw Error(Code::BadRecipe, "balls are thinner than sticks", "tcs.ball_mm", "use tcs.stick_mm or more");
  }
  if (!(p.cell_mm >= 4 * p.stick_mm)) {
    throw Error(Code::BadRecipe, "the cell is too small for its sticks", "tcs.cell_mm", "use 4 * tcs.stick_mm or more");
  }
}

}  // namespace

Shape crystal(const TcsParams& params) {
  check(params);
  return Shape(std::make_shared<const Crystal>(params));
}

void each_stick(const TcsParams& params, const Box3d& box, const std::function<void(const Capsule&)>& visit) {
  check(params);
  const double quarter = 0.25 * params.cell_mm, stretch = params.stretch_z ? std::numbers::sqrt2 : 1;
  const Vec3d unit{quarter, quarter, stretch * quarter};
  const auto place = [&](int x, int y, int z) { return params.shift_mm + Vec3d{x * unit.x, y * unit.y, z * unit.z}; };
  // Even coordinates from one stick before the box to one after it.
  const auto first = [&](double low, double shift, double step) {
    return 2 * static_cast<int>(std::floor(0.5 * ((low - shift) / step - 1)));
  };
  const auto last = [&](double high, double shift, double step) {
    return static_cast<int>(std::ceil((high - shift) / step + 1));
  };
  constexpr std::array<std::array<int, 3>, 4> bonds{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}};
  for (int x = first(box.min.x, params.shift_mm.x, unit.x); x <= last(box.max.x, params.shift_mm.x, unit.x); x += 2)
    for (int y = first(box.min.y, params.shift_mm.y, unit.y); y <= last(box.max.y, params.shift_mm.y, unit.y); y += 2)
      for (int z = first(box.min.z, params.shift_mm.z, unit.z); z <= last(box.max.z, params.shift_mm.z, unit.z);
           z += 2) {
        if (((x + y + z) / 2) % 2 != 0) continue;
        for (const auto& b : bonds) visit({place(x, y, z), place(x + b[0], y + b[1], z + b[2]), 0.5 * params.stick_mm});
      }
}

Fill generate(const Part&, const TcsParams& params) {
  Fill fill{.shape = crystal(params)};
  fill.sticks = [params](const Box3d& box, const std::function<void(const Capsule&)>& visit) {
    each_stick(params, box, visit);
  };
  fill.ball_mm = params.ball_mm;
  return fill;
}

}  // namespace fibrolite
