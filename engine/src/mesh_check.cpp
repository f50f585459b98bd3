// SPDX-License-Identifier: Apache-2.0
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "closed_check.h"
#include "closed_fan.h"
#include "fibrolite/error.h"
#include "fibrolite/mesh.h"
#include "fibrolite/mesh_layers.h"
#include "layer_sums.h"
#include "layer_weld.h"
#include "shared_sets.h"

namespace fibrolite {
namespace {

using Range = tbb::blocked_range<std::size_t>;

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

/// Looks at the vertices of a layer when the next one is there, for then all their triangles are. A vertex at the place
/// of one in the next layer counts as that one.
class Checker {
 public:
  void add(const MeshLayer& layer) {
    if (layer.triangles.size() > 0xffffffffu / 4)
      throw Error(Code::TooLarge, "a mesh of over 1,073,741,823 triangles cannot be checked");
    weld_.next(layer);
    if (!begun_ && !weld_.box.empty()) {
      from_ = weld_.box.center();
      begun_ = true;
    }
    result_.triangles += static_cast<std::int64_t>(layer.triangles.size());
    const LayerSums sums = sums_of(layer, from_);
    result_.volume_mm3 += sums.volume_mm3;
    result_.degenerate_triangles += sums.degenerate;
    names_ = name_vertices(layer);
    append(layer);
    end_ = layer.first + layer.before;
    if (first_ < end_) {
      visit_all();
      keep_open();
    }
    triangles_.insert(triangles_.end(), next_.begin(), next_.end());
    next_.clear();
    names_.erase(names_.begin(), names_.begin() + static_cast<std::ptrdiff_t>(layer.before));
    first_ = end_;
    end_ = layer.first + layer.vertices.size();
  }

  MeshCheck finish() {
    visit_all();
    first_ = end_;
    keep_open();
    return result_;
  }

 private:
  /// Corners by the numbers of welded vertices.
  struct Triangle {
    std::array<std::uint32_t, 3> corners;
    std::uint32_t shell;  // those with one number are connected already
  };

  /// Numbers of a layer's vertices after welding: the first of those in one place, in the newer layer if there are any.
  /// What is open already gets them too.
  std::vector<std::uint32_t> name_vertices(const MeshLayer& layer) {
    std::vector<std::uint32_t> id = std::move(names_);
    const std::vector<std::uint32_t>& own = weld_.own;
    id.resize(layer.vertices.size());
    const auto fresh = static_cast<std::uint32_t>(layer.first + layer.before);
    tbb::parallel_for(Range(0, own.size(), 4096), [&](const Range& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) id[layer.before + i] = fresh + own[i];
    });
    if (weld_.across.empty()) return id;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> newer;
    for (const auto& [before, now] : weld_.across) newer.emplace_back(id[before], id[layer.before + now]);
    std::sort(newer.begin(), newer.end());
    for (std::size_t i = 0; i < layer.before; ++i) {
      const auto at = std::lower_bound(newer.begin(), newer.end(), std::pair{id[i], std::uint32_t{0}});
      if (at != newer.end() && at->first == id[i]) id[i] = at->second;
    }
    for (Triangle& t : triangles_)
      for (std::uint32_t& v : t.corners)
        if (v >= layer.first) v = id[v - layer.first];
    return id;
  }

  /// A layer's triangles, but those with two equal corners, which have no place in the topology: to visit now, if a
  /// vertex of the layer before is among their corners, or next.
  void append(const MeshLayer& layer) {
    const std::size_t fresh = layer.first + layer.before;
    next_.reserve(layer.triangles.size());
    for (const auto& [a, b, c] : layer.triangles) {
      const Triangle mine{{names_[a - layer.first], names_[b - layer.first], names_[c - layer.first]}, no_shell};
      if (is_collapsed(mine)) continue;
      (std::min({mine.corners[0], mine.corners[1], mine.corners[2]}) < fresh ? triangles_ : next_).push_back(mine);
    }
  }
  static bool is_collapsed(const Triangle& t) {
    const auto& [a, b, c] = t.corners;
    return a == b || b == c || c == a;
  }

