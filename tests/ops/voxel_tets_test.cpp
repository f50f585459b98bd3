// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel_tets.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

TEST(VoxelTets, fill_a_box_exactly) {
  const Box3d box{{1, 2, 3}, {11, 12, 13}};
  const TetMesh mesh = voxel_tetrahedra(cuboid(box), box, 1000, 125);
  EXPECT_EQ(mesh.tets.size(), 125U * 6U);
  EXPECT_NEAR(volume_mm3(mesh), 1000, 1e-9);
  EXPECT_EQ(mesh.nodes.size(), 11U * 11U * 11U);  // corners and the midpoints of all edges and diagonals
  for (const auto& t : mesh.tets) {
    const Vec3d a = mesh.nodes[t[0]];
    EXPECT_GT(dot(mesh.nodes[t[1]] - a, cross(mesh.nodes[t[2]] - a, mesh.nodes[t[3]] - a)), 0);
  }
}

TEST(VoxelTets, keep_one_piece_near_the_volume_of_the_body) {
  const Shape two = unite({sphere({0, 0, 0}, 8), sphere({15, 0, 0}, 3)});
  const TetMesh mesh = voxel_tetrahedra(two, {{-9, -9, -9}, {19, 9, 9}}, 2145, 4000);
  EXPECT_NEAR(volume_mm3(mesh) / 2145, 1, 0.03);
  for (const Vec3d p : mesh.nodes) EXPECT_LT(norm(p), 10);
}

TEST(VoxelTets, nothing_inside_is_an_error) {
  EXPECT_THROW((void)voxel_tetrahedra(nothing(), {{0, 0, 0}, {1, 1, 1}}, 1), Error);
}

}  // namespace
}  // namespace fibrolite
