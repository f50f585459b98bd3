// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "fibrolite/error.h"
#include "label_field.h"

namespace fibrolite {
namespace {

constexpr int block_cells = 4;                // cells along a block's edge
constexpr int block_nodes = block_cells + 1;  // samples along it: the faces are stored on both sides
constexpr int nodes_per_block = block_nodes * block_nodes * block_nodes;

// A cube of 4 x 4 x 4 cells. With one label there is nothing to store.
struct Block {
  std::vector<std::uint16_t> labels;  // those that are nearer than the clamp somewhere in the block, ascending
  std::vector<float> phi;             // [label][node], empty if there is one label only
};

// Where a point lies: block, cell corner in the block, weights.
struct Place {
  std::size_t block = 0;
  int node = 0;
  float u = 0, v = 0, w = 0;
};

constexpr int node_index(int i, int j, int k) { return (k * block_nodes + j) * block_nodes + i; }

float trilinear(const float* phi, const Place& at) {
  const float* c = phi + at.node;
  constexpr int dy = block_nodes;
  constexpr int dz = block_nodes * block_nodes;
  const float x00 = c[0] + at.u * (c[1] - c[0]);
  const float x10 = c[dy] + at.u * (c[dy + 1] - c[dy]);
  const float x01 = c[dz] + at.u * (c[dz + 1] - c[dz]);
  const float x11 = c[dz + dy] + at.u * (c[dz + dy + 1] - c[dz + dy]);
  const float y0 = x00 + at.v * (x10 - x00);
  const float y1 = x01 + at.v * (x11 - x01);
  return y0 + at.w * (y1 - y0);
}

struct Range {
  int first = 0, last = 0;
};

}  // namespace

struct Labels::Impl {
  struct Fields {
    Vec3d origin{};
    double voxel_mm = 1;
    std::array<int, 3> cells{1, 1, 1};
    std::array<int, 3> blocks_along{1, 1, 1};
    float clamp_mm = far_mm;
    std::vector<Block> blocks;

    [[nodiscard]] double scaled(double p, int axis) const { return (p - origin[axis]) / voxel_mm; }
    [[nodiscard]] std::size_t block_at(int i, int j, int k) const {
      return (static_cast<std::size_t>(k) * static_cast<std::size_t>(blocks_along[1]) + static_cast<std::size_t>(j)) *
                 static_cast<std::size_t>(blocks_along[0]) +
             static_cast<std::size_t>(i);
    }
    // Points beyond the lattice read its nearest point.
    [[nodiscard]] Place place(Vec3d p) const {
      std::array<int, 3> cell{};
      std::array<float, 3> weight{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double s = std::clamp(scaled(p[static_cast<int>(axis)], static_cast<int>(axis)), 0.0,
                                    static_cast<double>(cells[axis]));
        cell[axis] = std::min(static_cast<int>(s), cells[axis] - 1);
        weight[axis] = static_cast<float>(s - cell[axis]);
      }
      return {block_at(cell[0] / block_cells, cell[1] / block_cells, cell[2] / block_cells),
              node_index(cell[0] % block_cells, cell[1] % block_cells, cell[2] % block_cells), weight[0], weight[1],
              weight[2]};
    }
    [[nodiscard]] Range cell_range(double lo, double hi, int axis) const {
      const int last = cells[static_cast<std::size_t>(axis)] - 1;
      const auto cell = [&](double p) {
        return static_cast<int>(std::clamp(std::floor(scaled(p, axis)), 0.0, static_cast<double>(last)));
      };
      return {cell(lo), cell(hi)};
    }
    // The fields of one block as (own, nearest other) of a group of labels.
    template <class Visit>
    void each_label(const Block& block, const Place& at, Visit&& visit) const {
      if (block.phi.empty()) {
        visit(block.labels.front(), -clamp_mm);
        return;
      }
      for (std::size_t l = 0; l < block.labels.size(); ++l)
        visit(block.labels[l], trilinear(block.phi.data() + l * nodes_per_block, at));
    }
  };
  // What a core takes from a stored label.
  struct Carved {
    Shape mantle;
    int host = 0;  // stored label
    int name = 0;
  };
  std::shared_ptr<const Fields> fields;  // none: one label everywhere
  std::vector<int> name;                 // of each stored label
  int count = 1;
  std::optional<Frame> frame{};  // whose coordinates the fields are given in; none: the world's
  std::vector<Carved> carved{};

