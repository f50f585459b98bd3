// SPDX-License-Identifier: GPL-3.0-or-later
// How stiff the crystal is as a material, by finite elements on its voxels (docs/strength.md).
#include <gtest/gtest.h>

#include <algorithm>
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

/// The crystal stood with z along [001], x and y along [110] and its like, between mirror planes of its own on all four
/// sides, so that it is the endless crystal but for its ends; three cells tall, floor and sides sliding.
class Prism {
 public:
  /// `sides` voxels from one mirror plane to the next: sqrt(1/8) of a cell.
  Prism(TcsParams p, int sides)
      : cell_(p.cell_mm.x), h_(cell_ / std::round(std::sqrt(8.0) * sides)), width_(sides * h_) {
    p.rotate_deg = {0, 0, 45};
    p.shift_mm = {low(), low(), 0.15 * cell_};
    const Box3d all{{low(), low(), low()}, {low() + width_, low() + width_, top() + cell_ / 4}};
    Box3d block = all;
    block.max.z = top();
    const Shape material = unite({intersect({crystal(p), cuboid(block)}), subtract(cuboid(all), cuboid(block))});
    problem_.solid =
        clean(realize(material, all.grown(4 * h_), {.voxel_mm = h_}), {.drop_below_vox = 1 << 30, .fill_below_vox = 0})
            .solid;
    problem_.young_mpa = 1000;
    problem_.poisson = poisson;
    problem_.residual = 1e-6;
    Box3d middle = all.grown(cell_);
    middle.min.z = low() + cell_;
    middle.max.z = low() + 2 * cell_;
    problem_.unmeasured = complement(cuboid(middle));  // stress of the middle cell alone
  }
  struct Response {
    double strain;  ///< Along z.
    Vec3d stress;   ///< Along the axes, over Young's modulus.
    double p99;     ///< Of the von Mises stress of the material, over Young's modulus.
  };
  /// Under a stress along z (over Young's modulus), its sides moved outward by these strains.
  [[nodiscard]] Response under(double stress, double strain_x, double strain_y) const {
    VoxelFemProblem problem = problem_;
    for (const double at : {low(), low() + width_}) {
      problem.supports.push_back({plane(0, at), {true, false, false}, [=](Vec3d q) {
                                    return Vec3d{strain_x * q.x, 0, 0};
                                  }});
      problem.supports.push_back({plane(1, at), {false, true, false}, [=](Vec3d q) {
                                    return Vec3d{0, strain_y * q.y, 0};
                                  }});
    }
    problem.supports.push_back({plane(2, low()), {false, false, true}, {}});
    const double least_n = 1e-9;  // some load there must be
    problem.forces.push_back(
        {plane(2, top() + cell_ / 4), {0, 0, stress == 0 ? least_n : stress * problem.young_mpa * width_ * width_}});
    const VoxelFemResult result = solve(problem);
    return {strain(result), mean_stress(result), result.p99_von_mises_mpa / problem.young_mpa};
  }

 private:
  [[nodiscard]] double low() const { return -0.5 * h_; }
  [[nodiscard]] double top() const { return low() + 3 * cell_; }
  [[nodiscard]] Shape plane(int axis, double at) const {
    constexpr double far = 1e4;
    Box3d box{{-far, -far, -far}, {far, far, far}};
    (axis == 0 ? box.min.x : axis == 1 ? box.min.y : box.min.z) = at - 0.3 * h_;
    (axis == 0 ? box.max.x : axis == 1 ? box.max.y : box.max.z) = at + 0.3 * h_;
    return cuboid(box);
  }
  /// Visits the cells of the middle cell of the crystal.
  template <class Visit>
  void each_sample(const Visit& visit) const {
    const int n = static_cast<int>(std::lround(width_ / h_)), tall = static_cast<int>(std::lround(cell_ / h_));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int k = tall; k < 2 * tall; ++k) visit(Vec3d{i * h_, j * h_, k * h_});
  }
  /// Points one cell apart move apart by the strain alone.
  [[nodiscard]] double strain(const VoxelFemResult& result) const {
    double sum = 0;
    int count = 0;
    each_sample([&](Vec3d p) {
      const auto below = result.displacement_mm(p - Vec3d{0, 0, 0.5 * cell_}),
                 above = result.displacement_mm(p + Vec3d{0, 0, 0.5 * cell_});
      if (!below || !above) return;
      sum += above->z - below->z;
      ++count;
    });
    return sum / count / cell_;
  }
  /// Over material and void: of each cell from the displacements of its faces.
  [[nodiscard]] Vec3d mean_stress(const VoxelFemResult& result) const {
    const double shear = 1 / (2 * (1 + poisson)), lame = poisson / ((1 + poisson) * (1 - 2 * poisson));
    Vec3d sum{};
    int count = 0;
    each_sample([&](Vec3d p) {
      ++count;
      const double fraction = std::clamp(0.5 - problem_.solid.distance(p) / h_, 0.0, 1.0);
      if (!result.displacement_mm(p)) return;
      const auto along = [&](Vec3d way) {
        const Vec3d half = 0.499 * h_ * way;
        return (1 / (0.998 * h_)) * (*result.displacement_mm(p + half) - *result.displacement_mm(p - half));
      };
      const Vec3d e{along({1, 0, 0}).x, along({0, 1, 0}).y, along({0, 0, 1}).z};
      const double spread = lame * (e.x + e.y + e.z);
      sum = sum + fraction * (2 * shear * e + Vec3d{spread, spread, spread});
    });
    return (1.0 / count) * sum;
  }

  double cell_, h_, width_;
  VoxelFemProblem problem_;
};

