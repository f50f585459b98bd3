// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/mesh_layers.h"

namespace fibrolite {

Mesh gathered(const MeshLayers& layers, const Context& context) {
  Mesh mesh;
  mesh.vertices.reserve(layers.vertices());
  mesh.triangles.reserve(layers.triangles());
  layers.each(
      [&](const MeshLayer& layer) {
        mesh.vertices.insert(mesh.vertices.end(), layer.fresh().begin(), layer.fresh().end());
        mesh.triangles.insert(mesh.triangles.end(), layer.triangles.begin(), layer.triangles.end());
        mesh.triangle_colors.insert(mesh.triangle_colors.end(), layer.colors.begin(), layer.colors.end());
      },
      context);
  return mesh;
}

}  // namespace fibrolite
