// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/prepare.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "fibrolite/disjoint_sets.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "orient.h"

namespace fibrolite {
namespace {

std::string counted(std::int64_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

void check_positive(const std::optional<double>& value, const char* name) {
  if (value && !(*value > 0 && std::isfinite(*value)))
    throw Error(Code::BadRecipe, std::string(name) + " must be greater than 0", number_text(*value));
}

// Unused vertices do not count.
Box3d used_box(const Mesh& mesh) {
  Box3d box;
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) box.include(to_double(mesh.vertices[v]));
  return box;
}

void scale(Mesh& mesh, double factor) {
  if (factor == 1) return;
  tbb::parallel_for(std::size_t{0}, mesh.vertices.size(),
                    [&](std::size_t i) { mesh.vertices[i] = to_float(factor * to_double(mesh.vertices[i])); });
}

void drop_marked(Mesh& mesh, const std::vector<bool>& marked) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!marked[t]) mesh.triangles[kept++] = mesh.triangles[t];
  mesh.triangles.resize(kept);
}

// Triangles for which `test` holds go. Returns how many.
template <class Test>
std::int64_t drop_if(Mesh& mesh, const Test& test) {
  return static_cast<std::int64_t>(std::erase_if(mesh.triangles, test));
}

// Smallest member of each vertex's connected component.
std::vector<std::uint32_t> vertex_components(const Mesh& mesh) {
  DisjointSets sets(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  std::vector<std::uint32_t> component(sets.size());
  for (std::uint32_t v = 0; v < component.size(); ++v) component[v] = sets.root(v);
  return component;
}

struct Duplicates {
  std::int64_t copies = 0;    // triangles dropped that repeat another
  std::int64_t opposite = 0;  // triangles dropped because another one faces them exactly
};

// Triangles on the same three corners are counted with their sides. What is left over on one side stays as one
// triangle; if the sides cancel (the wall between two bodies that touch), all go, for such a pair encloses nothing. But
// a component made of nothing else is a double-sided model: it keeps one side.
Duplicates drop_duplicates(Mesh& mesh) {
  struct Entry {
    Mesh::Triangle corners;  // sorted
    std::uint32_t triangle;
    bool even;  // side: whether sorting them was an even permutation
  };
  std::vector<Entry> entries(mesh.triangles.size());
  tbb::parallel_for(std::size_t{0}, entries.size(), [&](std::size_t t) {
    auto [a, b, c] = mesh.triangles[t];
    bool even = true;
    const auto order = [&](std::uint32_t& x, std::uint32_t& y) {
      if (x <= y) return;
      std::swap(x, y);
      even = !even;
    };
    order(a, b);
    order(b, c);
    order(a, b);
    entries[t] = {{a, b, c}, static_cast<std::uint32_t>(t), even};
  });
  tbb::parallel_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.triangle < b.triangle;
  });
  std::vector<bool> dropped(mesh.triangles.size(), false);
  std::vector<std::pair<std::size_t, std::size_t>> cancelled;  // groups in `entries`
  Duplicates result;
  for (std::size_t first = 0, end = 0; first < entries.size(); first = end) {
    std::int64_t sides = 0;
    for (end = first; end < entries.size() && entries[end].corners == entries[first].corners; ++end)
      sides += entries[end].even ? 1 : -1;
    if (end - first == 1) continue;
    if (sides == 0) {
      cancelled.emplace_back(first, end);
      continue;
    }
    bool kept = false;
    for (std::size_t i = first; i < end; ++i) {
      if (!kept && entries[i].even == (sides > 0)) {
        kept = true;
        continue;
      }
      dropped[entries[i].triangle] = true;
      ++result.copies;
    }
  }
  if (result.copies == 0 && cancelled.empty()) return result;

  if (!cancelled.empty()) {
    const std::vector<std::uint32_t> component = vertex_components(mesh);
    std::vector<bool> has_other(mesh.vertices.size(), false), is_cancelled(mesh.triangles.size(), false);
    for (const auto& [first, end] : cancelled)
      for (std::size_t i = first; i < end; ++i) is_cancelled[entries[i].triangle] = true;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (!is_cancelled[t]) has_other[component[mesh.triangles[t][0]]] = true;
    for (const auto& [first, end] : cancelled) {
      const bool double_sided = !has_other[component[entries[first].corners[0]]];
      for (std::size_t i = first + (double_sided ? 1 : 0); i < end; ++i) {
        dropped[entries[i].triangle] = true;
        ++(double_sided ? result.copies : result.opposite);
      }
    }
  }
  drop_marked(mesh, dropped);
  return result;
}

// Does everything lie within 1e-6 of the model's size of one plane (or line, or point)?
bool is_flat(const Mesh& mesh) {
  const Vec3d origin = to_double(mesh.vertices[0]);
  const auto farthest = [&](const auto& distance) {
    Vec3d best = origin;
    for (const Vec3f p : mesh.vertices)
      if (distance(to_double(p)) > distance(best)) best = to_double(p);
    return best;
  };
  const Vec3d along = farthest([&](Vec3d p) { return norm(p - origin); }) - origin;
  const Vec3d axis = normalized(along);
  const auto across = [&](Vec3d p) { return cross(axis, p - origin); };
  const Vec3d normal = normalized(across(farthest([&](Vec3d p) { return norm(across(p)); })));
  const auto height = [&](Vec3d p) { return std::abs(dot(normal, p - origin)); };
  return height(farthest(height)) <= 1e-6 * norm(along);
}

