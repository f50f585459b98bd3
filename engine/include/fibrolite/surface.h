// SPDX-License-Identifier: Apache-2.0
// The printed surface of a solid, as triangles.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/mesh_layers.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct SurfaceParams {
  /// Move each vertex so that curved surfaces keep their volume (a mesh with its vertices on a convex surface lies
  /// inside it).
  bool keep_volume = true;
  /// A coarse stand-in for a volume, not to be printed: that volume comes first. Flat faces get a ridge of up to a
  /// third of a voxel beside sharp edges to make good what those lack, and triangles may cut each other.
  bool stand_in = false;
  int axis = 2;  ///< Vertices and triangles come in layers of 8 voxels along it.
};

/// Dual surface of the zero level: closed, 2-manifold, outward, no degenerate triangle, at float coordinates. But for a
/// stand-in no triangle cuts another: that is not proven, and one of 105 meshes tried had 3 pairs that do.
/// Cost: O(leaves + triangles), parallel; peaks at about 70 bytes a vertex. The same bits on any number of threads.
/// Source: Nielson 2004 (dual marching cubes), Wenger 2013 (its manifold case).
/// @throws Error TooLarge (more than 2^32 - 1 vertices), Cancelled.
[[nodiscard]] Mesh surface(const Solid& solid, const SurfaceParams& params = {}, const Context& context = {});

/// The same surface, vertex for vertex, made and read a layer at a time: solid, then surface, or slab after slab of
/// both. Between the two it takes 34 bytes a vertex.
class SurfaceLayers final : public MeshLayers {
 public:
  /// With a `scratch` folder what has been made waits there, in a file without a name, and not in memory.
  /// @throws Error Io.
  explicit SurfaceLayers(Grid grid, const SurfaceParams& params = {},
                         const std::optional<std::filesystem::path>& scratch = {});
  ~SurfaceLayers() override;
  SurfaceLayers(const SurfaceLayers&) = delete;
  SurfaceLayers& operator=(const SurfaceLayers&) = delete;

  /// All of a solid, or its next slab along the axis: then `solid` holds the blocks of the range and one more on either
  /// side, and the first range begins a block or more below all there is. Cost: O(leaves + triangles), parallel.
  /// @throws Error TooLarge, Cancelled, Io.
  void add(const Solid& solid, const Context& context = {});
  void add(const Solid& solid, const SampleRange& range, const Context& context = {});
  /// After the last: the volume to keep. @throws Error Io.
  void finish(double volume_mm3);

  [[nodiscard]] std::size_t vertices() const override;
  [[nodiscard]] std::size_t triangles() const override;
  void each(const std::function<void(const MeshLayer&)>& use, const Context& context) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fibrolite
