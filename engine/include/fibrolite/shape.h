// SPDX-License-Identifier: Apache-2.0
// A shape: a distance *function* (mm, negative inside). Pure, thread-safe, no voxels of its own. Evaluated a block of
// points at a time, with a bound that lets a block be skipped. Composed values keep zero set and sign; their magnitude
// is at most the distance.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/frame.h"
#include "fibrolite/vec.h"

namespace fibrolite {

/// All values a shape takes in a box lie in [lo, hi], mm.
struct Interval {
  float lo, hi;
};
/// The least and the greatest of some values, 1 or more.
[[nodiscard]] Interval range_of(const float* values, int count);

/// Up to 512 points, structure of arrays, world mm. If `leaf` is set the points are the 8x8x8 samples of the lattice
/// voxel_mm * (leaf + (i, j, k)), k (z) fastest, as in OpenVDB's leaf.
struct PointBlock {
  static constexpr int capacity = 512;
  const float* x;
  const float* y;
  const float* z;
  int count;
  const Vec3i* leaf = nullptr;
  double voxel_mm = 0;
};

class Shape {
 public:
  /// What an implementer writes. evaluate() must be pure and thread-safe.
  struct Function {
    virtual ~Function() = default;
    /// out[i] = distance at point i, i < block.count.
    virtual void evaluate(const PointBlock& block, float* out) const = 0;
    /// Default: the value at the centre -+ lipschitz() * half diagonal.
    [[nodiscard]] virtual Interval bound(const Box3d& box) const;
    /// |f(p) - f(q)| <= lipschitz * |p - q|.
    [[nodiscard]] virtual double lipschitz() const { return 1.0; }
  };

  Shape();  ///< The empty shape (everywhere +infinity-like outside).
  explicit Shape(std::shared_ptr<const Function> function);

  void evaluate(const PointBlock& block, float* out) const { function_->evaluate(block, out); }
  [[nodiscard]] Interval bound(const Box3d& box) const { return function_->bound(box); }
  [[nodiscard]] double lipschitz() const { return function_->lipschitz(); }
  /// One point; convenient, not fast.
  [[nodiscard]] float operator()(Vec3d p) const;
  /// Any number of points.
  void evaluate(std::span<const Vec3d> points, std::span<float> out) const;

 private:
  std::shared_ptr<const Function> function_;
};

/// A value no distance of ours reaches (mm); what "far outside" reads.
inline constexpr float far_mm = 1e6F;

[[nodiscard]] Shape nothing();
[[nodiscard]] Shape everything();
[[nodiscard]] Shape unite(std::vector<Shape> shapes);      ///< min; of none: nothing().
[[nodiscard]] Shape intersect(std::vector<Shape> shapes);  ///< max; of none: everything().
[[nodiscard]] Shape complement(Shape a);                   ///< -a.
[[nodiscard]] Shape subtract(Shape a, Shape b);            ///< max(a, -b).
[[nodiscard]] Shape offset(Shape a, double outward_mm);    ///< a - outward_mm.
/// Polynomial smooth minimum (Quilez): blends within `blend_mm` of where both are equal; never larger than min.
[[nodiscard]] Shape smooth_unite(Shape a, Shape b, double blend_mm);

// Exact distances. Lengths in mm, world frame. Cost: O(1) per point.
[[nodiscard]] Shape sphere(Vec3d center, double radius_mm);
[[nodiscard]] Shape capsule(Vec3d a, Vec3d b, double radius_mm);
/// A round cone: the hull of two spheres.
[[nodiscard]] Shape round_cone(Vec3d a, double radius_a_mm, Vec3d b, double radius_b_mm);
[[nodiscard]] Shape cuboid(const Box3d& box);
/// Flat-ended cylinder between the centres of its end faces.
[[nodiscard]] Shape cylinder(Vec3d a, Vec3d b, double radius_mm);
/// Ring in the frame's xy plane.
[[nodiscard]] Shape torus(const Frame& frame, double ring_radius_mm, double tube_radius_mm);
/// Negative where dot(p - point, outward) < 0; `outward` is normalised.
[[nodiscard]] Shape half_space(Vec3d point, Vec3d outward);
/// Many capsules at once, found through a uniform grid of buckets: O(1) per point for even lengths.
struct Capsule {
  Vec3d a, b;
  double radius_mm;
};
[[nodiscard]] Shape capsules(std::vector<Capsule> list);
/// Many flat-ended cones at once, likewise, each between the centres of its end faces, which differ.
struct Frustum {
  Vec3d a;
  double radius_a_mm;
  Vec3d b;
  double radius_b_mm;
};
[[nodiscard]] Shape frusta(std::vector<Frustum> list);
/// The shape seen from a frame: value at p is `local` at frame.to_local(p).
[[nodiscard]] Shape placed(Shape local, const Frame& frame);

}  // namespace fibrolite
