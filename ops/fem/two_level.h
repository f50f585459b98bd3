// SPDX-License-Identifier: GPL-3.0-or-later
// Conjugate gradients for large bodies (docs/decisions/0010).
#pragma once

#include <memory>
#include <vector>

#include "fibrolite/context.h"
#include "stiffness.h"

namespace fibrolite::fem {

/// Eigen's conjugate gradients. The preconditioner: Chebyshev smoothing on all ten nodes, in single precision, around a
/// solve by Cholesky of the same body with four-node tetrahedra, an eighth of the unknowns. These linear displacements
/// contain the rigid motions of every piece exactly, so no mode that the smoother cannot see is lost.
class TwoLevel {
 public:
  /// Cost: a Cholesky factor of the corners, and two assemblies. @throws Error SolverFailed: singular; TooLarge;
  /// Cancelled.
  TwoLevel(const System& system, const Context& context);
  ~TwoLevel();
  TwoLevel(const TwoLevel&) = delete;
  TwoLevel& operator=(const TwoLevel&) = delete;

  struct Goal {
    double relative = 1e-10;  ///< Of the loads and reactions together.
    double absolute_n = 0;    ///< What rounding leaves.
    int max_iterations = 1000;
  };
  /// Improves a displacement, whose prescribed components stay, until its forces answer `force_n`, and returns the
  /// number of iterations. Same bits on any number of threads. @throws Error SolverFailed: not reached; Cancelled.
  int solve(const std::vector<Vec3d>& force_n, std::vector<Vec3d>& displacement, const Goal& goal,
            const Context& context);

 private:
  struct Nodes;
  const System& system_;
  std::unique_ptr<Nodes> nodes_;
};

}  // namespace fibrolite::fem
