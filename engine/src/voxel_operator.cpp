// SPDX-License-Identifier: Apache-2.0
#include "voxel_operator.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

// Vectors are passed only between inlined functions, so no call depends on how they are passed.
#pragma GCC diagnostic ignored "-Wpsabi"
#define FIBROLITE_MEMBER static inline __attribute__((always_inline))

namespace fibrolite {
namespace {

/// The nodes of one block: displacements in, forces out. Corner z = 0 and z = 1 gather apart, so that no sum is read
/// back across the edge of what was just written.
template <class T>
struct BlockScratch {
  alignas(32) T value[3][736];
  alignas(32) T force[2][3][648];
};

}  // namespace

// The kernel exists for the plain instruction set and for AVX2. Neither fuses a * b + c, so both give the same bits.
#define FIBROLITE_LANES 4
namespace voxel_plain {
namespace {
#include "voxel_kernel.inc"
}
}  // namespace voxel_plain
#undef FIBROLITE_LANES
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
#define FIBROLITE_LANES 8
namespace voxel_avx2 {
namespace {
#include "voxel_kernel.inc"
}
}  // namespace voxel_avx2
#undef FIBROLITE_LANES
#pragma GCC pop_options
#define FIBROLITE_HAS_AVX2 __builtin_cpu_supports("avx2") != 0
#endif

namespace {

template <class T>
void apply_all(const VoxelModel& model, const VoxelElement& element, const Context& context, const T* u, T* f) {
#ifdef FIBROLITE_HAS_AVX2
  static const bool has_avx2 = FIBROLITE_HAS_AVX2;
#endif
  T modal[8][6];
  for (std::size_t c = 0; c < 8; ++c) {
    for (std::size_t k = 0; k < 6; ++k) modal[c][k] = static_cast<T>(element.modal[c][k]);
  }
  std::fill_n(f, 3 * model.nodes(), T{0});
  for (const auto& blocks : model.colour) {
    context.check();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 8), [&](const auto& range) {
      BlockScratch<T> scratch;
      std::fill_n(&scratch.value[0][0], 3 * 736, T{0});
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        const std::size_t b = blocks[i];
        const std::uint32_t begin = model.ref_begin[b], end = model.ref_begin[b + 1];
        // Places no cell touches keep old values: finite, and they meet a fraction of 0.
        for (std::uint32_t r = begin; r < end; ++r) {
          const T* from = u + std::size_t{3} * model.ref_node[r];
          const std::size_t local = model.ref_local[r];
          for (std::size_t k = 0; k < 3; ++k) scratch.value[k][local] = from[k];
        }
        std::fill_n(&scratch.force[0][0][0], 2 * 3 * 648, T{0});
        const float* fraction = model.fraction.data() + 512 * b;
#ifdef FIBROLITE_HAS_AVX2
        if (has_avx2) {
          voxel_avx2::run_block(scratch, fraction, modal, scratch);
        } else {
          voxel_plain::run_block(scratch, fraction, modal, scratch);
        }
#else
        voxel_plain::run_block(scratch, fraction, modal, scratch);
#endif
        for (std::uint32_t r = begin; r < end; ++r) {
          T* to = f + std::size_t{3} * model.ref_node[r];
          const std::size_t local = model.ref_local[r], row = local / 9, z = local % 9;
          for (std::size_t k = 0; k < 3; ++k) {
            T sum = 0;
            if (z < 8) sum += scratch.force[0][k][8 * row + z];
            if (z > 0) sum += scratch.force[1][k][8 * row + z - 1];
            to[k] += sum;
          }
        }
      }
    });
  }
}

}  // namespace

double chunked_sum(std::size_t n, const std::function<double(std::size_t, std::size_t)>& work) {
  std::vector<double> part((n + sum_chunk - 1) / sum_chunk);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, part.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      part[i] = work(i * sum_chunk, std::min(n, (i + 1) * sum_chunk));
    }
  });
  double sum = 0;
  for (const double p : part) sum += p;
  return sum;
}

void chunked(std::size_t n, const std::function<void(std::size_t, std::size_t)>& work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (n + sum_chunk - 1) / sum_chunk, 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) work(i * sum_chunk, std::min(n, (i + 1) * sum_chunk));
  });
}

VoxelOperator::VoxelOperator(const VoxelModel& model, const VoxelElement& element, std::vector<std::uint32_t> fixed,
                             Context context)
    : model_(model), element_(element), fixed_(std::move(fixed)), context_(std::move(context)) {}

void VoxelOperator::apply_free(const double* u, double* f) const { apply_all(model_, element_, context_, u, f); }

void VoxelOperator::apply(const double* u, double* f) const {
  apply_all(model_, element_, context_, u, f);
  mask(f);
}

void VoxelOperator::apply(const float* u, float* f) const {
  apply_all(model_, element_, context_, u, f);
  mask(f);
}

std::vector<float> VoxelOperator::inverse_diagonal() const {
  std::vector<float> d(model_.nodes(), 0.0F);
  const auto unit = static_cast<float>(element_.diagonal);
  for (std::size_t b = 0; b < model_.blocks(); ++b) {
    std::array<float, 829> sum{};
    for (std::size_t c = 0; c < 512; ++c) {
      const auto low = static_cast<std::size_t>(VoxelModel::lowest_corner(static_cast<int>(c)));
      for (const int k : VoxelModel::corner) sum[low + static_cast<std::size_t>(k)] += model_.fraction[512 * b + c];
    }
    for (std::uint32_t r = model_.ref_begin[b]; r < model_.ref_begin[b + 1]; ++r) {
      d[model_.ref_node[r]] += unit * sum[model_.ref_local[r]];
    }
  }
  for (float& v : d) v = 1 / v;
  return d;
}

}  // namespace fibrolite
