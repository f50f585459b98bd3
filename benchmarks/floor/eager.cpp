// SPDX-License-Identifier: GPL-3.0-or-later
#include "eager.h"

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include "clocks.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/ops/recipe.h"
#include "fibrolite/realize.h"
#include "fibrolite/vdb.h"

namespace fibrolite::bench {

Eager eager_csg(const std::vector<openvdb::Vec3s>& points, const std::vector<openvdb::Vec3I>& triangles,
                double voxel_mm) {
  const Recipe recipe = preset("peer-tcs");
  Eager result;
  const double from = wall_s(), cpu_from = cpu_s();
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel_mm);
  const auto model = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, {}, 3.0F);

  const double offset_from = wall_s();
  const auto inner = model->deepCopy();
  openvdb::tools::LevelSetFilter<openvdb::FloatGrid>(*inner).offset(static_cast<float>(recipe.shell.thickness_mm));
  result.offset_s = wall_s() - offset_from;
  const auto solid = openvdb::tools::csgDifferenceCopy(*model, *inner);

  const openvdb::BBoxd box = transform->indexToWorld(model->evalActiveVoxelBoundingBox());
  const Solid sticks =
      realize(crystal(sized(recipe.tcs)),
              {{box.min().x(), box.min().y(), box.min().z()}, {box.max().x(), box.max().y(), box.max().z()}},
              {.voxel_mm = voxel_mm});
  const auto lattice = openvdb::tools::csgIntersectionCopy(*to_vdb(sticks), *model);
  openvdb::tools::csgUnion(*solid, *lattice);

  std::vector<openvdb::Vec3s> out_points;
  std::vector<openvdb::Vec3I> out_triangles;
  std::vector<openvdb::Vec4I> out_quads;
  openvdb::tools::volumeToMesh(*solid, out_points, out_triangles, out_quads, 0.0);
  result.wall_s = wall_s() - from;
  result.cpu_s = cpu_s() - cpu_from;
  result.triangles = out_triangles.size() + 2 * out_quads.size();
  result.volume_mm3 = openvdb::tools::levelSetVolume(*solid);
  return result;
}

}  // namespace fibrolite::bench
