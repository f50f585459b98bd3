// SPDX-License-Identifier: GPL-3.0-or-later
// Models for tests: built shapes, the bundled assets, and the shared real meshes where they exist.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "fibrolite/mesh.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite::testing {

Mesh cube(double side_mm, Vec3d min_corner = {});  ///< 12 triangles, outward.
Mesh icosphere(double radius_mm, int subdivisions, Vec3d center = {});
Mesh tube(double radius_mm, double length_mm, int sides, Vec3d base = {});  ///< Closed cylinder along z.
Mesh torus_mesh(double ring_mm, double tube_mm, int ring_sides, int tube_sides);
Mesh flipped(Mesh mesh);  ///< Inside out.
Mesh moved(Mesh mesh, Vec3d by);
Mesh turned(Mesh mesh, int axis, int quarter_turns);  ///< By 90 degrees about x, y or z.
Mesh joined(const Mesh& a, const Mesh& b);
Mesh without_triangle(Mesh mesh, std::size_t index);

/// nx * ny * nz bricks over the unit cube, six ten-node tetrahedra each, placed by `place`; midside nodes stay in the
/// middle.
TetMesh bricks(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz, const std::function<Vec3d(Vec3d)>& place);

/// assets/models/NAME.ply.
std::filesystem::path asset(const std::string& name);
/// A file of the shared folder of real meshes; nothing if the folder is missing (the test then skips and says so).
std::optional<std::filesystem::path> shared_model(const std::string& file);
/// A fresh empty folder, removed when the guard goes.
class TempDir {
 public:
  TempDir();
  ~TempDir();
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace fibrolite::testing
