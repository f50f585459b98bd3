// SPDX-License-Identifier: Apache-2.0
// Solids in .vdb files, whole or absent, the same bytes for the same grids, checked when read.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct NamedSolid {
  std::string name;
  Solid solid;
};
/// Voxel count, bounding box and a checksum are stored as metadata. @throws Error Io.
void write_vdb(const std::filesystem::path& path, const std::vector<NamedSolid>& solids, const Context& context = {});
/// The level set called `name`; without a name the only one there is, or among several the one called "solid".
/// @throws Error BadInput: missing, truncated, damaged, no such level set, or several and none is called so.
[[nodiscard]] Solid read_vdb(const std::filesystem::path& path, const std::string& name = {});

}  // namespace fibrolite
