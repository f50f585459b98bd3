// SPDX-License-Identifier: GPL-3.0-or-later
#include "cholesky.h"

#include <cblas.h>
#include <cholmod.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "fibrolite/error.h"

// Of libgomp, which CHOLMOD brings; its header belongs to the compiler and is not everywhere.
extern "C" void omp_set_max_active_levels(int levels);
extern "C" int omp_get_max_active_levels();

namespace fibrolite::fem {
namespace {

/// While it lives, OpenMP regions of this thread run on this thread alone. Debian's CHOLMOD asks for four threads in
/// each of its many small regions; beside TBB's own they wait for each other far longer than they work (27 s for 6 s of
/// work, measured).
class SerialOpenMp {
 public:
  SerialOpenMp() : before_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }
  ~SerialOpenMp() { omp_set_max_active_levels(before_); }
  SerialOpenMp(const SerialOpenMp&) = delete;
  SerialOpenMp& operator=(const SerialOpenMp&) = delete;

 private:
  int before_;
};

Error unsolvable() {
  return {Code::SolverFailed, "the stiffness matrix is singular or does not fit the memory", "elasticity",
          "look for parts that hang by a point or an edge"};
}

}  // namespace

struct Cholesky::Impl {
  cholmod_common common{};
  cholmod_factor* factor = nullptr;

  Impl() {
    cholmod_start(&common);
    common.print = 0;  // it would write its complaints to stdout
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 1;  // nested dissection wins on volume meshes: trying others first costs a third of the time
    common.method[0].ordering = CHOLMOD_METIS;
  }
  ~Impl() {
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
};

Cholesky::Cholesky(SymmetricMatrix matrix) : impl_(std::make_unique<Impl>()) {
  const SerialOpenMp serial;
  openblas_set_num_threads(1);
  cholmod_sparse view{};
  view.nrow = view.ncol = matrix.size();
  view.nzmax = matrix.row.size();
  view.p = matrix.begin.data();
  view.i = matrix.row.data();
  view.x = matrix.value.data();
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = view.packed = 1;
  {
    // METIS draws its random numbers from one state of the whole process: two orderings at once would spoil each
    // other's bits.
    static std::mutex one_ordering_at_a_time;
    const std::lock_guard lock(one_ordering_at_a_time);
    impl_->factor = cholmod_analyze(&view, &impl_->common);
  }
  if (impl_->factor == nullptr) throw unsolvable();
  cholmod_factorize(&view, impl_->factor, &impl_->common);
  if (impl_->common.status != CHOLMOD_OK || impl_->factor->minor < matrix.size()) throw unsolvable();
  // A hinge leaves a pivot that only rounding keeps above zero.
  if (cholmod_rcond(impl_->factor, &impl_->common) < 1e-13) throw unsolvable();
}

Cholesky::~Cholesky() = default;

void Cholesky::solve(std::vector<double>& b) const {
  const SerialOpenMp serial;
  cholmod_dense view{};
  view.nrow = view.d = view.nzmax = b.size();
  view.ncol = 1;
  view.x = b.data();
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, impl_->factor, &view, &impl_->common);
  if (x == nullptr) throw unsolvable();
  std::copy_n(static_cast<const double*>(x->x), b.size(), b.begin());
  cholmod_free_dense(&x, &impl_->common);
}

}  // namespace fibrolite::fem
