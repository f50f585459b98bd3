// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "fibrolite/clones.h"

namespace fibrolite {
namespace {

using Values = std::array<float, PointBlock::capacity>;
constexpr std::size_t size_of(const PointBlock& block) { return static_cast<std::size_t>(block.count); }

struct Constant final : Shape::Function {
  explicit Constant(float v) : value(v) {}
  void evaluate(const PointBlock& block, float* out) const override { std::fill_n(out, block.count, value); }
  [[nodiscard]] Interval bound(const Box3d&) const override { return {value, value}; }
  [[nodiscard]] double lipschitz() const override { return 0; }
  float value;
};

Box3d box_of(const PointBlock& block) {
  if (block.leaf != nullptr) {
    const Vec3d low = block.voxel_mm * Vec3d{static_cast<double>(block.leaf->x), static_cast<double>(block.leaf->y),
                                             static_cast<double>(block.leaf->z)};
    const double side = 7 * block.voxel_mm;
    return {low, low + Vec3d{side, side, side}};
  }
  const Interval x = range_of(block.x, block.count), y = range_of(block.y, block.count),
                 z = range_of(block.z, block.count);
  return {{x.lo, y.lo, z.lo}, {x.hi, y.hi, z.hi}};
}

/// min or max over any number of shapes. A member that cannot decide any value in the block is skipped.
template <bool Min>
struct Fold final : Shape::Function {
  explicit Fold(std::vector<Shape> list) : shapes(std::move(list)) {
    for (const Shape& shape : shapes) steepest = std::max(steepest, shape.lipschitz());
  }
  static Interval merge(Interval a, Interval b) {
    return Min ? Interval{std::min(a.lo, b.lo), std::min(a.hi, b.hi)}
               : Interval{std::max(a.lo, b.lo), std::max(a.hi, b.hi)};
  }
  void evaluate(const PointBlock& block, float* out) const override {
    Values other;
    if (block.count < 8) {  // too few to pay for bounds
      shapes[0].evaluate(block, out);
      for (std::size_t i = 1; i < shapes.size(); ++i) {
        shapes[i].evaluate(block, other.data());
        keep(block.count, other, out);
      }
      return;
    }
    // Members near the result come from their bounds: of many capsules or parts only a few matter in one block.
    const Box3d box = box_of(block);
    std::array<Interval, 16> small;
    std::vector<Interval> large;
    Interval* bounds = small.data();
    if (shapes.size() > small.size()) {
      large.resize(shapes.size());
      bounds = large.data();
    }
    Interval all = shapes[0].bound(box);
    bounds[0] = all;
    for (std::size_t i = 1; i < shapes.size(); ++i) {
      bounds[i] = shapes[i].bound(box);
      all = merge(all, bounds[i]);
    }
    bool first = true;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (Min ? bounds[i].lo > all.hi : bounds[i].hi < all.lo) continue;
      shapes[i].evaluate(block, first ? out : other.data());
      if (!first) keep(block.count, other, out);
      first = false;
    }
  }
  static void keep(int count, const Values& other, float* out) {
    for (int k = 0; k < count; ++k) {
      const float v = other[static_cast<std::size_t>(k)];
      out[k] = Min ? std::min(out[k], v) : std::max(out[k], v);
    }
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    Interval all = shapes[0].bound(box);
    for (std::size_t i = 1; i < shapes.size(); ++i) all = merge(all, shapes[i].bound(box));
    return all;
  }
  [[nodiscard]] double lipschitz() const override { return steepest; }