  [[nodiscard]] int label(Vec3d p) const;
  [[nodiscard]] int carved_from(int stored, Vec3d p) const;
};

/// The name of a point of a stored label.
int Labels::Impl::carved_from(int stored, Vec3d p) const {
  for (const Carved& core : carved)
    if (core.host == stored && core.mantle(p) < 0) return core.name;
  return name[static_cast<std::size_t>(stored)];
}

int Labels::Impl::label(Vec3d p) const {
  if (!fields && carved.empty()) return 0;
  if (frame) p = frame->to_local(p);
  if (!fields) return carved_from(0, p);
  const Place at = fields->place(p);
  int best = 0, best_stored = 0;
  float best_phi = far_mm;
  fields->each_label(fields->blocks[at.block], at, [&](std::uint16_t stored, float phi) {
    const int named = name[stored];
    if (phi < best_phi || (phi == best_phi && named < best)) {
      best_phi = phi;
      best = named;
      best_stored = stored;
    }
  });
  return carved.empty() ? best : carved_from(best_stored, p);
}

namespace {

/// Inside a core; never exactly zero, so that every point has one owner.
struct Mantle final : Shape::Function {
  explicit Mantle(Shape s) : solid(std::move(s)) {}
  void evaluate(const PointBlock& block, float* out) const override {
    solid.evaluate(block, out);
    for (int i = 0; i < block.count; ++i)
      if (out[i] == 0) out[i] = 1e-6F;
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Interval b = solid.bound(box);
    return {b.lo, std::max(b.hi, 1e-6F)};
  }
  Shape solid;
};

// p_i = (phi_i - min over the others) / 2; a tie belongs to the lower name, as in Labels::label().
class RegionFunction final : public Shape::Function {
 public:
  RegionFunction(std::shared_ptr<const Labels::Impl> impl, int part) : impl_(std::move(impl)), part_(part) {}

  void evaluate(const PointBlock& block, float* out) const override {
    if (block.count == 0) return;
    Box3d box;
    for (int i = 0; i < block.count; ++i) box.include({block.x[i], block.y[i], block.z[i]});
    const Interval all = bound(box);
    if (all.lo == all.hi) {
      std::fill(out, out + block.count, all.lo);
      return;
    }
    const auto& fields = *impl_->fields;
    for (int i = 0; i < block.count; ++i) {
      const Place at = fields.place({block.x[i], block.y[i], block.z[i]});
      float own = fields.clamp_mm;
      float other = fields.clamp_mm;
      int other_name = impl_->count;
      fields.each_label(fields.blocks[at.block], at, [&](std::uint16_t stored, float phi) {
        const int named = impl_->name[stored];
        if (named == part_) {
          own = std::min(own, phi);
        } else if (phi < other || (phi == other && named < other_name)) {
          other = phi;
          other_name = named;
        }
      });
      const float p = 0.5F * (own - other);
      // Every point has one owner: a tie is just inside the lower name and just outside the higher one.
      out[i] = p != 0 ? std::clamp(p, -fields.clamp_mm, fields.clamp_mm) : (part_ < other_name ? -tie_mm : tie_mm);
    }
  }

  // Trilinear values lie between their corners, so this needs no Lipschitz constant.
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const auto& fields = *impl_->fields;
    const Range x = fields.cell_range(box.min.x, box.max.x, 0);
    const Range y = fields.cell_range(box.min.y, box.max.y, 1);
    const Range z = fields.cell_range(box.min.z, box.max.z, 2);
    Interval all{far_mm, -far_mm};
    for (int k = z.first / block_cells; k <= z.last / block_cells; ++k) {
      for (int j = y.first / block_cells; j <= y.last / block_cells; ++j) {
        for (int i = x.first / block_cells; i <= x.last / block_cells; ++i) {
          const Interval one =
              bound_in_block(fields.blocks[fields.block_at(i, j, k)], local(x, i), local(y, j), local(z, k));
          all = {std::min(all.lo, one.lo), std::max(all.hi, one.hi)};
          if (all.lo <= -fields.clamp_mm && all.hi >= fields.clamp_mm) return all;
        }
      }
    }
    return all;
  }

  // Inside the body the fields are distances; interpolation may steepen a kink between cuts.
  [[nodiscard]] double lipschitz() const override { return std::sqrt(3.0); }

 private:
  static constexpr float tie_mm = 1e-6F;

