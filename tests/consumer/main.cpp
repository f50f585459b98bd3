// SPDX-License-Identifier: GPL-3.0-or-later
// A ball of 20 mm, filled with crystal: exit code 0 if it came out lighter than a full one and in one piece.
#include <fibrolite/ops/hybridize.h>
#include <fibrolite/realize.h>
#include <fibrolite/surface.h>

int main() {
  using namespace fibrolite;
  const Solid ball = realize(sphere({}, 10), Box3d{{-12, -12, -12}, {12, 12, 12}}, Grid{.voxel_mm = 0.5});
  Report report;
  const Hybrid hybrid = hybridize(Model{.mesh = surface(ball), .repairs = {}, .warnings = {}},
                                  {.recipe = {}, .infill = InfillKind::Tcs, .voxel_mm = 0.4}, report);
  return hybrid.solid.volume_mm3() < 0.8 * ball.volume_mm3() && report.solid.pieces == 1 ? 0 : 1;
}