  std::vector<Shape> shapes;
  double steepest = 0;
};

/// sign * a + shift: complement and offset.
struct Affine final : Shape::Function {
  Affine(Shape s, float sign_of, float shift_by) : a(std::move(s)), sign(sign_of), shift(shift_by) {}
  void evaluate(const PointBlock& block, float* out) const override {
    a.evaluate(block, out);
    for (int k = 0; k < block.count; ++k) out[k] = sign * out[k] + shift;
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Interval b = a.bound(box);
    return sign > 0 ? Interval{b.lo + shift, b.hi + shift} : Interval{shift - b.hi, shift - b.lo};
  }
  [[nodiscard]] double lipschitz() const override { return a.lipschitz(); }
  Shape a;
  float sign, shift;
};

struct SmoothUnion final : Shape::Function {
  SmoothUnion(Shape first, Shape second, double blend_mm)
      : a(std::move(first)), b(std::move(second)), k(static_cast<float>(blend_mm)) {}
  void evaluate(const PointBlock& block, float* out) const override {
    Values other;
    a.evaluate(block, out);
    b.evaluate(block, other.data());
    for (int i = 0; i < block.count; ++i) {
      const float va = out[i], vb = other[static_cast<std::size_t>(i)];
      const float h = std::max(k - std::abs(va - vb), 0.0F) / k;
      out[i] = std::min(va, vb) - h * h * k * 0.25F;
    }
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Interval p = a.bound(box), q = b.bound(box);
    return {std::min(p.lo, q.lo) - 0.25F * k, std::min(p.hi, q.hi)};
  }
  [[nodiscard]] double lipschitz() const override { return std::max(a.lipschitz(), b.lipschitz()); }
  Shape a, b;
  float k;
};

struct Placed final : Shape::Function {
  Placed(Shape s, const Frame& f) : local(std::move(s)), frame(f) {}
  void evaluate(const PointBlock& block, float* out) const override {
    std::array<Values, 3> moved;
    for (int i = 0; i < block.count; ++i) {
      const Vec3d p = frame.to_local({block.x[i], block.y[i], block.z[i]});
      const auto k = static_cast<std::size_t>(i);
      moved[0][k] = static_cast<float>(p.x);
      moved[1][k] = static_cast<float>(p.y);
      moved[2][k] = static_cast<float>(p.z);
    }
    local.evaluate({moved[0].data(), moved[1].data(), moved[2].data(), block.count}, out);
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    Box3d turned;
    for (int corner = 0; corner < 8; ++corner) {
      turned.include(
          frame.to_local({(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                          (corner & 4) != 0 ? box.max.z : box.min.z}));
    }
    return local.bound(turned);
  }
  [[nodiscard]] double lipschitz() const override { return local.lipschitz(); }
  Shape local;
  Frame frame;
};

template <class F, class... Args>
Shape make(Args&&... args) {
  return Shape(std::make_shared<const F>(std::forward<Args>(args)...));
}

}  // namespace

FIBROLITE_CLONES Interval range_of(const float* v, int count) {
  // Four rows of eight: one comparison need not wait for the one before.
  using Lanes [[gnu::vector_size(32)]] = float;
  constexpr int rows = 4, step = 8 * rows;
  Lanes low[rows], high[rows];  // NOLINT(modernize-avoid-c-arrays): arrays of them are kept in registers
  for (int r = 0; r < rows; ++r) low[r] = high[r] = Lanes{} + v[0];
  int i = 0;
  for (; i + step <= count; i += step) {
    for (int r = 0; r < rows; ++r) {
      Lanes x;
      std::memcpy(&x, v + i + 8 * r, sizeof x);
      low[r] = x < low[r] ? x : low[r];
      high[r] = x > high[r] ? x : high[r];
    }
  }
  Interval all{v[0], v[0]};
  for (int r = 0; r < rows; ++r) {
    for (int k = 0; k < 8; ++k) {
      all.lo = std::min(all.lo, low[r][k]);
      all.hi = std::max(all.hi, high[r][k]);
    }
  }
  for (; i < count; ++i) {
    all.lo = std::min(all.lo, v[i]);
    all.hi = std::max(all.hi, v[i]);
  }
  return all;
}

Interval Shape::Function::bound(const Box3d& box) const {
  const Vec3d c = box.center();
  const auto x = static_cast<float>(c.x), y = static_cast<float>(c.y), z = static_cast<float>(c.z);
  float value = 0;
  evaluate({&x, &y, &z, 1}, &value);
  const auto reach = static_cast<float>(lipschitz() * 0.5 * norm(box.size()) * 1.0001);
  return {value - reach, value + reach};
}

Shape::Shape() : Shape(nothing()) {}
Shape::Shape(std::shared_ptr<const Function> function) : function_(std::move(function)) {}

float Shape::operator()(Vec3d p) const {
  const auto x = static_cast<float>(p.x), y = static_cast<float>(p.y), z = static_cast<float>(p.z);
  float value = 0;
  evaluate(PointBlock{&x, &y, &z, 1}, &value);
  return value;
}

void Shape::evaluate(std::span<const Vec3d> points, std::span<float> out) const {
  std::array<Values, 3> soa;
  for (std::size_t start = 0; start < points.size(); start += PointBlock::capacity) {
    const std::size_t n = std::min<std::size_t>(PointBlock::capacity, points.size() - start);
    for (std::size_t i = 0; i < n; ++i) {
      soa[0][i] = static_cast<float>(points[start + i].x);
      soa[1][i] = static_cast<float>(points[start + i].y);
      soa[2][i] = static_cast<float>(points[start + i].z);
    }
    evaluate(PointBlock{soa[0].data(), soa[1].data(), soa[2].data(), static_cast<int>(n)}, out.data() + start);
  }
}

Shape nothing() {
  static const Shape shape = make<Constant>(far_mm);
  return shape;
}
Shape everything() {
  static const Shape shape = make<Constant>(-far_mm);
  return shape;
}
Shape unite(std::vector<Shape> shapes) {
  if (shapes.empty()) return nothing();
  return shapes.size() == 1 ? shapes[0] : make<Fold<true>>(std::move(shapes));
}
Shape intersect(std::vector<Shape> shapes) {
  if (shapes.empty()) return everything();
  return shapes.size() == 1 ? shapes[0] : make<Fold<false>>(std::move(shapes));
}
Shape complement(Shape a) { return make<Affine>(std::move(a), -1.0F, 0.0F); }
Shape subtract(Shape a, Shape b) { return intersect({std::move(a), complement(std::move(b))}); }
Shape offset(Shape a, double outward_mm) { return make<Affine>(std::move(a), 1.0F, static_cast<float>(-outward_mm)); }
Shape smooth_unite(Shape a, Shape b, double blend_mm) {
  return blend_mm > 0 ? make<SmoothUnion>(std::move(a), std::move(b), blend_mm) : unite({std::move(a), std::move(b)});
}
Shape placed(Shape local, const Frame& frame) { return make<Placed>(std::move(local), frame); }

}  // namespace fibrolite
