// SPDX-License-Identifier: Apache-2.0
// Where the vertices of a dual surface go so that it holds the volume of its solid.
#pragma once

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

/// A mesh with its vertices on (or, as those of a dual surface, averaged below) a convex surface lies inside it and
/// loses volume. To second order the loss is made good by moving each vertex along its normal by the normal part of its
/// umbrella vector, mirrored; how far exactly, for all alike, is then set by the volume wanted. Flat faces, sharp
/// edges and, if asked for, what lies beside one stay where they are: an edge is a bend beside something flat; a stick
/// as thin as two voxels bends as much but has nothing flat around it.
///
/// Works on a few layers at a time: what a vertex does depends on the quads of its own layer, the one below and the two
/// above.
class KeepVolume {
 public:
  using Use = std::function<void(MovableLayer&&)>;
  KeepVolume(double voxel_mm, bool moving, bool flat_faces)
      : voxel_mm_(voxel_mm), moving_(moving), flat_faces_(flat_faces) {}
  /// The next layer; those that are done are handed on, in order. The same bits on any number of threads.
  void add(QuadLayer&& layer, const Use& use);
  /// No more layers come.
  void finish(const Use& use);
  /// By how much each move is to be taken, 0 to 2, so that the volume is `wanted_mm3`, or as near to it as that brings.
  [[nodiscard]] double step(double wanted_mm3) const;

 private:
  struct Umbrella {
    float x = 0, y = 0, z = 0;     // sum of edge vectors to neighbours; later x: their mean, along the normal
    float nx = 0, ny = 0, nz = 0;  // sum of quad normals; later of length 1
    float flatness = 0;  // their lengths, summed: longer than the sum where the surface bends; later the ratio
    float edges = 0;     // neighbours, counted once per quad
    // Later, of the vertices around:
    float& flattest() { return edges; }
    float& sharpest() { return y; }
  };
  struct Work {
    MovableLayer layer;
    std::vector<Umbrella> mine, above;  // from quads of this layer, and of the next
  };
  void process(bool all, const Use& use);
  void sum_around(std::size_t n);
  void settle(std::size_t n);
  void look_around(std::size_t n);
  void choose_moves(std::size_t n);
  [[nodiscard]] std::array<double, 4> volume_of(std::size_t n) const;

  double voxel_mm_;
  bool moving_, flat_faces_;
  std::deque<Work> window_;  // the first is done already, unless it is the very first
  // How many of the window have had their quads summed, their normals settled, ...
  std::size_t summed_ = 0, settled_ = 0, looked_ = 0, moved_ = 0, measured_ = 0;
  std::array<double, 4> volume_{};  // six times it, by powers of the step
};

}  // namespace fibrolite
