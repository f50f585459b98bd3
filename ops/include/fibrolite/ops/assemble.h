// SPDX-License-Identifier: GPL-3.0-or-later
// Shell, fills and joints as one composed shape.
#pragma once

#include <vector>

#include "fibrolite/shape.h"

namespace fibrolite {

struct AssembleParams {
  double shell_mm = 1.0;    ///< Outer wall; 2 voxels or more.
  double overlap_mm = 0.3;  ///< Fills reach this far across part borders; 1 voxel or more.
};
struct FilledRegion {
  Shape region;  ///< p_i.
  Shape fill;    ///< Unclipped.
};
/// One part's fill, clipped to the part: max(fill_i, p_i - overlap).
[[nodiscard]] Shape clip(const FilledRegion& part, const AssembleParams& params);
/// The shell alone: max(b, -(b + t)), two isovalues of one distance.
[[nodiscard]] Shape shell(const Shape& body, double thickness_mm);
/// How deep a body must be told (ToSolidParams::inside_band_mm) for a shell: a hundredth of a voxel deeper than it is
/// thick, or rounding would put all that is deeper into the band about the shell's inner face.
[[nodiscard]] double depth_for_shell(double thickness_mm, double voxel_mm);
/// max(b, min(-(b + t), min_i max(fill_i, p_i - overlap), joints)). Conservative: zero set and sign are right.
/// Cost: one evaluation of b and, deeper than t/2, of the fills
/// and joints near the block. Source: ours (docs/architecture.md); the paper's Sec. 5.2 and 6 as level-set operations.
[[nodiscard]] Shape assemble(const Shape& body, const std::vector<FilledRegion>& parts,
                             const std::vector<Shape>& joints, const AssembleParams& params);

}  // namespace fibrolite
