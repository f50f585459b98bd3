// SPDX-License-Identifier: Apache-2.0
#include "closed_check.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "closed_fan.h"
#include "layer_sums.h"
#include "layer_weld.h"
#include "shared_sets.h"
#include "unwritten.h"

namespace fibrolite {
namespace {

using Range = tbb::blocked_range<std::size_t>;

/// Thrown at the first vertex that is not as it should be.
struct NotClosed {};

/// Each vertex's triangles are put into its fan as they come, and looked at when the next layer is there, for then they
/// all are. Triangles themselves need not stay.
class ClosedChecker {
 public:
  void add(const MeshLayer& layer) {
    weld_.next(layer);
    if (weld_.any()) throw NotClosed{};
    if (!begun_ && !weld_.box.empty()) {
      from_ = weld_.box.center();
      begun_ = true;
    }
    result_.triangles += static_cast<std::int64_t>(layer.triangles.size());
    const LayerSums sums = sums_of(layer, from_);
    if (sums.collapsed > 0) throw NotClosed{};
    result_.volume_mm3 += sums.volume_mm3;
    result_.degenerate_triangles += sums.degenerate;
    const std::size_t end = layer.first + layer.vertices.size();
    if (end >= Fan<16>::first_unused) throw NotClosed{};
    make_room(layer.first, layer.first + layer.before, end);
    fill(layer, static_cast<std::uint32_t>(end));
    look_at(layer.first + layer.before);
    end_ = end;
  }

  MeshCheck finish() {
    look_at(end_);
    return result_;
  }

 private:
  /// Of a vertex with more triangles than its fan has places.
  struct More {
    std::uint32_t vertex, to, from;
  };

  /// For the vertices of two layers: rings, in which those of the one before stay where they are.
  void make_room(std::size_t first, std::size_t middle, std::size_t end) {
    const std::size_t needed = std::bit_ceil(end - first + 1);
    if (needed <= counts_.size()) return;
    std::vector<Fan<8>, Unwritten<Fan<8>>> fans(needed);
    std::vector<std::uint8_t, Unwritten<std::uint8_t>> counts(needed);
    SharedSets sets(needed);
    for (std::size_t v = first; v < middle; ++v) {
      fans[v & (needed - 1)] = fans_[v & mask_];
      counts[v & (needed - 1)] = counts_[v & mask_];
      const auto a = static_cast<std::uint32_t>(v);
      sets.start(a);
    }
    for (std::size_t v = first; v < middle; ++v)
      sets.put_below(static_cast<std::uint32_t>(v), sets_.root(static_cast<std::uint32_t>(v)));
    std::swap(fans_, fans);
    std::swap(counts_, counts);
    std::swap(sets_, sets);
    mask_ = needed - 1;
  }

  /// Each share of the vertices goes through all triangles: that is less than what it costs to share the counts. Half
  /// of the threads have enough to do with the layer that is made meanwhile.
  void fill(const MeshLayer& layer, std::uint32_t end) {
    const auto first = static_cast<std::uint32_t>(layer.first),
               fresh = first + static_cast<std::uint32_t>(layer.before);
    const std::size_t shares =
        std::clamp<std::size_t>(static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) / 2, 1, 16);
    std::vector<std::vector<More>> more(shares);
    std::atomic<bool> too_many{false};
    tbb::parallel_for(std::size_t{0}, shares, [&](std::size_t share) {
      const auto bound = [&](std::size_t s) { return static_cast<std::uint32_t>(first + s * (end - first) / shares); };
      const std::uint32_t low = bound(share), size = bound(share + 1) - low;
      for (std::uint32_t v = std::max(low, fresh); v < low + size; ++v) {
        fans_[v & mask_].clear();
        counts_[v & mask_] = 0;
        sets_.start(v);
      }
      const auto put = [&](std::uint32_t v, std::uint32_t to, std::uint32_t from) {
        if (v - low >= size) return;
        std::uint8_t& count = counts_[v & mask_];
        if (count < 8) {
          fans_[v & mask_].put(count, to, from);
        } else {
          more[share].push_back({v, to, from});
          if (count == 16) too_many = true;
        }
        ++count;
      };
      for (const auto& [a, b, c] : layer.triangles) {
        put(a, b, c);
        put(b, c, a);
        put(c, a, b);
        if (!more[share].empty() && too_many) return;
      }
    });
    if (too_many) throw NotClosed{};
    for (const auto& some : more) more_.insert(more_.end(), some.begin(), some.end());
    std::sort(more_.begin(), more_.end(), [](const More& a, const More& b) { return a.vertex < b.vertex; });
  }

