// SPDX-License-Identifier: Apache-2.0
// Cells of 64^3 samples are halved down to blocks of 4^3. Each block hands down to its eight children only the
// triangles that may be nearest to some sample of them, so a block ends with a handful. A block whose centre is farther
// from the surface than its corners lies on one side; once the side is known, only the band on that side is followed.
#include "triangle_band.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "fibrolite/error.h"
#include "triangle_kernel.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using openvdb::Coord;

constexpr int cell_size = 64;
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

Coord cells_to_samples(int x, int y, int z) { return {x * cell_size, y * cell_size, z * cell_size}; }

enum Side : int { inside = -1, crossed = 0, outside = 1 };

struct Tile {
  Coord origin;
  int size;
};
struct Cell {
  std::vector<std::unique_ptr<Leaf>> leaves;
  std::vector<Tile> inner;
  std::int64_t sides_by_mesh = 0, sides_by_winding = 0;
};

struct Scratch {
  std::vector<TriangleFrame> frames;
  std::vector<std::uint32_t> all;
  std::vector<std::uint32_t> lists[4];  ///< For children of 32, 16, 8 and 4.
};

class Builder {
 public:
  Builder(const Mesh& mesh, const SurfaceTopology& topology, const WindingTree& winding, const BandParams& params)
      : mesh_(mesh),
        topology_(topology),
        winding_(winding),
        params_(params),
        scale_(1 / params.voxel_mm),
        reach_crossed_(std::max({params.outside_vox, params.inside_vox, crossed_reach})) {}

