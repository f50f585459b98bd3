// SPDX-License-Identifier: Apache-2.0
// Chebyshev smoothing of one level of a multigrid.
#pragma once

#include <cstddef>
#include <vector>

namespace fibrolite {

/// What a level gives to its smoother. Vectors are of size().
struct SmoothLevel {
  virtual ~SmoothLevel() = default;
  [[nodiscard]] virtual std::size_t size() const = 0;
  virtual void apply(const float* x, float* y) const = 0;
  /// d = keep * d + step * D^-1 (b - y), x += d; y may be null: 0.
  virtual void relax(const float* b, const float* y, float keep, float step, float* d, float* x) const = 0;
};

/// The upper end of the spectrum of D^-1 A, by Lanczos with a margin of 5 %: power iteration comes from below so slowly
/// that the smoother then excites what it should damp. Same bits on any number of threads.
[[nodiscard]] double largest_eigenvalue(const SmoothLevel& level, int steps);

/// Chebyshev polynomial for the eigenvalues in [largest / ratio, largest] of D^-1 A (Adams, Brezina, Hu, Tuminaro
/// 2003).
struct Chebyshev {
  double largest = 1;
  double ratio = 16;
  int degree = 2;
  /// Improve x; `zero`: it is 0 at entry, which saves one product. y and d are scratch. Cost: degree products.
  void smooth(const SmoothLevel& level, const float* b, float* x, float* y, float* d, bool zero) const;
};

}  // namespace fibrolite
