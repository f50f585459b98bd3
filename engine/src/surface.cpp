// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/surface.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "dual_surface.h"
#include "fibrolite/error.h"
#include "fibrolite/file.h"
#include "fibrolite/random.h"
#include "keep_volume.h"
#include "quad_envelope.h"
#include "quad_split.h"
#include "unwritten.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace fibrolite {
namespace {

/// Trees that are gone leave their memory with the allocator, in blocks too small for what comes now.
void return_free_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

template <class Work>
void each_chunk(std::size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

/// What has been made of the layers, in memory or in a scratch file.
class LayerStore {
 public:
  explicit LayerStore(const std::optional<std::filesystem::path>& scratch) {
    if (scratch) file_ = std::make_unique<ScratchFile>(*scratch);
  }

  void push(MovableLayer&& layer) {
    points_ += layer.points.size();
    quads_ += layer.quads.size();
    if (file_ == nullptr) {
      in_memory_.push_back(std::move(layer));
      return;
    }
    Place place{layer.first, layer.points.size(), layer.moves.size(), layer.quads.size(), 0};
    place.offset = file_->append(std::as_bytes(std::span(layer.points)));
    file_->append(std::as_bytes(std::span(layer.moves)));
    file_->append(std::as_bytes(std::span(layer.quads)));
    in_file_.push_back(place);
  }

  [[nodiscard]] std::size_t size() const { return in_memory_.size() + in_file_.size(); }
  [[nodiscard]] std::size_t points() const { return points_; }
  [[nodiscard]] std::size_t quads() const { return quads_; }

  /// `room` holds it, if it must be read first.
  [[nodiscard]] const MovableLayer& layer(std::size_t n, MovableLayer& room) const {
    if (file_ == nullptr) return in_memory_[n];
    const Place& place = in_file_[n];
    room.first = place.first;
    room.points.resize(place.points);
    room.moves.resize(place.moves);
    room.quads.resize(place.quads);
    std::uint64_t offset = place.offset;
    const auto read = [&](auto& list) {
      const std::span<std::byte> bytes = std::as_writable_bytes(std::span(list));
      file_->read(offset, bytes);
      offset += bytes.size();
    };
    read(room.points);
    read(room.moves);
    read(room.quads);
    return room;
  }

 private:
  struct Place {
    std::size_t first, points, moves, quads;
    std::uint64_t offset;
  };
  std::vector<MovableLayer> in_memory_;
  std::vector<Place> in_file_;
  std::unique_ptr<ScratchFile> file_;
  std::size_t points_ = 0, quads_ = 0;
};

using Places = std::vector<Vec3f, Unwritten<Vec3f>>;

struct FinishedLayer {
  Places vertices;
  std::size_t first = 0, before = 0;
  std::vector<Mesh::Triangle> triangles;
};

/// The layers' last step, one after another: moved, split. A layer is done when the next one has been looked at, which
/// may move its vertices.
class Finisher {
 public:
  using Use = std::function<void(FinishedLayer&)>;  ///< Which may swap it for another, to be written over.
  Finisher(double step, double voxel_mm, bool stand_in, Use use)
      : step_(static_cast<float>(step)),
        mover_(voxel_mm, stand_in),
        split_(voxel_mm, stand_in),
        voxel_mm_(voxel_mm),
        use_(std::move(use)) {}

  void add(const MovableLayer& layer) {
    const std::size_t from = points_.size();
    if (from == 0) first_ = layer.first;
    const auto moved = [&](std::size_t i, float step) {
      Four p = four(layer.points[i]);
      if (!layer.moves.empty()) p = mover_(p, mover_.cell(p), layer.moves[i], step);
      return Vec3f{p[0], p[1], p[2]};
    };
    points_.resize(from + layer.points.size());
    each_chunk(layer.points.size(), [&](std::size_t i) { points_[from + i] = moved(i, step_); });
    if (step_ != 1) {
      whole_.resize(points_.size());
      each_chunk(layer.points.size(), [&](std::size_t i) { whole_[from + i] = moved(i, 1); });
    }
    next_.resize(2 * layer.quads.size());
    const QuadSplit::Left left = split_(layer.quads, vertices(), next_);
    if (!left.empty()) mend(left);
    hand_on();
    before_ = upper_;
    upper_ = layer.points.size();
    std::swap(waits_.triangles, next_);
    ++number_;
  }
  void finish() { hand_on(); }

 private:
  [[nodiscard]] QuadSplit::Vertices vertices() const { return {points_, whole_.empty() ? points_ : whole_, first_}; }

  /// What a layer's quads have become, and what is wrong with them.
  struct Split {
    std::vector<Mesh::Triangle>& triangles;
    std::size_t end;  ///< Of the vertices they may have.
    QuadSplit::Left left{};

    [[nodiscard]] Quad quad(std::size_t i) const {
      const auto &one = triangles[2 * i], &other = triangles[2 * i + 1];
      return {one[0], one[1], other[1], other[2]};
    }
  };
  /// Quads that neither diagonal saves: their corners are moved, and all that touch them split again. What has been
  /// handed on already stays.
  void mend(QuadSplit::Left left) {
    Random random(1, "surface", number_);
    const std::size_t below = first_ + before_ + upper_, end = first_ + points_.size();
    std::array<Split, 2> layers{Split{waits_.triangles, below}, {next_, end, std::move(left)}};
    for (int round = 0; round < 8 && !(layers[0].left.empty() && layers[1].left.empty()); ++round) {
      moved_.assign(points_.size(), 0);
      lowest_moved_ = std::numeric_limits<std::uint32_t>::max();
      for (const Split& layer : layers) {
        for (const std::size_t i : layer.left.degenerate) shake(layer.quad(i), random);
        for (const std::size_t i : layer.left.astray) flatten(layer.quad(i));
      }
      for (Split& layer : layers) split_again(layer);
    }
  }
  void split_again(Split& layer) {
    std::vector<std::size_t> touched;
    const std::size_t quads = lowest_moved_ < layer.end ? layer.triangles.size() / 2 : 0;
    for (std::size_t i = 0; i < quads; ++i) {
      const auto [a, b, c, d] = layer.quad(i);
      if ((moved_[a - first_] | moved_[b - first_] | moved_[c - first_] | moved_[d - first_]) != 0)
        touched.push_back(i);
    }
    Quads some;
    for (const std::size_t i : touched) some.push_back(layer.quad(i));
    std::vector<Mesh::Triangle> triangles(2 * some.size());
    layer.left = split_(some, vertices(), triangles);
    for (std::size_t n = 0; n < touched.size(); ++n)
      for (const std::size_t k : {0U, 1U}) layer.triangles[2 * touched[n] + k] = triangles[2 * n + k];
    for (std::vector<std::size_t>* list : {&layer.left.degenerate, &layer.left.astray})
      for (std::size_t& i : *list) i = touched[i];
  }
  void move(std::uint32_t v, Vec3f to) {
    if (v - first_ < before_) return;  // handed on already
    points_[v - first_] = to;
    moved_[v - first_] = 1;
    lowest_moved_ = std::min(lowest_moved_, v);
  }
  /// By a thousandth of a voxel in a random direction.
  void shake(const Quad& quad, Random& random) {
    for (const std::uint32_t v : quad) {
      const auto step = [&] { return static_cast<float>((random.uniform() - 0.5) * 4e-3 * voxel_mm_); };
      const Vec3f p = points_[v - first_];
      move(v, {p.x + step(), p.y + step(), p.z + step()});
    }
  }
  /// Halves how far its corners lie apart along its edge: they stay in their cells, and a flat quad has a good
  /// diagonal.
  void flatten(const Quad& quad) {
    std::array<Vec3d, 4> corners;
    Vec3d middle{};
    for (std::size_t k = 0; k < 4; ++k) {
      corners[k] = to_double(points_[quad[k] - first_]);
      middle = middle + 0.25 * corners[k];
    }
    const std::optional<int> along = no_diagonal(corners, voxel_mm_, true);
    const std::optional<int> axis = along ? along : no_diagonal(corners, voxel_mm_, false);
    if (!axis) return;  // a neighbour has mended it
    for (std::size_t k = 0; k < 4; ++k) {
      Vec3f p = points_[quad[k] - first_];
      (*axis == 0 ? p.x : *axis == 1 ? p.y : p.z) = static_cast<float>(0.5 * (corners[k][*axis] + middle[*axis]));
      move(quad[k], p);
    }
  }

  void hand_on() {
    if (before_ + upper_ == 0) return;
    const auto below = static_cast<std::ptrdiff_t>(before_);
    waits_.vertices.assign(points_.begin() + below, points_.end());
    std::swap(waits_.vertices, points_);
    waits_.vertices.resize(before_ + upper_);
    waits_.first = first_;
    waits_.before = before_;
    use_(waits_);
    if (!whole_.empty()) whole_.erase(whole_.begin(), whole_.begin() + below);
    first_ += before_;
  }

  float step_;
  const Mover mover_;
  const QuadSplit split_;
  double voxel_mm_;
  const Use use_;
  // Of the layer below the one that waits, that one, and for a moment the next.
  Places points_;
  Places whole_;  // the same after a whole move, if that is another step
  std::size_t first_ = 0, before_ = 0, upper_ = 0, number_ = 0;
  FinishedLayer waits_;
  std::vector<Mesh::Triangle> next_;  // of the next
  std::vector<std::uint8_t> moved_;   // is a point, while quads are mended?
  std::uint32_t lowest_moved_ = 0;
};

}  // namespace

struct SurfaceLayers::Impl {
  Impl(Grid g, const SurfaceParams& p, const std::optional<std::filesystem::path>& scratch)
      : grid(g), params(p), keep(g.voxel_mm, p.keep_volume, p.stand_in), store(scratch) {
    dual.emplace(g, p.axis);
  }

