// SPDX-License-Identifier: Apache-2.0
// Point-triangle distances for many points at a time, and the test that tells which triangles a box of points needs.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fibrolite/vec.h"

namespace fibrolite {

/// A triangle as ten linear functions of a point, made so that no subtraction of large numbers is left when it is
/// evaluated near the origin. Lengths in voxels.
///
/// The squared distance is h^2 + m, where h is the height above the plane and m the squared distance within the plane:
/// 0 if all outward edge distances e[i] are negative, else the least of e[i]^2 + x[i]^2, x the overshoot past the
/// edge's ends.
struct TriangleFrame {
  float n[3], h;                          ///< h(p) = n . p + h
  float out[3][3], e[3];                  ///< e_i(p) = out_i . p + e_i
  float along[3][3], before[3], past[3];  ///< overshoots: before_i - along_i . p and along_i . p + past_i
  std::uint32_t triangle;
};

/// Corners relative to the origin, in voxels. A triangle without area becomes its longest edge.
[[nodiscard]] TriangleFrame make_frame(Vec3d a, Vec3d b, Vec3d c, std::uint32_t triangle);

/// Where the point of a triangle closest to p lies, and the vector from there to p.
struct ClosestFeature {
  enum Kind : std::uint8_t { Face, Edge, Vertex } kind;
  int index;  ///< Edge i runs from corner i to corner i + 1.
  Vec3f offset;
};
[[nodiscard]] ClosestFeature closest_feature(const TriangleFrame& t, Vec3f p);

/// Eight boxes of sample points with the same half edge, the children of one box.
struct EightBoxes {
  float x[8], y[8], z[8];  ///< Centres.
  float half;
};
/// Squared distance of each centre to the nearest triangle of the list, and that triangle's place in `frames`.
struct EightNearest {
  float d2[8];
  std::int32_t frame[8];
};
void nearest_to_centers(const TriangleFrame* frames, const std::uint32_t* list, int count, const EightBoxes& boxes,
                        EightNearest& nearest);

/// lists[k] receives the triangles that may be nearest to some point of box k and nearer than reach[k] to it; nothing
/// for a negative reach. No other triangle is nearest to any point of the box within the reach. `nearest` must be of
/// the same list; each lists[k] has room for `count`.
void cull(const TriangleFrame* frames, const std::uint32_t* list, int count, const EightBoxes& boxes,
          const EightNearest& nearest, const float reach[8], std::uint32_t* const lists[8], int counts[8]);

/// Squared distances and nearest frames of the 4x4x4 samples from `corner` on, spacing 1; (x * 4 + y) * 4 + z.
void distances_64(const TriangleFrame* frames, const std::uint32_t* list, int count, Vec3f corner, float d2[64],
                  std::int32_t frame[64]);

/// The three of one instruction set.
struct TriangleKernels {
  const char* instructions;
  decltype(&fibrolite::nearest_to_centers) nearest_to_centers;
  decltype(&fibrolite::cull) cull;
  decltype(&fibrolite::distances_64) distances_64;
};
/// Those that the processor can run, the fastest first. All give the same bits.
[[nodiscard]] std::span<const TriangleKernels> triangle_kernels();

}  // namespace fibrolite
