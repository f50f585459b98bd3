// SPDX-License-Identifier: GPL-3.0-or-later
// The proxy's inside as a graph of samples: what is connected to what, and how far along the inside.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fibrolite/ops/diameter.h"

namespace fibrolite {

/// Which of the 26 neighbours of a sample are joined to it through the body, one bit each.
using Links = std::vector<std::uint32_t>;

struct VoxelBody {
  static constexpr int margin = 4;       ///< Samples around the solid's box.
  static constexpr int directions = 26;  ///< Direction d and directions - 1 - d are opposite.

  Vec3d origin{};
  double voxel_mm = 1;
  Vec3i size{};
  std::vector<float> distance;                  ///< Per lattice sample, x fastest, mm.
  std::vector<std::int32_t> inside;             ///< Per lattice sample: index of the inside sample, or -1.
  std::vector<std::int32_t> lattice;            ///< Per inside sample: its lattice sample.
  Links links;                                  ///< Per inside sample, of the whole body.
  std::array<std::int32_t, directions> step{};  ///< To a neighbour, in lattice samples.
  std::array<float, directions> length_mm{};    ///< Of a step.
  std::array<Vec3i, directions> offset{};

  [[nodiscard]] std::size_t count() const { return lattice.size(); }
  [[nodiscard]] Vec3i coordinates(std::int32_t lattice_sample) const;
  [[nodiscard]] Vec3d position(std::int32_t inside_sample) const;
  /// Trilinear; beyond the lattice that of its nearest point.
  [[nodiscard]] float distance_at(Vec3d p) const;
  /// The inside sample across link `d` of `sample`.
  [[nodiscard]] std::int32_t neighbour(std::int32_t sample, int d) const {
    return inside[static_cast<std::size_t>(lattice[static_cast<std::size_t>(sample)] +
                                           step[static_cast<std::size_t>(d)])];
  }
};

/// @throws Error BadInput: nothing inside.
[[nodiscard]] VoxelBody make_voxel_body(const Solid& solid, const Context& context);

/// Connected components through `links`, numbered by their first sample.
struct Components {
  std::vector<std::int32_t> of;  ///< Per inside sample.
  int count = 0;
};
[[nodiscard]] Components components(const VoxelBody& body, const Links& links);

/// Length of the shortest way along `links` from any source, mm; negative where there is none within `reach_mm`.
[[nodiscard]] std::vector<float> geodesic(const VoxelBody& body, const Links& links,
                                          const std::vector<std::int32_t>& sources, double reach_mm);

/// For every lattice sample the nearest inside sample.
[[nodiscard]] std::vector<std::int32_t> nearest_inside(const VoxelBody& body);

/// For every inside sample the surface face nearest to it (through the inside).
[[nodiscard]] std::vector<std::int32_t> nearest_face(const VoxelBody& body, const std::vector<Vec3d>& face_centroids);

}  // namespace fibrolite