  void push(MovableLayer&& layer) { store.push(std::move(layer)); }

  Grid grid;
  SurfaceParams params;
  std::optional<DualSurface> dual;  // until the last layer
  KeepVolume keep;
  LayerStore store;
  double step = 1;
  bool finished = false;
};

SurfaceLayers::SurfaceLayers(Grid grid, const SurfaceParams& params,
                             const std::optional<std::filesystem::path>& scratch)
    : impl_(std::make_unique<Impl>(grid, params, scratch)) {}
SurfaceLayers::~SurfaceLayers() = default;

void SurfaceLayers::add(const Solid& solid, const Context& context) {
  add(solid, surface_range(solid, impl_->params.axis), context);
}

void SurfaceLayers::add(const Solid& solid, const SampleRange& range, const Context& context) {
  if (impl_->finished) throw Error(Code::Internal, "a surface that is finished gets no more layers");
  if (range.axis != impl_->params.axis) throw Error(Code::Internal, "slabs lie across another axis than the layers");
  context.check();
  return_free_memory();
  // The next layer is made while this one's vertices find their places.
  QuadLayer held;
  tbb::task_group behind;
  impl_->dual->add(
      solid, range,
      [&](QuadLayer&& layer) {
        behind.wait();
        held = std::move(layer);
        behind.run(
            [&] { impl_->keep.add(std::move(held), [&](MovableLayer&& done) { impl_->push(std::move(done)); }); });
      },
      context);
  behind.wait();
}

void SurfaceLayers::finish(double volume_mm3) {
  impl_->keep.finish([&](MovableLayer&& done) { impl_->push(std::move(done)); });
  const LayerStore& store = impl_->store;
  if (impl_->params.keep_volume) {
    impl_->step = step_for_volume(
        volume_mm3, impl_->keep.six_volumes(), Mover(impl_->grid.voxel_mm, impl_->params.stand_in), store.size(),
        [&](std::size_t n, MovableLayer& room) -> const MovableLayer& { return store.layer(n, room); });
  }
  impl_->dual.reset();
  impl_->finished = true;
}

std::size_t SurfaceLayers::vertices() const { return impl_->store.points(); }
std::size_t SurfaceLayers::triangles() const { return 2 * impl_->store.quads(); }

void SurfaceLayers::each(const std::function<void(const MeshLayer&)>& use, const Context& context) const {
  if (!impl_->finished) throw Error(Code::Internal, "the surface is not finished");
  // The next layer is made while this one is used.
  FinishedLayer held;
  tbb::task_group behind;
  Finisher finisher(impl_->step, impl_->grid.voxel_mm, impl_->params.stand_in, [&](FinishedLayer& layer) {
    behind.wait();
    std::swap(held, layer);
    behind.run([&] { use({held.vertices, held.first, held.before, held.triangles, {}}); });
  });
  MovableLayer room;
  const std::size_t count = impl_->store.size();
  for (std::size_t n = 0; n < count; ++n) {
    context.check();
    finisher.add(impl_->store.layer(n, room));
    context.progress(static_cast<double>(n + 1) / static_cast<double>(count));
  }
  finisher.finish();
  behind.wait();
}

Mesh surface(const Solid& solid, const SurfaceParams& params, const Context& context) {
  SurfaceLayers layers(solid.grid(), params);
  layers.add(solid, context.part(0, 0.8, ""));
  layers.finish(params.keep_volume ? solid.volume_mm3() : 0);
  return gathered(layers, context.part(0.8, 1, ""));
}

}  // namespace fibrolite
