// SPDX-License-Identifier: Apache-2.0
// Cells of 64^3 samples are halved down to blocks of 4^3. Each block hands down to its eight children only the
// triangles that may be nearest to some sample of them, so a block ends with a handful. A block whose centre is farther
// from the surface than its corners lies on one side; once the side is known, only the band on that side is followed.
#include "triangle_band.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <vector>

#include "band_check.h"
#include "fibrolite/clones.h"
#include "inner_tiles.h"
#include "leaf_bits.h"
#include "triangle_cells.h"
#include "triangle_kernel.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using openvdb::Coord;
using openvdb::CoordBBox;

constexpr int cell_size = TriangleCells::size;
/// Blocks of 8 and less that the surface may cross need every triangle this near (voxels): their corners are at
/// most 6.07 from their centre, a surface point at most as far again from the centre of a half block.
constexpr float crossed_reach = 8.2F;
/// How much farther the lists of larger blocks reach, so that the nearest triangle of a block that is found to lie
/// beyond the band is known, and its side with it, without a query of the winding number. Voxels.
constexpr float search_margin = 8;
/// Values this near to zero (voxels) are rounding: a surface that runs through samples.
constexpr float rounding_vox = 1e-4F, nudge_vox = 1e-3F;
/// Voxels from the surface w = 1/2 per unit of winding number, where no triangle tells the distance.
constexpr float voxels_per_turn = 4;

CoordBBox everywhere() { return CoordBBox::inf(); }

CoordBBox cube(const Coord& origin, int size) { return CoordBBox::createCube(origin, size); }
Coord cells_to_samples(int x, int y, int z) { return {x * cell_size, y * cell_size, z * cell_size}; }

enum Side : int { Inside = -1, Crossed = 0, Outside = 1 };

/// A leaf's values, in voxels and as they are stored.
FIBROLITE_CLONES void keep_in_band(const float* values, float lowest, float highest, float voxel, float* kept,
                                   float* stored) {
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const float some = values[i] < lowest ? lowest : values[i], v = highest < some ? highest : some;
    const float off = std::copysign(nudge_vox, v);
    kept[i] = std::abs(v) < rounding_vox ? off : v;
    stored[i] = voxel * kept[i];
  }
}

struct Tile {
  Coord origin;
  int size;
};
struct Cell {
  std::vector<std::unique_ptr<Leaf>> leaves;
  std::vector<Tile> inner;
  std::int64_t inside_samples = 0, doubtful_samples = 0;
  bool overlap = false;  ///< A winding number that is neither 0 nor 1 in a place thicker than a voxel.
};

struct Scratch {
  std::vector<TriangleFrame> frames;
  std::vector<std::uint32_t> all;
  std::vector<std::uint32_t> lists[4];  ///< For children of 32, 16, 8 and 4.
};

}  // namespace

class TriangleBand::Builder {
 public:
  Builder(const Mesh& mesh, const SurfaceTopology& topology, const WindingTree& winding, const BandParams& params)
      : mesh_(mesh),
        topology_(topology),
        winding_(winding),
        params_(params),
        scale_(1 / params.voxel_mm),
        reach_crossed_(std::max({params.outside_vox, params.inside_vox, crossed_reach})),
        cells_(triangle_cells(mesh, params.voxel_mm, reach_crossed_ + search_margin)),
        settled_(cells_.cells.size(), params.by_winding) {
    for (std::size_t i = 0; i < cells_.cells.size(); ++i) place_[cells_.cells[i].origin] = i;
  }