  /// All vertices before `end` that have not been looked at.
  void look_at(std::size_t end) {
    const auto more_of = [&](std::uint32_t v) {
      return std::lower_bound(more_.begin(), more_.end(), v,
                              [](const More& m, std::uint32_t u) { return m.vertex < u; });
    };
    std::atomic<bool> closed{true};
    tbb::enumerable_thread_specific<std::vector<std::array<std::uint32_t, 2>>> bridges;
    result_.vertices += tbb::parallel_reduce(
        Range(looked_at_, end, 1024), std::int64_t{0},
        [&](const Range& range, std::int64_t used) {
          bool good = closed.load(std::memory_order_relaxed);
          auto& mine = bridges.local();
          for (std::size_t i = range.begin(); i < range.end() && good; ++i) {
            const auto v = static_cast<std::uint32_t>(i);
            const std::uint32_t count = counts_[v & mask_];
            if (count == 0) continue;
            ++used;
            if (count <= 8) {
              good = count >= 3 && is_closed(fans_[v & mask_], count);
              connect(v, fans_[v & mask_], mine);
            } else {
              const Fan<16> fan = whole(fans_[v & mask_], more_of(v), count);
              good = is_closed(fan, count);
              connect(v, fan, mine);
            }
          }
          if (!good) closed = false;
          return used;
        },
        std::plus<>{});
    if (!closed) throw NotClosed{};
    for (const auto& some : bridges)
      for (const auto& [a, b] : some) sets_.join(a, b);
    result_.shells += tbb::parallel_reduce(
        Range(looked_at_, end, 4096), std::int64_t{0},
        [&](const Range& range, std::int64_t shells) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const auto v = static_cast<std::uint32_t>(i);
            shells += sets_.is_root(v) && counts_[v & mask_] > 0 ? 1 : 0;
          }
          return shells;
        },
        std::plus<>{});
    more_.erase(more_.begin(), more_of(static_cast<std::uint32_t>(end)));
    looked_at_ = end;
  }

  /// Around a vertex its neighbours are connected, and so are those with greater numbers as long as they follow each
  /// other: of each such row one is enough. Nearly always there is one row. (Sets without a vertex to come are shells:
  /// of an edge between vertices that have been looked at either both ends are in one set, or both sets have one.)
  template <std::uint32_t most>
  void connect(std::uint32_t v, const Fan<most>& fan, std::vector<std::array<std::uint32_t, 2>>& bridges) {
    std::uint32_t rows = 0, greater = v;
    for (std::uint32_t k = 0; k < most; ++k) {
      const bool begins = fan.out[k] > v && fan.in[k] < v;
      rows += begins ? 1 : 0;
      greater = begins ? fan.out[k] : greater;
    }
    if (rows == 0) greater = std::max(v, fan.out[0]);  // the whole circle, or none
    if (rows < 2 && sets_.put_below(v, greater)) return;
    if (rows == 0) bridges.push_back({v, greater});
    for (std::uint32_t k = 0; k < most; ++k)
      if (fan.out[k] > v && fan.in[k] < v) bridges.push_back({v, fan.out[k]});
  }

  static Fan<16> whole(const Fan<8>& fan, std::vector<More>::const_iterator more, std::uint32_t count) {
    Fan<16> all;
    all.clear();
    for (std::uint32_t k = 0; k < 8; ++k) all.put(k, fan.out[k], fan.in[k]);
    for (std::uint32_t k = 8; k < count; ++k, ++more) all.put(k, more->to, more->from);
    return all;
  }

  MeshCheck result_;
  LayerWeld weld_;
  Vec3d from_{};
  bool begun_ = false;
  std::vector<Fan<8>, Unwritten<Fan<8>>> fans_;
  std::vector<std::uint8_t, Unwritten<std::uint8_t>> counts_;
  SharedSets sets_{0};
  std::size_t mask_ = 0;
  std::vector<More> more_;  // sorted
  std::size_t looked_at_ = 0, end_ = 0;
};

}  // namespace

std::optional<MeshCheck> check_closed(const MeshLayers& layers, const Context& context) {
  try {
    ClosedChecker checker;
    layers.each([&](const MeshLayer& layer) { checker.add(layer); }, context);
    return checker.finish();
  } catch (const NotClosed&) {
    return std::nullopt;
  }
}

}  // namespace fibrolite
