// SPDX-License-Identifier: Apache-2.0
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <numeric>

#include "fibrolite/error.h"
#include "fibrolite/mesh.h"
#include "weld.h"

namespace fibrolite {
namespace {

using Range = tbb::blocked_range<std::size_t>;

// Union-find that several threads may use at once: a root only ever gets a
// smaller parent, so the smallest member of a set is its root in the end,
// whatever the order.
class Sets {
 public:
  explicit Sets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }

  std::uint32_t root(std::uint32_t a) {
    for (;;) {
      const std::uint32_t up = load(a);
      if (up == a) return a;
      const std::uint32_t upper = load(up);
      if (upper == up) return up;
      std::uint32_t expected = up;  // path halving; if another thread was
                                    // faster, its parent is as good
      std::atomic_ref(parent_[a]).compare_exchange_weak(expected, upper, std::memory_order_relaxed);
      a = upper;
    }
  }

  void join(std::uint32_t a, std::uint32_t b) {
    for (;;) {
      a = root(a);
      b = root(b);
      if (a == b) return;
      if (a < b) std::swap(a, b);
      std::uint32_t expected = a;
      if (std::atomic_ref(parent_[a]).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return;
    }
  }

 private:
  std::uint32_t load(std::uint32_t a) { return std::atomic_ref(parent_[a]).load(std::memory_order_relaxed); }
  std::vector<std::uint32_t> parent_;
};

// One end of an edge at the vertex at hand: the other vertex, the corner it
// belongs to, and whether the triangle runs away from the vertex along it.
struct Arc {
  std::uint32_t other;
  std::uint32_t corner;
  bool outward;
};

struct Tally {
  std::int64_t vertices = 0, boundary_edges = 0, nonmanifold_edges = 0, nonmanifold_vertices = 0;
  std::vector<Arc> arcs;
  std::vector<std::uint32_t> fan;
};

std::uint32_t fan_root(std::vector<std::uint32_t>& fan, std::uint32_t a) {
  while (fan[a] != a) a = fan[a] = fan[fan[a]];
  return a;
}

class Checker {
 public:
  explicit Checker(const Mesh& mesh) : mesh_(mesh), weld_(weld(mesh.vertices)) {}

  MeshCheck run() {
    MeshCheck result;
    result.triangles = static_cast<std::int64_t>(mesh_.triangles.size());
    result.volume_mm3 = signed_volume(mesh_);
    result.degenerate_triangles = collect_corners();
    Sets shells(mesh_.triangles.size());
    tbb::enumerable_thread_specific<Tally> tallies;
    tbb::parallel_for(Range(0, weld_.count, 1024), [&](const Range& range) {
      Tally& tally = tallies.local();
      for (std::size_t v = range.begin(); v < range.end(); ++v) visit(static_cast<std::uint32_t>(v), tally, shells);
    });
    for (const Tally& tally : tallies) {  // whole numbers: any order gives the same sums
      result.vertices += tally.vertices;
      result.boundary_edges += tally.boundary_edges;
      result.nonmanifold_edges += tally.nonmanifold_edges;
      result.nonmanifold_vertices += tally.nonmanifold_vertices;
    }
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      result.shells += shells.root(t) == t && !collapsed(t) ? 1 : 0;
    return result;
  }

 private:
  std::uint32_t vertex(std::uint32_t corner) const { return weld_.id[mesh_.triangles[corner / 3][corner % 3]]; }
  std::uint32_t vertex(std::uint32_t triangle, std::uint32_t i) const { return weld_.id[mesh_.triangles[triangle][i]]; }
  bool collapsed(std::uint32_t triangle) const {
    const std::uint32_t a = vertex(triangle, 0), b = vertex(triangle, 1), c = vertex(triangle, 2);
    return a == b || b == c || c == a;
  }

