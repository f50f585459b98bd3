// SPDX-License-Identifier: GPL-3.0-or-later
#include "self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace fibrolite {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Range = tbb::blocked_range<std::size_t>;

struct Box {
  Vec3f min{std::numeric_limits<float>::max(), std::numeric_limits<float>::max(), std::numeric_limits<float>::max()};
  Vec3f max{std::numeric_limits<float>::lowest(), std::numeric_limits<float>::lowest(),
            std::numeric_limits<float>::lowest()};

  void include(Vec3f p) {
    min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
  }
  [[nodiscard]] bool meets(const Box& b) const {
    return min.x <= b.max.x && b.min.x <= max.x && min.y <= b.max.y && b.min.y <= max.y && min.z <= b.max.z &&
           b.min.z <= max.z;
  }
};

// 21 bits spread to every third.
std::uint64_t spread(std::uint64_t x) {
  x = (x | (x << 32)) & 0x001f00000000ffffULL;
  x = (x | (x << 16)) & 0x001f0000ff0000ffULL;
  x = (x | (x << 8)) & 0x100f00f00f00f00fULL;
  x = (x | (x << 4)) & 0x10c30c30c30c30c3ULL;
  return (x | (x << 2)) & 0x1249249249249249ULL;
}

// The triangles along a Morton curve, in blocks of a few; over the blocks a full binary tree of boxes, node k above 2k
// and 2k + 1.
class BoxTree {
 public:
  static constexpr std::size_t block_size = 4;

  explicit BoxTree(const Mesh& mesh) {
    const Box3d world = bounds(mesh);
    const Vec3d size = world.size();
    const auto cell = [](double part, double whole) {
      return whole > 0 ? static_cast<std::uint64_t>(part / whole * 2097151.0) : std::uint64_t{0};
    };
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, keys.size(), [&](std::size_t t) {
      const Box box = box_of(mesh, t);
      const Vec3d p = 0.5 * (to_double(box.min) + to_double(box.max)) - world.min;
      keys[t] = {spread(cell(p.x, size.x)) | (spread(cell(p.y, size.y)) << 1) | (spread(cell(p.z, size.z)) << 2),
                 static_cast<std::uint32_t>(t)};
    });
    tbb::parallel_sort(keys.begin(), keys.end());
    for (const auto& [key, t] : keys) {
      const auto& [a, b, c] = mesh.triangles[t];
      if (!zero_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c])) order_.push_back(t);
    }
    blocks_ = (order_.size() + block_size - 1) / block_size;
    leaves_ = std::bit_ceil(std::max<std::size_t>(blocks_, 1));
    boxes_.resize(2 * leaves_);
    triangle_boxes_.resize(order_.size());
    tbb::parallel_for(std::size_t{0}, blocks_, [&](std::size_t block) {
      Box& box = boxes_[leaves_ + block];
      for (std::size_t i = begin(block); i < end(block); ++i) {
        triangle_boxes_[i] = box_of(mesh, order_[i]);
        box.include(triangle_boxes_[i].min);
        box.include(triangle_boxes_[i].max);
      }
    });
    for (std::size_t node = leaves_; node-- > 1;) {
      for (const Box& child : {boxes_[2 * node], boxes_[2 * node + 1]}) {
        if (child.min.x > child.max.x) continue;
        boxes_[node].include(child.min);
        boxes_[node].include(child.max);
      }
    }
  }

  [[nodiscard]] std::size_t blocks() const { return blocks_; }

  // Calls visit(t, u) once for every pair whose boxes meet, with t in `block` and u in it or a later one.
  template <class Visit>
  void for_pairs(std::size_t block, const Visit& visit) const {
    const Box& box = boxes_[leaves_ + block];
    std::array<std::size_t, 128> stack;
    std::size_t depth = 0;
    stack[depth++] = 1;
    while (depth > 0) {
      const std::size_t node = stack[--depth];
      if (!boxes_[node].meets(box)) continue;
      const int level = std::countl_zero(node) - std::countl_zero(leaves_);  // above the leaves
      if ((((node + 1) << level) - leaves_) <= block) continue;              // only earlier blocks below
      if (node < leaves_) {
        stack[depth++] = 2 * node;
        stack[depth++] = 2 * node + 1;
        continue;
      }
      const std::size_t other = node - leaves_;
      for (std::size_t i = begin(block); i < end(block); ++i)
        for (std::size_t j = other == block ? i + 1 : begin(other); j < end(other); ++j)
          if (triangle_boxes_[i].meets(triangle_boxes_[j])) visit(order_[i], order_[j]);
    }
  }

 private:
  static Box box_of(const Mesh& mesh, std::size_t t) {
    Box box;
    for (const std::uint32_t v : mesh.triangles[t]) box.include(mesh.vertices[v]);
    return box;
  }
  static std::size_t begin(std::size_t block) { return block * block_size; }
  [[nodiscard]] std::size_t end(std::size_t block) const { return std::min(order_.size(), (block + 1) * block_size); }

  std::size_t blocks_ = 0, leaves_ = 1;
  std::vector<std::uint32_t> order_;
  std::vector<Box> boxes_, triangle_boxes_;
};