  Band whole(const Context& context) {
    std::vector<std::size_t> all(cells_.cells.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    Band band{.tree = empty_tree()};
    put(fill(all, everywhere(), context.part(0, 0.9, "")), everywhere(), band);
    if (!params_.by_winding) settle(band, context);
    context.progress(1);
    return band;
  }

  Band survey(const Context& context) {
    Band total;
    std::vector<std::size_t> again;
    const auto look = [&](Band& band, const CoordBBox& box, const CoordBBox& known, const Context& here) {
      put(fill(cells_in(box), box, here), box, band);
      total.overlap = total.overlap || band.overlap;
      const std::vector<std::size_t> found = unsettled(contradictions(*band.tree, params_.voxel_mm, known));
      again.insert(again.end(), found.begin(), found.end());
    };
    const CoordBBox all = samples();
    const int rows = (all.dim().x() + cell_size - 1) / cell_size;
    Tree::Ptr before = empty_tree();
    for (int row = 0; row < rows && !total.overlap; ++row) {
      CoordBBox box = all;
      box.min().x() = all.min().x() + row * cell_size;
      box.max().x() = box.min().x() + cell_size - 1;
      Band band{.tree = empty_tree()};
      move_blocks(*before, box.min().x() - 8, all, *band.tree);
      before.reset();         // one row in memory at a time
      CoordBBox known = box;  // the last blocks of the row before too, so that each two neighbours are seen together
      known.min().x() -= 8;
      if (row + 1 == rows) known.max().x() += 8;
      look(band, box, known, context.part(0.8 * row / rows, 0.8 * (row + 1) / rows, ""));
      before = band.tree;
    }
    before.reset();
    while (!again.empty() && !total.overlap) {
      std::map<int, CoordBBox> changed;  // by row
      for (const std::size_t i : again) {
        settled_[i] = true;
        const TriangleCells::Cell& cell = cells_.cells[i];
        changed[cell.origin.x()].expand(cube(cell.origin, cell.size));
      }
      again.clear();
      for (auto& [row, box] : changed) {
        box.expand(8);
        Band band{.tree = empty_tree()};
        look(band, box, box, context.part(0.8, 0.9, ""));
      }
      std::sort(again.begin(), again.end());
      again.erase(std::unique(again.begin(), again.end()), again.end());
    }
    total.cells_by_winding = std::count(settled_.begin(), settled_.end(), true);
    return total;
  }

  [[nodiscard]] Tree::Ptr within(const CoordBBox& box, const Context& context) const {
    Band band{.tree = empty_tree()};
    put(fill(cells_in(box), box, context), box, band);
    return band.tree;
  }

  [[nodiscard]] CoordBBox samples() const {
    CoordBBox box;
    for (const TriangleCells::Cell& cell : cells_.cells) box.expand(cell.origin, static_cast<unsigned>(cell.size));
    return box;
  }

 private:
  [[nodiscard]] Vec3d in_voxels(std::uint32_t vertex) const { return scale_ * to_double(mesh_.vertices[vertex]); }

  // ---- sides ----

  [[nodiscard]] bool inside_by_winding(Vec3d p_vox) const { return winding_.winding(params_.voxel_mm * p_vox) > 0.5; }

  /// How fast the winding number can change, per voxel, within `radius` voxels of p and off the triangles: by Biot and
  /// Savart's law, from the border alone.
  [[nodiscard]] double winding_slope(Vec3d p_vox, double radius) const {
    double slope = 0;
    for (const auto& edge : topology_.border) {
      const Vec3d a = scale_ * edge.from - p_vox, along = scale_ * (edge.to - edge.from);
      const double length2 = dot(along, along);
      const double s = length2 > 0 ? std::clamp(-dot(a, along) / length2, 0.0, 1.0) : 0.0;
      const double gap = norm(a + s * along) - radius;
      if (gap < 1) return 1;
      slope += std::abs(edge.times) * std::sqrt(length2) / (4 * std::numbers::pi * gap * gap);
      if (slope > 1) return 1;
    }
    return slope;
  }

  /// The side of a block that no triangle crosses; `Crossed` if the winding number may pass 1/2 within it.
  [[nodiscard]] Side side_by_winding(Vec3d p_vox, double radius, Cell& result) const {
    const double w = winding_.winding(params_.voxel_mm * p_vox);
    result.overlap = result.overlap || w > 1.5 || w < -0.5;
    if (!topology_.closed() && std::abs(w - 0.5) <= winding_slope(p_vox, radius) * radius + 0.02) return Crossed;
    return w > 0.5 ? Inside : Outside;
  }

  /// By the closest feature; `Crossed` if it has no normal.
  [[nodiscard]] Side side_by_normal(const TriangleFrame& t, Vec3f p) const {
    const ClosestFeature f = closest_feature(t, p);
    const auto i = static_cast<std::size_t>(f.index);
    Vec3f normal{t.n[0], t.n[1], t.n[2]};
    if (f.kind == ClosestFeature::Edge) normal = topology_.edge_normals[t.triangle][i];
    if (f.kind == ClosestFeature::Vertex) {
      normal = topology_.vertex_normals[topology_.weld.id[mesh_.triangles[t.triangle][i]]];
    }
    const auto squared = [](Vec3f v) { return v.x * v.x + v.y * v.y + v.z * v.z; };
    const float along = f.offset.x * normal.x + f.offset.y * normal.y + f.offset.z * normal.z;
    if (!(along * along > 1e-8F * squared(f.offset) * squared(normal))) return Crossed;
    return along > 0 ? Outside : Inside;
  }

  // ---- cells ----

  [[nodiscard]] Tree::Ptr empty_tree() const {
    return std::make_shared<Tree>(static_cast<float>(params_.voxel_mm) * params_.outside_vox);
  }

  [[nodiscard]] std::vector<std::size_t> cells_in(const CoordBBox& box) const {
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < cells_.cells.size(); ++i) {
      if (box.hasOverlap(cube(cells_.cells[i].origin, cells_.cells[i].size))) which.push_back(i);
    }
    return which;
  }

