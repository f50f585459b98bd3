// SPDX-License-Identifier: Apache-2.0
#include "dual_surface.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#include <type_traits>
#include <utility>

#include "fibrolite/clones.h"
#include "fibrolite/error.h"
#include "leaf_bits.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using openvdb::Coord;
using Access = openvdb::tree::ValueAccessor<const Tree>;

// ---- one cell ----
// Corner c lies at bits 0, 1, 2 of c along x, y, z. Edge 4 a + p + 2 q runs along axis a from the corner with bits p
// and q along the next axes. Face 2 a + s is the one at s along axis a.

/// A number known to the compiler.
template <unsigned n>
using Number = std::integral_constant<unsigned, n>;

constexpr int edges = 12, faces = 6, no_face = faces;

struct Edge {
  unsigned from, to;
};
constexpr Edge edge(unsigned e) {
  const unsigned axis = e / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
  const unsigned from = (e & 1U) << u | (e >> 1 & 1U) << v;
  return {from, from | 1U << axis};
}

/// Sheets of the surface in a cell, by which of its corners are inside.
struct Sheets {
  std::array<std::uint8_t, edges> of{};  ///< Of each crossed edge.
  std::uint8_t count = 0;
};

/// Its four corners in a circle.
std::array<unsigned, 4> corners_of(unsigned face) {
  const unsigned axis = face / 2, u = 1U << (axis + 1) % 3, v = 1U << (axis + 2) % 3, base = (face & 1U) << axis;
  return {base, base | u, base | u | v, base | v};
}

unsigned edge_between(unsigned a, unsigned b) {
  for (unsigned e = 0; e < edges; ++e) {
    if ((edge(e).from == a && edge(e).to == b) || (edge(e).from == b && edge(e).to == a)) return e;
  }
  return edges;
}

/// Across a face the edges it crosses are linked in pairs; of four, the two next to each inside corner, or (on the
/// joined face) the two next to each outside one.
Sheets sheets_of(unsigned inside, unsigned joined) {
  std::array<unsigned, edges> parent;
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](unsigned i) {
    while (parent[i] != i) i = parent[i];
    return i;
  };
  const auto crossed = [&](unsigned e) { return (inside >> edge(e).from & 1U) != (inside >> edge(e).to & 1U); };
  for (unsigned face = 0; face < faces; ++face) {
    const std::array<unsigned, 4> c = corners_of(face);
    std::array<unsigned, 4> around, found;  // around[i]: from corner i to the next
    std::size_t n = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      around[i] = edge_between(c[i], c[(i + 1) % 4]);
      if (crossed(around[i])) found[n++] = around[i];
    }
    if (n == 2) parent[root(found[0])] = root(found[1]);
    if (n != 4) continue;
    const bool apart = face != joined;
    const std::size_t first = ((inside >> c[0] & 1U) != 0) == apart ? 0 : 1;
    for (const std::size_t i : {first, first + 2}) parent[root(around[(i + 3) % 4])] = root(around[i]);
  }
  Sheets result;
  std::array<std::uint8_t, edges> number;
  number.fill(edges);
  for (unsigned e = 0; e < edges; ++e) {
    if (!crossed(e)) continue;
    std::uint8_t& mine = number[root(e)];
    if (mine == edges) mine = result.count++;
    result.of[e] = mine;
  }
  return result;
}

struct CrossedEdges {
  std::array<std::uint8_t, edges> list{};
  std::uint8_t count = 0;
  std::array<float, 3> corners{};  ///< Where the edges begin, summed.
};

struct Tables {
  std::array<std::array<Sheets, faces + 1>, 256> sheets;  ///< By corners inside and joined face, if any.
  /// The face whose four crossed edges are all of one sheet; there is at most one, and then no other has four.
  std::array<std::uint8_t, 256> doubtful;
  std::array<CrossedEdges, 256> crossed;

