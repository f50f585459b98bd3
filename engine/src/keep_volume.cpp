// SPDX-License-Identifier: Apache-2.0
#include "keep_volume.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "quad_envelope.h"

namespace fibrolite {
namespace {

using openvdb::Vec3s;

using Row = std::array<float, 4>;
Four four(const Row& from) {
  Four row;
  std::memcpy(&row, from.data(), sizeof row);
  return row;
}
void add_to(Row& to, Four more) {
  const Four sum = four(to) + more;
  std::memcpy(to.data(), &sum, sizeof sum);
}
bool same(Four a, Four b) {
  const auto equal = a == b;
  return (equal[0] & equal[1] & equal[2]) != 0;
}
Four cross(Four a, Four b) {
  using Order [[gnu::vector_size(16)]] = std::int32_t;
  constexpr Order next{1, 2, 0, 3}, last{2, 0, 1, 3};
  return __builtin_shuffle(a, next) * __builtin_shuffle(b, last) -
         __builtin_shuffle(a, last) * __builtin_shuffle(b, next);
}
Vec3s vec(Four f) { return {f[0], f[1], f[2]}; }

/// Layers that are worked on at once. Beside them the next ones are made, which keeps half of the threads busy; and
/// they wait in memory.
std::size_t batch() { return static_cast<std::size_t>(std::clamp(tbb::this_task_arena::max_concurrency() / 2, 1, 16)); }

using Range = tbb::blocked_range<std::size_t>;

Vec3d to_vec(const Vec3s& v) { return {v.x(), v.y(), v.z()}; }

/// The corner where a quad's shorter diagonal begins.
std::size_t shorter(const std::array<Vec3d, 4>& p) {
  const Vec3d first = p[2] - p[0], second = p[3] - p[1];
  return dot(first, first) <= dot(second, second) ? 0 : 1;
}

/// Of the quad's two triangles, with the origin.
double six_volumes_of(const std::array<Vec3d, 4>& p, std::size_t diagonal) {
  return dot(p[diagonal], cross(p[diagonal + 2], p[(diagonal + 3) & 3] - p[diagonal + 1]));
}

}  // namespace

void KeepVolume::add(QuadLayer&& layer, const Use& use) {
  Work& work = window_.emplace_back();
  static_cast<QuadLayer&>(work.layer) = std::move(layer);
  if (window_.size() >= summed_ + batch()) process(false, use);
}

void KeepVolume::finish(const Use& use) { process(true, use); }

void KeepVolume::process(bool all, const Use& use) {
  const std::size_t count = window_.size();
  const auto each = [](std::size_t& from, std::size_t to, const auto& work) {
    if (from < to) tbb::parallel_for(from, to, work);
    from = std::max(from, to);
  };
  const auto but = [all](std::size_t n, std::size_t less) { return all ? n : n - std::min(n, less); };
  if (moving_) {
    each(summed_, count, [&](std::size_t n) { sum_around(n); });
    each(settled_, but(summed_, 1), [&](std::size_t n) { settle(n); });
    // A layer's quads reach into the one below: every other one at a time.
    for (const std::size_t odd : {0U, 1U}) {
      tbb::parallel_for(looked_, settled_, [&](std::size_t n) {
        if ((n & 1U) == odd) look_around(n);
      });
    }
    looked_ = settled_;
    each(moved_, but(looked_, 1), [&](std::size_t n) { choose_moves(n); });
  } else {
    summed_ = settled_ = looked_ = moved_ = count;
  }
  std::vector<double> volumes(moved_ - measured_);
  tbb::parallel_for(std::size_t{0}, volumes.size(), [&](std::size_t i) { volumes[i] = volume_of(measured_ + i); });
  for (const double v : volumes) six_volumes_ += v;
  measured_ = moved_;

  const std::size_t done = but(measured_, 1);  // the last is looked at from above
  for (std::size_t n = 0; n < done; ++n) {
    use(std::move(window_.front().layer));
    window_.pop_front();
  }
  for (std::size_t* progress : {&summed_, &settled_, &looked_, &moved_, &measured_}) *progress -= done;
}

/// Edge vectors and normals of a layer's quads, at their vertices.
void KeepVolume::sum_around(std::size_t n) {
  Work& work = window_[n];
  work.mine.resize(work.layer.points.size());
  Work* below = n > 0 ? &window_[n - 1] : nullptr;
  if (below != nullptr) below->above.resize(below->layer.points.size());
  const std::size_t first = work.layer.first;
  const auto point = [&](std::uint32_t v) -> const Vec3s& {
    return v >= first ? work.layer.points[v - first] : below->layer.points[v - below->layer.first];
  };
  for (const Quad& q : work.layer.quads) {
    const std::array<Four, 4> p{four(point(q[0])), four(point(q[1])), four(point(q[2])), four(point(q[3]))};
    const Four normal = cross(p[2] - p[0], p[3] - p[1]);
    const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    const Four bend{normal[0], normal[1], normal[2], length};
    for (std::size_t k = 0; k < 4; ++k) {
      Umbrella& u = q[k] >= first ? work.mine[q[k] - first] : below->above[q[k] - below->layer.first];
      const Four edges = p[(k + 1) & 3] + p[(k + 3) & 3] - 2.0F * p[k] + Four{0, 0, 0, 2};
      add_to(u.edges, edges);
      add_to(u.bends, bend);
    }
  }
}

void KeepVolume::settle(std::size_t n) {
  Work& work = window_[n];
  for (std::size_t i = 0; i < work.mine.size(); ++i) {
    Umbrella& u = work.mine[i];
    if (!work.above.empty()) {
      const Umbrella& more = work.above[i];
      add_to(u.edges, four(more.edges));
      add_to(u.bends, four(more.bends));
    }
    const auto [x, y, z, edges] = u.edges;
    const auto [nx, ny, nz, lengths] = u.bends;
    const float length = std::sqrt(nx * nx + ny * ny + nz * nz), mean = 1 / std::max(edges, 1.0F);
    const float unit = length > 0 ? 1 / length : 0;
    u.bends = {nx * unit, ny * unit, nz * unit, lengths > 0 ? length / lengths : 0};
    u.mean() = mean * (x * u.normal(0) + y * u.normal(1) + z * u.normal(2));
    u.flattest() = 0;
    u.sharpest() = 1;
  }
  work.above = {};
}

/// The flattest and the sharpest vertex around each.
void KeepVolume::look_around(std::size_t n) {
  Work& work = window_[n];
  const std::size_t first = work.layer.first;
  for (const Quad& q : work.layer.quads) {
    std::array<Umbrella*, 4> u;
    float most = 0, least = 1;
    for (std::size_t k = 0; k < 4; ++k) {
      u[k] = q[k] >= first ? &work.mine[q[k] - first] : &window_[n - 1].mine[q[k] - window_[n - 1].layer.first];
      most = std::max(most, u[k]->flatness());
      least = std::min(least, u[k]->flatness());
    }
    for (Umbrella* one : u) {
      one->flattest() = std::max(one->flattest(), most);
      one->sharpest() = std::min(one->sharpest(), least);
    }
  }
}

void KeepVolume::choose_moves(std::size_t n) {
  constexpr float sharp = 0.72F, smooth = 0.86F;  // flatness of a vertex: 1 on a face, cos 45 degrees on a box's edge
  constexpr float bent = 0.88F, flat = 0.95F;     // of the flattest vertex around it
  // Beside an edge there is a vertex on a face, and one on the edge, in whichever cells of the lattice that runs.
  constexpr float blunt = 0.96F, round = 0.985F, nearly_plane = 0.998F, plane = 0.9995F;
  constexpr Four from{sharp, bent, blunt, nearly_plane};
  constexpr Four size{smooth - sharp, flat - bent, round - blunt, plane - nearly_plane};
  const auto ramps = [&](Four x) {
    const Four share = (x - from) / size, least = share > 0 ? share : Four{};
    return least < 1 ? least : Four{} + 1.0F;
  };
  const auto rounded = [](float x) { return static_cast<std::int16_t>(x + (x < 0 ? -0.5F : 0.5F)); };
  Work& work = window_[n];
  const float per_unit = 1 / move_unit(voxel_mm_);
  const std::size_t count = work.mine.size();
  const Points& points = work.layer.points;
  work.layer.moves.resize(count);
  work.moved.resize(count);
  const auto cell_of = [&](std::size_t i) { return mover_.cell(four(points[i])); };
  Four cell{}, next = count > 0 ? cell_of(0) : Four{};
  bool with_last = false;
  for (std::size_t i = 0; i < count; ++i) {
    Umbrella& u = work.mine[i];
    cell = next;
    if (i + 1 < count) next = cell_of(i + 1);
    const bool with_next = i + 1 < count && same(next, cell), stays = !mover_.free() && (with_last || with_next);
    with_last = with_next;
    const Four ramp = ramps(Four{u.flatness(), u.flattest(), u.sharpest(), u.flattest()});
    const float edge = (1 - ramp[0]) * ramp[1];
    // The edge of a box hangs lower than its face: pushed out for that, the face would get a ridge.
    const float beside = mover_.free() ? 0 : (1 - ramp[2]) * ramp[3];
    const float by = std::min(std::max((std::max(edge, beside) - 1) * u.mean() * per_unit, -32767.0F), 32767.0F);
    MovableLayer::Move& move = work.layer.moves[i];
    if (!stays) move = {rounded(by * u.normal(0)), rounded(by * u.normal(1)), rounded(by * u.normal(2))};
    work.moved[i] = vec(mover_(four(points[i]), cell, move, 1));
  }
  work.mine = {};
}

/// What the quads add to six times the volume, each along its diagonal that is shorter after a whole move.
double KeepVolume::volume_of(std::size_t n) const {
  const Work& work = window_[n];
  const Work* below = n > 0 ? &window_[n - 1] : nullptr;
  const auto at = [&](std::uint32_t v) {
    const Work& of = v >= work.layer.first ? work : *below;
    return to_vec((moving_ ? of.moved : of.layer.points)[v - of.layer.first]);
  };
  double sum = 0;
  for (const Quad& q : work.layer.quads) {
    const std::array<Vec3d, 4> p{at(q[0]), at(q[1]), at(q[2]), at(q[3])};
    sum += six_volumes_of(p, shorter(p));
  }
  return sum;
}

double step_for_volume(double wanted_mm3, double six_volumes, const Mover& mover, std::size_t layers,
                       const std::function<const MovableLayer&(std::size_t, MovableLayer&)>& layer) {
  // Nearly always the move is right as it is; where hardly anything moves, a volume that is right too asks for nothing.
  constexpr double close_enough = 1e-3;
  if (std::abs(six_volumes - 6 * wanted_mm3) <= 6 * close_enough * std::abs(wanted_mm3)) return 1;
  constexpr std::array<float, 4> steps{0, 1, 1.5F, 2};
  std::array<double, steps.size()> volume{0, six_volumes, 0, 0};
  using Places = std::array<std::vector<Vec3s>, steps.size()>;
  Places places, before;
  MovableLayer room;
  for (std::size_t n = 0; n < layers; ++n) {
    const MovableLayer& mine = layer(n, room);
    const std::size_t below = mine.first - before[0].size();
    for (std::size_t s = 0; s < steps.size(); ++s) {
      places[s].resize(mine.points.size());
      tbb::parallel_for(Range(0, mine.points.size(), 4096), [&](const Range& some) {
        for (std::size_t i = some.begin(); i < some.end(); ++i) {
          const Vec3s& p = mine.points[i];
          places[s][i] = mine.moves.empty() ? p : vec(mover(four(p), mover.cell(four(p)), mine.moves[i], steps[s]));
        }
      });
    }
    const auto diagonal = [&](const std::array<Vec3d, 4>& p) {
      const std::size_t first = shorter(p);
      return !mover.free() && wrong_diagonal(p, mover.voxel_mm(), first == 0) ? 1 - first : first;
    };
    const auto corners = [&](const Quad& q, std::size_t s) {
      std::array<Vec3d, 4> p;
      for (std::size_t k = 0; k < 4; ++k)
        p[k] = to_vec(q[k] >= mine.first ? places[s][q[k] - mine.first] : before[s][q[k] - below]);
      return p;
    };
    using Sums = std::array<double, steps.size()>;
    const auto plus = [](Sums some, const Sums& more) {
      for (std::size_t s = 0; s < some.size(); ++s) some[s] += more[s];
      return some;
    };
    volume = plus(volume, tbb::parallel_deterministic_reduce(
                              Range(0, mine.quads.size(), 4096), Sums{},
                              [&](const Range& some, Sums sums) {
                                for (std::size_t i = some.begin(); i < some.end(); ++i) {
                                  const Quad& q = mine.quads[i];
                                  const std::size_t along = diagonal(corners(q, 1));
                                  for (const std::size_t s : {0U, 2U, 3U})
                                    sums[s] += six_volumes_of(corners(q, s), along);
                                }
                                return sums;
                              },
                              plus));
    std::swap(places, before);
  }
  const auto missing = [&](double s) {  // on the cubic through all four
    double sum = -6 * wanted_mm3;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      double weight = 1;
      for (const float other : steps)
        if (other != steps[i]) weight *= (s - static_cast<double>(other)) / static_cast<double>(steps[i] - other);
      sum += weight * volume[i];
    }
    return sum;
  };
  double low = 0, high = 2;
  if ((missing(low) < 0) == (missing(high) < 0)) {
    // A field that is no distance may hold a volume that no such move can reach.
    double best = 1;
    for (const double s : {low, high})
      if (std::abs(missing(s)) < std::abs(missing(best))) best = s;
    return best;
  }
  const bool rising = missing(low) < 0;
  for (int round = 0; round < 50; ++round) {
    const double middle = (low + high) / 2;
    ((missing(middle) < 0) == rising ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace fibrolite
