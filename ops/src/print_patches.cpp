// SPDX-License-Identifier: GPL-3.0-or-later
#include "print_patches.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "fibrolite/disjoint_sets.h"
#include "fibrolite/frame.h"

namespace fibrolite {
namespace {

constexpr double exact = 1 << 28;
std::int64_t fixed(double value) { return std::llround(value * exact); }
double floating(std::int64_t value) { return static_cast<double>(value) / exact; }

using Key = std::uint64_t;
constexpr int middle = 1 << 20;
constexpr Key key(int x, int y, int z) {  // neighbours differ by a constant
  return (static_cast<Key>(x + middle) << 42) + (static_cast<Key>(y + middle) << 21) + static_cast<Key>(z + middle);
}
int along(Key k, int axis) { return static_cast<int>((k >> (42 - 21 * axis)) & ((1U << 21) - 1)) - middle; }

/// Calls visit(i, j) for the positions of neighbours in a sorted list without doubles.
template <class Visit>
void each_touching(const std::vector<Key>& sorted, const Visit& visit) {
  for (int n = 14; n < 27; ++n) {  // the 13 neighbours that come later
    const Key step = key(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1) - key(0, 0, 0);
    std::size_t j = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      while (j < sorted.size() && sorted[j] < sorted[i] + step) ++j;
      if (j == sorted.size()) break;
      if (sorted[j] == sorted[i] + step) visit(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
    }
  }
}

/// For each spot the number of its patch, in the order in which patches first appear; and how many there are.
struct Numbers {
  explicit Numbers(const std::vector<Spot>& spots) {
    std::vector<Key> keys;
    for (const Spot& s : spots) keys.push_back(key(s.at.x, s.at.y, s.at.z));
    std::vector<Key> sorted = keys;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    DisjointSets sets(sorted.size());
    each_touching(sorted, [&](std::uint32_t i, std::uint32_t j) { sets.join(i, j); });
    constexpr std::uint32_t none = ~0U;
    std::vector<std::uint32_t> number(sorted.size(), none);
    for (const Key k : keys) {
      const auto place = std::lower_bound(sorted.begin(), sorted.end(), k) - sorted.begin();
      std::uint32_t& mine = number[sets.root(static_cast<std::uint32_t>(place))];
      if (mine == none) mine = count++;
      of.push_back(mine);
    }
  }
  std::vector<std::uint32_t> of;
  std::uint32_t count = 0;
};

std::array<Vec3d, 8> directions_across(Vec3d up) {
  const Frame frame = frame_along({}, up);
  std::array<Vec3d, 8> across;
  for (std::size_t d = 0; d < across.size(); ++d) {
    const double angle = std::numbers::pi * static_cast<double>(d) / static_cast<double>(across.size());
    across[d] = std::cos(angle) * frame.x + std::sin(angle) * frame.y;
  }
  return across;
}
PatchSum empty_sum() {
  PatchSum sum;
  sum.low.fill(INFINITY);
  sum.high.fill(-INFINITY);
  return sum;
}
auto order(Vec3d v) { return std::tuple(v.x, v.y, v.z); }

void take_least(PatchSum& sum, double mm, Vec3d at) {
  if (std::tuple(mm, order(at)) < std::tuple(sum.least_mm, order(sum.least_at_mm))) {
    sum.least_mm = mm;
    sum.least_at_mm = at;
  }
}
void add(PatchSum& sum, const Spot& spot, const std::array<Vec3d, 8>& across) {
  sum.area += fixed(spot.area_mm2);
  sum.volume += fixed(0.5 * spot.area_mm2 * spot.mm);
  for (int axis = 0; axis < 3; ++axis)
    sum.moment[static_cast<std::size_t>(axis)] += fixed(spot.area_mm2 * spot.foot_mm[axis]);
  take_least(sum, spot.mm, spot.foot_mm);
  for (std::size_t d = 0; d < across.size(); ++d) {
    const double at = dot(across[d], spot.foot_mm);
    sum.low[d] = std::min(sum.low[d], at);
    sum.high[d] = std::max(sum.high[d], at);
  }
}
void add(PatchSum& sum, const PatchSum& other) {
  sum.area += other.area;
  sum.volume += other.volume;
  for (std::size_t k = 0; k < 3; ++k) sum.moment[k] += other.moment[k];
  take_least(sum, other.least_mm, other.least_at_mm);
  for (std::size_t d = 0; d < sum.low.size(); ++d) {
    sum.low[d] = std::min(sum.low[d], other.low[d]);
    sum.high[d] = std::max(sum.high[d], other.high[d]);
  }
}
double width(const PatchSum& sum) {
  double most = 0;
  for (std::size_t d = 0; d < sum.low.size(); ++d) most = std::max(most, sum.high[d] - sum.low[d]);
  return most;
}
std::vector<PatchSum> sums_of(const std::vector<Spot>& spots, const Numbers& numbers, Vec3d up) {
  const std::array<Vec3d, 8> across = directions_across(up);
  std::vector<PatchSum> sums(numbers.count, empty_sum());
  for (std::size_t i = 0; i < spots.size(); ++i) add(sums[numbers.of[i]], spots[i], across);
  return sums;
}

constexpr std::size_t walls = 0, gaps = 1, steep = 2;

/// The worst first: the thinnest or narrowest, of overhangs the largest.
bool worse(const PrintPlace& a, const PrintPlace& b, std::size_t kind) {
  if (kind != steep && a.mm != b.mm) return a.mm < b.mm;
  if (a.area_mm2 != b.area_mm2) return a.area_mm2 > b.area_mm2;
  return order(a.at_mm) < order(b.at_mm);
}
void add(PatchRun::Totals& totals, const PrintPlace& place, std::int64_t before, std::size_t kind) {
  const auto full = static_cast<std::int64_t>(totals.worst.size());
  const auto held = static_cast<std::size_t>(std::min(before, full));
  PrintPlace next = place;
  for (std::size_t i = 0; i < held; ++i)
    if (worse(next, totals.worst[i], kind)) std::swap(next, totals.worst[i]);
  if (held < totals.worst.size()) totals.worst[held] = next;
}
void close(PatchRun::Totals& totals, const PatchSum& patch, std::size_t kind, const PatchRules& rules) {
  const double area = floating(patch.area);
  if (area < rules.least_mm2[kind]) return;
  PrintPlace place{patch.least_at_mm, patch.least_mm, area};
  if (kind == steep) {
    place.mm = width(patch);
    if (place.mm <= rules.node_mm) {
      totals.node_area += patch.area;
      return;
    }
    place.at_mm = Vec3d{floating(patch.moment[0]), floating(patch.moment[1]), floating(patch.moment[2])} / area;
  }
  add(totals, place, totals.places, kind);
  ++totals.places;
  totals.area += patch.area;
  totals.volume += patch.volume;
  totals.least_mm = std::min(totals.least_mm, patch.least_mm);
}
void add(PatchRun::Totals& totals, const PatchRun::Totals& other, std::size_t kind) {
  for (std::int64_t i = 0; i < std::min<std::int64_t>(other.places, 5); ++i)
    add(totals, other.worst[static_cast<std::size_t>(i)], totals.places + i, kind);
  totals.places += other.places;
  totals.area += other.area;
  totals.volume += other.volume;
  totals.node_area += other.node_area;
  totals.least_mm = std::min(totals.least_mm, other.least_mm);
}

/// Can samples of other ranges touch this one?
bool at_border(Key k, const SampleRange& range, const PatchRules& rules) {
  const int at = along(k, range.axis), reach = rules.reach_vox + 1;
  return at <= range.low + reach || at >= range.high - reach;
}

/// Closes the patches without a sample at the border and numbers the others anew.
void close_inner(PatchRun& run, std::vector<PatchSum>& patches, const SampleRange& range, std::size_t kind,
                 const PatchRules& rules) {
  std::erase_if(run.border, [&](const PatchRun::Sample& s) { return !at_border(s.key, range, rules); });
  constexpr std::uint64_t none = ~std::uint64_t{0};
  std::vector<std::uint64_t> number(patches.size(), none);
  for (PatchRun::Sample& s : run.border) {
    std::uint64_t& mine = number[s.patch];
    if (mine == none) {
      mine = run.open.size();
      run.open.push_back(patches[s.patch]);
    }
    s.patch = mine;
  }
  for (std::size_t i = 0; i < patches.size(); ++i)
    if (number[i] == none) close(run.closed, patches[i], kind, rules);
}

PatchRun run_of(const std::vector<Spot>& spots, const SampleRange& range, std::size_t kind, const PatchRules& rules) {
  const Numbers numbers(spots);
  std::vector<PatchSum> patches = sums_of(spots, numbers, rules.up);
  PatchRun run;
  for (std::size_t i = 0; i < spots.size(); ++i) {
    const Key k = key(spots[i].at.x, spots[i].at.y, spots[i].at.z);
    if (at_border(k, range, rules)) run.border.push_back({k, numbers.of[i]});
  }
  const auto by_key = [](const auto& a, const auto& b) { return a.key < b.key; };
  const auto same = [](const auto& a, const auto& b) { return a.key == b.key; };
  std::sort(run.border.begin(), run.border.end(), by_key);
  run.border.erase(std::unique(run.border.begin(), run.border.end(), same), run.border.end());
  close_inner(run, patches, range, kind, rules);
  return run;
}

/// Of two ranges that touch: `range` is both.
PatchRun joined(const PatchRun& a, const PatchRun& b, const SampleRange& range, std::size_t kind,
                const PatchRules& rules) {
  std::vector<PatchRun::Sample> samples = b.border;
  for (PatchRun::Sample& s : samples) s.patch += a.open.size();
  samples.insert(samples.end(), a.border.begin(), a.border.end());
  std::sort(samples.begin(), samples.end(),
            [](const auto& l, const auto& r) { return std::tie(l.key, l.patch) < std::tie(r.key, r.patch); });
  DisjointSets sets(a.open.size() + b.open.size());
  const auto join = [&](const PatchRun::Sample& l, const PatchRun::Sample& r) {
    sets.join(static_cast<std::uint32_t>(l.patch), static_cast<std::uint32_t>(r.patch));
  };
  PatchRun run;
  std::vector<Key> keys;
  for (const PatchRun::Sample& s : samples) {
    if (!keys.empty() && keys.back() == s.key) {
      join(run.border.back(), s);
    } else {
      keys.push_back(s.key);
      run.border.push_back(s);
    }
  }
  each_touching(keys, [&](std::uint32_t i, std::uint32_t j) { join(run.border[i], run.border[j]); });
  std::vector<PatchSum> patches(sets.size(), empty_sum());
  for (std::uint32_t i = 0; i < sets.size(); ++i)
    add(patches[sets.root(i)], i < a.open.size() ? a.open[i] : b.open[i - a.open.size()]);
  for (PatchRun::Sample& s : run.border) s.patch = sets.root(static_cast<std::uint32_t>(s.patch));
  // Roots alone are patches.
  std::vector<std::uint64_t> number(patches.size());
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < sets.size(); ++i) {
    if (sets.root(i) != i) continue;
    number[i] = count;
    patches[count++] = patches[i];
  }
  patches.resize(count);
  for (PatchRun::Sample& s : run.border) s.patch = number[s.patch];
  run.closed = a.closed;
  add(run.closed, b.closed, kind);
  close_inner(run, patches, range, kind, rules);
  return run;
}

PrintFault fault(const PatchRun& run, std::size_t kind, const PatchRules& rules, double& node_mm2) {
  PatchRun::Totals all = run.closed;
  for (const PatchSum& patch : run.open) close(all, patch, kind, rules);
  PrintFault result;
  result.places = all.places;
  result.area_mm2 = floating(all.area);
  result.volume_mm3 = floating(all.volume);
  result.least_mm = kind == steep || all.places == 0 ? 0 : all.least_mm;
  const auto listed = static_cast<std::ptrdiff_t>(std::min<std::int64_t>(all.places, 5));
  result.worst.assign(all.worst.begin(), all.worst.begin() + listed);
  node_mm2 += floating(all.node_area);
  return result;
}

}  // namespace

