// SPDX-License-Identifier: GPL-3.0-or-later
// Sparse symmetric positive definite systems: the one door to CHOLMOD.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace fibrolite::fem {

/// Lower triangle, column by column, rows rising.
struct SymmetricMatrix {
  std::vector<int> begin{0};  ///< Of each column; one more at the end.
  std::vector<int> row;
  std::vector<double> value;
  [[nodiscard]] std::size_t size() const { return begin.size() - 1; }
};

/// A supernodal factor. Pins OpenBLAS to one thread for the whole process: its threads would change the bits.
class Cholesky {
 public:
  /// Cost: 100 k unknowns of ten-node tetrahedra in 5 s. @throws Error SolverFailed: singular, or out of memory.
  explicit Cholesky(SymmetricMatrix matrix);
  ~Cholesky();
  Cholesky(const Cholesky&) = delete;
  Cholesky& operator=(const Cholesky&) = delete;
  /// b becomes A^-1 b. Not for two threads at once. @throws Error SolverFailed: out of memory.
  void solve(std::vector<double>& b) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fibrolite::fem