  Tables() {
    for (unsigned inside = 0; inside < 256; ++inside) {
      CrossedEdges& mine = crossed[inside];
      for (unsigned e = 0; e < edges; ++e) {
        if ((inside >> edge(e).from & 1U) != (inside >> edge(e).to & 1U)) {
          mine.list[mine.count++] = static_cast<std::uint8_t>(e);
          for (unsigned axis = 0; axis < 3; ++axis) mine.corners[axis] += static_cast<float>(edge(e).from >> axis & 1U);
        }
      }
      for (unsigned face = 0; face <= faces; ++face) sheets[inside][face] = sheets_of(inside, face);
      doubtful[inside] = no_face;
      for (unsigned face = 0; face < faces; ++face) {
        const std::array<unsigned, 4> c = corners_of(face);
        const auto in = [&](std::size_t i) { return (inside >> c[i] & 1U) != 0; };
        if (in(0) != in(2) || in(1) != in(3) || in(0) == in(1)) continue;
        const Sheets& s = sheets[inside][no_face];
        const std::uint8_t one = s.of[edge_between(c[0], c[1])];
        bool same = true;
        for (std::size_t i = 1; i < 4; ++i) same = same && s.of[edge_between(c[i], c[(i + 1) % 4])] == one;
        if (same) doubtful[inside] = static_cast<std::uint8_t>(face);
      }
    }
  }
};

const Tables& tables() {
  static const Tables all;
  return all;
}

// ---- one block of cells ----

/// The cells whose lowest corner lies in a block.
struct Block {
  Coord origin;
  std::array<std::uint16_t, 81> inside;  ///< Bit z of [9 x + y]: sample (x, y, z) of the block and the next ones.
  static constexpr unsigned several = 1U << 15;  ///< In `first`: of a cell with more than one sheet.
  std::array<std::uint16_t, Leaf::SIZE> first;   ///< Vertex of each mixed cell's first sheet, in the block.
  std::array<std::uint16_t, Leaf::SIZE> kind;    ///< 8 bits of corners inside, then the joined face.
  std::vector<openvdb::Vec3s> points;
  std::size_t base = 0;   ///< Of its vertices among all.
  std::size_t quads = 0;  ///< How many.

  /// Which edges along x, y and z, of those from samples (x, y, 0) to (x, y, 7), cross the surface.
  [[nodiscard]] std::array<unsigned, 3> crossed(unsigned x, unsigned y) const {
    const unsigned row = inside[9 * x + y], right = inside[9 * x + 9 + y], up = inside[9 * x + y + 1];
    return {(row ^ right) & 255U, (row ^ up) & 255U, (row ^ row >> 1) & 255U};
  }
};

struct Samples {
  std::array<float, 9 * 9 * 9> value;

  void fetch(const Coord& origin, const Access& access) {
    for (int n = 0; n < 8; ++n) {
      const int dx = n >> 2, dy = n >> 1 & 1, dz = n & 1;
      const Coord at = origin.offsetBy(8 * dx, 8 * dy, 8 * dz);
      const Leaf* leaf = access.probeConstLeaf(at);
      const float tile = leaf != nullptr ? 0 : access.getValue(at);
      const float* from = leaf != nullptr ? leaf->buffer().data() : nullptr;
      const int nx = dx == 0 ? 8 : 1, ny = dy == 0 ? 8 : 1, nz = dz == 0 ? 8 : 1;
      for (int x = 0; x < nx; ++x) {
        for (int y = 0; y < ny; ++y) {
          float* to = value.data() + ((8 * dx + x) * 9 + 8 * dy + y) * 9 + 8 * dz;
          if (from == nullptr) {
            std::fill_n(to, nz, tile);
          } else if (dz == 0) {
            std::copy_n(from + x * 64 + y * 8, 8, to);  // of a length that the compiler knows
          } else {
            *to = from[x * 64 + y * 8];
          }
        }
      }
    }
  }
};

FIBROLITE_CLONES void rows_inside(const std::array<float, 9 * 9 * 9>& value, std::array<std::uint16_t, 81>& bits) {
  std::array<std::uint8_t, 9 * 9 * 9> inside;
  for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = value[i] < 0 ? 1 : 0;
  for (std::size_t row = 0; row < 81; ++row) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, inside.data() + 9 * row, 8);
    bits[row] = static_cast<std::uint16_t>(lowest_of_bytes(eight) | std::uint64_t{inside[9 * row + 8]} << 8);
  }
}

