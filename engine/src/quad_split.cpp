// SPDX-License-Identifier: Apache-2.0
#include "quad_split.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "eight_places.h"
#include "fibrolite/clones.h"
#include "quad_envelope.h"

namespace fibrolite {
namespace {

using Corners = std::array<EightPlaces, 4>;
struct Choice {
  std::array<std::int32_t, lanes> second;  ///< Is the second diagonal the shorter one?
  std::array<std::int32_t, lanes> doubt;   ///< Must this one be looked at more closely?
};

/// By rounded products, with room for the rounding: what is in no doubt is right.
[[gnu::always_inline]] inline void choose(const Corners& at, const Corners& shape, Choice& choice) {
  Doubles first_length{}, second_length{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<Doubles, 4> corner;
    for (std::size_t k = 0; k < 4; ++k) corner[k] = __builtin_convertvector(shape[k][axis], Doubles);
    const Doubles one = corner[0] - corner[2], other = corner[1] - corner[3];
    first_length += one * one;
    second_length += other * other;
  }
  const Mask second = __builtin_convertvector(first_length > second_length, Mask);

  EightPlaces u, across, v, n, m;  // from where the diagonal begins
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Lanes begin = second ? at[1][axis] : at[0][axis];
    u[axis] = (second ? at[2][axis] : at[1][axis]) - begin;
    across[axis] = (second ? at[3][axis] : at[2][axis]) - begin;
    v[axis] = (second ? at[0][axis] : at[3][axis]) - begin;
  }
  Mask clear_n, clear_m;
  cross(u, across, n, clear_n);
  cross(across, v, m, clear_m);
  Lanes cosine{}, squared_n{}, squared_m{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cosine += n[axis] * m[axis];
    squared_n += n[axis] * n[axis];
    squared_m += m[axis] * m[axis];
  }
  const Mask hardly_folds = (cosine > 0) & (cosine * cosine > 0.82F * squared_n * squared_m);
  const Mask doubt = ~(clear_n & clear_m & hardly_folds);
  std::memcpy(choice.second.data(), &second, sizeof second);
  std::memcpy(choice.doubt.data(), &doubt, sizeof doubt);
}

FIBROLITE_CLONES void choose(const Quad* quads, const QuadSplit::Vertices& vertices, Choice& choice) {
  Corners at, shape;
  const bool same = vertices.shape.data() == vertices.places.data();
  for (std::size_t k = 0; k < 4; ++k) {
    gather(quads, k, vertices.places.data(), vertices.first, at[k]);
    if (!same) gather(quads, k, vertices.shape.data(), vertices.first, shape[k]);
  }
  choose(at, same ? at : shape, choice);
}

/// Do both triangles have an area?
bool sound(const Quad& q, bool first, const QuadSplit::Vertices& vertices) {
  const auto flat = [&](std::size_t a, std::size_t b, std::size_t c) {
    return zero_area(vertices.at(q[a]), vertices.at(q[b]), vertices.at(q[c & 3]));
  };
  const std::size_t k = first ? 0 : 1;
  return !flat(k, k + 1, k + 2) && !flat(k, k + 2, k + 3);
}

}  // namespace

QuadSplit::Left QuadSplit::operator()(std::span<const Quad> quads, const Vertices& vertices,
                                      std::span<Mesh::Triangle> triangles) const {
  // In doubt: the shorter diagonal, unless only the other one is good.
  const auto first_of = [&](std::size_t number, bool shorter_is_first, Left& left) {
    const Quad& q = quads[number];
    const auto other = [&] { return sound(q, !shorter_is_first, vertices); };
    if (!sound(q, shorter_is_first, vertices)) {
      if (!other()) left.degenerate.push_back(number);
      return !shorter_is_first;
    }
    if (stand_in_) return shorter_is_first;
    std::array<Vec3d, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = to_double(vertices.at(q[k]));
    if (no_diagonal(corners, voxel_mm_, shorter_is_first)) left.astray.push_back(number);
    return wrong_diagonal(corners, voxel_mm_, shorter_is_first) && other() ? !shorter_is_first : shorter_is_first;
  };
  const auto some = [&](const tbb::blocked_range<std::size_t>& range, Left left) {
    Choice choice;
    for (std::size_t from = range.begin(); from < range.end(); from += lanes) {
      const std::size_t count = std::min(lanes, range.end() - from);
      std::array<Quad, lanes> last;
      const Quad* eight = quads.data() + from;
      if (count < lanes) {
        last.fill(*eight);
        std::copy_n(eight, count, last.begin());
        eight = last.data();
      }
      choose(eight, vertices, choice);
      for (std::size_t lane = 0; lane < count; ++lane) {
        const Quad& q = eight[lane];
        bool first = choice.second[lane] == 0;
        if (choice.doubt[lane] != 0) first = first_of(from + lane, first, left);
        triangles[2 * (from + lane)] = {q[0], q[1], first ? q[2] : q[3]};
        triangles[2 * (from + lane) + 1] = {first ? q[0] : q[1], q[2], q[3]};
      }
    }
    return left;
  };
  return tbb::parallel_reduce(tbb::blocked_range<std::size_t>(0, quads.size(), 4096), Left{}, some,
                              [](Left a, const Left& b) {
                                a.degenerate.insert(a.degenerate.end(), b.degenerate.begin(), b.degenerate.end());
                                a.astray.insert(a.astray.end(), b.astray.begin(), b.astray.end());
                                return a;
                              });
}

}  // namespace fibrolite
