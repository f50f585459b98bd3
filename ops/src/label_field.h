// SPDX-License-Identifier: GPL-3.0-or-later
// The stored form of Labels: one field phi per label on a coarse lattice, kept only where labels meet.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fibrolite/ops/partition.h"

namespace fibrolite {

/// Labels of the samples origin + h * (i, j, k) and how far those near a cut are from it.
struct LabelSamples {
  Vec3d origin{};
  double voxel_mm = 1;
  Vec3i size{};                      ///< Samples per axis; 2 or more.
  int count = 1;                     ///< Labels.
  double clamp_mm = 1;               ///< Beyond this no one asks how far a border is.
  std::vector<std::uint16_t> label;  ///< Per sample, x fastest.
  /// One cut seen from one sample; sorted by sample.
  struct Near {
    std::int64_t sample = 0;
    std::uint16_t a = 0, b = 0;  ///< The labels the cut parts.
    float distance_mm = 0;       ///< To the cut; 0 or more.
  };
  std::vector<Near> near;
};

/// phi_own = -min distance of the cuts that touch the own label, phi_other = min distance of the cuts that touch the
/// other, clamped; between samples trilinear, so a plane is kept exactly. label(p) = argmin phi.
[[nodiscard]] Labels make_labels(const LabelSamples& samples);

}  // namespace fibrolite
