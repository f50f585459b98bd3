// SPDX-License-Identifier: Apache-2.0
// A symmetric sparse matrix of 6x6 blocks: translation and rotation of aggregates of nodes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace fibrolite {

/// Row by row.
using Block6 = std::array<double, 36>;

/// Sums blocks by (row, column), in the order they come: one thread's share of a matrix.
class BlockSum {
 public:
  struct Key {
    std::uint32_t row, column;
  };
  /// The sum at (row, column), zero at first. The reference holds until the next call.
  [[nodiscard]] Block6& at(std::uint32_t row, std::uint32_t column);
  [[nodiscard]] std::span<const Key> keys() const { return keys_; }
  [[nodiscard]] const Block6& value(std::size_t i) const { return values_[i]; }
  void clear();

 private:
  void grow();
  std::vector<Key> keys_;
  std::vector<Block6> values_;
  std::vector<std::uint32_t> slots_;  // open addressing; place in keys_ + 1
};

/// Only blocks with row <= column are stored, once; every row lists all its blocks.
class BlockMatrix {
 public:
  struct Entry {
    std::uint32_t column;
    std::uint32_t slot;  ///< Its upper bit: the stored block is the transpose.
  };
  static constexpr std::uint32_t transposed = 0x80000000U;

  explicit BlockMatrix(std::size_t rows = 0) : upper_(rows) {}
  /// Add blocks with row <= column.
  void add(const BlockSum& sum);
  /// No more blocks: list the rows.
  void finish();
  /// Keep single precision only: half the memory, enough to smooth.
  void round();

  [[nodiscard]] std::size_t rows() const { return rows_; }
  [[nodiscard]] std::size_t blocks() const { return count_; }
  [[nodiscard]] std::span<const Entry> row(std::size_t i) const {
    return {entry_.data() + begin_[i], begin_[i + 1] - begin_[i]};
  }
  /// Block in double precision, before round().
  [[nodiscard]] Block6 block(Entry e) const;
  /// y = A x, six numbers a row. Cost: parallel; the same bits on any number of threads.
  void apply(const float* x, float* y) const;

 private:
  /// Larger than what an allocator keeps for itself: a page given back is back.
  static constexpr std::size_t page = 1U << 17U;
  [[nodiscard]] const Block6& stored(std::uint32_t slot) const { return pages_[slot / page][slot % page]; }

  std::size_t rows_ = 0, count_ = 0;
  std::vector<std::vector<Entry>> upper_;
  std::vector<std::unique_ptr<Block6[]>> pages_;
  std::vector<std::size_t> begin_;
  std::vector<Entry> entry_;
  std::vector<float> rounded_;
};

}  // namespace fibrolite
