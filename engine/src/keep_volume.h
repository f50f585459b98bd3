// SPDX-License-Identifier: Apache-2.0
// Where the vertices of a dual surface go so that it holds the volume of its solid.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "dual_surface.h"

namespace fibrolite {

struct MovableLayer : QuadLayer {
  using Move = std::array<std::int16_t, 3>;
  std::vector<Move> moves;  ///< Per point, times move_unit(); none if nothing moves.
};
/// A 32767th of the longest move, 0.35 voxels: mm.
[[nodiscard]] constexpr float move_unit(double voxel_mm) { return static_cast<float>(0.35 * voxel_mm / 32767); }

/// Coordinates side by side; the last one is no matter.
using Four [[gnu::vector_size(16)]] = float;
[[nodiscard]] inline Four four(const openvdb::Vec3s& p) { return Four{p.x(), p.y(), p.z(), 0}; }

/// Where a move takes a point: free, or so that it keeps two fifths of its distance to each plane of the
/// lattice. Then it stays in its cell and apart from what lies around the lattice's points and edges, and no triangles
/// cut each other.
class Mover {
 public:
  Mover(double voxel_mm, bool free)
      : voxel_(static_cast<float>(voxel_mm)),
        per_voxel_(1 / voxel_),
        unit_(move_unit(voxel_mm)),
        more_(free ? 2 * voxel_ : 0) {}
  /// The lowest corner of a point's cell, in voxels.
  [[nodiscard]] Four cell(Four point) const {
    using Cut [[gnu::vector_size(16)]] = std::int32_t;
    const Four at = point * per_voxel_, cut = __builtin_convertvector(__builtin_convertvector(at, Cut), Four);
    return cut > at ? cut - 1 : cut;
  }
  [[nodiscard]] Four operator()(Four point, Four cell, const MovableLayer::Move& move, float step) const {
    const Four by =
        step * unit_ * Four{static_cast<float>(move[0]), static_cast<float>(move[1]), static_cast<float>(move[2]), 0};
    const Four low = voxel_ * cell - point, high = low + voxel_;
    const Four least = 0.6F * low - more_, most = 0.6F * high + more_, some = by > least ? by : least;
    return point + (some < most ? some : most);
  }
  [[nodiscard]] bool free() const { return more_ > 0; }
  [[nodiscard]] double voxel_mm() const { return static_cast<double>(voxel_); }

 private:
  float voxel_, per_voxel_, unit_, more_;  // longer than any move, if free
};

/// A mesh with its vertices on (or, as those of a dual surface, averaged below) a convex surface lies inside it and
/// loses volume. To second order the loss is made good by moving each vertex along its normal by the normal part of its
/// umbrella vector, mirrored; how far exactly, for all alike, step_for_volume() says. Flat faces, sharp
/// edges and, but in a stand-in, what lies beside one stay where they are: an edge is a bend beside something flat; a
/// stick as thin as two voxels bends as much but has nothing flat around it. Vertices that share a cell stay too, for
/// they might pass each other.
///
/// Works on a few layers at a time: what a vertex does depends on the quads of its own layer, the one below and the two
/// above.
class KeepVolume {
 public:
  using Use = std::function<void(MovableLayer&&)>;
  KeepVolume(double voxel_mm, bool moving, bool stand_in)
      : voxel_mm_(voxel_mm), moving_(moving), mover_(voxel_mm, stand_in) {}
  /// The next layer; those that are done are handed on, in order. The same bits on any number of threads.
  void add(QuadLayer&& layer, const Use& use);
  /// No more layers come.
  void finish(const Use& use);
  /// Six times the volume after a whole move, mm3.
  [[nodiscard]] double six_volumes() const { return six_volumes_; }

 private:
  struct Umbrella {
    std::array<float, 4> edges{};  // sum of edge vectors to neighbours, and how many: each counted once per quad
    std::array<float, 4> bends{};  // sum of quad normals, and their lengths, summed: longer where the surface bends
    // Later:
    float& mean() { return edges[0]; }                       // of the edge vectors, along the normal
    float& sharpest() { return edges[1]; }                   // of the vertices around
    float& flattest() { return edges[3]; }                   // of those too
    float& normal(std::size_t axis) { return bends[axis]; }  // of length 1
    float& flatness() { return bends[3]; }                   // length of the sum over sum of the lengths
  };
  struct Work {
    MovableLayer layer;
    std::vector<Umbrella> mine, above;  // from quads of this layer, and of the next
    Points moved;                       // if anything moves: the points after a whole move
  };
  void process(bool all, const Use& use);
  void sum_around(std::size_t n);
  void settle(std::size_t n);
  void look_around(std::size_t n);
  void choose_moves(std::size_t n);
  [[nodiscard]] double volume_of(std::size_t n) const;

  double voxel_mm_;
  bool moving_;
  Mover mover_;
  std::deque<Work> window_;  // the first is done already, unless it is the very first
  // How many of the window have had their quads summed, their normals settled, ...
  std::size_t summed_ = 0, settled_ = 0, looked_ = 0, moved_ = 0, measured_ = 0;
  double six_volumes_ = 0;
};

/// By how much each move is to be taken, 0 to 2, so that the volume is the one wanted, or as near to it as that brings:
/// 1, unless a whole move misses it by a thousandth. Cost: up to one pass over the layers, parallel.
/// @param layer  Gives the layer of a number, into the room if need be.
[[nodiscard]] double step_for_volume(double wanted_mm3, double six_volumes, const Mover& mover, std::size_t layers,
                                     const std::function<const MovableLayer&(std::size_t, MovableLayer&)>& layer);

}  // namespace fibrolite