  static Range local(Range cells, int block) {
    return {std::max(cells.first - block * block_cells, 0),
            std::min(cells.last - block * block_cells, block_cells - 1)};
  }

  [[nodiscard]] Interval bound_in_block(const Block& block, Range x, Range y, Range z) const {
    const float clamp = impl_->fields->clamp_mm;
    if (block.phi.empty()) {
      const float p = impl_->name[block.labels.front()] == part_ ? -clamp : clamp;
      return {p, p};
    }
    Interval own{clamp, clamp};
    Interval other{clamp, clamp};
    for (std::size_t l = 0; l < block.labels.size(); ++l) {
      const float* phi = block.phi.data() + l * nodes_per_block;
      Interval field{far_mm, -far_mm};
      for (int k = z.first; k <= z.last + 1; ++k) {
        for (int j = y.first; j <= y.last + 1; ++j) {
          for (int i = x.first; i <= x.last + 1; ++i) {
            const float value = phi[node_index(i, j, k)];
            field = {std::min(field.lo, value), std::max(field.hi, value)};
          }
        }
      }
      Interval& side = impl_->name[block.labels[l]] == part_ ? own : other;
      side = {std::min(side.lo, field.lo), std::min(side.hi, field.hi)};
    }
    // A tie is moved off zero by evaluate(); rounding of the interpolation is covered too.
    const float slack = 4 * tie_mm + 1e-6F * clamp;
    return {std::max(0.5F * (own.lo - other.hi) - slack, -clamp), std::min(0.5F * (own.hi - other.lo) + slack, clamp)};
  }

  std::shared_ptr<const Labels::Impl> impl_;
  int part_;
};

std::size_t sample_index(const LabelSamples& s, int i, int j, int k) {
  i = std::min(i, s.size.x - 1);
  j = std::min(j, s.size.y - 1);
  k = std::min(k, s.size.z - 1);
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(s.size.y) + static_cast<std::size_t>(j)) *
             static_cast<std::size_t>(s.size.x) +
         static_cast<std::size_t>(i);
}

Block make_block(const LabelSamples& s, int bi, int bj, int bk) {
  Block block;
  std::array<std::size_t, nodes_per_block> index{};
  std::array<std::pair<std::size_t, std::size_t>, nodes_per_block> near{};
  int node = 0;
  for (int k = 0; k < block_nodes; ++k) {
    for (int j = 0; j < block_nodes; ++j) {
      for (int i = 0; i < block_nodes; ++i, ++node) {
        const auto n = static_cast<std::size_t>(node);
        index[n] = sample_index(s, bi * block_cells + i, bj * block_cells + j, bk * block_cells + k);
        block.labels.push_back(s.label[index[n]]);
        const auto wanted = static_cast<std::int64_t>(index[n]);
        auto it = std::lower_bound(s.near.begin(), s.near.end(), wanted,
                                   [](const LabelSamples::Near& a, std::int64_t b) { return a.sample < b; });
        near[n].first = static_cast<std::size_t>(it - s.near.begin());
        while (it != s.near.end() && it->sample == wanted) {
          block.labels.push_back(it->a);
          block.labels.push_back(it->b);
          ++it;
        }
        near[n].second = static_cast<std::size_t>(it - s.near.begin());
      }
    }
    std::sort(block.labels.begin(), block.labels.end());
    block.labels.erase(std::unique(block.labels.begin(), block.labels.end()), block.labels.end());
  }
  if (block.labels.size() == 1) return block;
  const auto clamp = static_cast<float>(s.clamp_mm);
  block.phi.assign(block.labels.size() * nodes_per_block, clamp);
  for (std::size_t n = 0; n < nodes_per_block; ++n) {
    const std::uint16_t own = s.label[index[n]];
    for (std::size_t l = 0; l < block.labels.size(); ++l) {
      float nearest = clamp;
      for (std::size_t c = near[n].first; c < near[n].second; ++c)
        if (s.near[c].a == block.labels[l] || s.near[c].b == block.labels[l])
          nearest = std::min(nearest, s.near[c].distance_mm);
      block.phi[l * nodes_per_block + n] = block.labels[l] == own ? -nearest : nearest;
    }
  }
  return block;
}

}  // namespace

