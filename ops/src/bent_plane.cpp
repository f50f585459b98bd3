// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/bent_plane.h"

#include <cmath>

namespace fibrolite {

double Bend::stretch(Vec2d p) const {
  const Vec2d s = slope_at(p);
  return std::sqrt(1 + dot(s, s));
}

double Bend::curvature() const {
  // Eigenvalues of the matrix of second derivatives; where the surface slopes it bends less.
  return std::abs(xx + yy) + std::hypot(xx - yy, xy);
}

double Bend::steepest(double radius_mm) const { return norm(slope) + curvature() * radius_mm; }

Vec3d BentPlane::at(Vec2d local, double above_mm) const {
  if (bend.flat()) return frame.to_world({local.x, local.y, above_mm});
  return frame.to_world({local.x, local.y, bend.height(local)}) + above_mm * normal(local);
}

Vec3d BentPlane::normal(Vec2d local) const {
  if (bend.flat()) return frame.z;
  const Vec2d s = bend.slope_at(local);
  return normalized(frame.z - s.x * frame.x - s.y * frame.y);
}

Vec3d BentPlane::flattened(Vec3d world) const {
  const Vec3d q = frame.to_local(world);
  return {q.x, q.y, q.z - bend.height({q.x, q.y})};
}

BentPlane::Foot BentPlane::foot(Vec3d world) const {
  const Vec3d q = frame.to_local(world);
  Foot best{{q.x, q.y}, q.z - bend.height({q.x, q.y})};
  if (bend.flat()) return best;
  const double side = best.above_mm < 0 ? -1 : 1;
  constexpr int rounds = 12;
  Vec2d on = best.local;
  for (int round = 0; round < rounds; ++round) {
    const Vec2d s = bend.slope_at(on);
    // Down the normal of the tangent plane there.
    const double above = (q.z - bend.height(on) - s.x * (q.x - on.x) - s.y * (q.y - on.y)) / (1 + dot(s, s));
    const Vec2d next{q.x + above * s.x, q.y + above * s.y};
    const double off = norm(Vec3d{q.x - next.x, q.y - next.y, q.z - bend.height(next)});
    if (off < std::abs(best.above_mm)) best = {next, side * off};
    if (norm(next - on) < 1e-9) break;
    on = next;
  }
  return best;
}

}  // namespace fibrolite
