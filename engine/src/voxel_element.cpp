// SPDX-License-Identifier: Apache-2.0
#include "voxel_element.h"

#include <Eigen/Dense>
#include <bit>
#include <cmath>

namespace fibrolite {
namespace {

using Full = Eigen::Matrix<double, 33, 33>;
using StrainOf = Eigen::Matrix<double, 6, 33>;

void strain_column(StrainOf& b, int column, int axis, const std::array<double, 3>& gradient) {
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  // Engineering shears xy yz zx sit at 3 4 5: the one of axes (i, i + 1) at 3 + i.
  b(axis, column) = gradient[static_cast<std::size_t>(axis)];
  b(3 + axis, column) = gradient[static_cast<std::size_t>(next)];
  b(3 + last, column) = gradient[static_cast<std::size_t>(last)];
}

/// Strains of the 24 corner displacements and the nine modes 1 - s_k^2, at s in [-1, 1]^3 of a unit cube.
StrainOf strains(const std::array<double, 3>& s) {
  StrainOf b = StrainOf::Zero();
  for (int a = 0; a < 8; ++a) {
    std::array<double, 3> value{}, slope{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double side = ((a >> (2 - k)) & 1) != 0 ? 1 : -1;
      value[k] = 0.5 * (1 + side * s[k]);
      slope[k] = side;  // d/dx = 2 d/ds
    }
    for (int axis = 0; axis < 3; ++axis) {
      strain_column(b, 3 * a + axis, axis,
                    {slope[0] * value[1] * value[2], value[0] * slope[1] * value[2], value[0] * value[1] * slope[2]});
    }
  }
  for (int k = 0; k < 3; ++k) {
    std::array<double, 3> gradient{};
    gradient[static_cast<std::size_t>(k)] = -4 * s[static_cast<std::size_t>(k)];
    for (int axis = 0; axis < 3; ++axis) strain_column(b, 24 + 3 * k + axis, axis, gradient);
  }
  return b;
}

}  // namespace

VoxelElement voxel_element(double poisson) {
  Eigen::Matrix<double, 6, 6> elastic = Eigen::Matrix<double, 6, 6>::Zero();
  const double lambda = poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = 0.5 / (1 + poisson);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) elastic(i, j) = lambda + (i == j ? 2 * mu : 0);
    elastic(3 + i, 3 + i) = mu;
  }
  const std::array<double, 3> at{-std::sqrt(0.6), 0, std::sqrt(0.6)}, weight{5.0 / 18, 8.0 / 18, 5.0 / 18};
  Full full = Full::Zero();
  for (std::size_t x = 0; x < 3; ++x) {
    for (std::size_t y = 0; y < 3; ++y) {
      for (std::size_t z = 0; z < 3; ++z) {
        const StrainOf b = strains({at[x], at[y], at[z]});
        full += weight[x] * weight[y] * weight[z] * b.transpose() * elastic * b;
      }
    }
  }
  using Corner = Eigen::Matrix<double, 24, 24>;
  const Eigen::Matrix<double, 9, 24> coupling = full.bottomLeftCorner<9, 24>();
  const Eigen::Matrix<double, 9, 9> inner = full.bottomRightCorner<9, 9>();
  const Corner k = full.topLeftCorner<24, 24>() - coupling.transpose() * inner.ldlt().solve(coupling);

  Corner hadamard = Corner::Zero();
  for (unsigned m = 0; m < 8; ++m) {
    for (unsigned a = 0; a < 8; ++a) {
      // Corner bit 0 is s = -1: each axis of the monomial gives its sign there.
      const double sign = std::popcount(m & ~a & 7U) % 2 == 0 ? 1 : -1;
      for (unsigned i = 0; i < 3; ++i) hadamard(3 * m + i, 3 * a + i) = sign;
    }
  }
  const Corner modal = hadamard * k * hadamard.transpose() / 64;

  VoxelElement element{};
  const auto rest = strains({0, 0, 0});
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 24; ++j) element.centre[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = rest(i, j);
  }
  for (unsigned c = 0; c < 8; ++c) {
    const auto row = [&](unsigned i) { return static_cast<int>(3 * (c ^ (4U >> i)) + i); };
    Eigen::Matrix3d block;
    for (unsigned i = 0; i < 3; ++i) {
      for (unsigned j = 0; j < 3; ++j) {
        const double v = 0.5 * (modal(row(i), row(j)) + modal(row(j), row(i)));
        block(i, j) = std::abs(v) < 1e-12 ? 0 : v;
      }
    }
    element.modal[c] = {block(0, 0), block(1, 1), block(2, 2), block(0, 1), block(1, 2), block(2, 0)};
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(block);
    for (int e = 0; e < 3; ++e) {
      const double value = eigen.eigenvalues()[e];
      element.largest = std::max(element.largest, 8 * value);
      if (value < 1e-10) continue;
      auto& r = element.root.emplace_back();
      r.cls = c;
      for (unsigned i = 0; i < 3; ++i) r.coefficient[i] = std::sqrt(value) * eigen.eigenvectors()(i, e);
    }
  }
  element.diagonal = k(0, 0);
  return element;
}

}  // namespace fibrolite