  // Lists the corners at each vertex (a counting sort); triangles with two
  // equal corners have no place in the topology. Returns the number of
  // degenerate triangles. The order within a list depends on the threads;
  // nothing counted does.
  std::int64_t collect_corners() {
    const std::size_t n = mesh_.triangles.size();
    first_.assign(std::size_t{weld_.count} + 1, 0);
    std::atomic<std::int64_t> degenerate{0};
    const auto for_corners = [&](const auto& use) {
      tbb::parallel_for(Range(0, n, 4096), [&](const Range& range) {
        for (std::size_t t = range.begin(); t < range.end(); ++t) {
          const auto triangle = static_cast<std::uint32_t>(t);
          if (!collapsed(triangle))
            for (std::uint32_t i = 0; i < 3; ++i) use(std::atomic_ref(first_[vertex(triangle, i)]), 3 * triangle + i);
        }
      });
    };
    tbb::parallel_for(Range(0, n, 4096), [&](const Range& range) {
      std::int64_t count = 0;
      for (std::size_t t = range.begin(); t < range.end(); ++t) {
        const auto& [a, b, c] = mesh_.triangles[t];
        count += zero_area(mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]) ? 1 : 0;
      }
      degenerate += count;
    });
    for_corners(
        [](std::atomic_ref<std::uint32_t> first, std::uint32_t) { first.fetch_add(1, std::memory_order_relaxed); });
    // Ends first; filling backwards turns them into beginnings.
    std::uint32_t sum = 0;
    for (std::uint32_t& first : first_) first = sum += first;
    corners_.resize(sum);
    for_corners([&](std::atomic_ref<std::uint32_t> first, std::uint32_t corner) {
      corners_[first.fetch_sub(1, std::memory_order_relaxed) - 1] = corner;
    });
    return degenerate;
  }

  // Judges one vertex and the edges to vertices with greater numbers, and joins
  // the triangles along those.
  void visit(std::uint32_t v, Tally& tally, Sets& shells) const {
    const std::uint32_t begin = first_[v], count = first_[v + 1] - begin;
    if (count == 0) return;
    ++tally.vertices;
    tally.arcs.clear();
    tally.fan.resize(count);
    for (std::uint32_t c = 0; c < count; ++c) {
      const std::uint32_t triangle = corners_[begin + c] / 3, i = corners_[begin + c] % 3;
      tally.arcs.push_back({vertex(triangle, (i + 1) % 3), c, true});
      tally.arcs.push_back({vertex(triangle, (i + 2) % 3), c, false});
      tally.fan[c] = c;
    }
    std::sort(tally.arcs.begin(), tally.arcs.end(), [](const Arc& a, const Arc& b) { return a.other < b.other; });
    std::uint32_t fans = count;
    for (std::size_t i = 0, j = 0; i < tally.arcs.size(); i = j) {
      std::int64_t outward = 0;
      for (j = i; j < tally.arcs.size() && tally.arcs[j].other == tally.arcs[i].other; ++j) {
        outward += tally.arcs[j].outward ? 1 : 0;
        const std::uint32_t a = fan_root(tally.fan, tally.arcs[i].corner),
                            b = fan_root(tally.fan, tally.arcs[j].corner);
        if (a != b) {
          tally.fan[b] = a;
          --fans;
        }
        if (j > i && v < tally.arcs[i].other)
          shells.join(corners_[begin + tally.arcs[i].corner] / 3, corners_[begin + tally.arcs[j].corner] / 3);
      }
      if (v > tally.arcs[i].other) continue;
      const auto triangles = static_cast<std::int64_t>(j - i);
      tally.boundary_edges += triangles == 1 ? 1 : 0;
      tally.nonmanifold_edges += triangles > 2 || (triangles == 2 && outward != 1) ? 1 : 0;
    }
    tally.nonmanifold_vertices += fans > 1 ? 1 : 0;
  }

  const Mesh& mesh_;
  Weld weld_;
  std::vector<std::uint32_t> first_, corners_;
};

}  // namespace

MeshCheck check(const Mesh& mesh) {
  if (mesh.triangles.size() > 0xffffffffu / 3)
    throw Error(Code::TooLarge, "a mesh of over 1,431,655,765 triangles cannot be checked");
  return Checker(mesh).run();
}

}  // namespace fibrolite
