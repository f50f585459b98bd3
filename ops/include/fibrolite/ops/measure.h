// SPDX-License-Identifier: GPL-3.0-or-later
// How much material is where, on the finished solid.
#pragma once

#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/shape.h"
#include "fibrolite/solid.h"

namespace fibrolite {

struct PartVolumes {
  double part_mm3 = 0;    ///< Of the body that belongs to the part.
  double lumen_mm3 = 0;   ///< Of that, deeper than the shell.
  double infill_mm3 = 0;  ///< Material in the lumen (fills, joints and ties).
  Vec3d centroid_mm{};    ///< Of part_mm3.
};
/// The same as sums over samples, in voxels: those of ranges add up to the whole's without an error.
struct PartSums {
  double part = 0, lumen = 0, infill = 0;
  Vec3d moment_mm{};
  PartSums& operator+=(const PartSums& other);
  [[nodiscard]] PartVolumes volumes(double voxel_mm) const;
};
/// The whole and its parts, by their place in the list of regions.
struct VolumeSums {
  double body_vox = 0, solid_vox = 0;  ///< As Solid::volume_mm3(), in voxels.
  std::vector<PartSums> parts;
  VolumeSums& operator+=(const VolumeSums& other);
};
struct Volumes {
  double body_mm3 = 0, solid_mm3 = 0;
  std::vector<PartVolumes> parts;
};
[[nodiscard]] Volumes volumes(const VolumeSums& sums, double voxel_mm);

/// One part per region, at least one; a voxel on a border counts for both in part. `body` and `solid` share one
/// lattice, and the solid lies in the body. Samples near a surface count in part. Cost: O(samples inside the body),
/// parallel; the same bits on any number of threads.
[[nodiscard]] Volumes measure(const Solid& body, const Solid& solid, const std::vector<Shape>& regions, double shell_mm,
                              const Context& context = {});
/// Of the samples in a range only; both hold the samples next to it too.
[[nodiscard]] VolumeSums measure(const Solid& body, const Solid& solid, const std::vector<Shape>& regions,
                                 double shell_mm, const SampleRange& range, const Context& context = {});

}  // namespace fibrolite
