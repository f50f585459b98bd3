// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh -> solid, shape -> solid, solid -> mesh, on a ball of 40 mm. The argument is the voxel in micrometres; items are
// active voxels.
#include <benchmark/benchmark.h>

#include "fibrolite/ops/assemble.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "fibrolite/to_solid.h"

namespace {

using namespace fibrolite;

Grid grid(const benchmark::State& state) { return {.voxel_mm = static_cast<double>(state.range(0)) / 1000}; }
const Box3d region{{-22, -22, -22}, {22, 22, 22}};

Shape filled_ball() {
  return assemble(sphere({}, 20), {{.region = everything(), .fill = crystal({})}}, {}, {.shell_mm = 1.0});
}

void to_solid(benchmark::State& state) {
  const Mesh mesh = surface(realize(sphere({}, 20), region, Grid{.voxel_mm = 0.5}));
  std::int64_t voxels = 0;
  for (auto _ : state) voxels = to_solid(mesh, {.grid = grid(state), .inside_band_mm = 1.0}).solid.active_voxels();
  state.SetItemsProcessed(state.iterations() * voxels);
}

void realize_block_by_block(benchmark::State& state) {
  const Shape shape = filled_ball();
  std::int64_t voxels = 0;
  for (auto _ : state) voxels = realize(shape, region, grid(state)).active_voxels();
  state.SetItemsProcessed(state.iterations() * voxels);
}

void surface_of_crystal(benchmark::State& state) {
  const Solid solid = realize(filled_ball(), region, grid(state));
  for (auto _ : state) benchmark::DoNotOptimize(surface(solid).triangles.size());
  state.SetItemsProcessed(state.iterations() * solid.active_voxels());
}

BENCHMARK(to_solid)->Arg(400)->Arg(200)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(realize_block_by_block)->Arg(400)->Arg(200)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(surface_of_crystal)->Arg(400)->Arg(200)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