class PairTest {
 public:
  explicit PairTest(const Mesh& mesh) : mesh_(mesh) {}

  // Do the triangles meet other than in the corners they share?
  [[nodiscard]] bool operator()(std::uint32_t t, std::uint32_t u) const {
    Mesh::Triangle a = mesh_.triangles[t], b = mesh_.triangles[u];
    std::size_t shared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto* const match = std::find(b.begin() + shared, b.end(), a[i]);
      if (match == b.end()) continue;
      // Shared corners to the front of both.
      std::swap(a[shared], a[i]);
      std::swap(b[shared], b[static_cast<std::size_t>(match - b.begin())]);
      ++shared;
    }
    const std::array<Point, 3> p{point(a[0]), point(a[1]), point(a[2])}, q{point(b[0]), point(b[1]), point(b[2])};
    switch (shared) {
      case 0:
        return meet(p, q);
      case 1:
        return meet_beyond_corner(p, q);
      case 2:
        return folded(p[0], p[1], p[2], q[2]);
      default:
        return true;
    }
  }

 private:
  using Corners = std::array<Point, 3>;

  [[nodiscard]] Point point(std::uint32_t v) const {
    const Vec3d p = to_double(mesh_.vertices[v]);
    return {p.x, p.y, p.z};
  }

  // Are the points all strictly on one side of the triangle's plane?
  static bool apart(const Corners& p, const Point& a, const Point& b, const Point& c) {
    const CGAL::Orientation side = CGAL::orientation(p[0], p[1], p[2], a);
    return side != CGAL::COPLANAR && CGAL::orientation(p[0], p[1], p[2], b) == side &&
           CGAL::orientation(p[0], p[1], p[2], c) == side;
  }

  static bool meet(const Corners& p, const Corners& q) {
    if (apart(p, q[0], q[1], q[2]) || apart(q, p[0], p[1], p[2])) return false;
    return CGAL::do_intersect(Kernel::Triangle_3(p[0], p[1], p[2]), Kernel::Triangle_3(q[0], q[1], q[2]));
  }

  // p[0] is q[0]. The triangles are cones from there: they meet elsewhere if the far side of one meets the other.
  static bool meet_beyond_corner(const Corners& p, const Corners& q) {
    if (apart(p, q[1], q[2], q[2]) || apart(q, p[1], p[2], p[2])) return false;
    return CGAL::do_intersect(Kernel::Triangle_3(p[0], p[1], p[2]), Kernel::Segment_3(q[1], q[2])) ||
           CGAL::do_intersect(Kernel::Triangle_3(q[0], q[1], q[2]), Kernel::Segment_3(p[1], p[2]));
  }

  // Two triangles on the edge a b overlap only if one lies flat on the other.
  static bool folded(const Point& a, const Point& b, const Point& c, const Point& d) {
    return CGAL::orientation(a, b, c, d) == CGAL::COPLANAR && CGAL::coplanar_orientation(a, b, c, d) == CGAL::POSITIVE;
  }

  const Mesh& mesh_;
};

}  // namespace

std::int64_t self_intersections(const Mesh& mesh, const Context& context) {
  const BoxTree tree(mesh);
  context.check();
  const PairTest meets(mesh);
  std::atomic<std::size_t> done{0};
  return tbb::parallel_reduce(
      Range(0, tree.blocks(), 256), std::int64_t{0},
      [&](const Range& range, std::int64_t count) {
        context.check();
        for (std::size_t block = range.begin(); block < range.end(); ++block)
          tree.for_pairs(block, [&](std::uint32_t t, std::uint32_t u) { count += meets(t, u) ? 1 : 0; });
        const std::size_t finished = done += range.size();
        context.progress(static_cast<double>(finished) / static_cast<double>(tree.blocks()));
        return count;
      },
      std::plus<>{});
}

}  // namespace fibrolite