/// Which corners of any cell are inside.
unsigned corners_inside(const Coord& cell, const Access& access) {
  unsigned inside = 0;
  for (unsigned c = 0; c < 8; ++c) {
    const Coord at = cell.offsetBy(static_cast<int>(c & 1U), static_cast<int>(c >> 1 & 1U), static_cast<int>(c >> 2));
    inside |= (access.getValue(at) < 0 ? 1U : 0U) << c;
  }
  return inside;
}

class Cells {
 public:
  Cells(Block& block, const Access& access, float voxel, std::vector<openvdb::Vec3s>& room)
      : block_(block), access_(access), voxel_(voxel), points_(room) {}

  void run() {
    points_.clear();
    samples_.fetch(block_.origin, access_);
    rows_inside(samples_.value, block_.inside);
    block_.quads = 0;
    for (unsigned x = 0; x < 8; ++x) {
      for (unsigned y = 0; y < 8; ++y) {
        const std::array<unsigned, 3> crossed = block_.crossed(x, y);
        block_.quads += static_cast<std::size_t>(std::popcount(crossed[0] | crossed[1] << 8 | crossed[2] << 16));
        const std::array<unsigned, 4> rows{block_.inside[9 * x + y], block_.inside[9 * x + 9 + y],
                                           block_.inside[9 * x + y + 1], block_.inside[9 * x + 9 + y + 1]};
        const unsigned any = rows[0] | rows[1] | rows[2] | rows[3], all = rows[0] & rows[1] & rows[2] & rows[3];
        for (unsigned mixed = (any | any >> 1) & ~(all & all >> 1) & 255U; mixed != 0; mixed &= mixed - 1)
          cell(x, y, static_cast<unsigned>(std::countr_zero(mixed)), rows);
      }
    }
    block_.points.assign(points_.begin(), points_.end());
  }

 private:
  void cell(unsigned x, unsigned y, unsigned z, const std::array<unsigned, 4>& rows) {
    unsigned inside = 0;
    for (unsigned r = 0; r < 4; ++r) inside |= (rows[r] >> z & 1U) << r | (rows[r] >> (z + 1) & 1U) << (r + 4);
    const unsigned joined = joined_face(x, y, z, inside);
    const Sheets& sheets = tables().sheets[inside][joined];
    const std::size_t at = 64 * x + 8 * y + z;
    block_.kind[at] = static_cast<std::uint16_t>(inside | joined << 8);
    block_.first[at] = static_cast<std::uint16_t>(points_.size() | (sheets.count == 1 ? 0 : Block::several));

    const float* const lowest = samples_.value.data() + (9 * x + y) * 9 + z;
    const std::array<float, 8> v{lowest[0], lowest[81], lowest[9],  lowest[90],
                                 lowest[1], lowest[82], lowest[10], lowest[91]};
    const CrossedEdges& crossed = tables().crossed[inside];
    const openvdb::Vec3s corner(static_cast<float>(block_.origin.x() + static_cast<int>(x)),
                                static_cast<float>(block_.origin.y() + static_cast<int>(y)),
                                static_cast<float>(block_.origin.z() + static_cast<int>(z)));
    if (sheets.count == 1) {  // nearly always
      points_.push_back(placed(corner, sum_of_crossings(v, crossed.corners), static_cast<float>(crossed.count)));
      return;
    }
    std::array<std::array<float, 3>, 4> sum{};  // of each sheet
    std::array<float, 4> number{};
    for (std::size_t n = 0; n < crossed.count; ++n) {
      const unsigned e = crossed.list[n];
      const Edge ends = edge(e);
      const float a = v[ends.from];
      std::array<float, 3>& of = sum[sheets.of[e]];
      of[0] += static_cast<float>(ends.from & 1U);
      of[1] += static_cast<float>(ends.from >> 1 & 1U);
      of[2] += static_cast<float>(ends.from >> 2);
      of[e / 4] += a / (a - v[ends.to]);
      number[sheets.of[e]] += 1;
    }
    for (std::size_t s = 0; s < sheets.count; ++s) points_.push_back(placed(corner, sum[s], number[s]));
  }
  /// Of all crossed edges, with where they begin: one edge along each axis at a time, side by side.
  static std::array<float, 3> sum_of_crossings(const std::array<float, 8>& v, const std::array<float, 3>& begin) {
    using Four [[gnu::vector_size(16)]] = float;
    Four sum{begin[0], begin[1], begin[2], 0};
    const auto add = [&](float ax, float ay, float az, float bx, float by, float bz) {
      const Four a{ax, ay, az, 0}, b{bx, by, bz, 0}, along = a / (a - b);
      sum += ((a < 0) ^ (b < 0)) ? along : Four{};
    };
    add(v[0], v[0], v[0], v[1], v[2], v[4]);
    add(v[2], v[4], v[1], v[3], v[6], v[5]);
    add(v[4], v[1], v[2], v[5], v[3], v[6]);
    add(v[6], v[5], v[3], v[7], v[7], v[7]);
    return {sum[0], sum[1], sum[2]};
  }
  [[nodiscard]] openvdb::Vec3s placed(const openvdb::Vec3s& corner, const std::array<float, 3>& sum,
                                      float number) const {
    return voxel_ * (corner + openvdb::Vec3s(sum[0], sum[1], sum[2]) * (1 / number));
  }

