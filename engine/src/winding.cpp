// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/winding.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/random.h"

namespace fibrolite {
namespace {

constexpr std::uint32_t lanes = 4;
/// A cluster is seen through its expansion from beyond this many radii.
constexpr float far_radii = 2.0F;
constexpr float infinity = std::numeric_limits<float>::infinity();

using Lanes [[gnu::vector_size(16)]] = float;
using Mask [[gnu::vector_size(16)]] = std::int32_t;  // a lane is all ones or zero

Lanes load(const float* p) {
  Lanes v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
Lanes all(float x) { return Lanes{x, x, x, x}; }
Lanes least(Lanes a, Lanes b) { return a < b ? a : b; }
Lanes most(Lanes a, Lanes b) { return a > b ? a : b; }
Lanes root(Lanes a) { return Lanes{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])}; }
double sum_of(Lanes a) { return (static_cast<double>(a[0]) + a[1]) + (static_cast<double>(a[2]) + a[3]); }

struct Corners {
  Vec3f a, b, c;
};

/// Up to four triangles; the rest are points at a corner of the first: they have no solid angle and are no nearer.
struct Pack {
  float v[9][lanes];
  std::uint32_t index[lanes];
};

/// The far field of a cluster up to second order about its centre: the area vector, the quadratic form
/// of the first moments, and what the second moments come to after contraction.
// NOLINTBEGIN(readability-identifier-naming): the names of the literature
enum Moment {
  cx,
  cy,
  cz,
  far2,
  nx,
  ny,
  nz,
  xx,
  yy,
  zz,
  xy,
  xz,
  yz,
  tx,
  ty,
  tz,
  xxx,
  yyy,
  zzz,
  xxy,
  xxz,
  xyy,
  yyz,
  xzz,
  yzz,
  xyz,
  moment_count
};
// NOLINTEND(readability-identifier-naming)
using Moments = std::array<float, moment_count>;

/// Four children: boxes, far fields, and where they are: an inner node, or ~pack, or nothing.
struct Node {
  float lo[3][lanes], hi[3][lanes];
  float far[moment_count][lanes];
  std::int32_t child[lanes];
};
constexpr std::int32_t nothing_there = std::numeric_limits<std::int32_t>::max();

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
          f(far_radii * far_radii * radius2 * (1 + 1e-6)),
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

struct Point {
  Lanes x, y, z;     ///< Rounded to float,
  Lanes dx, dy, dz;  ///< and what was lost.
};
Point split(Vec3d p) {
  const Vec3f high = to_float(p), low = to_float(p - to_double(high));
  return {all(high.x), all(high.y), all(high.z), all(low.x), all(low.y), all(low.z)};
}

/// 4 pi times the winding numbers of four clusters from afar; r points from the query to their centres.
Lanes far_field(const Node& node, Lanes x, Lanes y, Lanes z, Lanes r2) {
  const auto m = [&](Moment k) { return load(node.far[k]); };
  const Lanes i1 = 1.0F / root(r2), i2 = i1 * i1, i3 = i1 * i2, i5 = i3 * i2;
  const Lanes x2 = x * x, y2 = y * y, z2 = z * z;
  const Lanes zeroth = m(nx) * x + m(ny) * y + m(nz) * z, trace = m(xx) + m(yy) + m(zz);
  const Lanes quadric = m(xx) * x2 + m(yy) * y2 + m(zz) * z2 + m(xy) * x * y + m(xz) * x * z + m(yz) * y * z;
  const Lanes linear = m(tx) * x + m(ty) * y + m(tz) * z;
  const Lanes cubic = x * (m(xxx) * x2 + m(xxy) * x * y + m(xxz) * x * z + m(xyy) * y2 + m(xzz) * z2) +
                      y * (m(yyy) * y2 + m(yyz) * y * z + m(yzz) * z2) + m(zzz) * z2 * z + m(xyz) * x * y * z;
  return i3 * (zeroth + trace) - i5 * (3.0F * quadric + 1.5F * linear - 7.5F * i2 * cubic);
}

/// Error below 1e-6.
Lanes arc_tangent(Lanes y, Lanes x) {
  const Lanes ay = most(y, -y), ax = most(x, -x), high = most(ax, ay);
  const Lanes t = least(ax, ay) / most(high, all(1e-37F)), s = t * t;
  // Abramowitz and Stegun 4.4.49.
  Lanes a = all(0.0028662257F);
  for (const float c : {-0.0161657367F, 0.0429096138F, -0.0752896400F, 0.1065626393F, -0.1420889944F, 0.1999355085F,
                        -0.3333314528F, 1.0F}) {
    a = a * s + c;
  }
  a = a * t;
  a = ay > ax ? std::numbers::pi_v<float> / 2 - a : a;
  a = x < Lanes{} ? std::numbers::pi_v<float> - a : a;
  return y < Lanes{} ? -a : a;
}

/// Van Oosterom and Strackee 1983.
Lanes solid_angles(const Pack& pack, const Point& p) {
  const auto from_p = [&](int k, const Lanes& high, const Lanes& low) { return (load(pack.v[k]) - high) - low; };
  const Lanes ax = from_p(0, p.x, p.dx), ay = from_p(1, p.y, p.dy), az = from_p(2, p.z, p.dz);
  const Lanes bx = from_p(3, p.x, p.dx), by = from_p(4, p.y, p.dy), bz = from_p(5, p.z, p.dz);
  const Lanes cx = from_p(6, p.x, p.dx), cy = from_p(7, p.y, p.dy), cz = from_p(8, p.z, p.dz);
  const Lanes la = root(ax * ax + ay * ay + az * az), lb = root(bx * bx + by * by + bz * bz),
              lc = root(cx * cx + cy * cy + cz * cz);
  const Lanes above = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
  const Lanes below = la * lb * lc + (ax * bx + ay * by + az * bz) * lc + (bx * cx + by * cy + bz * cz) * la +
                      (cx * ax + cy * ay + cz * az) * lb;
  return 2.0F * arc_tangent(above, below);
}

/// Squared distances of p to the four triangles, in float: tells which ones deserve a closer look.
Lanes rough_distance2(const Pack& pack, const Point& p) {
  Lanes v[3][3];  // from p to corner i, axis a
  const Lanes high[3] = {p.x, p.y, p.z}, low[3] = {p.dx, p.dy, p.dz};
  for (int i = 0; i < 3; ++i) {
    for (int a = 0; a < 3; ++a) v[i][a] = (load(pack.v[3 * i + a]) - high[a]) - low[a];
  }
  const auto dot3 = [](const Lanes* a, const Lanes* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const auto cross3 = [](const Lanes* a, const Lanes* b, Lanes* c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
  };
  Lanes edge[3][3], least2 = all(infinity);
  for (int i = 0; i < 3; ++i) {
    Lanes gap[3];
    for (int a = 0; a < 3; ++a) edge[i][a] = v[(i + 1) % 3][a] - v[i][a];
    const Lanes t = -dot3(edge[i], v[i]) / most(dot3(edge[i], edge[i]), all(1e-30F));
    const Lanes s = least(most(t, Lanes{}), all(1));
    for (int a = 0; a < 3; ++a) gap[a] = v[i][a] + s * edge[i][a];
    least2 = least(least2, dot3(gap, gap));
  }
  Lanes n[3], side[3];
  cross3(edge[0], edge[1], n);
  Mask above = {-1, -1, -1, -1};
  for (int i = 0; i < 3; ++i) {
    cross3(edge[i], n, side);  // outward in the plane; p's foot is inside where all corners lie outward of it
    above &= dot3(side, v[i]) > Lanes{};
  }
  const Lanes h = dot3(n, v[0]);
  return above ? h * h / most(dot3(n, n), all(1e-30F)) : least2;
}

/// Ericson, Real-Time Collision Detection, 5.1.5; zero-area triangles end in one of the edge or corner cases.
Vec3d closest_point(Vec3d a, Vec3d b, Vec3d c, Vec3d p) {
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
  std::vector<Pack> packs;
  std::vector<Node> nodes;
  bool closed = false;
  double extent_mm = 0;  ///< Longest side of the bounding box.
};

namespace {

class TreeBuilder {
 public:
  TreeBuilder(const Mesh& mesh, std::vector<Vec3f> centers, std::vector<Pack>& packs, std::vector<Node>& nodes)
      : mesh_(mesh), centers_(std::move(centers)), packs_(packs), nodes_(nodes), index_(mesh.triangles.size()) {
    std::iota(index_.begin(), index_.end(), 0U);
    packs_.resize((index_.size() + lanes - 1) / lanes);
    nodes_.resize(packs_.size());  // an upper bound: each node has two children or more
  }

  void run() {
    build({0, static_cast<std::uint32_t>(index_.size())}, next_++);
    nodes_.resize(next_);
    nodes_.shrink_to_fit();
  }

 private:
  /// Triangles index_[begin..end); begin is a multiple of four, so that packs are full but for the last.
  struct Range {
    std::uint32_t begin, end;
    [[nodiscard]] std::uint32_t size() const { return end - begin; }
  };

  std::pair<Range, Range> halve(Range r) {
    if (r.size() <= lanes) return {r, {r.end, r.end}};
    Box3d box;
    for (std::uint32_t i = r.begin; i < r.end; ++i) box.include(to_double(centers_[index_[i]]));
    const Vec3d size = box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t packs = (r.size() + lanes - 1) / lanes, middle = r.begin + (packs + 1) / 2 * lanes;
    const auto of = [&](std::uint32_t i) {
      return axis == 0 ? centers_[i].x : axis == 1 ? centers_[i].y : centers_[i].z;
    };
    std::nth_element(index_.begin() + r.begin, index_.begin() + middle, index_.begin() + r.end,
                     [&](std::uint32_t a, std::uint32_t b) { return of(a) < of(b) || (of(a) == of(b) && a < b); });
    return {{r.begin, middle}, {middle, r.end}};
  }

  void build(Range range, std::uint32_t at) {
    const auto [left, right] = halve(range);
    std::array<Range, lanes> parts;
    const auto halve_left = [&, half = left] { std::tie(parts[0], parts[1]) = halve(half); };
    const auto halve_right = [&, half = right] { std::tie(parts[2], parts[3]) = halve(half); };
    const bool large = range.size() > 4096;
    if (large) {
      tbb::parallel_invoke(halve_left, halve_right);
    } else {
      halve_left();
      halve_right();
    }
    const auto child = [&](std::size_t k) {
      if (parts[k].size() > lanes) {
        const std::uint32_t place = next_++;
        nodes_[at].child[k] = static_cast<std::int32_t>(place);
        build(parts[k], place);
      } else if (parts[k].size() > 0) {
        nodes_[at].child[k] = ~static_cast<std::int32_t>(parts[k].begin / lanes);
        make_pack(parts[k]);
      } else {
        nodes_[at].child[k] = nothing_there;
      }
      describe(parts[k], nodes_[at], k);
    };
    if (large) {
      tbb::parallel_invoke([&] { child(0); }, [&] { child(1); }, [&] { child(2); }, [&] { child(3); });
    } else {
      for (std::size_t k = 0; k < lanes; ++k) child(k);
    }
  }

  [[nodiscard]] Corners corners(std::uint32_t i) const {
    const Mesh::Triangle& t = mesh_.triangles[index_[i]];
    return {mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]};
  }

  void make_pack(Range r) {
    Pack& pack = packs_[r.begin / lanes];
    const Vec3f first = corners(r.begin).a;
    for (std::uint32_t k = 0; k < lanes; ++k) {
      const bool there = k < r.size();
      const Corners t = there ? corners(r.begin + k) : Corners{first, first, first};
      const float v[9] = {t.a.x, t.a.y, t.a.z, t.b.x, t.b.y, t.b.z, t.c.x, t.c.y, t.c.z};
      for (int i = 0; i < 9; ++i) pack.v[i][k] = v[i];
      pack.index[k] = index_[there ? r.begin + k : r.begin];
    }
  }

  void describe(Range r, Node& node, std::size_t k) const {
    Vec3f lo{infinity, infinity, infinity}, hi{-infinity, -infinity, -infinity};
    std::vector<Corners> triangles;
    triangles.reserve(r.size());
    for (std::uint32_t i = r.begin; i < r.end; ++i) {
      triangles.push_back(corners(i));
      for (const Vec3f& v : {triangles.back().a, triangles.back().b, triangles.back().c}) {
        lo = {std::min(lo.x, v.x), std::min(lo.y, v.y), std::min(lo.z, v.z)};
        hi = {std::max(hi.x, v.x), std::max(hi.y, v.y), std::max(hi.z, v.z)};
      }
    }
    const float low[3] = {lo.x, lo.y, lo.z}, high[3] = {hi.x, hi.y, hi.z};
    for (int a = 0; a < 3; ++a) {
      node.lo[a][k] = low[a];
      node.hi[a][k] = high[a];
    }
    const Moments m = triangles.empty() ? Moments{} : moments(triangles.data(), triangles.data() + triangles.size());
    for (std::size_t i = 0; i < moment_count; ++i) node.far[i][k] = m[i];
  }

  const Mesh& mesh_;
  const std::vector<Vec3f> centers_;
  std::vector<Pack>& packs_;
  std::vector<Node>& nodes_;
  std::vector<std::uint32_t> index_;
  std::atomic<std::uint32_t> next_{0};
};

}  // namespace

WindingTree::WindingTree(const Mesh& mesh) {
  auto impl = std::make_shared<Impl>();
  const std::size_t n = mesh.triangles.size();
  if (n >= std::numeric_limits<std::uint32_t>::max() / 2) {
    throw Error(Code::TooLarge, "the mesh has more triangles than a tree can hold");
  }
  if (n > 0) {
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
    impl->extent_mm = bounds(mesh).longest_side();
    TreeBuilder(mesh, std::move(centers), impl->packs, impl->nodes).run();
  }
  impl_ = std::move(impl);
}

double WindingTree::winding(Vec3d p) const {
  const Impl& tree = *impl_;
  if (tree.nodes.empty()) return 0;
  const Point q = split(p);
  std::array<std::int32_t, 128> stack;
  std::size_t height = 0;
  stack[height++] = 0;
  double sum = 0;
  while (height > 0) {
    const std::int32_t at = stack[--height];
    if (at < 0) {
      sum += sum_of(solid_angles(tree.packs[static_cast<std::size_t>(~at)], q));
      continue;
    }
    const Node& node = tree.nodes[static_cast<std::size_t>(at)];
    const Lanes x = load(node.far[cx]) - q.x, y = load(node.far[cy]) - q.y, z = load(node.far[cz]) - q.z;
    const Lanes r2 = x * x + y * y + z * z;
    const Mask far = r2 > load(node.far[far2]);
    if ((far[0] | far[1] | far[2] | far[3]) != 0) {
      const Lanes field = far_field(node, x, y, z, r2);
      sum += sum_of(far ? field : Lanes{});
    }
    for (int k = 0; k < static_cast<int>(lanes); ++k) {
      if (far[k] == 0 && node.child[k] != nothing_there) stack[height++] = node.child[k];
    }
  }
  return sum / (4 * std::numbers::pi);
}

WindingTree::Nearest WindingTree::nearest(Vec3d p) const {
  const Impl& tree = *impl_;
  Nearest best{std::numeric_limits<double>::infinity(), 0, p};
  if (tree.nodes.empty()) return best;
  double best2 = best.distance_mm, look2 = best2;
  // A rough distance may be too long by the rounding of float coordinates.
  const double rounding_mm = 1e-6 * tree.extent_mm;
  const Point q = split(p);
  struct Item {
    std::int32_t at;
    float d2;
  };
  std::array<Item, 128> stack;
  std::size_t height = 0;
  stack[height++] = {0, 0};
  while (height > 0) {
    const Item item = stack[--height];
    if (item.d2 >= best2) continue;
    if (item.at < 0) {
      const Pack& pack = tree.packs[static_cast<std::size_t>(~item.at)];
      const Lanes rough = rough_distance2(pack, q);
      for (std::size_t k = 0; k < lanes; ++k) {
        if (rough[k] > look2) continue;
        const auto v = [&](int i) { return static_cast<double>(pack.v[i][k]); };
        const Vec3d c = closest_point({v(0), v(1), v(2)}, {v(3), v(4), v(5)}, {v(6), v(7), v(8)}, p);
        const double d2 = dot(c - p, c - p);
        if (d2 < best2) {
          best2 = d2;
          look2 = (1 + 1e-5) * (std::sqrt(d2) + rounding_mm) * (std::sqrt(d2) + rounding_mm);
          best.triangle = pack.index[k];
          best.point = c;
        }
      }
      continue;
    }
    const Node& node = tree.nodes[static_cast<std::size_t>(item.at)];
    const auto gap = [&](int a, Lanes high, Lanes low) {
      return most(most((load(node.lo[a]) - high) - low, (high - load(node.hi[a])) + low), Lanes{});
    };
    const Lanes x = gap(0, q.x, q.dx), y = gap(1, q.y, q.dy), z = gap(2, q.z, q.dz);
    const Lanes d2 = (x * x + y * y + z * z) * (1 - 1e-6F);
    // Push the farthest first; an empty child is infinitely far.
    const std::size_t base = height;
    for (int k = 0; k < static_cast<int>(lanes); ++k) {
      if (!(d2[k] < best2) || node.child[k] == nothing_there) continue;
      std::size_t place = height++;
      for (; place > base && stack[place - 1].d2 < d2[k]; --place) stack[place] = stack[place - 1];
      stack[place] = {node.child[k], d2[k]};
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
