// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/winding.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/random.h"

namespace fibrolite {
namespace {

constexpr std::uint32_t leaf_size = 4;
/// A cluster is seen through its expansion from beyond this many radii.
constexpr double far_radii = 2.0;

struct Corners {
  Vec3f a, b, c;
};

/// Nodes lie in depth-first order. All leaves but the last of a subtree are full, so the left child follows its parent
/// and the right child's place follows from the number of triangles.
struct Node {
  Vec3f lo, hi;
  std::uint32_t first, count;
};

constexpr std::uint32_t left_count(std::uint32_t count) {
  const std::uint32_t leaves = (count + leaf_size - 1) / leaf_size;
  return (leaves + 1) / 2 * leaf_size;
}
constexpr std::uint32_t node_count(std::uint32_t count) { return 2 * ((count + leaf_size - 1) / leaf_size) - 1; }

/// The far field of a cluster up to second order about its centre: the area vector, the quadratic form
/// of the first moments, and what the second moments come to after contraction.
struct Moments {
  float cx, cy, cz, radius2;
  float nx, ny, nz;
  float xx, yy, zz, xy, xz, yz;
  float tx, ty, tz;
  float xxx, yyy, zzz, xxy, xxz, xyy, yyz, xzz, yzz, xyz;
};

Vec3d area_vector(const Corners& t) {
  const Vec3d a = to_double(t.a);
  return 0.5 * cross(to_double(t.b) - a, to_double(t.c) - a);
}

Moments moments(const Corners* begin, const Corners* end) {
  Vec3d center{}, middle{};
  double area = 0;
  for (const Corners* t = begin; t < end; ++t) {
    const Vec3d centroid = (to_double(t->a) + to_double(t->b) + to_double(t->c)) / 3.0;
    const double weight = norm(area_vector(*t));
    center = center + weight * centroid;
    middle = middle + centroid;
    area += weight;
  }
  center = area > 0 ? center / area : middle / static_cast<double>(end - begin);
  double radius2 = 0, first[3][3] = {}, second[3][3][3] = {};  // [i] normal, [j][k] position
  Vec3d sum{};
  for (const Corners* t = begin; t < end; ++t) {
    const Vec3d n = area_vector(*t);
    const std::array<Vec3d, 3> v{to_double(t->a) - center, to_double(t->b) - center, to_double(t->c) - center};
    const Vec3d s = v[0] + v[1] + v[2];
    for (const Vec3d& p : v) radius2 = std::max(radius2, dot(p, p));
    sum = sum + n;
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) first[i][j] += n[i] * s[j] / 3;
      for (int k = 0; k < 3; ++k) {
        const double m = (v[0][j] * v[0][k] + v[1][j] * v[1][k] + v[2][j] * v[2][k] + s[j] * s[k]) / 12;
        for (int i = 0; i < 3; ++i) second[i][j][k] += n[i] * m;
      }
    }
  }
  const auto f = [](double x) { return static_cast<float>(x); };
  const auto cubic = [&](int i, int j, int k) {  // all orders of one monomial
    if (i == j && j == k) return f(second[i][i][i]);
    if (i == j || j == k || i == k) {
      const int twice = i == j || i == k ? i : j, once = i == j ? k : i == k ? j : i;
      return f(second[once][twice][twice] + 2 * second[twice][twice][once]);
    }
    return f(2 * (second[0][1][2] + second[1][0][2] + second[2][0][1]));
  };
  const auto contracted = [&](int j) {
    double t = 0;
    for (int i = 0; i < 3; ++i) t += second[j][i][i] + 2 * second[i][i][j];
    return f(t);
  };
  return {f(center.x),
          f(center.y),
          f(center.z),
          f(radius2 * (1 + 1e-6)),
          f(sum.x),
          f(sum.y),
          f(sum.z),
          f(first[0][0]),
          f(first[1][1]),
          f(first[2][2]),
          f(first[0][1] + first[1][0]),
          f(first[0][2] + first[2][0]),
          f(first[1][2] + first[2][1]),
          contracted(0),
          contracted(1),
          contracted(2),
          cubic(0, 0, 0),
          cubic(1, 1, 1),
          cubic(2, 2, 2),
          cubic(0, 0, 1),
          cubic(0, 0, 2),
          cubic(0, 1, 1),
          cubic(1, 1, 2),
          cubic(0, 2, 2),
          cubic(1, 2, 2),
          cubic(0, 1, 2)};
}

