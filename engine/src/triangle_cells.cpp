// SPDX-License-Identifier: Apache-2.0
#include "triangle_cells.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

constexpr int size = TriangleCells::size;

/// All cells of the mesh's neighbourhood, whole nodes of 128, numbered z fastest.
struct Layout {
  std::array<std::int64_t, 3> first, count;  ///< In cells.

  [[nodiscard]] std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return static_cast<std::uint64_t>((x * count[1] + y) * count[2] + z);
  }
  [[nodiscard]] openvdb::Coord origin(std::uint64_t cell) const {
    const auto y = static_cast<std::uint64_t>(count[1]), z = static_cast<std::uint64_t>(count[2]);
    const auto sample = [&](std::size_t axis, std::uint64_t i) {
      return static_cast<int>((first[axis] + static_cast<std::int64_t>(i)) * size);
    };
    return {sample(0, cell / (y * z)), sample(1, cell / z % y), sample(2, cell % z)};
  }
};

Layout layout_for(const Box3d& box_vox, double reach_vox) {
  Layout layout{};
  for (int a = 0; a < 3; ++a) {
    const auto even_cell = [&](double x) { return static_cast<std::int64_t>(std::floor(x / size)) & ~std::int64_t{1}; };
    const auto axis = static_cast<std::size_t>(a);
    layout.first[axis] = even_cell(box_vox.min[a] - reach_vox - 1);
    layout.count[axis] = even_cell(box_vox.max[a] + reach_vox + 1) + 2 - layout.first[axis];
  }
  constexpr std::int64_t most = std::int64_t{1} << 32;
  if (layout.count[0] * layout.count[1] >= most || layout.count[0] * layout.count[1] * layout.count[2] >= most) {
    throw Error(Code::TooLarge, "the model has more voxels than can be numbered", {}, "use a larger --voxel");
  }
  return layout;
}

/// The cells within reach of a triangle's box and of its plane.
void touch_cells(const std::array<Vec3d, 3>& corners_vox, double reach_vox, const Layout& layout,
                 std::uint32_t triangle, std::vector<std::uint64_t>& pairs) {
  std::array<Vec3d, 3> p;
  Box3d box;
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = corners_vox[i] - static_cast<double>(size) * Vec3d{static_cast<double>(layout.first[0]),
                                                              static_cast<double>(layout.first[1]),
                                                              static_cast<double>(layout.first[2])};
    box.include(p[i]);
  }
  box = box.grown(reach_vox);
  const Vec3d normal = normalized(cross(p[1] - p[0], p[2] - p[0]));
  const double half = 0.5 * (size - 1);
  const double limit = reach_vox + half * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z)) + 1e-3;
  // Samples of cell i lie in [64 i, 64 i + 63].
  const auto low = [](double x) { return static_cast<std::int64_t>(std::ceil((x - (size - 1)) / size)); };
  const auto high = [](double x) { return static_cast<std::int64_t>(std::floor(x / size)); };
  const auto middle = [&](std::int64_t i) { return static_cast<double>(size * i) + half; };
  for (std::int64_t x = low(box.min.x); x <= high(box.max.x); ++x) {
    for (std::int64_t y = low(box.min.y); y <= high(box.max.y); ++y) {
      for (std::int64_t z = low(box.min.z); z <= high(box.max.z); ++z) {
        if (std::abs(dot(Vec3d{middle(x), middle(y), middle(z)} - p[0], normal)) > limit) continue;
        pairs.push_back(layout.key(x, y, z) << 32 | triangle);
      }
    }
  }
}

/// One cell per free node of 128, else one per free cell.
void add_far_cells(const Layout& layout, TriangleCells& result) {
  std::vector<bool> taken(static_cast<std::size_t>(layout.count[0] * layout.count[1] * layout.count[2]), false);
  for (const TriangleCells::Cell& cell : result.cells) taken[result.triangles[cell.first] >> 32] = true;
  for (std::int64_t x = 0; x < layout.count[0]; x += 2) {
    for (std::int64_t y = 0; y < layout.count[1]; y += 2) {
      for (std::int64_t z = 0; z < layout.count[2]; z += 2) {
        std::array<std::uint64_t, 8> keys;
        for (std::size_t k = 0; k < 8; ++k) {
          const auto i = static_cast<std::int64_t>(k);
          keys[k] = layout.key(x + (i >> 2), y + (i >> 1 & 1), z + (i & 1));
        }
        if (std::none_of(keys.begin(), keys.end(), [&](std::uint64_t key) { return taken[key]; })) {
          result.cells.push_back({layout.origin(keys[0]), 2 * size, 0, 0});
          continue;
        }
        for (const std::uint64_t key : keys) {
          if (!taken[key]) result.cells.push_back({layout.origin(key), size, 0, 0});
        }
      }
    }
  }
}

}  // namespace

TriangleCells triangle_cells(const Mesh& mesh, double voxel_mm, double reach_vox) {
  const double scale = 1 / voxel_mm;
  const auto corner = [&](std::size_t t, std::size_t i) {
    return scale * to_double(mesh.vertices[mesh.triangles[t][i]]);
  };
  const std::size_t n = mesh.triangles.size();
  Box3d box;
  for (std::size_t t = 0; t < n; ++t) {
    for (std::size_t i = 0; i < 3; ++i) box.include(corner(t, i));
  }
  const Layout layout = layout_for(box, reach_vox);

  constexpr std::size_t chunk = 8192;
  std::vector<std::vector<std::uint64_t>> parts((n + chunk - 1) / chunk);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t c) {
    for (std::size_t t = c * chunk; t < std::min(n, (c + 1) * chunk); ++t) {
      touch_cells({corner(t, 0), corner(t, 1), corner(t, 2)}, reach_vox, layout, static_cast<std::uint32_t>(t),
                  parts[c]);
    }
  });
  TriangleCells result;
  std::size_t total = 0;
  for (const auto& part : parts) total += part.size();
  result.triangles.reserve(total);
  for (auto& part : parts) {
    result.triangles.insert(result.triangles.end(), part.begin(), part.end());
    std::vector<std::uint64_t>().swap(part);
  }
  tbb::parallel_sort(result.triangles.begin(), result.triangles.end());
  for (std::size_t i = 0; i < total;) {
    std::size_t end = i;
    while (end < total && result.triangles[end] >> 32 == result.triangles[i] >> 32) ++end;
    result.cells.push_back({layout.origin(result.triangles[i] >> 32), size, i, end - i});
    i = end;
  }
  add_far_cells(layout, result);
  return result;
}

}  // namespace fibrolite
