// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/inspect.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

#include "fibrolite/mesh_io.h"
#include "fibrolite/solid_io.h"
#include "fibrolite/surface.h"
#include "self_intersections.h"

namespace fibrolite {
namespace {

struct Loaded {
  Mesh mesh;
  std::vector<std::string> notes;
};

Loaded load(const std::filesystem::path& path, const Context& context) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  if (ending == ".vdb") return {surface(read_vdb(path), {}, context), {}};
  MeshFile file = read_mesh(path, context);
  if (file.unit_mm != 1)
    for (Vec3f& p : file.mesh.vertices) p = to_float(file.unit_mm * to_double(p));
  return {std::move(file.mesh), std::move(file.notes)};
}

}  // namespace

Inspection inspect(const Mesh& mesh, const Context& context) {
  const Mesh clean = welded(mesh);
  Inspection result;
  result.mesh = check(clean);
  result.size_mm = bounds(clean).size();
  result.volume_mm3 = result.mesh.volume_mm3;
  context.check();
  result.self_intersections = self_intersections(clean, context.part(0.2, 1, "self-intersections"));
  context.progress(1);
  return result;
}

std::string inspect_file(const std::filesystem::path& path, const Context& context) {
  const Loaded loaded = load(path, context.part(0, 0.3, "read"));
  const Inspection found = inspect(loaded.mesh, context.part(0.3, 1, "check"));
  const MeshCheck& m = found.mesh;
  nlohmann::ordered_json json;
  json["path"] = path.string();
  json["volume_mm3"] = found.volume_mm3;
  json["size_mm"] = {found.size_mm.x, found.size_mm.y, found.size_mm.z};
  json["closed"] = m.closed();
  json["self_intersections"] = found.self_intersections;
  json["mesh"] = {{"volume_mm3", m.volume_mm3},
                  {"triangles", m.triangles},
                  {"vertices", m.vertices},
                  {"boundary_edges", m.boundary_edges},
                  {"nonmanifold_edges", m.nonmanifold_edges},
                  {"nonmanifold_vertices", m.nonmanifold_vertices},
                  {"degenerate_triangles", m.degenerate_triangles},
                  {"shells", m.shells}};
  json["notes"] = loaded.notes;
  // A path need not be UTF-8; JSON must be.
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace fibrolite