void drop_small_patches(std::vector<Spot>& spots, double least_mm2) {
  const Numbers numbers(spots);
  std::vector<std::int64_t> area(numbers.count, 0);
  for (std::size_t i = 0; i < spots.size(); ++i) area[numbers.of[i]] += fixed(spots[i].area_mm2);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < spots.size(); ++i)
    if (floating(area[numbers.of[i]]) >= least_mm2) spots[kept++] = spots[i];
  spots.resize(kept);
}

void keep_wide_patches(std::vector<Spot>& spots, Vec3d up, double across_mm) {
  const Numbers numbers(spots);
  const std::vector<PatchSum> sums = sums_of(spots, numbers, up);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < spots.size(); ++i)
    if (width(sums[numbers.of[i]]) > across_mm) spots[kept++] = spots[i];
  spots.resize(kept);
}

PrintTally::PrintTally(const Scan& found, const SampleRange& range, const PatchRules& rules)
    : lumen_mm2(found.lumen_mm2) {
  runs.push_back({range,
                  {run_of(found.walls, range, walls, rules), run_of(found.gaps, range, gaps, rules),
                   run_of(found.steep, range, steep, rules)}});
}

void PrintTally::add(const PrintTally& other, const PatchRules& rules) {
  lumen_mm2 += other.lumen_mm2;
  for (const Run& run : other.runs) {
    const auto place = std::upper_bound(runs.begin(), runs.end(), run.range.low,
                                        [](int low, const Run& r) { return low < r.range.low; });
    const auto i = static_cast<std::size_t>(place - runs.begin());
    runs.insert(place, run);
    const auto join_with_next = [&](std::size_t k) {
      Run &a = runs[k], &b = runs[k + 1];
      if (a.range.high != b.range.low) return;
      a.range.high = b.range.high;
      for (std::size_t kind = 0; kind < a.kinds.size(); ++kind)
        a.kinds[kind] = joined(a.kinds[kind], b.kinds[kind], a.range, kind, rules);
      runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    };
    if (i + 1 < runs.size()) join_with_next(i);
    if (i > 0) join_with_next(i - 1);
  }
}

Printable PrintTally::total(const PatchRules& rules) const {
  Printable result;
  result.lumen_mm2 = lumen_mm2;
  if (runs.empty()) return result;
  const std::array<PatchRun, 3>& kinds = runs.front().kinds;
  double none = 0;
  result.thin_walls = fault(kinds[walls], walls, rules, none);
  result.small_gaps = fault(kinds[gaps], gaps, rules, none);
  result.overhangs = fault(kinds[steep], steep, rules, result.node_overhang_mm2);
  return result;
}

}  // namespace fibrolite
