// SPDX-License-Identifier: Apache-2.0
#include "triangle_kernel.h"

#include <cmath>
#include <limits>
#include <vector>

#define FIBROLITE_INLINE static inline __attribute__((always_inline))
// Vectors are passed only between inlined functions, so no call depends on how they are passed.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace fibrolite {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
/// Rounding of a culling bound, voxels.
constexpr float slack = 2e-4F;

}  // namespace

// The kernels exist for the plain instruction set, for AVX2, and for AVX-512, whose gain is twice the registers and
// masks. None fuses a * b + c, so all give the same bits.
namespace plain {
#include "triangle_kernel.inc"
}
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
#include "triangle_kernel.inc"
}
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw,prefer-vector-width=256")
#pragma GCC optimize("fp-contract=off")
namespace avx512 {
#include "triangle_kernel.inc"
}
#pragma GCC pop_options
#define FIBROLITE_MORE_KERNELS
#endif

namespace {

std::vector<TriangleKernels> kernels_that_run() {
  std::vector<TriangleKernels> all;
#ifdef FIBROLITE_MORE_KERNELS
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
      __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512bw") != 0)
    all.push_back({"AVX-512", avx512::nearest_to_centers, avx512::cull, avx512::distances_64});
  if (__builtin_cpu_supports("avx2") != 0)
    all.push_back({"AVX2", avx2::nearest_to_centers, avx2::cull, avx2::distances_64});
#endif
  all.push_back({"plain", plain::nearest_to_centers, plain::cull, plain::distances_64});
  return all;
}

}  // namespace

std::span<const TriangleKernels> triangle_kernels() {
  static const std::vector<TriangleKernels> all = kernels_that_run();
  return all;
}

namespace {
const TriangleKernels fastest = triangle_kernels().front();
}  // namespace

TriangleFrame make_frame(Vec3d a, Vec3d b, Vec3d c, std::uint32_t triangle) {
  std::array<Vec3d, 3> v{a, b, c};
  Vec3d normal = cross(b - a, c - a);
  const std::array<double, 3> edges{norm(b - a), norm(c - b), norm(a - c)};
  const int longest = edges[0] >= edges[1] && edges[0] >= edges[2] ? 0 : edges[1] >= edges[2] ? 1 : 2;
  const double length = edges[static_cast<std::size_t>(longest)];
  const bool flat = !(norm(normal) > 1e-12 * length * length);
  Vec3d u = length > 0
                ? (v[static_cast<std::size_t>((longest + 1) % 3)] - v[static_cast<std::size_t>(longest)]) / length
                : Vec3d{1, 0, 0};
  if (flat) {
    const Vec3d helper = std::abs(u.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    normal = cross(u, helper);
    v = {v[static_cast<std::size_t>(longest)], v[static_cast<std::size_t>((longest + 1) % 3)], {}};
  }
  normal = normalized(normal);
  const auto f = [](double x) { return static_cast<float>(x); };
  TriangleFrame t;
  t.triangle = triangle;
  t.n[0] = f(normal.x), t.n[1] = f(normal.y), t.n[2] = f(normal.z), t.h = f(-dot(normal, v[0]));
  for (std::size_t i = 0; i < 3; ++i) {
    // Without area: the longest edge three times, with outward sides that can never all be negative.
    const Vec3d from = flat ? v[0] : v[i], to = flat ? v[1] : v[(i + 1) % 3];
    const Vec3d direction = flat ? u : normalized(to - from);
    Vec3d out = cross(direction, normal);
    if (flat && i == 1) out = -out;
    const double e = dot(out, from);
    t.out[i][0] = f(out.x), t.out[i][1] = f(out.y), t.out[i][2] = f(out.z), t.e[i] = f(-e);
    t.along[i][0] = f(direction.x), t.along[i][1] = f(direction.y), t.along[i][2] = f(direction.z);
    t.before[i] = f(dot(direction, from));
    t.past[i] = f(-dot(direction, to));
  }
  return t;
}

ClosestFeature closest_feature(const TriangleFrame& t, Vec3f p) {
  const auto linear = [&](const float* v) { return v[0] * p.x + v[1] * p.y + v[2] * p.z; };
  const float h = t.h + linear(t.n);
  Vec3f offset{h * t.n[0], h * t.n[1], h * t.n[2]};
  const float e[3] = {t.e[0] + linear(t.out[0]), t.e[1] + linear(t.out[1]), t.e[2] + linear(t.out[2])};
  if (e[0] < 0 && e[1] < 0 && e[2] < 0) return {ClosestFeature::Face, 0, offset};
  float x[3];
  int best = 0;
  float best_m = infinity;
  for (int i = 0; i < 3; ++i) {
    const float a = linear(t.along[i]), before = t.before[i] - a, past = a + t.past[i];
    x[i] = past > 0 ? past : before > 0 ? -before : 0.0F;
    const float m = e[i] * e[i] + x[i] * x[i];
    if (m < best_m) {
      best_m = m;
      best = i;
    }
  }
  const float *out = t.out[best], *along = t.along[best];
  offset = {offset.x + e[best] * out[0] + x[best] * along[0], offset.y + e[best] * out[1] + x[best] * along[1],
            offset.z + e[best] * out[2] + x[best] * along[2]};
  if (x[best] > 0) return {ClosestFeature::Vertex, (best + 1) % 3, offset};
  if (x[best] < 0) return {ClosestFeature::Vertex, best, offset};
  return {ClosestFeature::Edge, best, offset};
}

void nearest_to_centers(const TriangleFrame* frames, const std::uint32_t* list, int count, const EightBoxes& boxes,
                        EightNearest& nearest) {
  fastest.nearest_to_centers(frames, list, count, boxes, nearest);
}

void cull(const TriangleFrame* frames, const std::uint32_t* list, int count, const EightBoxes& boxes,
          const EightNearest& nearest, const float reach[8], std::uint32_t* const lists[8], int counts[8]) {
  fastest.cull(frames, list, count, boxes, nearest, reach, lists, counts);
}

void distances_64(const TriangleFrame* frames, const std::uint32_t* list, int count, Vec3f corner, float d2[64],
                  std::int32_t frame[64]) {
  fastest.distances_64(frames, list, count, corner, d2, frame);
}

}  // namespace fibrolite
