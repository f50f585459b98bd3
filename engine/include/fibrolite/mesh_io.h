// SPDX-License-Identifier: Apache-2.0
// Reading and writing meshes: .stl (binary, ASCII) .obj .ply .off .3mf.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/mesh_layers.h"

namespace fibrolite {

/// Endings that read_mesh understands, with the dot, lower case.
[[nodiscard]] std::vector<std::string> readable_mesh_endings();
[[nodiscard]] std::vector<std::string> writable_mesh_endings();

/// What came with a file beside its triangles.
struct MeshFile {
  Mesh mesh;             ///< Polygons are split into fans; STL corners are not welded yet. Units as in the file.
  double unit_mm = 1.0;  ///< Millimetres per file unit; known for .3mf only, else 1.
  std::vector<std::string> notes;  ///< E.g. "3 polygons with fewer than 3 corners left out".
};

/// @throws Error BadInput: missing or empty file, not the format its ending says, truncated, an index out of range, NaN
/// or infinite coordinates, no triangles; Unsupported: unknown ending. The message names the place (line, byte, face).
[[nodiscard]] MeshFile read_mesh(const std::filesystem::path& path, const Context& context = {});

/// The file is whole or absent: written beside its target, flushed, renamed. Coordinates are written so that they read
/// back to the same floats. The same mesh gives the same bytes (3MF UUIDs are fixed).
/// @throws Error Io: folder missing, not writable, disk full; Unsupported: unknown ending.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh, const Context& context = {});
/// As many of the layers in memory as they come in. The same triangles in other layers give the same bytes, but in
/// .3mf.
void write_mesh(const std::filesystem::path& path, const MeshLayers& mesh, const Context& context = {});

}  // namespace fibrolite