Stiffness stiffness(const TcsParams& params, int sides = 23) {
  const Prism prism(sized(params), sides);
  constexpr double e = 0.001;
  const Prism::Response pressed = prism.under(-e, 0, 0), spread = prism.under(0, e, e), sheared = prism.under(0, e, -e);
  EXPECT_NEAR(pressed.stress.z / -e, 1, 0.01);  // what is known tells how well stress is measured
  Stiffness result{};
  result.c11 = -e / pressed.strain;
  result.c12 = -result.c11 * spread.strain / (2 * e);  // free along z: 0 = c11 strain + 2 c12 e
  result.c44 = (sheared.stress.x - sheared.stress.y) / (4 * e);
  EXPECT_NEAR(0.5 * (pressed.stress.x + pressed.stress.y) / pressed.strain / result.c12, 1, 0.02);
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

/// Sticks bend: soft along [100], where no stick runs, twice as stiff along [111], where one in four does. Eleven
/// voxels across a stick.
TEST_F(CrystalStiffness, sticks_bend) {
  const Stiffness s = stiffness({.density = density});
  note(s);
  EXPECT_LT(s.bulk(), 0.5 * most_bulk(density));
  EXPECT_NEAR(s.young({1, 1, 1}) / s.young({1, 0, 0}), 2.2, 0.1 * 2.2);
  EXPECT_NEAR(s.mean_young(), 0.041, 0.1 * 0.041);
}

/// Balls of half again the stick's diameter make nodes stiff and leave more to the sticks than twice as large ones.
TEST_F(CrystalStiffness, smaller_balls_are_a_tenth_stiffer) {
  const Stiffness s = stiffness({.stick_mm = 0.8, .ball_mm = 1.2, .density = density});
  note(s);
  EXPECT_NEAR(s.young({1, 1, 1}) / s.young({1, 0, 0}), 2.2, 0.05 * 2.2);
  EXPECT_NEAR(s.mean_young(), 0.041, 0.05 * 0.041);
}

TEST_F(CrystalStiffness, a_network_is_a_little_stiffer_than_sticks) {
  const Stiffness s = stiffness({.form = TcsForm::Network, .density = density});
  note(s);
  EXPECT_LT(s.bulk(), 0.5 * most_bulk(density));
  EXPECT_NEAR(s.mean_young(), 0.045, 0.1 * 0.045);
}

/// The membrane stretches: more than three quarters of what any shape can reach in bulk. Three voxels across a wall,
/// which need not bend.
TEST_F(CrystalStiffness, a_sheet_stretches) {
  const Stiffness s = stiffness({.form = TcsForm::Sheet, .density = density});
  note(s);
  EXPECT_GT(s.bulk(), 0.75 * most_bulk(density));
  EXPECT_LT(s.bulk(), most_bulk(density));
  EXPECT_NEAR(s.mean_young(), 0.073, 0.1 * 0.073);
}

/// Pressure along [001] at first yield, over yield stress: 99 % of the middle cell's material is at or below p99. Of
/// the same mass the sheet carries about twice as much as sticks do, whichever their balls. Within 3 % from 45 voxels
/// to a cell to 99.
TEST_F(CrystalStiffness, a_sheet_carries_twice_as_much_per_gram_as_sticks) {
  constexpr double e = 0.001;
  const auto carried = [](const TcsParams& params) { return e / Prism(sized(params), 23).under(-e, 0, 0).p99; };
  const double sheet = carried({.form = TcsForm::Sheet, .density = density}), sticks = carried({.density = density}),
               smaller_balls = carried({.stick_mm = 0.8, .ball_mm = 1.2, .density = density});
  RecordProperty("sheet", std::to_string(sheet));
  RecordProperty("sticks", std::to_string(sticks));
  RecordProperty("sticks_smaller_balls", std::to_string(smaller_balls));
  // Whatever its shape, in the mean of the material the stress along the load is pressure / density.
  EXPECT_LT(sheet, density);
  EXPECT_GT(sheet, 0.5 * density);
  EXPECT_NEAR(sheet / sticks, 2.3, 0.1 * 2.3);
  EXPECT_NEAR(sheet / smaller_balls, 1.83, 0.1 * 1.83);
}

}  // namespace
}  // namespace fibrolite
