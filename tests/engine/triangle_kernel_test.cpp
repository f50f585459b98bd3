// SPDX-License-Identifier: GPL-3.0-or-later
#include "triangle_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <vector>

#include "fibrolite/random.h"

namespace fibrolite {
namespace {

/// Triangles around the origin, some of them slivers and some without area, and their frames.
struct Soup {
  std::vector<std::array<Vec3d, 3>> triangles;
  std::vector<TriangleFrame> frames;
  std::vector<std::uint32_t> list;

  explicit Soup(std::uint64_t seed, std::size_t count = 40) {
    Random random(seed, "soup");
    const auto within = [&](double size) {
      const auto one = [&] { return size * (random.uniform() - 0.5); };
      return Vec3d{one(), one(), one()};
    };
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d a = within(16), b = a + within(6);
      const Vec3d c = i % 5 == 0 ? a + 0.3 * (b - a) : i % 5 == 1 ? a + 0.5 * (b - a) + within(1e-3) : a + within(6);
      triangles.push_back({a, b, c});
      frames.push_back(make_frame(a, b, c, static_cast<std::uint32_t>(i)));
    }
    list.resize(count);
    std::iota(list.begin(), list.end(), 0U);
  }
  [[nodiscard]] int size() const { return static_cast<int>(list.size()); }
};

/// By its edges and its inside, in double precision.
double distance(const std::array<Vec3d, 3>& t, Vec3d p) {
  double least = INFINITY;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d a = t[i], u = t[(i + 1) % 3] - a;
    const double s = dot(u, u) > 0 ? std::clamp(dot(p - a, u) / dot(u, u), 0.0, 1.0) : 0;
    least = std::min(least, norm(p - a - s * u));
  }
  const Vec3d n = cross(t[1] - t[0], t[2] - t[0]);
  if (norm(n) < 1e-9) return least;
  bool above = true;
  for (std::size_t i = 0; i < 3; ++i) above = above && dot(cross(t[(i + 1) % 3] - t[i], p - t[i]), n) >= 0;
  return above ? std::min(least, std::abs(dot(p - t[0], n)) / norm(n)) : least;
}

struct Sixty4 {
  std::array<float, 64> d2;
  std::array<std::int32_t, 64> frame;
};
Sixty4 distances(const TriangleKernels& kernels, const Soup& soup, Vec3f corner) {
  Sixty4 all;
  kernels.distances_64(soup.frames.data(), soup.list.data(), soup.size(), corner, all.d2.data(), all.frame.data());
  return all;
}

EightBoxes boxes_around(Vec3f middle, float half) {
  EightBoxes boxes;
  for (std::size_t k = 0; k < 8; ++k) {
    boxes.x[k] = middle.x + ((k & 4U) != 0 ? half : -half);
    boxes.y[k] = middle.y + ((k & 2U) != 0 ? half : -half);
    boxes.z[k] = middle.z + ((k & 1U) != 0 ? half : -half);
  }
  boxes.half = half;
  return boxes;
}
struct Culled {
  EightNearest nearest;
  std::array<std::vector<std::uint32_t>, 8> lists;
};
Culled culled(const TriangleKernels& kernels, const Soup& soup, const EightBoxes& boxes, float reach) {
  Culled result;
  kernels.nearest_to_centers(soup.frames.data(), soup.list.data(), soup.size(), boxes, result.nearest);
  std::array<std::uint32_t*, 8> lists;
  std::array<int, 8> counts;
  std::array<float, 8> reaches;
  reaches.fill(reach);
  for (std::size_t k = 0; k < 8; ++k) {
    result.lists[k].resize(soup.list.size());
    lists[k] = result.lists[k].data();
  }
  kernels.cull(soup.frames.data(), soup.list.data(), soup.size(), boxes, result.nearest, reaches.data(), lists.data(),
               counts.data());
  for (std::size_t k = 0; k < 8; ++k) result.lists[k].resize(static_cast<std::size_t>(counts[k]));
  return result;
}

constexpr int soups = 50;

