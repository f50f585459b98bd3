// SPDX-License-Identifier: GPL-3.0-or-later
#include "orient.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace fibrolite {
namespace {

constexpr std::uint32_t none = 0xffffffff;

void turn(Mesh::Triangle& t) { std::swap(t[1], t[2]); }

Vec3d corner(const Mesh& mesh, std::size_t triangle, std::size_t i) {
  return to_double(mesh.vertices[mesh.triangles[triangle][i]]);
}

// The triangle across each edge of each triangle, if the edge has exactly two; and whether the two run along it the
// same way, which is wrong.
struct Neighbours {
  struct Across {
    std::uint32_t triangle = none;
    bool same_way = false;
  };
  std::vector<std::array<Across, 3>> of;

  explicit Neighbours(const Mesh& mesh) : of(mesh.triangles.size()) {
    struct Side {
      std::uint64_t edge;
      std::uint32_t triangle;
      std::uint8_t i;
      bool up;
    };
    std::vector<Side> sides(3 * mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t t) {
      for (std::uint8_t i = 0; i < 3; ++i) {
        const std::uint64_t a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
        sides[3 * t + i] = {(std::min(a, b) << 32) | std::max(a, b), static_cast<std::uint32_t>(t), i, a < b};
      }
    });
    tbb::parallel_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
    });
    for (std::size_t first = 0, end = 0; first < sides.size(); first = end) {
      for (end = first + 1; end < sides.size() && sides[end].edge == sides[first].edge; ++end) {
      }
      if (end - first != 2) continue;
      const Side &a = sides[first], &b = sides[first + 1];
      of[a.triangle][a.i] = {b.triangle, a.up == b.up};
      of[b.triangle][b.i] = {a.triangle, a.up == b.up};
    }
  }
};

struct Component {
  std::vector<std::uint32_t> triangles;
  bool one_sided = false, closed = true;
  std::int64_t wrong_edges = 0;
};

// Spreads the side of the first triangle over its component; `turned` says which triangles face the other way.
Component spread(const Neighbours& neighbours, std::uint32_t seed, std::vector<bool>& seen, std::vector<bool>& turned) {
  Component component;
  component.triangles.push_back(seed);
  seen[seed] = true;
  for (std::size_t next = 0; next < component.triangles.size(); ++next) {
    const std::uint32_t t = component.triangles[next];
    for (const auto& across : neighbours.of[t]) {
      if (across.triangle == none) {
        component.closed = false;
        continue;
      }
      component.wrong_edges += across.same_way ? 1 : 0;
      const bool wanted = turned[t] != across.same_way;
      if (!seen[across.triangle]) {
        seen[across.triangle] = true;
        turned[across.triangle] = wanted;
        component.triangles.push_back(across.triangle);
      } else if (turned[across.triangle] != wanted) {
        component.one_sided = true;
      }
    }
  }
  return component;
}

// Turns the smaller share of the area; on a tie the triangles that differ from the first one.
std::int64_t make_consistent(Mesh& mesh, const Component& component, const std::vector<bool>& turned) {
  double kept_area = 0, turned_area = 0;
  for (const std::uint32_t t : component.triangles) {
    const Vec3d a = corner(mesh, t, 0);
    (turned[t] ? turned_area : kept_area) += norm(cross(corner(mesh, t, 1) - a, corner(mesh, t, 2) - a));
  }
  const bool side = turned_area <= kept_area;
  std::int64_t count = 0;
  for (const std::uint32_t t : component.triangles) {
    if (turned[t] != side) continue;
    turn(mesh.triangles[t]);
    ++count;
  }
  return count;
}

struct Shell {
  const Component* component;
  Box3d box;
  double volume = 0;  // signed; measured from the middle of its own box, so that small shells far away are right too
};

Shell measure(const Mesh& mesh, const Component& component) {
  Shell shell{&component, {}, 0};
  for (const std::uint32_t t : component.triangles)
    for (std::size_t i = 0; i < 3; ++i) shell.box.include(corner(mesh, t, i));
  const Vec3d middle = shell.box.center();
  for (const std::uint32_t t : component.triangles)
    shell.volume +=
        dot(corner(mesh, t, 0) - middle, cross(corner(mesh, t, 1) - middle, corner(mesh, t, 2) - middle)) / 6;
  return shell;
}

// By boxes: a shell that only might lie in another is left alone.
bool may_lie_in(const Shell& inner, const Shell& outer) {
  return inner.component != outer.component && outer.box.contains(inner.box.min) && outer.box.contains(inner.box.max);
}

}  // namespace

Orientation orient(Mesh& mesh) {
  Orientation result;
  const Neighbours neighbours(mesh);
  const std::size_t n = mesh.triangles.size();
  std::vector<bool> seen(n, false), turned(n, false);
  std::vector<Component> components;
  for (std::uint32_t t = 0; t < n; ++t)
    if (!seen[t]) components.push_back(spread(neighbours, t, seen, turned));
  for (const Component& component : components) {
    if (component.one_sided)
      ++result.one_sided_components;
    else if (component.wrong_edges > 0)
      result.turned_triangles += make_consistent(mesh, component, turned);
  }

  if (signed_volume(mesh) < 0) {
    for (auto& t : mesh.triangles) turn(t);
    result.turned_inside_out = true;
  }
  if (components.size() == 1) return result;
  std::vector<Shell> shells;
  for (const Component& component : components) shells.push_back(measure(mesh, component));
  for (const Shell& shell : shells) {
    if (!shell.component->closed || shell.component->one_sided || shell.volume >= 0) continue;
    if (std::any_of(shells.begin(), shells.end(), [&](const Shell& other) { return may_lie_in(shell, other); }))
      continue;
    for (const std::uint32_t t : shell.component->triangles) turn(mesh.triangles[t]);
    ++result.turned_shells;
  }
  return result;
}

}  // namespace fibrolite