  /// The doubtful face, if it is doubtful seen from its other side too.
  [[nodiscard]] unsigned joined_face(unsigned x, unsigned y, unsigned z, unsigned inside) const {
    const unsigned face = tables().doubtful[inside];
    if (face == no_face) return no_face;
    Coord next = block_.origin.offsetBy(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
    next[face / 2] += (face & 1U) != 0 ? 1 : -1;
    return tables().doubtful[corners_inside(next, access_)] == (face ^ 1U) ? face : no_face;
  }

  Block& block_;
  const Access& access_;
  const float voxel_;
  std::vector<openvdb::Vec3s>& points_;
  Samples samples_;
};

}  // namespace

struct DualSurface::Impl {
  using Key = std::array<int, 3>;  // of an origin, the axis first
  /// Its blocks are the first `count`; the others have been used before and keep their memory.
  struct Layer {
    std::vector<Block> blocks;
    std::size_t count = 0;
    void resize(std::size_t n) {
      count = n;
      if (blocks.size() < n) blocks.resize(n);
    }
  };

  Impl(Grid g, int along) : grid(g), axis(static_cast<std::size_t>(along)) {}

  [[nodiscard]] Key key(const Coord& o) const { return {o[axis], o[(axis + 1) % 3], o[(axis + 2) % 3]}; }