  /// All vertices from first_ to end_, whose triangles are all there.
  void visit_all() {
    collect_corners();
    sets_ = SharedSets(std::bit_ceil(triangles_.size() + 1));
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) sets_.start(t);
    join_shells();
    tbb::enumerable_thread_specific<Tally> tallies;
    tbb::parallel_for(Range(first_, end_, 1024), [&](const Range& range) {
      Tally& tally = tallies.local();
      for (std::size_t v = range.begin(); v < range.end(); ++v) visit(static_cast<std::uint32_t>(v), tally);
    });
    for (const Tally& tally : tallies) {  // whole numbers: any order gives the same sums
      result_.vertices += tally.vertices;
      result_.boundary_edges += tally.boundary_edges;
      result_.nonmanifold_edges += tally.nonmanifold_edges;
      result_.nonmanifold_vertices += tally.nonmanifold_vertices;
    }
  }

  /// Triangles that are connected already: those with a shell come first.
  void join_shells() {
    std::vector<std::uint32_t> of_shell(shell_count_, no_shell);
    for (std::uint32_t t = 0; t < triangles_.size() && triangles_[t].shell != no_shell; ++t) {
      std::uint32_t& one = of_shell[triangles_[t].shell];
      if (one == no_shell) one = t;
      sets_.join(one, t);
    }
  }

