// SPDX-License-Identifier: GPL-3.0-or-later
// How stiff the crystal is as a material, by finite elements on its voxels (docs/strength.md).
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/pieces.h"
#include "fibrolite/realize.h"
#include "fibrolite/voxel_fem.h"

namespace fibrolite {
namespace {

constexpr double poisson = 0.35;

/// Of a material with cubic symmetry, over Young's modulus of what it is made of.
struct Stiffness {
  double c11, c12, c44;
  [[nodiscard]] double bulk() const { return (c11 + 2 * c12) / 3; }
  [[nodiscard]] double young(Vec3d direction) const {
    const double determinant = (c11 - c12) * (c11 + 2 * c12), s11 = (c11 + c12) / determinant, s12 = -c12 / determinant;
    const Vec3d n = normalized(direction);
    const double askew = n.x * n.x * n.y * n.y + n.y * n.y * n.z * n.z + n.z * n.z * n.x * n.x;
    return 1 / (s11 - 2 * (s11 - s12 - 0.5 / c44) * askew);
  }
  /// Over all directions.
  [[nodiscard]] double mean_young() const {
    constexpr int n = 60;
    double sum = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double z = (i + 0.5) / n, ring = std::sqrt(1 - z * z), turn = std::numbers::pi / 2 * (j + 0.5) / n;
        sum += young({ring * std::cos(turn), ring * std::sin(turn), z});
      }
    return sum / (n * n);
  }
};

/// A cube of two cells under a plate, its sides and its floor sliding, with `voxels` to a cell. Either under a stress
/// along z of 1 / 1000 of Young's modulus, or with its sides moved apart by 1 / 1000: its strain along z.
double strain(const TcsParams& p, int voxels, bool sides_move) {
  const double cell = p.cell_mm.x, h = cell / voxels, low = -h / 2, length = 2 * cell, plate = cell / 2;
  const Box3d all{{low, low, low}, {low + length, low + length, low + length + plate}};
  Box3d block = all;
  block.max.z = low + length;
  const auto plane = [&](int axis, double at) {
    constexpr double far = 1e4;
    Box3d box{{-far, -far, -far}, {far, far, far}};
    (axis == 0 ? box.min.x : axis == 1 ? box.min.y : box.min.z) = at - 0.3 * h;
    (axis == 0 ? box.max.x : axis == 1 ? box.max.y : box.max.z) = at + 0.3 * h;
    return cuboid(box);
  };
  VoxelFemProblem problem;
  const Shape material = unite({intersect({crystal(p), cuboid(block)}), subtract(cuboid(all), cuboid(block))});
  // Ends of sticks that the sides cut off would slide away.
  problem.solid =
      clean(realize(material, all.grown(4 * h), {.voxel_mm = h}), {.drop_below_vox = 1 << 30, .fill_below_vox = 0})
          .solid;
  problem.young_mpa = 1000;
  problem.poisson = poisson;
  problem.residual = 1e-5;
  for (int axis = 0; axis < 2; ++axis)
    for (const double at : {low, low + length})
      problem.supports.push_back({plane(axis, at), {axis == 0, axis == 1, false}, [sides_move](Vec3d q) {
                                    return sides_move ? Vec3d{0.001 * q.x, 0.001 * q.y, 0} : Vec3d{};
                                  }});
  problem.supports.push_back({plane(2, low), {false, false, true}, {}});
  const double force_n = sides_move ? 1e-9 : length * length;  // some load there must be
  problem.forces.push_back({plane(2, low + length + plate), {0, 0, -force_n}});
  const VoxelFemResult result = solve(problem);
  double sum = 0;
  constexpr int n = 30;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      sum += result.displacement_mm({low + length * (i + 0.5) / n, low + length * (j + 0.5) / n, low + length + h})
                 .value_or(Vec3d{})
                 .z;
  return sum / (n * n) / length;
}

Stiffness stiffness(TcsForm form, double density, int voxels) {
  TcsParams p = sized({.form = form, .density = density, .shift_mm = {0.4, 0.9, 0.2}});
  Stiffness result{};
  result.c11 = -0.001 / strain(p, voxels, false);
  result.c12 = -result.c11 * strain(p, voxels, true) / 0.002;  // free along z: 0 = c11 strain_z + c12 (2 / 1000)
  p.rotate_deg = {45, -std::atan(std::sqrt(0.5)) * 180 / std::numbers::pi, 0};  // [111] upright
  const double along_111 = -0.001 / strain(p, voxels, false);                   // (c11 + 2 c12 + 4 c44) / 3
  result.c44 = (3 * along_111 - result.c11 - 2 * result.c12) / 4;
  return result;
}

/// The most that a porous material with these symmetries can have, whatever its shape (Hashin and Shtrikman 1963).
double most_bulk(double density) {
  const double bulk = 1 / (3 * (1 - 2 * poisson)), shear = 1 / (2 * (1 + poisson));
  return 4 * shear * bulk * density / (4 * shear + 3 * bulk * (1 - density));
}

class CrystalStiffness : public ::testing::Test {
 protected:
  static constexpr double density = 0.2;
  void note(const Stiffness& s) {
    RecordProperty("young_100", std::to_string(s.young({1, 0, 0})));
    RecordProperty("young_111", std::to_string(s.young({1, 1, 1})));
    RecordProperty("young_mean", std::to_string(s.mean_young()));
    RecordProperty("bulk_over_bound", std::to_string(s.bulk() / most_bulk(density)));
  }
};

/// Sticks bend: soft along [100], where no stick runs, twice as stiff along [111], where one in four does.
TEST_F(CrystalStiffness, sticks_bend) {
  const Stiffness s = stiffness(TcsForm::Sticks, density, 36);  // six voxels across a stick
  note(s);
  EXPECT_LT(s.bulk(), 0.5 * most_bulk(density));
  EXPECT_NEAR(s.young({1, 1, 1}) / s.young({1, 0, 0}), 2.2, 0.4);
  EXPECT_NEAR(s.mean_young(), 0.041, 0.25 * 0.041);
}

/// The membrane stretches: more than three quarters of what any shape can reach in bulk.
TEST_F(CrystalStiffness, a_sheet_stretches) {
  const Stiffness s = stiffness(TcsForm::Sheet, density, 38);  // two voxels across a wall, which need not bend
  note(s);
  EXPECT_GT(s.bulk(), 0.75 * most_bulk(density));
  EXPECT_LT(s.bulk(), most_bulk(density));
  EXPECT_NEAR(s.mean_young(), 0.073, 0.15 * 0.073);
}

}  // namespace
}  // namespace fibrolite
