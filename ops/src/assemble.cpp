// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/assemble.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

namespace fibrolite {
namespace {

using Values = std::array<float, PointBlock::capacity>;

/// max(b, min(-(b + t), inner)): the body, hollowed to a shell, with `inner` in its lumen. One evaluation of b serves
/// both.
struct Assembly final : Shape::Function {
  Assembly(Shape b, Shape in, double thickness_mm)
      : body(std::move(b)), inner(std::move(in)), shell(static_cast<float>(thickness_mm)) {}

  void evaluate(const PointBlock& block, float* out) const override {
    body.evaluate(block, out);
    // Where b > -t/2 the shell's other face is farther than the outer one and nothing inside can change the value.
    if (range_of(out, block.count).lo > -0.5F * shell) return;
    Values fill;
    inner.evaluate(block, fill.data());
    for (int k = 0; k < block.count; ++k) {
      const float b = out[k];
      out[k] = std::max(b, std::min(-(b + shell), fill[static_cast<std::size_t>(k)]));
    }
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Interval b = body.bound(box);
    if (b.lo > -0.5F * shell) return b;
    const Interval in = inner.bound(box);
    return {std::max(b.lo, std::min(-(b.hi + shell), in.lo)), std::max(b.hi, std::min(-(b.lo + shell), in.hi))};
  }
  [[nodiscard]] double lipschitz() const override { return std::max(body.lipschitz(), inner.lipschitz()); }

  Shape body, inner;
  float shell;
};

/// max(fill, p - overlap); the fill is not evaluated where the part is farther than `reach`.
struct Clipped final : Shape::Function {
  Clipped(FilledRegion f, double overlap_mm)
      : filled(std::move(f)), overlap(static_cast<float>(overlap_mm)), reach(3 * overlap) {}

  void evaluate(const PointBlock& block, float* out) const override {
    Values region;
    filled.region.evaluate(block, region.data());
    const auto [lo, hi] = range_of(region.data(), block.count);
    if (lo - overlap > reach) {
      for (int k = 0; k < block.count; ++k) out[k] = region[static_cast<std::size_t>(k)] - overlap;
      return;
    }
    filled.fill.evaluate(block, out);
    if (hi < -reach) return;  // deep inside the part: the clip is far below anything in the band
    for (int k = 0; k < block.count; ++k) out[k] = std::max(out[k], region[static_cast<std::size_t>(k)] - overlap);
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Interval r = filled.region.bound(box);
    if (r.lo - overlap > reach) return {r.lo - overlap, far_mm};
    const Interval f = filled.fill.bound(box);
    return {std::max(f.lo, r.hi < -reach ? f.lo : r.lo - overlap), std::max(f.hi, r.hi - overlap)};
  }
  [[nodiscard]] double lipschitz() const override {
    return std::max(filled.fill.lipschitz(), filled.region.lipschitz());
  }

  FilledRegion filled;
  float overlap, reach;
};

}  // namespace

Shape assemble(const Shape& body, const std::vector<FilledRegion>& parts, const std::vector<Shape>& joints,
               const AssembleParams& params) {
  std::vector<Shape> inner;
  for (const FilledRegion& part : parts) inner.push_back(clip(part, params));
  inner.insert(inner.end(), joints.begin(), joints.end());
  return Shape(std::make_shared<const Assembly>(body, unite(std::move(inner)), params.shell_mm));
}

Shape clip(const FilledRegion& part, const AssembleParams& params) {
  return Shape(std::make_shared<const Clipped>(part, params.overlap_mm));
}

double depth_for_shell(double thickness_mm, double voxel_mm) { return thickness_mm + 0.01 * voxel_mm; }

Shape shell(const Shape& body, double thickness_mm) {
  return Shape(std::make_shared<const Assembly>(body, nothing(), thickness_mm));
}

}  // namespace fibrolite
