// SPDX-License-Identifier: GPL-3.0-or-later
#include "kept_stream.h"

#include <cstdint>
#include <string>
#include <type_traits>

namespace fibrolite {
namespace {

constexpr const char* first_pass = "pieces";

std::string name_of(const SampleRange& slab) {
  return std::string("slab_").append(std::to_string(slab.low)).append("_").append(std::to_string(slab.high));
}

/// Every field, in one order for writing and reading.
template <class Sums, class Field, class List>
void each(Sums& sums, const Field& field, const List& list) {
  list(sums.volumes.parts);
  field(sums.volumes.body_vox);
  field(sums.volumes.solid_vox);
  field(sums.active_voxels);
  field(sums.print.lumen_mm2);
  auto count = static_cast<std::uint64_t>(sums.print.runs.size());
  field(count);
  if constexpr (!std::is_const_v<Sums>) sums.print.runs.resize(count);
  for (auto& run : sums.print.runs) {
    field(run.range);
    for (auto& kind : run.kinds) {
      field(kind.closed);
      list(kind.open);
      list(kind.border);
    }
  }
}
template <class Tie, class Flip, class Field, class List>
void each(Tie& tied, Flip& flips, const Field& field, const List& list) {
  auto count = static_cast<std::uint64_t>(tied.changes.size());
  field(count);
  if constexpr (!std::is_const_v<Tie>) tied.changes.resize(count);
  for (auto& change : tied.changes) {
    list(change.removed);
    list(change.struts);
  }
  for (auto* number : {&tied.dropped, &tied.filled, &tied.necks, &tied.tips_tied, &tied.tips_removed, &tied.dangling})
    field(*number);
  list(tied.left.material);
  list(tied.left.cavities);
  list(tied.unreached);
  list(flips.blocks);
}

}  // namespace

void SlabSums::add(const SlabSums& other, const PatchRules& rules) {
  volumes += other.volumes;
  active_voxels += other.active_voxels;
  print.add(other.print, rules);
}

void keep(KeptWork& work, const SampleRange& slab, const SlabSums& sums) {
  KeptWork::Writer part = work.write(name_of(slab));
  each(
      sums, [&](const auto& value) { part.put(value); }, [&](const auto& values) { part.put_list(values); });
  part.commit();
}

bool recall(const KeptWork& work, const SampleRange& slab, SlabSums& sums) {
  if (!work.holds(name_of(slab))) return false;
  KeptWork::Reader part = work.read(name_of(slab));
  each(
      sums, [&](auto& value) { part.get(value); }, [&](auto& values) { part.get_list(values); });
  return true;
}

void keep(KeptWork& work, const Tied& tied, const Flips& flips) {
  KeptWork::Writer part = work.write(first_pass);
  each(
      tied, flips, [&](const auto& value) { part.put(value); }, [&](const auto& values) { part.put_list(values); });
  part.commit();
}

bool recall(const KeptWork& work, Tied& tied, Flips& flips) {
  if (!work.holds(first_pass)) return false;
  KeptWork::Reader part = work.read(first_pass);
  each(
      tied, flips, [&](auto& value) { part.get(value); }, [&](auto& values) { part.get_list(values); });
  return true;
}

}  // namespace fibrolite
