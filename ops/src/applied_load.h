// SPDX-License-Identifier: GPL-3.0-or-later
// A load case on a finite element mesh: nodal forces and held degrees of freedom.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "fibrolite/ops/loads.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// How a body stands, and what it is made of.
struct LoadSetting {
  Vec3d up{0, 0, 1};       ///< Unit.
  double azimuth_deg = 0;  ///< Where Direction::Of::Slanted comes from, see load_directions().
  Material material{};
  /// How far the mesh may lie from the surface that boxes and half-spaces were stated for: they reach this much farther
  /// along the normal of what they cut, so that a plane stated in a face holds that face.
  double tolerance_mm = 0;
  /// How far above or below a face of a mesh a point of seen_from may lie to act on it.
  double reach_mm = std::numeric_limits<double>::infinity();
  Labels labels{};            ///< For Selection::label.
  Frame frame{};              ///< Of the mesh's coordinates, for messages in the world's.
  std::string key = "loads";  ///< What the list of cases is called in messages.
};

/// A load case found on a body: total forces are tractions, shares of the height are heights. It can then be put on the
/// body's mesh, or on that of a piece of it. Immutable, thread-safe, cheap to copy.
class AppliedLoad {
 public:
  struct Impl;
  /// `cases[index]`, already checked, in the coordinates of `body`.
  /// @throws Error BadRecipe: a selection is empty, a label does not exist, the supports leave the body free to move,
  /// the directions of its sliding supports are neither parallel nor at right angles; each names the case, the key and
  /// the size of what was selected. Cost: O(faces + nodes) per selection.
  AppliedLoad(const std::vector<LoadCase>& cases, std::size_t index, const TetMesh& body, const LoadSetting& setting);

  /// Consistent forces on the nodes of `mesh`, N. Tractions are integrated exactly over straight-sided faces, also
  /// where a plane cuts one. A force by seen_from takes the points that `mine` accepts (given with the unit direction
  /// to the eye): its shares are those of the whole body. Cost: O(faces + nodes) per force.
  [[nodiscard]] std::vector<Vec3d> forces_n(const TetMesh& mesh,
                                            const std::function<bool(Vec3d p, Vec3d to_eye)>& mine) const;
  /// The axes that held() speaks of; the mesh's own unless a sliding support lies askew to them.
  [[nodiscard]] const Frame& held_in() const;
  /// Which components of each node of `mesh`, along the axes of held_in(), are held.
  [[nodiscard]] std::vector<std::array<bool, 3>> held(const TetMesh& mesh) const;
  /// Sum of the magnitudes of its forces on the body, N.
  [[nodiscard]] double magnitude_n() const;
  /// One for each support and each force that has a selection.
  [[nodiscard]] const std::vector<Selected>& selected() const;

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Weight of 1 mm3 of a material, N: g/cm3 = 1e-6 kg/mm3, times 9.80665 m/s2.
[[nodiscard]] double weight_n_per_mm3(const Material& material);

}  // namespace fibrolite
