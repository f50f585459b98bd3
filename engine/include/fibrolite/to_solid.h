// SPDX-License-Identifier: Apache-2.0
// Mesh -> Solid: exact distance in a band, with a sign that survives holes and self-intersections.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/solid.h"
#include "fibrolite/winding.h"

namespace fibrolite {

struct ToSolidParams {
  Grid grid{};
  /// The band reaches at least this deep inside the surface, mm (the shell needs its thickness), and grid.band_vox
  /// outside.
  double inside_band_mm = 0;
  /// Of this mesh, where there is one already; else one is made.
  std::optional<WindingTree> tree{};
  /// A mesh that overlaps itself is refused if replacing it would need more (repair_bytes()).
  double most_bytes = std::numeric_limits<double>::infinity();
};
/// What it takes to replace a mesh that is open or overlaps itself by its outermost surface, all of it at once, beside
/// the mesh: from its area. Cost: O(n).
[[nodiscard]] double repair_bytes(const Mesh& mesh, double voxel_mm);
/// Is it open, so that it will be replaced? Cost: O(n).
[[nodiscard]] bool is_open(const Mesh& mesh);
struct ToSolidResult {
  /// Interior background is -(inside_band_mm + band), or less if the body is nowhere so deep; exterior +band.
  Solid solid;
  std::vector<std::string> repairs;  ///< What had to be decided by winding number, in words; empty for a clean mesh.
};
/// @throws Error BadInput: the mesh encloses no volume (an open sheet, all triangles in one plane, thinner than the
/// voxel); BadRecipe: voxel (2e-5 mm or more) or band out of range; TooLarge: more than 2^31 voxels along an axis, or
/// most_bytes. Cost: O(triangles + band voxels), parallel; the same bits on any number of threads.
[[nodiscard]] ToSolidResult to_solid(const Mesh& mesh, const ToSolidParams& params, const Context& context = {});

/// The same solid a box at a time, for models whose whole band is too large for memory. Immutable, thread-safe; copies
/// are cheap.
class MeshVoxels {
 public:
  /// Looks at the whole band once, a row of it in memory at a time, so that each box gets the same sides as the whole.
  /// A mesh that is open or overlaps itself is replaced by its outermost surface at this voxel, which must fit into
  /// memory. Errors as of to_solid(), but for a mesh without volume, which is not noticed. Cost: as to_solid().
  MeshVoxels(const Mesh& mesh, const ToSolidParams& params, const Context& context = {});
  /// Holds every sample that is inside or in the band.
  [[nodiscard]] SampleBox samples() const;
  [[nodiscard]] const std::vector<std::string>& repairs() const;
  /// to_solid()'s samples in the blocks of 8 that the box touches, bit for bit; nothing beyond them. Cost: in
  /// proportion to the band in the box, parallel.
  [[nodiscard]] Solid within(const SampleBox& box, const Context& context = {}) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace fibrolite
