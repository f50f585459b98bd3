// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/chebyshev.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "voxel_operator.h"

namespace fibrolite {
namespace {

double dot(const std::vector<float>& a, const std::vector<float>& b) {
  return chunked_sum(a.size(), [&](std::size_t from, std::size_t to) {
    double s = 0;
    for (std::size_t i = from; i < to; ++i) s += static_cast<double>(a[i]) * static_cast<double>(b[i]);
    return s;
  });
}

}  // namespace

double largest_eigenvalue(const SmoothLevel& level, int steps) {
  const std::size_t n = level.size();
  std::vector<float> r(n), z(n), p(n, 0.0F), image(n, 0.0F), scratch(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t h = (i + 1) * 0x9E3779B97F4A7C15ULL;
    image[i] = static_cast<float>((h >> 40U) & 0xFFFFU) / 32768.0F - 1.0F;
  }
  level.relax(image.data(), nullptr, 0, 1, scratch.data(), p.data());  // zero where nothing moves
  level.apply(p.data(), r.data());
  std::fill(p.begin(), p.end(), 0.0F);
  // The coefficients of conjugate gradients are those of Lanczos' tridiagonal matrix.
  std::vector<double> alpha, beta;
  double last = 0;
  for (int k = 0; k < steps; ++k) {
    std::fill(z.begin(), z.end(), 0.0F);
    level.relax(r.data(), nullptr, 0, 1, scratch.data(), z.data());
    const double square = dot(r, z);
    if (!(square > 0) || !std::isfinite(square)) break;
    const double b = last > 0 ? square / last : 0;
    last = square;
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + static_cast<float>(b) * p[i];
    level.apply(p.data(), image.data());
    const double curvature = dot(p, image);
    if (!(curvature > 0) || !std::isfinite(curvature)) break;
    const double a = square / curvature;
    for (std::size_t i = 0; i < n; ++i) r[i] -= static_cast<float>(a) * image[i];
    alpha.push_back(a);
    beta.push_back(b);
  }
  if (alpha.empty()) return 1;
  const auto m = static_cast<Eigen::Index>(alpha.size());
  Eigen::MatrixXd t = Eigen::MatrixXd::Zero(m, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto i = static_cast<std::size_t>(k);
    t(k, k) = 1 / alpha[i] + (k > 0 ? beta[i] / alpha[i - 1] : 0);
    if (k > 0) t(k, k - 1) = t(k - 1, k) = std::sqrt(beta[i]) / alpha[i - 1];
  }
  return 1.05 * Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(t, Eigen::EigenvaluesOnly).eigenvalues()[m - 1];
}

void Chebyshev::smooth(const SmoothLevel& level, const float* b, float* x, float* y, float* d, bool zero) const {
  const double low = largest / ratio, middle = 0.5 * (largest + low), half = 0.5 * (largest - low);
  const double sigma = middle / half;
  double rho = 1 / sigma;
  if (!zero) level.apply(x, y);
  level.relax(b, zero ? nullptr : y, 0, static_cast<float>(1 / middle), d, x);
  for (int k = 1; k < degree; ++k) {
    level.apply(x, y);
    const double next = 1 / (2 * sigma - rho);
    level.relax(b, y, static_cast<float>(next * rho), static_cast<float>(2 * next / half), d, x);
    rho = next;
  }
}

}  // namespace fibrolite
