// SPDX-License-Identifier: GPL-3.0-or-later
// The floor that whole runs are compared with: what OpenVDB's own tools need to take the model to a level set and back
// to a mesh, with nothing inside. Prints one JSON object.
//   fibrolite-floor MODEL SIZE_MM VOXEL_MM
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <vector>

#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/prepare.h"

namespace {

double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::cerr << "usage: fibrolite-floor MODEL SIZE_MM VOXEL_MM\n";
    return 2;
  }
  const double read_from = wall_s();
  const fibrolite::Model model =
      fibrolite::prepare(fibrolite::read_mesh(argv[1]), {.size_mm = std::atof(argv[2]), .unit_mm = {}});
  std::vector<openvdb::Vec3s> points;
  for (const auto& p : model.mesh.vertices) points.emplace_back(p.x, p.y, p.z);
  std::vector<openvdb::Vec3I> triangles;
  for (const auto& t : model.mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  openvdb::initialize();

  const double from = wall_s(), cpu_from = cpu_s();
  const auto transform = openvdb::math::Transform::createLinearTransform(std::atof(argv[3]));
  const auto grid = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, {}, 3.0F);
  const double meshed_from = wall_s();
  std::vector<openvdb::Vec3s> out_points;
  std::vector<openvdb::Vec3I> out_triangles;
  std::vector<openvdb::Vec4I> out_quads;
  openvdb::tools::volumeToMesh(*grid, out_points, out_triangles, out_quads, 0.0);
  const double to = wall_s();

  std::cout << nlohmann::json{{"read_s", from - read_from},
                              {"level_set_s", meshed_from - from},
                              {"mesh_s", to - meshed_from},
                              {"compute_s", to - from},
                              {"compute_cpu_s", cpu_s() - cpu_from},
                              {"active_voxels", grid->activeVoxelCount()},
                              {"triangles", out_triangles.size() + 2 * out_quads.size()}}
                   .dump()
            << '\n';
  return 0;
} catch (const std::exception& error) {
  std::cerr << "fibrolite-floor: " << error.what() << '\n';
  return 1;
}
