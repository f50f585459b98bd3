// SPDX-License-Identifier: Apache-2.0
// A mesh a layer at a time, for meshes that do not fit into memory, or need not.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"

namespace fibrolite {

/// Vertices of this layer, and triangles whose corners are among them and those of the layer before.
struct MeshLayer {
  std::span<const Vec3f> vertices;  ///< mm; of the layer before, then of this one.
  std::size_t first = 0;            ///< Number of vertices[0] in the mesh.
  std::size_t before = 0;           ///< How many of them the layer before has.
  std::span<const Mesh::Triangle> triangles;
  std::span<const Rgb> colors;  ///< Empty or one per triangle.

  [[nodiscard]] Vec3f at(std::uint32_t corner) const { return vertices[corner - first]; }
  [[nodiscard]] std::span<const Vec3f> fresh() const { return vertices.subspan(before); }
};

class MeshLayers {
 public:
  virtual ~MeshLayers() = default;
  [[nodiscard]] virtual std::size_t vertices() const = 0;
  [[nodiscard]] virtual std::size_t triangles() const = 0;
  /// Have its layers colours?
  [[nodiscard]] virtual bool colored() const { return false; }
  /// In order, as often as asked for; the same each time. A layer lives until `use` returns, which may be called on
  /// another thread, but never twice at once: the next layer is made meanwhile. Reports progress.
  /// @throws Error Cancelled, Io; whatever `use` throws.
  virtual void each(const std::function<void(const MeshLayer&)>& use, const Context& context) const = 0;
};

/// A mesh in memory as its only layer. The mesh must outlive it.
class WholeMesh final : public MeshLayers {
 public:
  explicit WholeMesh(const Mesh& mesh) : mesh_(&mesh) {}
  [[nodiscard]] std::size_t vertices() const override { return mesh_->vertices.size(); }
  [[nodiscard]] std::size_t triangles() const override { return mesh_->triangles.size(); }
  [[nodiscard]] bool colored() const override { return !mesh_->triangle_colors.empty(); }
  void each(const std::function<void(const MeshLayer&)>& use, const Context& context) const override {
    context.check();
    use({mesh_->vertices, 0, 0, mesh_->triangles, mesh_->triangle_colors});
    context.progress(1);
  }

 private:
  const Mesh* mesh_;
};

/// All layers in memory. Cost: O(n).
[[nodiscard]] Mesh gathered(const MeshLayers& layers, const Context& context = {});

/// What check() says of the whole, from no more than two layers at once. Vertices with equal coordinates must lie in
/// the same layer or in neighbouring ones. Cost: O(n) time, parallel; 40 bytes a triangle of two layers.
[[nodiscard]] MeshCheck check(const MeshLayers& layers, const Context& context = {});

}  // namespace fibrolite