/// 4 pi times the winding number of a cluster at distance r from its centre (r points from the query to the centre).
double far_field(const Moments& m, Vec3d r, double r2) {
  const double i1 = 1 / std::sqrt(r2), i2 = i1 * i1, i3 = i1 * i2, i5 = i3 * i2;
  const double zeroth = m.nx * r.x + m.ny * r.y + m.nz * r.z;
  const double trace = static_cast<double>(m.xx) + m.yy + m.zz;
  const double x2 = r.x * r.x, y2 = r.y * r.y, z2 = r.z * r.z;
  const double quadric = m.xx * x2 + m.yy * y2 + m.zz * z2 + m.xy * r.x * r.y + m.xz * r.x * r.z + m.yz * r.y * r.z;
  const double linear = m.tx * r.x + m.ty * r.y + m.tz * r.z;
  const double cubic = r.x * (m.xxx * x2 + m.xxy * r.x * r.y + m.xxz * r.x * r.z + m.xyy * y2 + m.xzz * z2) +
                       r.y * (m.yyy * y2 + m.yyz * r.y * r.z + m.yzz * z2) + m.zzz * z2 * r.z + m.xyz * r.x * r.y * r.z;
  return zeroth * i3 + trace * i3 - 3 * quadric * i5 - 1.5 * linear * i5 + 7.5 * cubic * i5 * i2;
}

/// Van Oosterom and Strackee 1983.
double solid_angle(const Corners& t, Vec3d p) {
  const Vec3d a = to_double(t.a) - p, b = to_double(t.b) - p, c = to_double(t.c) - p;
  const double la = norm(a), lb = norm(b), lc = norm(c);
  const double above = dot(a, cross(b, c));
  const double below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  return above == 0 && below >= 0 ? 0 : 2 * std::atan2(above, below);
}

double distance2_to_box(const Node& node, Vec3d p) {
  const double x = std::max({node.lo.x - p.x, 0.0, p.x - node.hi.x});
  const double y = std::max({node.lo.y - p.y, 0.0, p.y - node.hi.y});
  const double z = std::max({node.lo.z - p.z, 0.0, p.z - node.hi.z});
  return x * x + y * y + z * z;
}

/// Ericson, Real-Time Collision Detection, 5.1.5; zero-area triangles end in one of the edge or corner cases.
Vec3d closest_point(const Corners& t, Vec3d p) {
  const Vec3d a = to_double(t.a), b = to_double(t.b), c = to_double(t.c);
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3d bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + (d1 > d3 ? d1 / (d1 - d3) : 0.0) * ab;
  const Vec3d cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + (d2 > d6 ? d2 / (d2 - d6) : 0.0) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b);
  const double sum = va + vb + vc;
  return a + (vb / sum) * ab + (vc / sum) * ac;
}

std::uint64_t key(Vec3f p) {
  const auto bits = [](float v) { return std::uint64_t{std::bit_cast<std::uint32_t>(v + 0.0F)}; };
  return mix(mix(bits(p.x) | bits(p.y) << 32) ^ bits(p.z));
}

}  // namespace

struct WindingTree::Impl {
  std::vector<Corners> triangles;
  std::vector<std::uint32_t> index;  // into the mesh
  std::vector<Node> nodes;
  std::vector<Moments> far;
  bool closed = false;

