// SPDX-License-Identifier: GPL-3.0-or-later
// What a run will need, known before it starts.
#include <algorithm>

#include "fibrolite/ops/hybridize.h"

namespace fibrolite {

double choose_voxel(const Box3d& model, const Recipe& recipe, InfillKind infill, std::optional<double> wanted) {
  return wanted ? *wanted : std::min(model.longest_side() / 400, thinnest_mm(recipe, infill) / 3);
}

double predict_memory(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill) {
  const double surface_mm2 = area(model), volume_mm3 = std::abs(signed_volume(model));
  const double h = voxel_mm;
  // Surface of the structure per volume of lumen: 16 sticks and 8 balls per cell; both sides of the membrane, or one;
  // walls with two sides per fibre.
  const TcsParams t = sized(recipe.tcs);
  const double cell = t.cell_mm.least();
  const double sticks = 3.15 * (16 * t.stick_mm * 0.433 * cell + 8 * t.ball_mm * t.ball_mm) / (cell * cell * cell);
  const double tcs = t.form == TcsForm::Sticks ? sticks : (t.form == TcsForm::Sheet ? 2 : 1) * 3.84 / cell;
  const double mfs = 4 / recipe.mfs.fibre_mm;
  const auto per_mm3_of = [&] {
    switch (infill) {
      case InfillKind::Solid:
      case InfillKind::Shell:
        return 0.0;
      case InfillKind::Tcs:
        return tcs;
      case InfillKind::Gyroid:
        return 2 * 3.09 / recipe.gyroid.cell_mm;
      default:
        return std::max(tcs, mfs);
    }
  };
  const double per_mm3 = per_mm3_of();
  const double faces_mm2 = surface_mm2 * (infill == InfillKind::Solid ? 1 : 2) + per_mm3 * volume_mm3;
  // Leaves are 8 voxels wide and the band 6: a surface fills about two voxels of leaf for each of its band.
  const double solid_voxels = 12 * faces_mm2 / (h * h);
  const double body_voxels = surface_mm2 * (recipe.shell.thickness_mm + 12 * h) / (h * h * h);
  const double triangles = 2.4 * faces_mm2 / (h * h);
  const double model_bytes = 400.0 * static_cast<double>(model.triangles.size());
  const double grids = 4.2 * (body_voxels + solid_voxels);
  // The body is gone when the surface is made; the surface peaks at about twice itself.
  return 120e6 + model_bytes + std::max(grids + 2.1 * solid_voxels, 4.2 * solid_voxels + 48 * triangles);
}

}  // namespace fibrolite
