// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/quilt.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace fibrolite {
namespace {

using Error2 = std::int64_t;  // sum of squared differences
constexpr Error2 hopeless = std::numeric_limits<Error2>::max();

struct Corner {
  int x = 0, y = 0;
};

/// One patch to be laid at `at`: what it shares with the patches to its left and above.
struct Slot {
  Corner at;
  bool left = false, above = false;
};

class Quilt {
 public:
  Quilt(const GrayImage& texture, int width, int height, const QuiltParams& params)
      : texture_(texture),
        params_(params),
        step_(params.block_px - params.overlap_px),
        columns_(1 + std::max(0, (width - params.overlap_px - 1) / step_)),
        rows_(1 + std::max(0, (height - params.overlap_px - 1) / step_)),
        canvas_(columns_ * step_ + params.overlap_px, rows_ * step_ + params.overlap_px) {}

  GrayImage sew(int width, int height, Random& random) {
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        const Slot slot{{column * step_, row * step_}, column > 0, row > 0};
        lay(slot, choose(slot, random));
      }
    GrayImage result(width, height);
    for (int y = 0; y < height; ++y) std::copy_n(&canvas_(0, y), width, &result(0, y));
    return result;
  }

 private:
  [[nodiscard]] Error2 row_error(Slot slot, Corner from, int y, int x_end) const {
    const std::uint8_t* a = &canvas_(slot.at.x, slot.at.y + y);
    const std::uint8_t* b = &texture_(from.x, from.y + y);
    std::int32_t sum = 0;  // at most 65025 * block, far below 2^31
    for (int x = 0; x < x_end; ++x) {
      const std::int32_t d = static_cast<std::int32_t>(a[x]) - static_cast<std::int32_t>(b[x]);
      sum += d * d;
    }
    return sum;
  }

  /// Error of the overlap; gives up and says hopeless once it exceeds `limit`.
  [[nodiscard]] Error2 error(Slot slot, Corner from, Error2 limit) const {
    Error2 sum = 0;
    for (int y = 0; y < params_.block_px; ++y) {
      const bool whole_row = slot.above && y < params_.overlap_px;
      if (!whole_row && !slot.left) break;
      sum += row_error(slot, from, y, whole_row ? params_.block_px : params_.overlap_px);
      if (sum > limit) return hopeless;
    }
    return sum;
  }

  Corner choose(Slot slot, Random& random) const {
    const auto width = static_cast<std::uint64_t>(texture_.width - params_.block_px + 1);
    const auto height = static_cast<std::uint64_t>(texture_.height - params_.block_px + 1);
    const auto draw = [&] {
      const auto x = static_cast<int>(random.below(width));
      return Corner{x, static_cast<int>(random.below(height))};
    };
    if (!slot.left && !slot.above) return draw();
    std::vector<Corner> place(static_cast<std::size_t>(params_.candidates));
    for (Corner& c : place) c = draw();
    std::vector<Error2> cost(place.size(), hopeless);
    // Each chunk gives up early by its own best alone, so that the outcome does not depend on who runs when. The slack
    // keeps every candidate within the tolerance of the overall best exact.
    constexpr std::size_t chunks = 8;
    const double slack = 1 + params_.tolerance;
    tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
      Error2 limit = hopeless - 1;
      for (std::size_t i = chunk; i < place.size(); i += chunks) {
        cost[i] = error(slot, place[i], limit);
        if (cost[i] != hopeless) limit = std::min(limit, static_cast<Error2>(slack * static_cast<double>(cost[i])) + 1);
      }
    });
    const Error2 best = *std::min_element(cost.begin(), cost.end());
    std::vector<Corner> good;
    for (std::size_t i = 0; i < place.size(); ++i)
      if (static_cast<double>(cost[i]) <= slack * static_cast<double>(best)) good.push_back(place[i]);
    return good[random.below(good.size())];
  }

  /// For each line of an overlap the position where the new patch takes over: the path of least error from end to end.
  template <class Difference>
  std::vector<int> cheapest_cut(Difference&& difference) const {
    const int length = params_.block_px, across = params_.overlap_px;
    Image<Error2> total(across, length);
    for (int along = 0; along < length; ++along)
      for (int i = 0; i < across; ++i) {
        Error2 before = 0;
        if (along > 0) {
          before = total(i, along - 1);
          if (i > 0) before = std::min(before, total(i - 1, along - 1));
          if (i + 1 < across) before = std::min(before, total(i + 1, along - 1));
        }
        total(i, along) = before + difference(i, along);
      }
    std::vector<int> cut(static_cast<std::size_t>(length));
    int at = 0;
    for (int i = 1; i < across; ++i)
      if (total(i, length - 1) < total(at, length - 1)) at = i;
    for (int along = length - 1; along >= 0; --along) {
      cut[static_cast<std::size_t>(along)] = at;
      if (along == 0) break;
      int next = at;
      for (const int i : {at - 1, at + 1})
        if (i >= 0 && i < across && total(i, along - 1) < total(next, along - 1)) next = i;
      at = next;
    }
    return cut;
  }

  void lay(Slot slot, Corner from) {
    const auto difference = [&](int x, int y) {
      const Error2 d = Error2{canvas_(slot.at.x + x, slot.at.y + y)} - Error2{texture_(from.x + x, from.y + y)};
      return d * d;
    };
    std::vector<int> left(static_cast<std::size_t>(params_.block_px), 0), above = left;
    if (slot.left) left = cheapest_cut([&](int across, int along) { return difference(across, along); });
    if (slot.above) above = cheapest_cut([&](int across, int along) { return difference(along, across); });
    for (int y = 0; y < params_.block_px; ++y)
      for (int x = 0; x < params_.block_px; ++x)
        if (x >= left[static_cast<std::size_t>(y)] && y >= above[static_cast<std::size_t>(x)])
          canvas_(slot.at.x + x, slot.at.y + y) = texture_(from.x + x, from.y + y);
  }

  const GrayImage& texture_;
  QuiltParams params_;
  int step_, columns_, rows_;
  GrayImage canvas_;
};

}  // namespace

GrayImage quilt(const GrayImage& texture, int width, int height, const QuiltParams& params, Random random) {
  return Quilt(texture, width, height, params).sew(width, height, random);
}

}  // namespace fibrolite