  void build(const Mesh& mesh, const std::vector<Vec3f>& centers, std::uint32_t at, std::uint32_t first,
             std::uint32_t count) {
    Node& node = nodes[at];
    node.first = first;
    node.count = count;
    if (count <= leaf_size) {
      constexpr float inf = std::numeric_limits<float>::infinity();
      node.lo = {inf, inf, inf};
      node.hi = {-inf, -inf, -inf};
      for (std::uint32_t i = first; i < first + count; ++i) {
        const Mesh::Triangle& t = mesh.triangles[index[i]];
        triangles[i] = {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
        for (const Vec3f& v : {triangles[i].a, triangles[i].b, triangles[i].c}) {
          node.lo = {std::min(node.lo.x, v.x), std::min(node.lo.y, v.y), std::min(node.lo.z, v.z)};
          node.hi = {std::max(node.hi.x, v.x), std::max(node.hi.y, v.y), std::max(node.hi.z, v.z)};
        }
      }
    } else {
      Box3d box;
      for (std::uint32_t i = first; i < first + count; ++i) box.include(to_double(centers[index[i]]));
      const Vec3d size = box.size();
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      const std::uint32_t left = left_count(count);
      const auto begin = index.begin() + first;
      std::nth_element(begin, begin + left, begin + count, [&](std::uint32_t a, std::uint32_t b) {
        const auto of = [&](std::uint32_t i) {
          return axis == 0 ? centers[i].x : axis == 1 ? centers[i].y : centers[i].z;
        };
        return of(a) < of(b) || (of(a) == of(b) && a < b);
      });
      const std::uint32_t other = at + 1 + node_count(left);
      const auto go_left = [&] { build(mesh, centers, at + 1, first, left); };
      const auto go_right = [&] { build(mesh, centers, other, first + left, count - left); };
      if (count > 2048) {
        tbb::parallel_invoke(go_left, go_right);
      } else {
        go_left();
        go_right();
      }
      const Node &l = nodes[at + 1], &r = nodes[other];
      node.lo = {std::min(l.lo.x, r.lo.x), std::min(l.lo.y, r.lo.y), std::min(l.lo.z, r.lo.z)};
      node.hi = {std::max(l.hi.x, r.hi.x), std::max(l.hi.y, r.hi.y), std::max(l.hi.z, r.hi.z)};
    }
    far[at] = moments(triangles.data() + first, triangles.data() + first + count);
  }
};

WindingTree::WindingTree(const Mesh& mesh) {
  auto impl = std::make_shared<Impl>();
  const std::size_t n = mesh.triangles.size();
  if (n >= std::numeric_limits<std::uint32_t>::max() / 2) {
    throw Error(Code::TooLarge, "the mesh has more triangles than a tree can hold");
  }
  if (n > 0) {
    impl->triangles.resize(n);
    impl->index.resize(n);
    std::iota(impl->index.begin(), impl->index.end(), 0U);
    std::vector<Vec3f> centers(n);
    // Each directed edge adds a hash of its ends, counted negative the other way round: the sum is zero when every edge
    // is run through as often in both directions, and by chance once in 2^64 otherwise.
    std::uint64_t boundary = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Mesh::Triangle& t = mesh.triangles[i];
      const std::array<Vec3f, 3> v{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
      centers[i] = to_float((to_double(v[0]) + to_double(v[1]) + to_double(v[2])) / 3.0);
      const std::array<std::uint64_t, 3> k{key(v[0]), key(v[1]), key(v[2])};
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint64_t a = k[e], b = k[(e + 1) % 3];
        if (a < b) boundary += mix(a ^ mix(b));
        if (b < a) boundary -= mix(b ^ mix(a));
      }
    }
    impl->closed = boundary == 0;
    impl->nodes.resize(node_count(static_cast<std::uint32_t>(n)));
    impl->far.resize(impl->nodes.size());
    impl->build(mesh, centers, 0, 0, static_cast<std::uint32_t>(n));
  }
  impl_ = std::move(impl);
}

