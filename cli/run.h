// SPDX-License-Identifier: GPL-3.0-or-later
// Steps that commands share.
#pragma once

#include <tbb/global_control.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "fibrolite/context.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/ops/prepare.h"
#include "fibrolite/ops/report.h"
#include "options.h"

namespace fibrolite::cli {

/// Read and prepare MODEL as stages of the report. A .vdb is taken as the surface of its level set.
[[nodiscard]] Model load_model(const ModelOptions& options, Report& report, const Context& context);

/// @throws Error TooLarge, before anything is allocated, if the run would need more than it may use.
void check_memory(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill, const RunOptions& run);

/// Slab by slab, if the run would need more memory than it may use as a whole. `needs`: of slabs, by voxel.
/// `more_bytes`: taken beside the solid.
/// `whole`: what asks for all of it in memory; empty if nothing does. `extras`: what the run does besides; whether the
/// mesh is open is found out.
/// @throws Error TooLarge, before anything is allocated, if it does not fit either way.
[[nodiscard]] std::optional<SlabPlan> fit_into_memory(const Mesh& model, double voxel_mm, const Recipe& recipe,
                                                      InfillKind infill, const RunOptions& run,
                                                      const std::function<SlabNeeds(double)>& needs, double more_bytes,
                                                      const std::string& whole, Extras extras = {});

/// What decides by shape: proxy, diameter and partition as stages of the report, seen as the model stands under its
/// load (proxy.frame); to be placed in the world.
struct FoundParts {
  Proxy proxy;
  Partition partition;
};
[[nodiscard]] FoundParts find_parts(const Model& model, const Recipe& recipe, Report& report, const Context& context);

/// Whole or absent. @throws Error Io.
void write_text(const std::filesystem::path& path, const std::string& text);

/// "time      about ...": on this many threads, and of the processor.
[[nodiscard]] std::string time_text(double cpu_s);

/// "1.5 GB", steps of 1024.
[[nodiscard]] std::string memory_text(double bytes);

/// Keeps TBB to --threads while it lives.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);  ///< 0: no limit.
  /// How many may run.
  [[nodiscard]] static int count();

 private:
  std::optional<tbb::global_control> control_;
};

}  // namespace fibrolite::cli
