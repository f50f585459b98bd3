// SPDX-License-Identifier: Apache-2.0
#include "surface_topology.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace fibrolite {
namespace {

struct Corner {
  std::uint32_t triangle;
  int index;
};

/// Directed use of an edge: the triangle runs from the vertex to `other`, or from `other` to it.
struct Use {
  std::uint32_t other;
  bool outward;
  std::uint32_t triangle;
};

class Builder {
 public:
  Builder(const Mesh& mesh, SurfaceTopology& result) : mesh_(mesh), result_(result) {}

  void run() {
    const std::size_t n = mesh_.triangles.size();
    result_.weld = weld(mesh_.vertices);
    collect_corners();
    normals_.resize(n);
    result_.edge_normals.resize(n);
    result_.vertex_normals.resize(result_.weld.count);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 4096), [&](const auto& range) {
      for (std::size_t t = range.begin(); t < range.end(); ++t) {
        const auto triangle = static_cast<std::uint32_t>(t);
        const Vec3d a = corner(triangle, 0);
        const Vec3d normal = cross(corner(triangle, 1) - a, corner(triangle, 2) - a);
        const Mesh::Triangle& v = mesh_.triangles[t];
        const bool flat = zero_area(mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]);
        normals_[t] = flat ? Vec3d{} : normalized(normal);
      }
    });
    // One task per stretch of vertices; what each finds at the border is put together in order.
    constexpr std::size_t stretch = 4096;
    const std::size_t stretches = (result_.weld.count + stretch - 1) / stretch;
    std::vector<std::vector<SurfaceTopology::Border>> borders(stretches);
    std::vector<std::int64_t> irregular(stretches, 0);
    tbb::parallel_for(std::size_t{0}, stretches, [&](std::size_t s) {
      const std::size_t end = std::min<std::size_t>(result_.weld.count, (s + 1) * stretch);
      std::vector<Use> uses;
      for (std::size_t v = s * stretch; v < end; ++v) {
        vertex(static_cast<std::uint32_t>(v), uses, borders[s], irregular[s]);
      }
    });
    for (std::size_t s = 0; s < stretches; ++s) {
      result_.border.insert(result_.border.end(), borders[s].begin(), borders[s].end());
      result_.irregular_edges += irregular[s];
    }
  }

 private:
  [[nodiscard]] std::uint32_t id(std::uint32_t triangle, int corner) const {
    return result_.weld.id[mesh_.triangles[triangle][static_cast<std::size_t>(corner % 3)]];
  }
  [[nodiscard]] Vec3d corner(std::uint32_t triangle, int index) const {
    return to_double(mesh_.vertices[mesh_.triangles[triangle][static_cast<std::size_t>(index % 3)]]);
  }

  /// Corners sorted by welded vertex, triangles rising within each.
  void collect_corners() {
    first_.assign(result_.weld.count + 1, 0);
    for (const Mesh::Triangle& t : mesh_.triangles) {
      for (const std::uint32_t v : t) ++first_[result_.weld.id[v] + 1];
    }
    for (std::size_t v = 0; v < result_.weld.count; ++v) first_[v + 1] += first_[v];
    corners_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (int i = 0; i < 3; ++i) corners_[next[id(t, i)]++] = {t, i};
    }
  }

  /// Normals of this vertex and of the edges that run out of it.
  void vertex(std::uint32_t v, std::vector<Use>& uses, std::vector<SurfaceTopology::Border>& border,
              std::int64_t& irregular) {
    uses.clear();
    Vec3d sum{};
    std::size_t triangles = 0;
    bool regular = true;
    for (std::uint32_t c = first_[v]; c < first_[v + 1]; ++c) {
      const auto [t, i] = corners_[c];
      const std::uint32_t next = id(t, i + 1), last = id(t, i + 2);
      if (next != v) uses.push_back({next, true, t});
      if (last != v) uses.push_back({last, false, t});
      const Vec3d p = corner(t, i), a = normalized(corner(t, i + 1) - p), b = normalized(corner(t, i + 2) - p);
      sum = sum + std::atan2(norm(cross(a, b)), dot(a, b)) * normals_[t];
      ++triangles;
    }
    std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
      return a.other != b.other ? a.other < b.other : a.outward != b.outward ? a.outward : a.triangle < b.triangle;
    });
    for (std::size_t begin = 0; begin < uses.size();) {
      std::size_t end = begin;
      int net = 0;
      for (; end < uses.size() && uses[end].other == uses[begin].other; ++end) net += uses[end].outward ? 1 : -1;
      const bool pair = end - begin == 2 && net == 0 &&
                        dot(normals_[uses[begin].triangle], normals_[uses[begin].triangle]) > 0 &&
                        dot(normals_[uses[begin + 1].triangle], normals_[uses[begin + 1].triangle]) > 0;
      const Vec3d normal = pair ? normals_[uses[begin].triangle] + normals_[uses[begin + 1].triangle] : Vec3d{};
      for (std::size_t k = begin; k < end; ++k) {
        if (uses[k].outward) set_edge(uses[k].triangle, v, uses[k].other, to_float(normal));
        if (uses[k].outward && !pair) ++irregular;
      }
      if (net != 0 && v < uses[begin].other) border.push_back({point_of(v), point_of(uses[begin].other), net});
      regular = regular && pair;
      begin = end;
    }
    if (regular && triangles > 0 && single_fan(v, uses, triangles)) result_.vertex_normals[v] = to_float(sum);
  }

  void set_edge(std::uint32_t triangle, std::uint32_t from, std::uint32_t to, Vec3f normal) {
    for (int i = 0; i < 3; ++i) {
      if (id(triangle, i) == from && id(triangle, i + 1) == to) {
        result_.edge_normals[triangle][static_cast<std::size_t>(i)] = normal;
      }
    }
  }

  [[nodiscard]] Vec3d point_of(std::uint32_t v) const {
    const Corner c = corners_[first_[v]];
    return corner(c.triangle, c.index);
  }

  /// All edges are pairs (one use outward, one inward): walk from triangle to triangle and see whether the walk is back
  /// too soon.
  [[nodiscard]] bool single_fan(std::uint32_t v, const std::vector<Use>& uses, std::size_t triangles) const {
    std::uint32_t t = uses.front().triangle;
    std::size_t steps = 0;
    do {
      int i = 0;
      while (id(t, i) != v) ++i;
      const std::uint32_t last = id(t, i + 2);
      const auto use = std::lower_bound(uses.begin(), uses.end(), last,
                                        [](const Use& u, std::uint32_t other) { return u.other < other; });
      t = use->triangle;  // the outward use of the edge this triangle runs inward
      ++steps;
    } while (t != uses.front().triangle && steps <= triangles);
    return steps == triangles;
  }

  const Mesh& mesh_;
  SurfaceTopology& result_;
  std::vector<Vec3d> normals_;
  std::vector<std::uint32_t> first_;
  std::vector<Corner> corners_;
};

}  // namespace

SurfaceTopology surface_topology(const Mesh& mesh) {
  SurfaceTopology result;
  Builder(mesh, result).run();
  return result;
}

}  // namespace fibrolite