  /// Blocks that may have mixed cells, layer by layer: leaves, and tiles below a leaf's face of another sign.
  [[nodiscard]] std::vector<Coord> candidates(const Tree& tree, const SampleRange& range) const {
    std::vector<const Leaf*> leaves;
    leaves.reserve(tree.leafCount());
    tree.getNodes(leaves);
    constexpr std::size_t share = 1024;
    std::vector<std::vector<Coord>> found((leaves.size() + share - 1) / share);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t part) {
      const Access access(tree);
      for (std::size_t i = part * share; i < std::min((part + 1) * share, leaves.size()); ++i) {
        const Leaf& leaf = *leaves[i];
        const Coord o = leaf.origin();
        if (o[axis] < range.low || o[axis] > range.high) continue;
        if (o[axis] < range.high) found[part].push_back(o);
        for (int n = 1; n < 8; ++n) {
          const Coord low = o.offsetBy(-8 * (n >> 2), -8 * (n >> 1 & 1), -8 * (n & 1));
          if (low[axis] < range.low || low[axis] >= range.high || access.probeConstLeaf(low) != nullptr) continue;
          if (other_side(leaf, n, access.getValue(low) < 0)) found[part].push_back(low);
        }
      }
    });
    std::vector<Coord> all;
    for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
    tbb::parallel_sort(all.begin(), all.end(), [&](const Coord& a, const Coord& b) { return key(a) < key(b); });
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }
  /// Has a leaf, on its lower face, edge or corner towards n, a sample on the other side?
  static bool other_side(const Leaf& leaf, int n, bool inside) {
    const float* v = leaf.buffer().data();
    const int nx = (n >> 2) != 0 ? 1 : 8, ny = (n >> 1 & 1) != 0 ? 1 : 8, nz = (n & 1) != 0 ? 1 : 8;
    for (int x = 0; x < nx; ++x)
      for (int y = 0; y < ny; ++y)
        for (int z = 0; z < nz; ++z)
          if ((v[64 * x + 8 * y + z] < 0) != inside) return true;
    return false;
  }

  [[nodiscard]] QuadLayer add_layer(const Tree& tree, const Coord* from, const Coord* to) {
    const auto count = static_cast<std::size_t>(to - from);
    std::swap(layer, below);
    layer.resize(count);
    std::vector<Block>& blocks = layer.blocks;
    const auto each = [&](const auto& work) {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 8), [&](const auto& some) {
        for (std::size_t i = some.begin(); i < some.end(); ++i) work(i);
      });
    };
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 8), [&](const auto& some) {
      const Access access(tree);
      thread_local std::vector<openvdb::Vec3s> room;
      for (std::size_t i = some.begin(); i < some.end(); ++i) {
        blocks[i].origin = from[i];
        Cells(blocks[i], access, static_cast<float>(grid.voxel_mm), room).run();
      }
    });
    std::size_t points = out_points;
    for (std::size_t i = 0; i < count; ++i) {
      blocks[i].base = points;
      points += blocks[i].points.size();
    }
    if (points >= std::numeric_limits<std::uint32_t>::max())
      throw Error(Code::TooLarge, "the surface has more vertices than a mesh can hold", {}, "use a larger --voxel");
    std::vector<std::size_t> quads{0};
    for (std::size_t i = 0; i < count; ++i) quads.push_back(quads.back() + blocks[i].quads);
    QuadLayer out;
    out.first = out_points;
    out.points.resize(points - out_points);
    out.quads.resize(quads.back());
    each([&](std::size_t i) {
      const Block& block = blocks[i];
      std::copy(block.points.begin(), block.points.end(),
                out.points.begin() + static_cast<std::ptrdiff_t>(block.base - out_points));
      make_quads(i, out.quads.data() + quads[i]);
    });
    out_points = points;
    return out;
  }

  [[nodiscard]] const Block* find(const Layer& in, const Coord& origin) const {
    const auto end = in.blocks.begin() + static_cast<std::ptrdiff_t>(in.count);
    const auto at = std::lower_bound(in.blocks.begin(), end, key(origin),
                                     [&](const Block& b, const Key& k) { return key(b.origin) < k; });
    return at != end && at->origin == origin ? &*at : nullptr;
  }

  void make_quads(std::size_t number, Quad* next) const {
    const Block& block = layer.blocks[number];
    // Those on the lower sides, at bits 2, 1, 0 for x, y, z.
    std::array<const Block*, 8> lower{&block};
    for (int n = 1; n < 8; ++n) {
      const Coord o = block.origin.offsetBy(-8 * (n >> 2), -8 * (n >> 1 & 1), -8 * (n & 1));
      lower[static_cast<std::size_t>(n)] = find(o[axis] == block.origin[axis] ? layer : below, o);
    }
    const auto vertex = [&](int x, int y, int z, unsigned e) {
      const Block& in = (x | y | z) >= 0 ? block : *lower[(x < 0 ? 4U : 0U) | (y < 0 ? 2U : 0U) | (z < 0 ? 1U : 0U)];
      const auto at = static_cast<std::size_t>(64 * (x & 7) + 8 * (y & 7) + (z & 7));
      const unsigned first = in.first[at];
      if ((first & Block::several) == 0) return static_cast<std::uint32_t>(in.base + first);
      const unsigned kind = in.kind[at], sheet = tables().sheets[kind & 255U][kind >> 8].of[e];
      return static_cast<std::uint32_t>(in.base + (first & ~Block::several) + sheet);
    };
    // Bits of `circle` are steps down along the next two axes.
    const auto corner = [&]<unsigned along, unsigned circle>(Number<along>, Number<circle>, int x, int y, int z) {
      constexpr int u = circle & 1U, v = circle >> 1;
      constexpr int dx = along == 2   ? u
                         : along == 1 ? v
                                      : 0,
                    dy = along == 0   ? u
                         : along == 2 ? v
                                      : 0,
                    dz = along == 1   ? u
                         : along == 0 ? v
                                      : 0;
      return vertex(x - dx, y - dy, z - dz, 4 * along + circle);
    };
    const auto quad = [&](auto along, int x, int y, int z, bool inside) {
      const std::uint32_t a = corner(along, Number<0>{}, x, y, z), b = corner(along, Number<1>{}, x, y, z),
                          c = corner(along, Number<3>{}, x, y, z), d = corner(along, Number<2>{}, x, y, z);
      *next++ = inside ? Quad{a, b, c, d} : Quad{d, c, b, a};
    };
    for (int x = 0; x < 8; ++x) {
      for (int y = 0; y < 8; ++y) {
        const unsigned row = block.inside[static_cast<std::size_t>(9 * x + y)];
        const std::array<unsigned, 3> crossed = block.crossed(static_cast<unsigned>(x), static_cast<unsigned>(y));
        for (unsigned any = crossed[0] | crossed[1] | crossed[2]; any != 0; any &= any - 1) {
          const int z = std::countr_zero(any);
          const bool inside = (row >> z & 1U) != 0;
          if ((crossed[0] >> z & 1U) != 0) quad(Number<0>{}, x, y, z, inside);
          if ((crossed[1] >> z & 1U) != 0) quad(Number<1>{}, x, y, z, inside);
          if ((crossed[2] >> z & 1U) != 0) quad(Number<2>{}, x, y, z, inside);
        }
      }
    }
  }

  const Grid grid;
  const std::size_t axis;
  Layer layer, below;  ///< The one made last, and the one before: quads reach into that.
  std::size_t out_points = 0;
};

