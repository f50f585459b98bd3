// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/voxel_fem.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"

namespace fibrolite {
namespace {

/// A box of whole cells: faces half a voxel beside the samples.
Solid block(Vec3i cells, double voxel) {
  const Vec3d low{-0.5 * voxel, -0.5 * voxel, -0.5 * voxel};
  const Box3d box{low, low + voxel * Vec3d{1.0 * cells.x, 1.0 * cells.y, 1.0 * cells.z}};
  return realize(cuboid(box), box.grown(4 * voxel), {.voxel_mm = voxel});
}
/// Everything within half a voxel of the plane x = at.
[[maybe_unused]] Shape plane_x(double at, double voxel) {
  return cuboid({{at - 0.4 * voxel, -1e3, -1e3}, {at + 0.4 * voxel, 1e3, 1e3}});
}
template <class Call>
Code code_of(const Call& call) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.code();
  }
  ADD_FAILURE() << "nothing thrown";
  return Code::Internal;
}

TEST(VoxelFem, a_linear_displacement_field_is_exact) {
  const auto field = [](Vec3d p) {
    return Vec3d{0.001 * p.x + 0.002 * p.y - 0.003 * p.z, 0.0005 * p.x - 0.001 * p.y, 0.004 * p.z + 0.002 * p.x};
  };
  VoxelFemProblem problem;
  problem.solid = block({20, 11, 13}, 0.5);
  const Box3d inner{{0.01, 0.01, 0.01}, {9.4, 4.9, 5.9}};
  problem.supports = {{complement(cuboid(inner)), {true, true, true}, field}};
  problem.residual = 1e-10;
  const auto result = solve(problem);
  for (const Vec3d p : {Vec3d{2, 2, 2}, Vec3d{5.3, 3.1, 4.7}, Vec3d{9.1, 4.4, 0.3}}) {
    const auto u = result.displacement_mm(p);
    ASSERT_TRUE(u.has_value());
    EXPECT_LT(norm(*u - field(p)), 1e-6 * 0.04);
  }
  EXPECT_FALSE(result.displacement_mm({20, 2, 2}).has_value());
}

}  // namespace
}  // namespace fibrolite
