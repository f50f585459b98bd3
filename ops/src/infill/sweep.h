// SPDX-License-Identifier: GPL-3.0-or-later
// Coordinates across a limb: every point of space gets the place (u, v) where the limb's normal plane through it holds
// it. Private to the fibre infill.
#pragma once

#include <vector>

#include "fibrolite/frame.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// A rotation-minimising frame along a centre line (double reflection, Wang et al. 2008, "Computation of rotation
/// minimizing frames"). Along a smooth line the map p -> (u, v) is the projection on the normal plane: 1-Lipschitz and
/// constant along the limb's tangent, whatever the curvature, as long as the normal planes do not cross.
class Sweep {
 public:
  explicit Sweep(const Axis& axis);
  /// (u, v) of every point of the block, mm, and, unless null, how far along the line its normal plane stands, mm from
  /// the line's start (below 0 and beyond the length where the limb goes straight on). Continuous inside the limb.
  void map(const PointBlock& block, float* u, float* v, float* along = nullptr) const;
  [[nodiscard]] double length_mm() const { return arc_mm_.back(); }
  /// The frame at a share of the line's length, 0 to 1; z along the limb.
  [[nodiscard]] Frame frame_at(double share) const;
  /// How fast the frame turns about a ring's line so that it meets itself, rad / mm: the map of a place r mm off the
  /// line is 1 + (r * twist)^2 / 2 Lipschitz at most. 0 along an open line.
  [[nodiscard]] double twist_per_mm() const { return twist_per_mm_; }
  [[nodiscard]] bool closed() const { return closed_; }
  /// Turn of the tangent at a share of the line's length, rad / mm: the most of the stations about it.
  [[nodiscard]] double curvature_at(double share) const;

 private:
  void close();
  /// Planes of stations k and k + 1 bound slab k; before the first and after the last plane the limb goes straight on,
  /// unless it is a ring.
  struct Station {
    Frame frame;                    // z is the tangent
    double bend_u = 0, bend_v = 0;  // turn of the tangent towards u and v until the next station, rad
    double at_mm = 0;               // from the line's start
  };
  /// A station's frame in single precision: origin, tangent, u and v axis.
  struct Plane {
    float cx, cy, cz, tx, ty, tz, ux, uy, uz, vx, vy, vz;
    explicit Plane(const Frame& frame);
  };
  /// A slab's line: where it starts and how long it is, and half the turn of its tangent towards u and v.
  struct Stretch {
    float from_mm, length_mm, half_bend_u, half_bend_v;
  };
  static void map_straight(const Plane& plane, float from, const float* x, const float* y, const float* z, int count,
                           float* u, float* v, float* along);
  static void map_between(const Plane& start, const Plane& end, const Stretch& stretch, const float* x, const float* y,
                          const float* z, int count, float* u, float* v, float* along);
  /// Adds one to each point's number if it lies beyond the plane.
  static void count_passed(const Plane& plane, const float* x, const float* y, const float* z, int count, int* passed);
  [[nodiscard]] double distance_to_slab(int slab, Vec3d p) const;
  [[nodiscard]] bool in_slab(int slab, Vec3d p) const;
  /// Where answers go; `along` may be null.
  struct Places {
    float *u, *v, *along;
    [[nodiscard]] Places from(int i) const { return {u + i, v + i, along == nullptr ? nullptr : along + i}; }
  };
  void map_in_slab(int slab, const float* x, const float* y, const float* z, int count, Places out) const;
  void map_in_run(int from, int to, const PointBlock& block, Vec3d center, double radius, Places out) const;
  void map_by_distance(const std::vector<int>& slabs, const PointBlock& block, Places out) const;
  [[nodiscard]] int last() const { return static_cast<int>(stations_.size()) - 1; }

  std::vector<Station> stations_;
  std::vector<Plane> planes_;  // one per station
  double longest_slab_mm_ = 0, twist_per_mm_ = 0;
  bool closed_ = false;
  std::vector<Frame> line_;  // at every point of the centre line
  std::vector<double> arc_mm_;
};

}  // namespace fibrolite