DualSurface::DualSurface(Grid grid, int axis) : impl_(std::make_unique<Impl>(grid, axis)) {}
DualSurface::~DualSurface() = default;

void DualSurface::add(const Solid& solid, const SampleRange& range, const std::function<void(QuadLayer&&)>& use,
                      const Context& context) {
  const Tree& tree = solid.impl().grid->tree();
  const std::vector<Coord> blocks = impl_->candidates(tree, range);
  for (std::size_t i = 0; i < blocks.size();) {
    context.check();
    std::size_t end = i;
    while (end < blocks.size() && blocks[end][impl_->axis] == blocks[i][impl_->axis]) ++end;
    use(impl_->add_layer(tree, blocks.data() + i, blocks.data() + end));
    i = end;
    context.progress(static_cast<double>(i) / static_cast<double>(blocks.size()));
  }
}

SampleRange surface_range(const Solid& solid, int axis) {
  openvdb::CoordBBox box;
  solid.impl().grid->tree().evalLeafBoundingBox(box);
  if (box.empty()) return {axis, 0, 0};
  const auto a = static_cast<std::size_t>(axis);
  return {axis, (box.min()[a] & ~7) - 8, (box.max()[a] | 7) + 1};
}

QuadLayer dual_surface(const Solid& solid, int axis, const Context& context) {
  QuadLayer all;
  const auto append = [&](QuadLayer&& layer) {
    all.points.insert(all.points.end(), layer.points.begin(), layer.points.end());
    all.quads.insert(all.quads.end(), layer.quads.begin(), layer.quads.end());
  };
  DualSurface(solid.grid(), axis).add(solid, surface_range(solid, axis), append, context);
  return all;
}

}  // namespace fibrolite
