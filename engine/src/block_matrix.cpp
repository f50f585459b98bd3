// SPDX-License-Identifier: Apache-2.0
#include "block_matrix.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace fibrolite {
namespace {

std::size_t hash(std::uint32_t row, std::uint32_t column) {
  const std::uint64_t key = (std::uint64_t{row} << 32U) | column;
  return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> 20U);
}

}  // namespace

Block6& BlockSum::at(std::uint32_t row, std::uint32_t column) {
  if (2 * keys_.size() >= slots_.size()) grow();
  const std::size_t mask = slots_.size() - 1;
  std::size_t s = hash(row, column) & mask;
  while (slots_[s] != 0) {
    const Key& k = keys_[slots_[s] - 1];
    if (k.row == row && k.column == column) return values_[slots_[s] - 1];
    s = (s + 1) & mask;
  }
  keys_.push_back({row, column});
  values_.push_back(Block6{});
  slots_[s] = static_cast<std::uint32_t>(keys_.size());
  return values_.back();
}

void BlockSum::grow() {
  slots_.assign(std::max<std::size_t>(1024, 2 * slots_.size()), 0);
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    std::size_t s = hash(keys_[i].row, keys_[i].column) & mask;
    while (slots_[s] != 0) s = (s + 1) & mask;
    slots_[s] = static_cast<std::uint32_t>(i + 1);
  }
}

void BlockSum::clear() {
  keys_.clear();
  values_.clear();
  std::fill(slots_.begin(), slots_.end(), 0U);
}

void BlockMatrix::add(const BlockSum& sum) {
  for (std::size_t i = 0; i < sum.keys().size(); ++i) {
    const auto [row, column] = sum.keys()[i];
    auto& list = upper_[row];
    auto at = std::find_if(list.begin(), list.end(), [c = column](const Entry& e) { return e.column == c; });
    if (at == list.end()) {
      if (count_ % page == 0) pages_.push_back(std::make_unique_for_overwrite<Block6[]>(page));
      list.push_back({column, static_cast<std::uint32_t>(count_++)});
      at = list.end() - 1;
      pages_[at->slot / page][at->slot % page].fill(0);
    }
    Block6& into = pages_[at->slot / page][at->slot % page];
    const Block6& from = sum.value(i);
    for (std::size_t k = 0; k < 36; ++k) into[k] += from[k];
  }
}

void BlockMatrix::finish() {
  rows_ = upper_.size();
  std::vector<std::size_t> fill(rows_ + 1, 0);
  for (std::size_t i = 0; i < rows_; ++i) {
    for (const Entry& e : upper_[i]) {
      ++fill[i + 1];
      if (e.column != i) ++fill[e.column + 1];
    }
  }
  for (std::size_t i = 0; i < rows_; ++i) fill[i + 1] += fill[i];
  begin_ = fill;
  entry_.resize(begin_.back());
  for (std::size_t i = 0; i < rows_; ++i) {
    for (const Entry& e : upper_[i]) {
      entry_[fill[i]++] = e;
      if (e.column != i) entry_[fill[e.column]++] = {static_cast<std::uint32_t>(i), e.slot | transposed};
    }
    upper_[i] = {};
  }
  upper_ = {};
  for (std::size_t i = 0; i < rows_; ++i) {
    std::sort(entry_.begin() + static_cast<std::ptrdiff_t>(begin_[i]),
              entry_.begin() + static_cast<std::ptrdiff_t>(begin_[i + 1]),
              [](const Entry& a, const Entry& b) { return a.column < b.column; });
  }
}

void BlockMatrix::round() {
  rounded_.resize(36 * count_);
  for (std::size_t s = 0; s < count_; ++s) {
    const Block6& b = stored(static_cast<std::uint32_t>(s));
    for (std::size_t k = 0; k < 36; ++k) rounded_[36 * s + k] = static_cast<float>(b[k]);
    if (s % page == page - 1) pages_[s / page].reset();
  }
  pages_.clear();
}

Block6 BlockMatrix::block(Entry e) const {
  const Block6& b = stored(e.slot & ~transposed);
  if ((e.slot & transposed) == 0) return b;
  Block6 t;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) t[6 * i + j] = b[6 * j + i];
  }
  return t;
}

namespace {

template <class T>
void multiply_add(const T* a, bool transpose, const float* v, float* sum) {
  if (transpose) {
    for (std::size_t c = 0; c < 6; ++c) {
      for (std::size_t r = 0; r < 6; ++r) sum[r] += static_cast<float>(a[6 * c + r]) * v[c];
    }
    return;
  }
  for (std::size_t r = 0; r < 6; ++r) {
    float s = 0;
    for (std::size_t c = 0; c < 6; ++c) s += static_cast<float>(a[6 * r + c]) * v[c];
    sum[r] += s;
  }
}

}  // namespace

void BlockMatrix::apply(const float* x, float* y) const {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rows_, 512), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      std::array<float, 6> sum{};
      for (const Entry e : row(i)) {
        const std::uint32_t slot = e.slot & ~transposed;
        const float* v = x + std::size_t{6} * e.column;
        if (rounded_.empty()) {
          multiply_add(stored(slot).data(), slot != e.slot, v, sum.data());
        } else {
          multiply_add(rounded_.data() + std::size_t{36} * slot, slot != e.slot, v, sum.data());
        }
      }
      std::copy(sum.begin(), sum.end(), y + 6 * i);
    }
  });
}

}  // namespace fibrolite
