// SPDX-License-Identifier: Apache-2.0
// The stiffness of one cubic cell, in the forms the voxel solver works with.
#pragma once

#include <array>
#include <vector>

namespace fibrolite {

/// A cube of edge 1 and Young's modulus 1: eight corners, a = 4 x + 2 y + z, each with three displacements (3 a +
/// axis). Trilinear with Wilson's nine incompatible modes condensed out (Taylor, Beresford, Wilson 1976): bends as a
/// beam does even where a member is two or three cells thick, passes the patch test, costs the same to apply. A cube of
/// edge h and modulus E has h E times this.
struct VoxelElement {
  /// K = W^T M W with W the 8-point Hadamard transform of each axis. In that basis the three reflections of a cube
  /// leave only couplings between (c ^ bit(i), i) and (c ^ bit(j), j): eight 3x3 matrices, each xx yy zz xy yz zx.
  std::array<std::array<double, 6>, 8> modal;
  /// K = sum of r r^T over these: 18, one per mode that strains. In the Hadamard basis only the three entries of one
  /// class are not zero: (cls ^ bit(i), i) holds coefficient[i].
  struct Root {
    unsigned cls = 0;
    std::array<double, 3> coefficient{};
  };
  std::vector<Root> root;
  double diagonal = 0;                             ///< Each of the 24 diagonal entries.
  double largest = 0;                              ///< Largest eigenvalue.
  std::array<std::array<double, 24>, 6> centre{};  ///< Strain at the centre: xx yy zz, engineering xy yz zx.
};
/// 0 <= poisson < 0.5. Cost: microseconds.
[[nodiscard]] VoxelElement voxel_element(double poisson);

}  // namespace fibrolite
