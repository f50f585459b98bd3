// SPDX-License-Identifier: GPL-3.0-or-later
// Is this mesh or solid fit to print? What `fibrolite check` prints.
#pragma once

#include <filesystem>
#include <string>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"

namespace fibrolite {

struct Inspection {
  MeshCheck mesh;
  Vec3d size_mm{};
  double volume_mm3 = 0;
  std::int64_t self_intersections = 0;  ///< Pairs of triangles that meet other than in a shared corner or edge.
};
[[nodiscard]] Inspection inspect(const Mesh& mesh, const Context& context = {});
/// JSON: "mesh" block, volume_mm3, size_mm, closed, self_intersections. Reads .stl .obj .ply .off .3mf, or a .vdb (its
/// surface).
[[nodiscard]] std::string inspect_file(const std::filesystem::path& path, const Context& context = {});

}  // namespace fibrolite