  Band run(const Context& context) {
    sort_into_cells();
    find_far_cells();
    const std::size_t n = cells_.size();
    std::vector<Cell> results(n);
    tbb::enumerable_thread_specific<Scratch> scratch;
    std::atomic<std::size_t> done{0};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 1), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        context.check();
        fill(cells_[i], scratch.local(), results[i]);
        context.progress(0.95 * static_cast<double>(++done) / static_cast<double>(n));
      }
    });
    Band band = assemble(results);
    context.progress(1);
    return band;
  }

 private:
  struct CellJob {
    Coord origin;
    int size;                  ///< 64, or 128 for a far one.
    std::size_t first, count;  ///< Its triangles in pairs_.
  };

  // ---- which cells there are ----

  [[nodiscard]] Vec3d in_voxels(std::uint32_t vertex) const { return scale_ * to_double(mesh_.vertices[vertex]); }
  [[nodiscard]] Coord cell_origin(std::uint64_t key) const {
    const auto y = static_cast<std::uint64_t>(cells_y_), z = static_cast<std::uint64_t>(cells_z_);
    return first_cell_ +
           cells_to_samples(static_cast<int>(key / (y * z)), static_cast<int>(key / z % y), static_cast<int>(key % z));
  }

  void sort_into_cells() {
    Box3d box;
    for (const Mesh::Triangle& t : mesh_.triangles) {
      for (const std::uint32_t v : t) box.include(in_voxels(v));
    }
    const double margin = reach_crossed_ + search_margin + 1.0;
    const auto floor_cell = [](double x) { return static_cast<std::int64_t>(std::floor(x / cell_size)); };
    const std::int64_t lo[3] = {floor_cell(box.min.x - margin), floor_cell(box.min.y - margin),
                                floor_cell(box.min.z - margin)};
    const std::int64_t hi[3] = {floor_cell(box.max.x + margin), floor_cell(box.max.y + margin),
                                floor_cell(box.max.z + margin)};
    // Whole nodes of 128, so that far ones can be decided at once.
    const auto even = [](std::int64_t x) { return x & ~std::int64_t{1}; };
    const auto count = [&](int a) { return even(hi[a]) + 2 - even(lo[a]); };
    cells_x_ = count(0), cells_y_ = count(1), cells_z_ = count(2);
    if (cells_x_ * cells_y_ > std::int64_t{1} << 32 ||
        cells_x_ * cells_y_ * cells_z_ >= std::int64_t{std::numeric_limits<std::uint32_t>::max()}) {
      throw Error(Code::TooLarge, "the model has more voxels than can be indexed", {}, "use a larger --voxel");
    }
    first_cell_ = Coord(static_cast<int>(even(lo[0]) * cell_size), static_cast<int>(even(lo[1]) * cell_size),
                        static_cast<int>(even(lo[2]) * cell_size));

    constexpr std::size_t chunk = 8192;
    const std::size_t n = mesh_.triangles.size(), chunks = (n + chunk - 1) / chunk;
    std::vector<std::vector<std::uint64_t>> parts(chunks);
    tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
      for (std::size_t t = c * chunk; t < std::min(n, (c + 1) * chunk); ++t) {
        touch_cells(static_cast<std::uint32_t>(t), parts[c]);
      }
    });
    std::size_t total = 0;
    for (const auto& part : parts) total += part.size();
    pairs_.reserve(total);
    for (auto& part : parts) {
      pairs_.insert(pairs_.end(), part.begin(), part.end());
      std::vector<std::uint64_t>().swap(part);
    }
    tbb::parallel_sort(pairs_.begin(), pairs_.end());
    for (std::size_t i = 0; i < pairs_.size();) {
      std::size_t end = i;
      while (end < pairs_.size() && pairs_[end] >> 32 == pairs_[i] >> 32) ++end;
      cells_.push_back({cell_origin(pairs_[i] >> 32), cell_size, i, end - i});
      i = end;
    }
  }

  /// The cells within reach of a triangle: of its box, and of its plane.
  void touch_cells(std::uint32_t triangle, std::vector<std::uint64_t>& pairs) const {
    const Mesh::Triangle& t = mesh_.triangles[triangle];
    const Vec3d origin{1.0 * first_cell_.x(), 1.0 * first_cell_.y(), 1.0 * first_cell_.z()};
    const Vec3d a = in_voxels(t[0]) - origin, b = in_voxels(t[1]) - origin, c = in_voxels(t[2]) - origin;
    Box3d box;
    box.include(a), box.include(b), box.include(c);
    box = box.grown(reach_crossed_ + search_margin);
    const Vec3d normal = normalized(cross(b - a, c - a));
    const double half = 0.5 * (cell_size - 1);
    const double limit =
        reach_crossed_ + search_margin + half * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z)) + 1e-3;
    // Samples of cell i lie in [64 i, 64 i + 63].
    const auto low = [](double x) { return static_cast<std::int64_t>(std::ceil((x - (cell_size - 1)) / cell_size)); };
    const auto high = [](double x) { return static_cast<std::int64_t>(std::floor(x / cell_size)); };
    for (std::int64_t x = low(box.min.x); x <= high(box.max.x); ++x) {
      for (std::int64_t y = low(box.min.y); y <= high(box.max.y); ++y) {
        for (std::int64_t z = low(box.min.z); z <= high(box.max.z); ++z) {
          const Vec3d center{64.0 * static_cast<double>(x) + half, 64.0 * static_cast<double>(y) + half,
                             64.0 * static_cast<double>(z) + half};
          if (std::abs(dot(center - a, normal)) > limit) continue;
          const auto cell = static_cast<std::uint64_t>((x * cells_y_ + y) * cells_z_ + z);
          pairs.push_back(cell << 32 | triangle);
        }
      }
    }
  }

  /// Cells that no triangle reaches still have a side: one job per free node of 128, else one per free cell.
  void find_far_cells() {
    std::vector<bool> taken(static_cast<std::size_t>(cells_x_ * cells_y_ * cells_z_), false);
    const auto key = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      return static_cast<std::size_t>((x * cells_y_ + y) * cells_z_ + z);
    };
    for (std::size_t i = 0; i < cells_.size(); ++i) taken[pairs_[cells_[i].first] >> 32] = true;
    const auto origin = [&](std::int64_t x, std::int64_t y, std::int64_t z) { return cell_origin(key(x, y, z)); };
    for (std::int64_t x = 0; x < cells_x_; x += 2) {
      for (std::int64_t y = 0; y < cells_y_; y += 2) {
        for (std::int64_t z = 0; z < cells_z_; z += 2) {
          int free = 0;
          for (int k = 0; k < 8; ++k) free += taken[key(x + (k >> 2), y + (k >> 1 & 1), z + (k & 1))] ? 0 : 1;
          if (free == 8) {
            cells_.push_back({origin(x, y, z), 2 * cell_size, 0, 0});
            continue;
          }
          for (int k = 0; k < 8; ++k) {
            const std::int64_t i = x + (k >> 2), j = y + (k >> 1 & 1), l = z + (k & 1);
            if (!taken[key(i, j, l)]) cells_.push_back({origin(i, j, l), cell_size, 0, 0});
          }
        }
      }
    }
  }

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

  /// The side of a block that no triangle crosses; `crossed` if the winding number may pass 1/2 within it.
  [[nodiscard]] Side side_by_winding(Vec3d p_vox, double radius) const {
    const double w = winding_.winding(params_.voxel_mm * p_vox);
    if (!topology_.closed() && std::abs(w - 0.5) <= winding_slope(p_vox, radius) * radius + 0.02) return crossed;
    return w > 0.5 ? inside : outside;
  }

  /// By the closest feature; `crossed` if it has no normal.
  [[nodiscard]] Side side_by_normal(const TriangleFrame& t, Vec3f p) const {
    const ClosestFeature f = closest_feature(t, p);
    const auto i = static_cast<std::size_t>(f.index);
    Vec3f normal{t.n[0], t.n[1], t.n[2]};
    if (f.kind == ClosestFeature::edge) normal = topology_.edge_normals[t.triangle][i];
    if (f.kind == ClosestFeature::vertex) {
      normal = topology_.vertex_normals[topology_.weld.id[mesh_.triangles[t.triangle][i]]];
    }
    const auto squared = [](Vec3f v) { return v.x * v.x + v.y * v.y + v.z * v.z; };
    const float along = f.offset.x * normal.x + f.offset.y * normal.y + f.offset.z * normal.z;
    if (!(along * along > 1e-8F * squared(f.offset) * squared(normal))) return crossed;
    return along > 0 ? outside : inside;
  }

  // ---- one cell ----

  struct Block {
    Vec3d cell_center;  ///< Voxels.
    Coord cell_middle;  ///< The sample just above the centre.
    Scratch& scratch;
    Cell& result;
  };

  void fill(const CellJob& job, Scratch& scratch, Cell& result) const {
    const double half = 0.5 * (job.size - 1);
    const Vec3d center{job.origin.x() + half, job.origin.y() + half, job.origin.z() + half};
    if (job.count == 0) {
      const Side side = side_by_winding(center, half * std::numbers::sqrt3);
      if (side == inside) result.inner.push_back({job.origin, job.size});
      if (side != crossed) return;
      if (job.size > cell_size) {
        for (int k = 0; k < 8; ++k) {
          fill({job.origin + cells_to_samples(k >> 2, k >> 1 & 1, k & 1), cell_size, 0, 0}, scratch, result);
        }
        return;
      }
    }
    scratch.frames.clear();
    scratch.all.clear();
    for (std::size_t i = 0; i < job.count; ++i) {
      const auto triangle = static_cast<std::uint32_t>(pairs_[job.first + i]);
      const Mesh::Triangle& t = mesh_.triangles[triangle];
      scratch.frames.push_back(
          make_frame(in_voxels(t[0]) - center, in_voxels(t[1]) - center, in_voxels(t[2]) - center, triangle));
      scratch.all.push_back(static_cast<std::uint32_t>(i));
    }
    const Block block{center, job.origin + Coord(cell_size / 2), scratch, result};
    split(block, {}, cell_size, crossed, scratch.all.data(), static_cast<int>(job.count),
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
      if (side == crossed && d > radius) {
        const Vec3f p{c.boxes.x[k], c.boxes.y[k], c.boxes.z[k]};
        const Vec3d world = block.cell_center + to_double(p);
        // The list holds all triangles within reach of the parent, so the nearest one is known this far from the
        // child's centre.
        const bool known = d <= reach + 0.5F * static_cast<float>(child) - 0.5F;
        if (!params_.by_winding && known) {
          c.side[k] = side_by_normal(block.scratch.frames[static_cast<std::size_t>(c.nearest.frame[k])], p);
        }
        if (c.side[k] == crossed) c.side[k] = side_by_winding(world, radius);
      }
      const float band = c.side[k] == outside ? params_.outside_vox : params_.inside_vox;
      const float margin = child >= 16 ? search_margin : 0.0F;
      c.reach[k] = c.side[k] == crossed ? reach_crossed_ + margin : d - radius > band ? -1.0F : band;
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
      if (c.side[k] != crossed && c.counts[k] == 0) {
        if (c.side[k] == inside) block.result.inner.push_back({origin, child});
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
    const bool winding = params_.by_winding && side == crossed;
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
          if (child == crossed) {
            const Vec3f p{corner.x + static_cast<float>(i >> 4), corner.y + static_cast<float>(i >> 2 & 3),
                          corner.z + static_cast<float>(i & 3)};
            sample = value < rounding_vox ? outside
                                          : side_by_normal(block.scratch.frames[static_cast<std::size_t>(frame[i])], p);
            if (sample == crossed) sample = inside_by_winding(block.cell_center + to_double(p)) ? inside : outside;
          }
          if (sample == inside) value = -value;
        }
        values[at + (i >> 4) * 64 + (i >> 2 & 3) * 8 + (i & 3)] = value;
      }
    }
    if (winding) sides_by_winding(block, center, values);
    store(origin, values, block.result);
  }

  /// Signs for unsigned distances. Two neighbours whose distances add up to more than their spacing have no triangle
  /// between them, so one query does for all samples so connected, as long as the border is too far to change the
  /// number among them.
  void sides_by_winding(const Block& block, Vec3f center, float* values) const {
    constexpr int size = Leaf::SIZE;
    const Vec3d corner = block.cell_center + to_double(center) - Vec3d{3.5, 3.5, 3.5};
    const auto point = [&](int i) { return corner + Vec3d{1.0 * (i >> 6), 1.0 * (i >> 3 & 7), 1.0 * (i & 7)}; };
    float distances[size];
    std::copy_n(values, size, distances);
    const bool tame =
        topology_.closed() || winding_slope(block.cell_center + to_double(center), 6.1) * 3 * Leaf::DIM < 0.2;
    bool done[size] = {};
    int stack[size];
    for (int seed = 0; seed < size; ++seed) {
      if (done[seed]) continue;
      const double w = winding_.winding(params_.voxel_mm * point(seed));
      const float sign = w > 0.5 ? -1.0F : 1.0F;
      done[seed] = true;
      values[seed] = sign * distances[seed];
      if (!tame || std::abs(w - 0.5) < 0.25) {
        values[seed] = sign * std::min(distances[seed], voxels_per_turn * static_cast<float>(std::abs(w - 0.5)));
        continue;
      }
      int height = 0;
      stack[height++] = seed;
      while (height > 0) {
        const int i = stack[--height];
        const auto visit = [&](int j) {
          if (done[j] || !(distances[i] + distances[j] > 1.001F)) return;
          done[j] = true;
          values[j] = sign * distances[j];
          stack[height++] = j;
        };
        if ((i >> 6) > 0) visit(i - 64);
        if ((i >> 6) < 7) visit(i + 64);
        if ((i >> 3 & 7) > 0) visit(i - 8);
        if ((i >> 3 & 7) < 7) visit(i + 8);
        if ((i & 7) > 0) visit(i - 1);
        if ((i & 7) < 7) visit(i + 1);
      }
    }
    const auto compare = [&](int i, int j) {
      if ((values[i] < 0) == (values[j] < 0)) return;
      (distances[i] + distances[j] > 1.05F ? block.result.sides_by_winding : block.result.sides_by_mesh) += 1;
    };
    for (int i = 0; i < size; ++i) {
      if ((i >> 6) < 7) compare(i, i + 64);
      if ((i >> 3 & 7) < 7) compare(i, i + 8);
      if ((i & 7) < 7) compare(i, i + 1);
    }
  }

  /// Clamp to the band, nudge what lies on the surface, and keep the leaf if any value is in the band.
  void store(const Coord& origin, const float* values, Cell& result) const {
    const auto voxel = static_cast<float>(params_.voxel_mm);
    const float lowest = -params_.inside_vox, highest = params_.outside_vox;
    auto leaf = std::make_unique<Leaf>(origin, voxel * highest, false);
    float* out = leaf->buffer().data();
    openvdb::util::NodeMask<3> active;
    bool any = false, negative = false;
    for (openvdb::Index x = 0; x < 8; ++x) {
      std::uint64_t word = 0;
      for (openvdb::Index i = 0; i < 64; ++i) {
        float v = std::clamp(values[x * 64 + i], lowest, highest);
        if (std::abs(v) < rounding_vox) v = nudge_vox;
        word |= std::uint64_t{v > lowest && v < highest} << i;
        out[x * 64 + i] = voxel * v;
        negative = negative || v < 0;
      }
      active.getWord<std::uint64_t>(x) = word;
      any = any || word != 0;
    }
    if (any) {
      leaf->setValueMask(active);
      result.leaves.push_back(std::move(leaf));
    } else if (negative) {
      result.inner.push_back({origin, 8});
    }
  }

  // ---- the tree ----

  [[nodiscard]] Band assemble(std::vector<Cell>& cells) const {
    const auto voxel = static_cast<float>(params_.voxel_mm);
    const float inner = -voxel * params_.inside_vox;
    Band band;
    band.tree = std::make_shared<Tree>(voxel * params_.outside_vox);
    Tree& tree = *band.tree;
    openvdb::tree::ValueAccessor<Tree> accessor(tree);
    for (Cell& cell : cells) {
      for (auto& leaf : cell.leaves) accessor.addLeaf(leaf.release());
      for (const Tile& tile : cell.inner) {
        if (tile.size == 128) {
          tree.addTile(2, tile.origin, inner, false);
          continue;
        }
        for (int x = 0; x < tile.size; x += 8) {
          for (int y = 0; y < tile.size; y += 8) {
            for (int z = 0; z < tile.size; z += 8) accessor.addTile(1, tile.origin + Coord(x, y, z), inner, false);
          }
        }
      }
      band.sides_by_mesh += cell.sides_by_mesh;
      band.sides_by_winding += cell.sides_by_winding;
    }
    return band;
  }

  const Mesh& mesh_;
  const SurfaceTopology& topology_;
  const WindingTree& winding_;
  const BandParams params_;
  const double scale_;
  const float reach_crossed_;
  Coord first_cell_;
  std::int64_t cells_x_ = 0, cells_y_ = 0, cells_z_ = 0;
  std::vector<std::uint64_t> pairs_;  ///< cell << 32 | triangle, sorted
  std::vector<CellJob> cells_;
};

}  // namespace

Band triangle_band(const Mesh& mesh, const SurfaceTopology& topology, const WindingTree& winding,
                   const BandParams& params, const Context& context) {
  return Builder(mesh, topology, winding, params).run(context);
}

}  // namespace fibrolite