double WindingTree::winding(Vec3d p) const {
  const Impl& tree = *impl_;
  if (tree.nodes.empty()) return 0;
  std::array<std::uint32_t, 64> stack;
  std::size_t height = 0;
  stack[height++] = 0;
  double sum = 0;
  while (height > 0) {
    const std::uint32_t at = stack[--height];
    const Moments& m = tree.far[at];
    const Vec3d r{m.cx - p.x, m.cy - p.y, m.cz - p.z};
    const double r2 = dot(r, r);
    if (r2 > far_radii * far_radii * m.radius2) {
      sum += far_field(m, r, r2);
      continue;
    }
    const Node& node = tree.nodes[at];
    if (node.count <= leaf_size) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) sum += solid_angle(tree.triangles[i], p);
    } else {
      stack[height++] = at + 1 + node_count(left_count(node.count));
      stack[height++] = at + 1;
    }
  }
  return sum / (4 * std::numbers::pi);
}

WindingTree::Nearest WindingTree::nearest(Vec3d p) const {
  const Impl& tree = *impl_;
  Nearest best{std::numeric_limits<double>::infinity(), 0, p};
  if (tree.nodes.empty()) return best;
  double best2 = best.distance_mm;
  std::array<std::pair<std::uint32_t, double>, 64> stack;
  std::size_t height = 0;
  stack[height++] = {0, distance2_to_box(tree.nodes[0], p)};
  while (height > 0) {
    auto [at, box2] = stack[--height];
    if (box2 >= best2) continue;
    while (tree.nodes[at].count > leaf_size) {
      std::uint32_t near = at + 1, other = at + 1 + node_count(left_count(tree.nodes[at].count));
      double near2 = distance2_to_box(tree.nodes[near], p), other2 = distance2_to_box(tree.nodes[other], p);
      if (other2 < near2) {
        std::swap(near, other);
        std::swap(near2, other2);
      }
      if (other2 < best2) stack[height++] = {other, other2};
      at = near;
      box2 = near2;
      if (box2 >= best2) break;
    }
    if (box2 >= best2) continue;
    const Node& node = tree.nodes[at];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Vec3d q = closest_point(tree.triangles[i], p);
      const double d2 = dot(q - p, q - p);
      if (d2 < best2) {
        best2 = d2;
        best.triangle = tree.index[i];
        best.point = q;
      }
    }
  }
  best.distance_mm = std::sqrt(best2);
  return best;
}

bool WindingTree::closed() const { return impl_->closed; }

namespace {

class MeshDistance final : public Shape::Function {
 public:
  explicit MeshDistance(WindingTree tree) : tree_(std::move(tree)) {}

  void evaluate(const PointBlock& block, float* out) const override {
    // Around a point whose surface is d away, the ball of radius d lies on one side of a closed surface.
    Vec3d center{};
    double radius = -1;
    bool inside = false;
    for (int i = 0; i < block.count; ++i) {
      const Vec3d p{block.x[i], block.y[i], block.z[i]};
      const double d = tree_.nearest(p).distance_mm;
      if (!(norm(p - center) < radius)) {
        inside = tree_.winding(p) > 0.5;
        if (tree_.closed()) {
          center = p;
          radius = d;
        }
      }
      out[i] = static_cast<float>(inside ? -d : std::min<double>(d, far_mm));
    }
  }

  /// An open surface's sign may also flip where there is no triangle, so only a closed one is 1-Lipschitz.
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const double reach = 0.5 * norm(box.size()) * (1 + 1e-6);
    const Vec3d c = box.center();
    const double d = tree_.nearest(c).distance_mm;
    if (!tree_.closed()) return {static_cast<float>(-(d + reach)), static_cast<float>(d + reach)};
    const double signed_d = tree_.winding(c) > 0.5 ? -d : std::min<double>(d, far_mm);
    return {static_cast<float>(signed_d - reach), static_cast<float>(signed_d + reach)};
  }

 private:
  WindingTree tree_;
};

}  // namespace

Shape distance_to(const WindingTree& tree) { return Shape(std::make_shared<const MeshDistance>(tree)); }

}  // namespace fibrolite
