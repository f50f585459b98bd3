// SPDX-License-Identifier: GPL-3.0-or-later
#include "models.h"

#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace fibrolite::testing {
namespace {

std::uint32_t to_index(int i) { return static_cast<std::uint32_t>(i); }

}  // namespace

Mesh cube(double side_mm, Vec3d min_corner) {
  Mesh mesh;
  // Corner i has x, y, z from its bits 0, 1, 2.
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        to_float(min_corner + side_mm * Vec3d{double(i & 1), double((i >> 1) & 1), double((i >> 2) & 1)}));
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

Mesh icosphere(double radius_mm, int subdivisions, Vec3d center) {
  const double g = std::numbers::phi;
  std::vector<Vec3d> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                               {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vec3d& p : points) p = normalized(p);
  std::vector<Mesh::Triangle> triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                           {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                           {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                           {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (is_new) points.push_back(normalized(points[a] + points[b]));
      return it->second;
    };
    std::vector<Mesh::Triangle> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  Mesh mesh;
  for (const Vec3d p : points) mesh.vertices.push_back(to_float(center + radius_mm * p));
  mesh.triangles = std::move(triangles);
  return mesh;
}

Mesh tube(double radius_mm, double length_mm, int sides, Vec3d base) {
  Mesh mesh;
  for (const double z : {0.0, length_mm})
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.push_back(to_float(base + Vec3d{radius_mm * std::cos(angle), radius_mm * std::sin(angle), z}));
    }
  const std::uint32_t n = to_index(sides), bottom = 2 * n, top = bottom + 1;
  mesh.vertices.push_back(to_float(base));
  mesh.vertices.push_back(to_float(base + Vec3d{0, 0, length_mm}));
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.insert(mesh.triangles.end(),
                          {{i, j, n + j}, {i, n + j, n + i}, {bottom, j, i}, {top, n + i, n + j}});
  }
  return mesh;
}

Mesh torus_mesh(double ring_mm, double tube_mm, int ring_sides, int tube_sides) {
  Mesh mesh;
  for (int i = 0; i < ring_sides; ++i)
    for (int j = 0; j < tube_sides; ++j) {
      const double u = 2 * std::numbers::pi * i / ring_sides, v = 2 * std::numbers::pi * j / tube_sides;
      const double r = ring_mm + tube_mm * std::cos(v);
      mesh.vertices.push_back(to_float({r * std::cos(u), r * std::sin(u), tube_mm * std::sin(v)}));
    }
  const auto at = [&](int i, int j) { return to_index((i % ring_sides) * tube_sides + j % tube_sides); };
  for (int i = 0; i < ring_sides; ++i)
    for (int j = 0; j < tube_sides; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

Mesh flipped(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

Mesh moved(Mesh mesh, Vec3d by) {
  for (Vec3f& p : mesh.vertices) p = to_float(to_double(p) + by);
  return mesh;
}

Mesh turned(Mesh mesh, int axis, int quarter_turns) {
  for (int turn = 0; turn < ((quarter_turns % 4) + 4) % 4; ++turn)
    for (Vec3f& p : mesh.vertices) {
      if (axis == 0) p = {p.x, -p.z, p.y};
      if (axis == 1) p = {p.z, p.y, -p.x};
      if (axis == 2) p = {-p.y, p.x, p.z};
    }
  return mesh;
}

Mesh joined(const Mesh& a, const Mesh& b) {
  Mesh mesh = a;
  const auto offset = static_cast<std::uint32_t>(a.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  mesh.triangle_colors.clear();
  return mesh;
}

TetMesh bricks(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz, const std::function<Vec3d(Vec3d)>& place) {
  const auto id = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) { return (x * (ny + 1) + y) * (nz + 1) + z; };
  std::vector<Vec3d> nodes;
  for (std::uint32_t x = 0; x <= nx; ++x) {
    for (std::uint32_t y = 0; y <= ny; ++y) {
      for (std::uint32_t z = 0; z <= nz; ++z) nodes.push_back(place({x / double(nx), y / double(ny), z / double(nz)}));
    }
  }
  constexpr std::array<std::array<int, 3>, 6> orders{
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  std::vector<std::array<std::uint32_t, 4>> tets;
  for (std::uint32_t x = 0; x < nx; ++x) {
    for (std::uint32_t y = 0; y < ny; ++y) {
      for (std::uint32_t z = 0; z < nz; ++z) {
        for (std::size_t k = 0; k < 6; ++k) {
          std::array<std::uint32_t, 3> at{x, y, z};
          std::array<std::uint32_t, 4> tet{id(x, y, z), 0, 0, 0};
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(orders[k][step])];
            tet[step + 1] = id(at[0], at[1], at[2]);
          }
          if (k >= 3) std::swap(tet[2], tet[3]);
          tets.push_back(tet);
        }
      }
    }
  }
  return ten_node(std::move(nodes), tets);
}

Mesh without_triangle(Mesh mesh, std::size_t index) {
  mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(index));
  mesh.triangle_colors.clear();
  return mesh;
}

std::filesystem::path asset(const std::string& name) {
  return std::filesystem::path(FIBROLITE_ASSETS) / "models" / (name + ".ply");
}

std::optional<std::filesystem::path> shared_model(const std::string& file) {
  const std::filesystem::path path = std::filesystem::path(FIBROLITE_SHARED_MODELS) / file;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
  return path;
}

TempDir::TempDir() {
  std::string name = (std::filesystem::temp_directory_path() / "fibrolite-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a temporary folder " + name);
  path_ = name;
}

TempDir::~TempDir() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace fibrolite::testing
