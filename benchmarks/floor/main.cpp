// SPDX-License-Identifier: GPL-3.0-or-later
// The floor that whole runs are compared with: what OpenVDB's own tools need to take the model to a level set and back
// to a mesh, with nothing inside. Prints one JSON object.
//   fibrolite-floor MODEL SIZE_MM VOXEL_MM
// With --band: the first half of it only, beside our own with the same band, and with 1 mm more of it inside; the best
// of three each, by turns.
//   fibrolite-floor MODEL SIZE_MM VOXEL_MM --band
// With --eager: the whole of the preset peer-tcs by grids and OpenVDB's tools, one after the other (eager.h).
//   fibrolite-floor MODEL SIZE_MM VOXEL_MM --eager
// Back from a solid that Fibrolite made to a mesh, beside our own; the best of three each, by turns.
//   fibrolite-floor SOLID.vdb --mesh
// And what memory gives: how fast all cores together copy arrays that no cache holds.
//   fibrolite-floor --copy
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "clocks.h"
#include "eager.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/prepare.h"
#include "fibrolite/solid_io.h"
#include "fibrolite/surface.h"
#include "fibrolite/to_solid.h"
#include "fibrolite/vdb.h"

namespace {

using fibrolite::bench::cpu_s;
using fibrolite::bench::wall_s;

int compare_bands(const fibrolite::Mesh& mesh, double voxel_mm, const std::vector<openvdb::Vec3s>& points,
                  const std::vector<openvdb::Vec3I>& triangles) {
  double level_set_s = 1e9, band_s = 1e9, wide_s = 1e9;
  std::int64_t voxels = 0;
  for (int round = 0; round < 3; ++round) {
    const auto seconds = [](const auto& work) {
      const double from = wall_s();
      work();
      return wall_s() - from;
    };
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel_mm);
    level_set_s =
        std::min(level_set_s, seconds([&] {
                   (void)openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, {}, 3.0F);
                 }));
    const fibrolite::Grid grid{.voxel_mm = voxel_mm};
    band_s =
        std::min(band_s, seconds([&] { voxels = fibrolite::to_solid(mesh, {.grid = grid}).solid.active_voxels(); }));
    wide_s = std::min(wide_s, seconds([&] { (void)fibrolite::to_solid(mesh, {.grid = grid, .inside_band_mm = 1}); }));
  }
  std::cout << nlohmann::json{{"level_set_s", level_set_s},
                              {"band_s", band_s},
                              {"wide_band_s", wide_s},
                              {"band_voxels", voxels}}
                   .dump()
            << '\n';
  return 0;
}

int compare_meshes(const char* file) {
  const fibrolite::Solid solid = fibrolite::read_vdb(file);
  const auto grid = fibrolite::to_vdb(solid);
  double volume_to_mesh_s = 1e9, surface_s = 1e9;
  std::size_t theirs = 0, ours = 0;
  for (int round = 0; round < 3; ++round) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    double start = wall_s();
    openvdb::tools::volumeToMesh(*grid, points, triangles, quads, 0.0);
    volume_to_mesh_s = std::min(volume_to_mesh_s, wall_s() - start);
    theirs = triangles.size() + 2 * quads.size();
    start = wall_s();
    ours = fibrolite::surface(solid).triangles.size();
    surface_s = std::min(surface_s, wall_s() - start);
  }
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grid, points, triangles, quads, 0.0);
  fibrolite::Mesh mesh;
  for (const auto& p : points) mesh.vertices.push_back({p.x(), p.y(), p.z()});
  for (const auto& t : triangles) mesh.triangles.push_back({t[0], t[1], t[2]});
  for (const auto& q : quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  const auto faults = [](const fibrolite::MeshCheck& c) {
    return c.boundary_edges + c.nonmanifold_edges + c.nonmanifold_vertices + c.degenerate_triangles;
  };
  const std::int64_t their_faults = faults(check(mesh)), our_faults = faults(check(fibrolite::surface(solid)));
  std::cout << nlohmann::json{{"volume_to_mesh_s", volume_to_mesh_s},  {"surface_s", surface_s},
                              {"volume_to_mesh_triangles", theirs},    {"surface_triangles", ours},
                              {"volume_to_mesh_faults", their_faults}, {"surface_faults", our_faults}}
                   .dump()
            << '\n';
  return 0;
}

/// Bytes read and written a second, the best of five passes over half a gigabyte.
int measure_copy() {
  constexpr std::size_t bytes = std::size_t{1} << 28;
  std::vector<char> from(bytes, 1), to(bytes, 2);
  double least_s = 1e9;
  for (int round = 0; round < 5; ++round) {
    const double start = wall_s();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bytes, std::size_t{1} << 20),
                      [&](const auto& some) { std::memcpy(&to[some.begin()], &from[some.begin()], some.size()); });
    least_s = std::min(least_s, wall_s() - start);
  }
  std::cout << nlohmann::json{{"copy_gb_s", 2e-9 * static_cast<double>(bytes) / least_s}}.dump() << '\n';
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 2 && std::string_view(argv[1]) == "--copy") return measure_copy();
  if (argc == 3 && std::string_view(argv[2]) == "--mesh") {
    openvdb::initialize();
    return compare_meshes(argv[1]);
  }
  const bool band = argc == 5 && std::string_view(argv[4]) == "--band";
  const bool eager = argc == 5 && std::string_view(argv[4]) == "--eager";
  if (argc != 4 && !band && !eager) {
    std::cerr << "usage: fibrolite-floor MODEL SIZE_MM VOXEL_MM [--band | --eager]\n       fibrolite-floor SOLID.vdb "
                 "--mesh\n    "
                 "   fibrolite-floor --copy\n";
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
  if (band) return compare_bands(model.mesh, std::atof(argv[3]), points, triangles);
  if (eager) {
    const fibrolite::bench::Eager made = fibrolite::bench::eager_csg(points, triangles, std::atof(argv[3]));
    std::cout << nlohmann::json{{"eager_s", made.wall_s},
                                {"eager_cpu_s", made.cpu_s},
                                {"offset_s", made.offset_s},
                                {"volume_mm3", made.volume_mm3},
                                {"triangles", made.triangles}}
                     .dump()
              << '\n';
    return 0;
  }

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