  /// Triangles with a vertex that has not been visited stay; shells without any are whole.
  void keep_open() {
    const auto open = [this](const Triangle& t) {
      return std::any_of(t.corners.begin(), t.corners.end(), [this](std::uint32_t v) { return v >= end_; });
    };
    std::vector<std::uint32_t> number(triangles_.size(), no_shell);
    shell_count_ = 0;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      if (!open(triangles_[t])) continue;
      std::uint32_t& shell = number[sets_.root(t)];
      if (shell == no_shell) shell = shell_count_++;
    }
    std::size_t kept = 0;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      result_.shells += sets_.is_root(t) && number[t] == no_shell ? 1 : 0;
      if (!open(triangles_[t])) continue;
      triangles_[kept] = triangles_[t];
      triangles_[kept++].shell = number[sets_.root(t)];
    }
    triangles_.resize(kept);
  }

  // Lists the corners at each vertex to visit (a counting sort). Each thread has its share of the vertices, and goes
  // through the chunks of triangles that touch it: that is less than what it costs to share the counters.
  void collect_corners() {
    const std::size_t vertices = end_ - first_,
                      shares = 4 * std::clamp<std::size_t>(
                                       static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()), 1, 8);
    constexpr std::size_t chunk_size = 2048;
    const std::size_t chunks = (triangles_.size() + chunk_size - 1) / chunk_size;
    const auto chunk_end = [&](std::size_t chunk) { return std::min(triangles_.size(), (chunk + 1) * chunk_size); };
    std::vector<std::pair<std::size_t, std::size_t>> touched(chunks);  // least and greatest vertex
    tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
      std::uint32_t low = none, high = 0;
      for (std::size_t t = chunk * chunk_size; t < chunk_end(chunk); ++t) {
        for (const std::uint32_t v : triangles_[t].corners) {
          low = std::min(low, v);
          high = std::max(high, v);
        }
      }
      touched[chunk] = {low, high};
    });
    starts_.assign(vertices + 1, 0);
    const auto for_corners = [&](const auto& use) {
      tbb::parallel_for(std::size_t{0}, shares, [&](std::size_t share) {
        const std::size_t low = first_ + share * vertices / shares, high = first_ + (share + 1) * vertices / shares;
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
          if (touched[chunk].first >= high || touched[chunk].second < low) continue;
          for (std::size_t t = chunk * chunk_size; t < chunk_end(chunk); ++t) {
            for (std::uint32_t i = 0; i < 3; ++i) {
              const std::uint32_t v = triangles_[t].corners[i];
              if (v - low < high - low) use(starts_[v - first_], 4 * static_cast<std::uint32_t>(t) + i);
            }
          }
        }
      });
    };
    for_corners([](std::uint32_t& start, std::uint32_t) { ++start; });
    // Ends first; filling backwards turns them into beginnings.
    std::uint32_t sum = 0;
    for (std::uint32_t& start : starts_) start = sum += start;
    corners_.resize(sum);
    for_corners([&](std::uint32_t& start, std::uint32_t corner) { corners_[--start] = corner; });
  }

  /// Nearly every vertex: its triangles follow each other around it once, each edge in both directions.
  template <std::uint32_t most>
  [[nodiscard]] bool closed_fan(std::uint32_t begin, std::uint32_t count) const {
    if (count < 3 || count > most) return false;
    Fan<most> fan;
    fan.clear();
    for (std::uint32_t c = 0; c < count; ++c) {
      const std::uint32_t i = corners_[begin + c] & 3;
      const auto& corners = triangles_[corners_[begin + c] >> 2].corners;
      fan.put(c, corners[i == 2 ? 0 : i + 1], corners[i == 0 ? 2 : i - 1]);
    }
    return is_closed(fan, count);
  }

  // Judges one vertex and the edges to vertices with greater numbers, and joins
  // the triangles along those.
  void visit(std::uint32_t v, Tally& tally) {
    const std::uint32_t begin = starts_[v - first_], count = starts_[v - first_ + 1] - begin;
    if (count == 0) return;
    ++tally.vertices;
    if (count <= 8 ? closed_fan<8>(begin, count) : closed_fan<16>(begin, count)) {
      for (std::uint32_t c = 1; c < count; ++c) sets_.join(corners_[begin] >> 2, corners_[begin + c] >> 2);
      return;
    }
    tally.arcs.clear();
    tally.fan.resize(count);
    for (std::uint32_t c = 0; c < count; ++c) {
      const std::uint32_t triangle = corners_[begin + c] >> 2, i = corners_[begin + c] & 3;
      tally.arcs.push_back({triangles_[triangle].corners[(i + 1) % 3], c, true});
      tally.arcs.push_back({triangles_[triangle].corners[(i + 2) % 3], c, false});
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
          sets_.join(corners_[begin + tally.arcs[i].corner] >> 2, corners_[begin + tally.arcs[j].corner] >> 2);
      }
      if (v > tally.arcs[i].other) continue;
      const auto triangles = static_cast<std::int64_t>(j - i);
      tally.boundary_edges += triangles == 1 ? 1 : 0;
      tally.nonmanifold_edges += triangles > 2 || (triangles == 2 && outward != 1) ? 1 : 0;
    }
    tally.nonmanifold_vertices += fans > 1 ? 1 : 0;
  }

  static constexpr std::uint32_t none = 0xffffffff, no_shell = none;
  MeshCheck result_;
  LayerWeld weld_;
  Vec3d from_{};
  bool begun_ = false;
  std::vector<std::uint32_t> names_;  // of the last layer's vertices
  std::vector<Triangle> triangles_;   // with a vertex to visit
  std::vector<Triangle> next_;        // without
  SharedSets sets_{0};                // of triangles
  std::uint32_t shell_count_ = 0;
  std::size_t first_ = 0, end_ = 0;              // vertices to visit
  std::vector<std::uint32_t> starts_, corners_;  // a corner: four times its triangle, and which of it
};

}  // namespace

MeshCheck check(const MeshLayers& layers, const Context& context) {
  // Nearly always nothing is wrong, and what is found out then costs less.
  if (const std::optional<MeshCheck> sound = check_closed(layers, context)) return *sound;
  Checker checker;
  layers.each([&](const MeshLayer& layer) { checker.add(layer); }, context);
  return checker.finish();
}

MeshCheck check(const Mesh& mesh) { return check(WholeMesh(mesh)); }

}  // namespace fibrolite
