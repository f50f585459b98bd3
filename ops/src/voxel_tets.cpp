// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel_tets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

/// Cubes inside, by lattice index; 0 = outside.
struct Cubes {
  Vec3i n{};
  std::vector<std::uint8_t> inside;
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(n.x) +
           static_cast<std::size_t>(x);
  }
};

Cubes sample(const Shape& shape, const Box3d& box, double edge) {
  Cubes cubes;
  const Vec3d size = box.size();
  const auto steps = [&](double length) { return std::max(1, static_cast<int>(std::ceil(length / edge))); };
  cubes.n = {steps(size.x), steps(size.y), steps(size.z)};
  std::vector<Vec3d> centres;
  for (int z = 0; z < cubes.n.z; ++z) {
    for (int y = 0; y < cubes.n.y; ++y) {
      for (int x = 0; x < cubes.n.x; ++x) centres.push_back(box.min + edge * Vec3d{x + 0.5, y + 0.5, z + 0.5});
    }
  }
  std::vector<float> values(centres.size());
  shape.evaluate(centres, values);
  cubes.inside.resize(values.size());
  std::transform(values.begin(), values.end(), cubes.inside.begin(), [](float v) { return v < 0 ? 1 : 0; });
  return cubes;
}

/// Keep the largest set of cubes joined through faces.
void keep_largest(Cubes& cubes) {
  std::vector<std::int32_t> piece(cubes.inside.size(), -1);
  std::vector<std::size_t> size;
  std::vector<Vec3i> stack;
  for (int z = 0; z < cubes.n.z; ++z) {
    for (int y = 0; y < cubes.n.y; ++y) {
      for (int x = 0; x < cubes.n.x; ++x) {
        if (cubes.inside[cubes.index(x, y, z)] == 0 || piece[cubes.index(x, y, z)] >= 0) continue;
        const auto id = static_cast<std::int32_t>(size.size());
        size.push_back(0);
        stack.push_back({x, y, z});
        piece[cubes.index(x, y, z)] = id;
        while (!stack.empty()) {
          const Vec3i at = stack.back();
          stack.pop_back();
          ++size.back();
          for (const Vec3i d : {Vec3i{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
            const Vec3i to{at.x + d.x, at.y + d.y, at.z + d.z};
            if (to.x < 0 || to.y < 0 || to.z < 0 || to.x >= cubes.n.x || to.y >= cubes.n.y || to.z >= cubes.n.z)
              continue;
            const std::size_t i = cubes.index(to.x, to.y, to.z);
            if (cubes.inside[i] == 0 || piece[i] >= 0) continue;
            piece[i] = id;
            stack.push_back(to);
          }
        }
      }
    }
  }
  if (size.empty()) {
    throw Error(Code::SolverFailed, "the body is too thin for any cube of the coarse lattice", "voxel tetrahedra");
  }
  const auto largest = static_cast<std::int32_t>(std::max_element(size.begin(), size.end()) - size.begin());
  for (std::size_t i = 0; i < piece.size(); ++i) cubes.inside[i] = piece[i] == largest ? 1 : 0;
}

}  // namespace

TetMesh voxel_tetrahedra(const Shape& shape, const Box3d& box, double volume_mm3, int cells) {
  const double edge = std::cbrt(volume_mm3 / cells);
  if (!(edge > 0)) throw Error(Code::SolverFailed, "the body has no volume", "voxel tetrahedra");
  Cubes cubes = sample(shape, box, edge);
  keep_largest(cubes);

  const Vec3i corners{cubes.n.x + 1, cubes.n.y + 1, cubes.n.z + 1};
  std::vector<std::int64_t> node(
      static_cast<std::size_t>(corners.x) * static_cast<std::size_t>(corners.y) * static_cast<std::size_t>(corners.z),
      -1);
  std::vector<Vec3d> nodes;
  std::vector<std::array<std::uint32_t, 4>> tets;
  const auto node_at = [&](int x, int y, int z) {
    auto& number =
        node[(static_cast<std::size_t>(z) * static_cast<std::size_t>(corners.y) + static_cast<std::size_t>(y)) *
                 static_cast<std::size_t>(corners.x) +
             static_cast<std::size_t>(x)];
    if (number < 0) {
      number = static_cast<std::int64_t>(nodes.size());
      nodes.push_back(box.min + edge * Vec3d{1.0 * x, 1.0 * y, 1.0 * z});
    }
    return static_cast<std::uint32_t>(number);
  };
  // One tetrahedron per order of the axes: from corner 0 step by step to the opposite one. Odd orders are mirrored.
  constexpr std::array<std::array<int, 3>, 6> orders{
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int z = 0; z < cubes.n.z; ++z) {
    for (int y = 0; y < cubes.n.y; ++y) {
      for (int x = 0; x < cubes.n.x; ++x) {
        if (cubes.inside[cubes.index(x, y, z)] == 0) continue;
        for (std::size_t k = 0; k < orders.size(); ++k) {
          std::array<int, 3> at{x, y, z};
          std::array<std::uint32_t, 4> tet{};
          tet[0] = node_at(at[0], at[1], at[2]);
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(orders[k][step])];
            tet[step + 1] = node_at(at[0], at[1], at[2]);
          }
          if (k >= 3) std::swap(tet[1], tet[2]);
          tets.push_back(tet);
        }
      }
    }
  }
  return ten_node(std::move(nodes), tets);
}

}  // namespace fibrolite