void warn_about_units(Model& model) {
  const double side = bounds(model.mesh).longest_side();
  if (is_odd_size(side))
    model.warnings.push_back("the model's longest side is " + number_text(side, 4) +
                             " mm: is its unit right? Try --unit or --size");
}

/// Voxels have a least edge. And coordinates are floats: far from the origin their steps are wider than what the model
/// is made of.
void check_place(const Mesh& mesh) {
  if (mesh.triangles.empty()) return;
  constexpr double smallest_mm = 0.01;
  const Box3d box = used_box(mesh);
  if (const double side = box.longest_side(); side > 0 && side < smallest_mm)
    throw Error(Code::BadInput,
                "the model is " + number_text(side, 3) + " mm long, less than a hundredth of a millimetre", "",
                "is its unit right? Try --unit or --size");
  double farthest = 0;
  for (const Vec3d p : {box.min, box.max}) farthest = std::max({farthest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const auto at = static_cast<float>(farthest);
  const double step = std::nextafter(at, std::numeric_limits<float>::infinity()) - at;
  constexpr double steps = 4000;  // along the model: ten to the coarsest voxel chosen by itself
  if (box.longest_side() >= steps * step || !(box.longest_side() > 0)) return;
  throw Error(Code::BadInput,
              "the model is " + number_text(box.longest_side(), 3) + " mm long and lies " + number_text(farthest, 3) +
                  " mm from the origin, where coordinates are " + number_text(step, 2) + " mm apart",
              "", "move it to the origin");
}

}  // namespace

bool is_odd_size(double longest_mm) {
  constexpr double smallest_mm = 5, largest_mm = 2000;
  return longest_mm < smallest_mm || longest_mm > largest_mm;
}

Vec3d direction(Up up) {
  switch (up) {
    case Up::X:
      return {1, 0, 0};
    case Up::Y:
      return {0, 1, 0};
    case Up::Z:
      return {0, 0, 1};
    case Up::MinusX:
      return {-1, 0, 0};
    case Up::MinusY:
      return {0, -1, 0};
    case Up::MinusZ:
      break;
  }
  return {0, 0, -1};
}

Frame upright(Up up) { return up == Up::Z ? Frame{} : frame_along({}, direction(up)); }

Model prepare(const MeshFile& file, const PrepareParams& params, const Context& context) {
  check_positive(params.size_mm, "size");
  check_positive(params.unit_mm, "unit");
  Model model;
  model.repairs = file.notes;
  model.mesh.vertices = file.mesh.vertices;
  model.mesh.triangles = file.mesh.triangles;
  Mesh& mesh = model.mesh;

  double factor = params.unit_mm.value_or(file.unit_mm);
  const double longest = used_box(mesh).longest_side();
  if (params.size_mm && longest > 0) factor = *params.size_mm / longest;
  scale(mesh, factor);
  if (const double side = used_box(mesh).longest_side(); !std::isfinite(side))
    throw Error(Code::BadInput, "the model is too large to be held in mm", number_text(longest * factor, 4) + " mm",
                "give another --size or --unit");
  check_place(mesh);
  if (!file.mesh.triangle_colors.empty()) {
    model.painted = mesh;
    model.painted.triangle_colors = file.mesh.triangle_colors;
  }
  context.check();
  context.progress(0.2);

  mesh = welded(mesh);
  const std::int64_t collapsed =
      drop_if(mesh, [](const Mesh::Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  const Duplicates duplicates = drop_duplicates(mesh);
  context.check();
  context.progress(0.5);
  // Triangles with area zero but three corners still carry the orientation from one neighbour to the next, so they go
  // last.
  const Orientation orientation = orient(mesh);
  const std::int64_t flat = drop_if(mesh, [&](const Mesh::Triangle& t) {
    return zero_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  });
  mesh = welded(mesh);
  context.check();

  if (mesh.triangles.empty())
    throw Error(Code::BadInput,
                "no triangles are left: all " + std::to_string(file.mesh.triangles.size()) +
                    " have no area or cancel each other",
                "", "the model must enclose a volume");
  if (is_flat(mesh))
    throw Error(Code::BadInput, "all triangles lie in one plane", "", "the model must enclose a volume");

  const auto say = [&](std::int64_t count, const char* one, const char* many) {
    if (count > 0) model.repairs.push_back(counted(count, one, many));
  };
  say(collapsed + flat, "triangle without area dropped", "triangles without area dropped");
  say(duplicates.copies, "duplicate triangle dropped", "duplicate triangles dropped");
  say(duplicates.opposite, "triangle dropped that another faces exactly", "triangles dropped that others face exactly");
  say(orientation.turned_triangles, "triangle turned to match its neighbours",
      "triangles turned to match their neighbours");
  if (orientation.turned_inside_out) model.repairs.emplace_back("turned inside out");
  say(orientation.turned_shells, "closed shell turned outward", "closed shells turned outward");
  if (orientation.one_sided_components > 0)
    model.warnings.push_back(counted(orientation.one_sided_components, "component has", "components have") +
                             " no inside and outside that its triangles agree on");
  warn_about_units(model);
  context.progress(1);
  return model;
}

}  // namespace fibrolite