  /// Only blocks in `box` are made.
  [[nodiscard]] std::vector<Cell> fill(const std::vector<std::size_t>& which, const CoordBBox& box,
                                       const Context& context) const {
    std::vector<Cell> results(which.size());
    tbb::enumerable_thread_specific<Scratch> scratch;
    std::atomic<std::size_t> done{0};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, which.size(), 1), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        context.check();
        fill_cell(cells_.cells[which[i]], settled_[which[i]], box, scratch.local(), results[i]);
        context.progress(static_cast<double>(++done) / static_cast<double>(which.size()));
      }
    });
    return results;
  }

  void put(std::vector<Cell> cells, const CoordBBox& box, Band& band) const {
    const float inner = -static_cast<float>(params_.voxel_mm) * params_.inside_vox;
    openvdb::tree::ValueAccessor<Tree> accessor(*band.tree);
    for (Cell& cell : cells) {
      for (auto& leaf : cell.leaves) accessor.addLeaf(leaf.release());
      for (const Tile& tile : cell.inner) {
        CoordBBox part = cube(tile.origin, tile.size);
        if (tile.size == 2 * cell_size && box.isInside(part)) {
          accessor.addTile(2, tile.origin, inner, false);
          continue;
        }
        part.intersect(box);
        for (int x = part.min().x(); x <= part.max().x(); x += 8) {
          for (int y = part.min().y(); y <= part.max().y(); y += 8) {
            for (int z = part.min().z(); z <= part.max().z(); z += 8) accessor.addTile(1, Coord(x, y, z), inner, false);
          }
        }
      }
      band.inside_samples += cell.inside_samples;
      band.doubtful_samples += cell.doubtful_samples;
      band.overlap = band.overlap || cell.overlap;
    }
  }

  /// Blocks of one layer across x.
  static void move_blocks(Tree& from, int x, const CoordBBox& all, Tree& to) {
    std::vector<const Leaf*> leaves;
    from.getNodes(leaves);
    for (const Leaf* leaf : leaves) {
      const Coord origin = leaf->origin();
      if (origin.x() == x) to.addLeaf(from.stealNode<Leaf>(origin, from.background(), false));
    }
    CoordBBox layer = all;
    layer.min().x() = x;
    layer.max().x() = x + 7;
    for (CoordBBox tile : inner_tiles(from)) {
      const float inside = from.getValue(tile.min());
      tile.intersect(layer);
      for (int y = tile.min().y(); y <= tile.max().y() && !tile.empty(); y += 8)
        for (int z = tile.min().z(); z <= tile.max().z(); z += 8) to.addTile(1, Coord(x, y, z), inside, false);
    }
  }

  /// Cells of blocks with sides that contradict each other, not yet settled by winding number; sorted.
  [[nodiscard]] std::vector<std::size_t> unsettled(const std::vector<Coord>& blocks) const {
    std::vector<std::size_t> found;
    for (const Coord& block : blocks) {
      auto cell = place_.find(block & ~(cell_size - 1));
      if (cell == place_.end()) cell = place_.find(block & ~(2 * cell_size - 1));
      if (cell != place_.end() && !settled_[cell->second]) found.push_back(cell->second);
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  /// Where a surface meets itself, the closest feature may tell the wrong side. Sides that contradict each other show
  /// it: their cells are filled again by winding number, and so on while that contradicts their neighbours.
  void settle(Band& band, const Context& context) {
    std::vector<std::size_t> again;
    if (!band.overlap) again = unsettled(contradictions(*band.tree, params_.voxel_mm));
    while (!again.empty() && !band.overlap) {
      context.check();
      band.cells_by_winding += static_cast<std::int64_t>(again.size());
      openvdb::tree::ValueAccessor<Tree> accessor(*band.tree);
      std::vector<CoordBBox> changed;
      for (const std::size_t i : again) {
        settled_[i] = true;
        const TriangleCells::Cell& cell = cells_.cells[i];
        changed.push_back(cube(cell.origin, cell.size));
        for (int x = 0; x < cell.size; x += 8) {
          for (int y = 0; y < cell.size; y += 8) {
            for (int z = 0; z < cell.size; z += 8) {
              accessor.addTile(1, cell.origin + Coord(x, y, z), band.tree->background(), false);
            }
          }
        }
      }
      put(fill(again, everywhere(), context.part(0.9, 1, "")), everywhere(), band);
      again = unsettled(contradictions_around(changed, *band.tree, params_.voxel_mm));
    }
  }

  struct Block {
    Vec3d cell_center;  ///< Voxels.
    Coord cell_middle;  ///< The sample just above the centre.
    bool by_winding;
    const CoordBBox& box;  ///< What is wanted.
    Scratch& scratch;
    Cell& result;
  };

  void fill_cell(const TriangleCells::Cell& job, bool by_winding, const CoordBBox& box, Scratch& scratch,
                 Cell& result) const {
    const double half = 0.5 * (job.size - 1);
    const Vec3d center{job.origin.x() + half, job.origin.y() + half, job.origin.z() + half};
    if (job.count == 0) {
      const Side side = side_by_winding(center, half * std::numbers::sqrt3, result);
      if (side == Inside) result.inner.push_back({job.origin, job.size});
      if (side != Crossed) return;
      if (job.size > cell_size) {
        for (int k = 0; k < 8; ++k) {
          fill_cell({job.origin + cells_to_samples(k >> 2, k >> 1 & 1, k & 1), cell_size, 0, 0}, by_winding, box,
                    scratch, result);
        }
        return;
      }
    }
    scratch.frames.clear();
    scratch.all.clear();
    for (std::size_t i = 0; i < job.count; ++i) {
      const auto triangle = static_cast<std::uint32_t>(cells_.triangles[job.first + i]);
      const Mesh::Triangle& t = mesh_.triangles[triangle];
      scratch.frames.push_back(
          make_frame(in_voxels(t[0]) - center, in_voxels(t[1]) - center, in_voxels(t[2]) - center, triangle));
      scratch.all.push_back(static_cast<std::uint32_t>(i));
    }
    const Block block{center, job.origin + Coord(cell_size / 2), by_winding, box, scratch, result};
    split(block, {}, cell_size, Crossed, scratch.all.data(), static_cast<int>(job.count),
          reach_crossed_ + search_margin);
  }

  static EightBoxes children_of(Vec3f center, int size) {
    EightBoxes boxes;
    const auto quarter = static_cast<float>(size) / 4;
    for (int k = 0; k < 8; ++k) {
      boxes.x[k] = center.x + ((k & 4) != 0 ? quarter : -quarter);
      boxes.y[k] = center.y + ((k & 2) != 0 ? quarter : -quarter);
      boxes.z[k] = center.z + ((k & 1) != 0 ? quarter : -quarter);
    }
    boxes.half = quarter - 0.5F;
    return boxes;
  }

  /// The eight children of a block, each with its side, its triangles, and how far those are complete.
  struct Children {
    EightBoxes boxes;
    EightNearest nearest;
    Side side[8];
    float reach[8];  ///< Negative: nothing of the band lies in this child.
    std::uint32_t* lists[8];
    int counts[8];
  };

  void divide(const Block& block, Vec3f center, int size, Side side, const std::uint32_t* list, int count, float reach,
              Children& c) const {
    const int child = size / 2;
    c.boxes = children_of(center, size);
    const float radius = c.boxes.half * std::numbers::sqrt3_v<float> + 1e-3F;
    nearest_to_centers(block.scratch.frames.data(), list, count, c.boxes, c.nearest);
    for (int k = 0; k < 8; ++k) {
      const float d = std::sqrt(c.nearest.d2[k]);
      c.side[k] = side;
      if (side == Crossed && d > radius) {
        const Vec3f p{c.boxes.x[k], c.boxes.y[k], c.boxes.z[k]};
        const Vec3d world = block.cell_center + to_double(p);
        // The list holds all triangles within reach of the parent, so the nearest one is known this far from the
        // child's centre.
        const bool known = d <= reach + 0.5F * static_cast<float>(child) - 0.5F;
        if (!block.by_winding && known) {
          c.side[k] = side_by_normal(block.scratch.frames[static_cast<std::size_t>(c.nearest.frame[k])], p);
        }
        if (c.side[k] == Crossed) c.side[k] = side_by_winding(world, radius, block.result);
      }
      const float band = c.side[k] == Outside ? params_.outside_vox : params_.inside_vox;
      const float margin = child >= 16 ? search_margin : 0.0F;
      c.reach[k] = c.side[k] == Crossed ? reach_crossed_ + margin : d - radius > band ? -1.0F : band;
    }
    std::vector<std::uint32_t>& room = block.scratch.lists[size == 64 ? 0 : size == 32 ? 1 : size == 16 ? 2 : 3];
    const auto n = static_cast<std::size_t>(count) + 1;  // cull writes one past what it keeps
    if (room.size() < 8 * n) room.resize(8 * n);
    for (std::size_t k = 0; k < 8; ++k) c.lists[k] = room.data() + k * n;
    std::fill_n(c.counts, 8, 0);
    if (count > 0) cull(block.scratch.frames.data(), list, count, c.boxes, c.nearest, c.reach, c.lists, c.counts);
  }

  void split(const Block& block, Vec3f center, int size, Side side, const std::uint32_t* list, int count,
             float reach) const {
    Children c;
    divide(block, center, size, side, list, count, reach, c);
    const int child = size / 2;
    for (int k = 0; k < 8; ++k) {
      const Vec3f p{c.boxes.x[k], c.boxes.y[k], c.boxes.z[k]};
      const auto low = [&](float x) {
        return static_cast<int>(std::lround(x - c.boxes.half + 0.5F * (cell_size - 1))) - cell_size / 2;
      };
      const Coord origin = block.cell_middle + Coord(low(p.x), low(p.y), low(p.z));
      if (!block.box.hasOverlap(cube(origin, child))) continue;
      if (c.side[k] != Crossed && c.counts[k] == 0) {
        if (c.side[k] == Inside) block.result.inner.push_back({origin, child});
      } else if (child > 8) {
        split(block, p, child, c.side[k], c.lists[k], c.counts[k], c.reach[k]);
      } else {
        leaf(block, p, origin, c.side[k], c.lists[k], c.counts[k], c.reach[k]);
      }
    }
  }

  // ---- one leaf ----

  void leaf(const Block& block, Vec3f center, const Coord& origin, Side side, const std::uint32_t* list, int count,
            float reach) const {
    alignas(32) float values[Leaf::SIZE];  // voxels
    Children c;
    divide(block, center, Leaf::DIM, side, list, count, reach, c);
    const bool winding = block.by_winding && side == Crossed;
    for (int k = 0; k < 8; ++k) {
      const int at = ((k >> 2) * 64 + (k >> 1 & 1) * 8 + (k & 1)) * 4;
      const Side child = c.side[k];
      alignas(32) float d2[64];
      alignas(32) std::int32_t frame[64];
      const Vec3f corner{c.boxes.x[k] - 1.5F, c.boxes.y[k] - 1.5F, c.boxes.z[k] - 1.5F};
      distances_64(block.scratch.frames.data(), c.lists[k], c.counts[k], corner, d2, frame);
      for (int i = 0; i < 64; ++i) {
        float value = std::sqrt(d2[i]);
        if (!winding) {
          Side sample = child;
          if (child == Crossed) {
            const Vec3f p{corner.x + static_cast<float>(i >> 4), corner.y + static_cast<float>(i >> 2 & 3),
                          corner.z + static_cast<float>(i & 3)};
            sample = value < rounding_vox ? Outside
                                          : side_by_normal(block.scratch.frames[static_cast<std::size_t>(frame[i])], p);
            if (sample == Crossed) sample = inside_by_winding(block.cell_center + to_double(p)) ? Inside : Outside;
          }
          if (sample == Inside) value = -value;
        }
        values[at + (i >> 4) * 64 + (i >> 2 & 3) * 8 + (i & 3)] = value;
      }
    }
    if (winding) sides_by_winding(block, center, values);
    store(origin, values, block.result);
  }

  /// Signs for unsigned distances. Two neighbours whose distances add up to more than their spacing have no triangle
  /// between them, so one query does for all samples so connected, as far as the border lets the number be the same.
  void sides_by_winding(const Block& block, Vec3f center, float* values) const {
    constexpr int size = Leaf::SIZE;
    const Vec3d middle = block.cell_center + to_double(center), corner = middle - Vec3d{3.5, 3.5, 3.5};
    const auto point = [&](int i) { return corner + Vec3d{1.0 * (i >> 6), 1.0 * (i >> 3 & 7), 1.0 * (i & 7)}; };
    const double slope = topology_.closed() ? 0 : winding_slope(middle, 6.1);
    float distances[size];
    std::copy_n(values, size, distances);
    int steps[size], queue[size];
    std::fill_n(steps, size, -1);
    for (int seed = 0; seed < size; ++seed) {
      if (steps[seed] >= 0) continue;
      const double w = winding_.winding(params_.voxel_mm * point(seed)), off = std::abs(w - 0.5);
      // On an outer wall the number lies between 0 and 1, and the sample counts as outside; on an inner one above 1.
      const float sign = w > (distances[seed] < rounding_vox ? 0.98 : 0.5) ? -1.0F : 1.0F;
      steps[seed] = 0;
      values[seed] = sign * (topology_.closed() ? distances[seed]
                                                : std::min(distances[seed], voxels_per_turn * static_cast<float>(off)));
      float deepest = distances[seed];
      int begin = 0, end = 0;
      queue[end++] = seed;
      while (begin < end) {
        const int i = queue[begin++];
        const int step = steps[i] + 1;
        if (off - slope * step < (topology_.closed() ? 0.0 : 0.25)) break;
        const auto visit = [&](int j) {
          if (steps[j] >= 0 || !(distances[i] + distances[j] > 1.001F)) return;
          steps[j] = step;
          values[j] = sign * distances[j];
          deepest = std::max(deepest, distances[j]);
          queue[end++] = j;
        };
        if ((i >> 6) > 0) visit(i - 64);
        if ((i >> 6) < 7) visit(i + 64);
        if ((i >> 3 & 7) > 0) visit(i - 8);
        if ((i >> 3 & 7) < 7) visit(i + 8);
        if ((i & 7) > 0) visit(i - 1);
        if ((i & 7) < 7) visit(i + 1);
      }
      if ((w > 1.5 || w < -0.5) && deepest > 0.75F) block.result.overlap = true;
      if (sign < 0) block.result.inside_samples += end;
      if (sign < 0 && w < 0.75) block.result.doubtful_samples += end;
    }
  }

  /// Clamp to the band, nudge what lies on the surface, and keep the leaf if any value is in the band.
  void store(const Coord& origin, const float* values, Cell& result) const {
    const auto voxel = static_cast<float>(params_.voxel_mm);
    const float lowest = -params_.inside_vox, highest = params_.outside_vox;
    auto leaf = std::make_unique<Leaf>(origin, voxel * highest, false);
    float kept[Leaf::SIZE];
    keep_in_band(values, lowest, highest, voxel, kept, leaf->buffer().data());
    const LeafBits under = bits_below(kept, highest),
                   lowest_or_less = bits_below(kept, std::nextafter(lowest, highest));
    const bool negative = bits_below(kept, 0) != LeafBits{};
    openvdb::util::NodeMask<3> active;
    bool any = false;
    for (std::size_t x = 0; x < under.size(); ++x) {
      const std::uint64_t word = under[x] & ~lowest_or_less[x];
      active.getWord<std::uint64_t>(static_cast<openvdb::Index>(x)) = word;
      any = any || word != 0;
    }
    if (any) {
      leaf->setValueMask(active);
      result.leaves.push_back(std::move(leaf));
    } else if (negative) {
      result.inner.push_back({origin, 8});
    }
  }

  const Mesh& mesh_;
  const SurfaceTopology& topology_;
  const WindingTree& winding_;
  const BandParams params_;
  const double scale_;
  const float reach_crossed_;
  const TriangleCells cells_;
  std::map<Coord, std::size_t> place_;  ///< Of each cell, by its origin.
  std::vector<bool> settled_;           ///< Cells whose sides are told by winding number.
};

TriangleBand::TriangleBand(const Mesh& mesh, const SurfaceTopology& topology, const WindingTree& winding,
                           const BandParams& params)
    : builder_(std::make_unique<Builder>(mesh, topology, winding, params)) {}
TriangleBand::~TriangleBand() = default;

Band TriangleBand::whole(const Context& context) { return builder_->whole(context); }
Band TriangleBand::survey(const Context& context) { return builder_->survey(context); }
openvdb::FloatTree::Ptr TriangleBand::within(const CoordBBox& box, const Context& context) const {
  return builder_->within(box, context);
}
CoordBBox TriangleBand::samples() const { return builder_->samples(); }

}  // namespace fibrolite
