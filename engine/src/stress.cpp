// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/stress.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace fibrolite {

double von_mises(const StressTensor& s) {
  const double xy = s[0] - s[1], yz = s[1] - s[2], zx = s[2] - s[0];
  const double shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  return std::sqrt(0.5 * (xy * xy + yz * yz + zx * zx) + 3 * shear);
}

std::array<double, 3> principal_stresses(const StressTensor& s) {
  Eigen::Matrix3d tensor;
  tensor << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(tensor, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d& ascending = solver.eigenvalues();
  return {ascending[2], ascending[1], ascending[0]};
}

}  // namespace fibrolite