Labels::Labels() : impl_(std::make_shared<Impl>(Impl{nullptr, {0}, 1, {}, {}})) {}
Labels::Labels(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

int Labels::count() const { return impl_->count; }
int Labels::label(Vec3d p) const { return impl_->label(p); }

Shape Labels::region(int i) const {
  if (i < 0 || i >= impl_->count) {
    throw Error(Code::Internal, "there is no part " + std::to_string(i), "Labels::region",
                "ask for 0 to " + std::to_string(impl_->count - 1));
  }
  if (impl_->count == 1) return everything();
  // Of a stored label's name; of a name that is a core's alone: of nothing.
  const auto stored = [&](const std::shared_ptr<const Impl>& impl, int named) {
    if (std::find(impl->name.begin(), impl->name.end(), named) == impl->name.end()) return nothing();
    return impl->fields ? Shape(std::make_shared<RegionFunction>(impl, named)) : everything();
  };
  Shape region = stored(impl_, i);
  if (!impl_->carved.empty()) {
    // Hosts by their stored labels: what was merged with one of them gives nothing to the core.
    const auto own = std::make_shared<Impl>(*impl_);
    for (std::size_t l = 0; l < own->name.size(); ++l) own->name[l] = static_cast<int>(l);
    own->count = static_cast<int>(own->name.size());
    for (const Impl::Carved& core : impl_->carved) {
      const int host = impl_->name[static_cast<std::size_t>(core.host)];
      if ((core.name == i) == (host == i)) continue;
      const Shape piece = impl_->fields ? intersect({stored(own, core.host), core.mantle}) : core.mantle;
      region = core.name == i ? unite({region, piece}) : subtract(region, piece);
    }
  }
  return impl_->frame ? fibrolite::placed(std::move(region), *impl_->frame) : region;
}

Labels Labels::carved(const std::vector<Core>& cores) const {
  auto impl = std::make_shared<Impl>(*impl_);
  for (const Core& core : cores) {
    if (core.id != impl->count || core.host >= static_cast<int>(impl->name.size()))
      throw Error(Code::Internal, "cores are numbered on from the labels", "Labels::carved");
    const Vec3d from = core.frame.origin, to = from + core.length_mm * core.frame.z;
    impl->carved.push_back(
        {Shape(std::make_shared<Mantle>(cylinder(from, to, core.radius_mm))), core.host, impl->count++});
  }
  return Labels(std::move(impl));
}

Labels Labels::merged(const std::vector<int>& part_of_candidate) const {
  if (static_cast<int>(part_of_candidate.size()) != impl_->count) {
    throw Error(Code::Internal, "a new name is needed for each of " + std::to_string(impl_->count) + " candidates",
                "Labels::merged");
  }
  auto impl = std::make_shared<Impl>();
  impl->fields = impl_->fields;
  impl->frame = impl_->frame;
  impl->count = 1 + *std::max_element(part_of_candidate.begin(), part_of_candidate.end());
  for (const int old : impl_->name) impl->name.push_back(part_of_candidate[static_cast<std::size_t>(old)]);
  impl->carved = impl_->carved;
  for (Impl::Carved& core : impl->carved) core.name = part_of_candidate[static_cast<std::size_t>(core.name)];
  return Labels(std::move(impl));
}

Labels Labels::placed(const Frame& frame) const {
  auto impl = std::make_shared<Impl>(*impl_);
  impl->frame = frame;
  return Labels(std::move(impl));
}

Labels make_labels(const LabelSamples& samples) {
  auto fields = std::make_shared<Labels::Impl::Fields>();
  fields->origin = samples.origin;
  fields->voxel_mm = samples.voxel_mm;
  fields->clamp_mm = static_cast<float>(samples.clamp_mm);
  const std::array<int, 3> size{samples.size.x, samples.size.y, samples.size.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    fields->cells[axis] = size[axis] - 1;
    fields->blocks_along[axis] = (fields->cells[axis] + block_cells - 1) / block_cells;
  }
  fields->blocks.resize(fields->block_at(0, 0, fields->blocks_along[2]));
  tbb::parallel_for(0, fields->blocks_along[2], [&](int k) {
    for (int j = 0; j < fields->blocks_along[1]; ++j)
      for (int i = 0; i < fields->blocks_along[0]; ++i)
        fields->blocks[fields->block_at(i, j, k)] = make_block(samples, i, j, k);
  });
  auto impl = std::make_shared<Labels::Impl>();
  impl->fields = std::move(fields);
  impl->count = samples.count;
  for (int i = 0; i < samples.count; ++i) impl->name.push_back(i);
  return Labels(std::move(impl));
}

}  // namespace fibrolite