TEST(TriangleKernels, give_the_distance_by_brute_force) {
  for (const TriangleKernels& kernels : triangle_kernels()) {
    for (int seed = 0; seed < soups; ++seed) {
      const Soup soup(static_cast<std::uint64_t>(seed));
      const Sixty4 all = distances(kernels, soup, {-1.5F, -1.5F, -1.5F});
      for (std::size_t i = 0; i < 64; ++i) {
        const Vec3d p{static_cast<double>(i / 16) - 1.5, static_cast<double>(i / 4 % 4) - 1.5,
                      static_cast<double>(i % 4) - 1.5};
        double least = INFINITY;
        for (const auto& t : soup.triangles) least = std::min(least, distance(t, p));
        EXPECT_NEAR(std::sqrt(all.d2[i]), least, 1e-3) << kernels.instructions << ", soup " << seed;
        EXPECT_NEAR(distance(soup.triangles[static_cast<std::size_t>(all.frame[i])], p), least, 1e-3);
      }
    }
  }
}

TEST(TriangleKernels, give_the_same_bits_on_every_instruction_set) {
  const TriangleKernels& plain = triangle_kernels().back();
  EXPECT_STREQ(plain.instructions, "plain");
  for (const TriangleKernels& kernels : triangle_kernels()) {
    for (int seed = 0; seed < soups; ++seed) {
      const Soup soup(static_cast<std::uint64_t>(seed));
      const Vec3f corner{-1.3F, -1.7F, 0.4F};
      const Sixty4 mine = distances(kernels, soup, corner), other = distances(plain, soup, corner);
      EXPECT_EQ(std::memcmp(&mine, &other, sizeof mine), 0) << kernels.instructions << ", soup " << seed;
      const EightBoxes boxes = boxes_around({0.2F, 0.7F, -0.6F}, 2);
      const Culled some = culled(kernels, soup, boxes, 4), same = culled(plain, soup, boxes, 4);
      EXPECT_EQ(std::memcmp(&some.nearest, &same.nearest, sizeof some.nearest), 0) << kernels.instructions;
      EXPECT_EQ(some.lists, same.lists) << kernels.instructions << ", soup " << seed;
    }
  }
}

/// What is nearest to any point of a box stays in its list; and lists get shorter.
TEST(TriangleKernels, drop_no_triangle_that_is_nearest_anywhere) {
  std::size_t kept = 0, all = 0;
  for (const TriangleKernels& kernels : triangle_kernels()) {
    for (int seed = 0; seed < soups; ++seed) {
      const Soup soup(static_cast<std::uint64_t>(seed));
      const EightBoxes boxes = boxes_around({0.2F, 0.7F, -0.6F}, 1);
      const Culled lists = culled(kernels, soup, boxes, 100);
      Random random(static_cast<std::uint64_t>(seed), "points");
      for (std::size_t k = 0; k < 8; ++k) {
        all += soup.list.size();
        kept += lists.lists[k].size();
        for (int n = 0; n < 40; ++n) {
          const auto along = [&](float centre) { return static_cast<double>(centre) + 2 * random.uniform() - 1; };
          const Vec3d p{along(boxes.x[k]), along(boxes.y[k]), along(boxes.z[k])};
          const auto least_of = [&](const std::vector<std::uint32_t>& list) {
            double least = INFINITY;
            for (const std::uint32_t i : list) least = std::min(least, distance(soup.triangles[i], p));
            return least;
          };
          EXPECT_NEAR(least_of(lists.lists[k]), least_of(soup.list), 1e-9) << kernels.instructions;
        }
      }
    }
  }
  EXPECT_LT(kept, all / 2);
}

/// A triangle beyond the reach is in no list, one within it in that of its box.
TEST(TriangleKernels, keep_to_the_reach) {
  for (const TriangleKernels& kernels : triangle_kernels()) {
    Soup soup(1, 0);
    soup.frames.push_back(make_frame({10, 0, 0}, {10, 1, 0}, {10, 0, 1}, 0));
    soup.list = {0};
    const EightBoxes boxes = boxes_around({0, 0, 0}, 1);  // the upper ones end at x = 2
    for (const float reach : {7.9F, 8.1F, 9.9F, 10.1F}) {
      const Culled lists = culled(kernels, soup, boxes, reach);
      EXPECT_EQ(lists.lists[4].size(), reach > 8 ? 1U : 0U) << kernels.instructions << ", reach " << reach;
      EXPECT_EQ(lists.lists[0].size(), reach > 10 ? 1U : 0U) << kernels.instructions << ", reach " << reach;
    }
  }
}

}  // namespace
}  // namespace fibrolite
