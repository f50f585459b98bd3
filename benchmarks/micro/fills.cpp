// SPDX-License-Identifier: GPL-3.0-or-later
// Distance of the two structures, a point and a block of 512 at a time. Items are points.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <vector>

#include "fibrolite/ops/infill/mfs.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/ops/verify.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"

namespace {

using namespace fibrolite;

/// The samples of one leaf.
struct Leaf {
  static constexpr double voxel_mm = 0.1;
  std::array<float, PointBlock::capacity> x{}, y{}, z{};
  Vec3i origin{24, -16, 8};

  Leaf() {
    for (int n = 0; n < PointBlock::capacity; ++n) {
      const auto i = static_cast<std::size_t>(n);
      const Vec3i at{origin.x + n / 64, origin.y + n / 8 % 8, origin.z + n % 8};
      x[i] = static_cast<float>(voxel_mm * at.x);
      y[i] = static_cast<float>(voxel_mm * at.y);
      z[i] = static_cast<float>(voxel_mm * at.z);
    }
  }
  [[nodiscard]] PointBlock block() const {
    return {.x = x.data(),
            .y = y.data(),
            .z = z.data(),
            .count = PointBlock::capacity,
            .leaf = &origin,
            .voxel_mm = voxel_mm};
  }
};

void per_block(benchmark::State& state, const Shape& shape) {
  const Leaf leaf;
  std::array<float, PointBlock::capacity> out{};
  for (auto _ : state) {
    shape.evaluate(leaf.block(), out.data());
    benchmark::DoNotOptimize(out);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * PointBlock::capacity);
}

void per_point(benchmark::State& state, const Shape& shape) {
  Vec3d p{1, 2, 3};
  for (auto _ : state) {
    benchmark::DoNotOptimize(shape(p));
    p.x = p.x > 4 ? 1 : p.x + 0.01;
  }
  state.SetItemsProcessed(state.iterations());
}

/// Membranes through a cylinder of 20 mm.
Shape membranes() {
  const Shape rod = cylinder({0, 0, -30}, {0, 0, 30}, 10);
  const Solid solid = realize(rod, Box3d{{-12, -12, -32}, {12, 12, 32}}, Grid{.voxel_mm = 0.5});
  const Parts parts = whole_body(surface(solid), Kind::Column);
  return generate(parts.parts.front(), MfsParams{}, rod, 1.0).shape;
}

/// Membranes along an arc of 30 mm through the leaf, with a taper or without.
Shape bent_membranes(const Taper& taper) {
  std::vector<Vec3d> line;
  for (int i = 0; i <= 60; ++i) line.push_back({30 * std::cos(0.03 * i - 0.9) - 28, 0, 30 * std::sin(0.03 * i - 0.9)});
  const MembraneParams wanted{.width_mm = 24, .height_mm = 24};
  return sweep(synthesize(find_fibres(read_gray(bundled_micrograph())), wanted), Axis::along(line), {}, taper);
}

void tcs_block(benchmark::State& state) { per_block(state, crystal({})); }
void tcs_stretched_block(benchmark::State& state) { per_block(state, crystal({.stretch_z = true})); }
void tcs_any_cell_block(benchmark::State& state) { per_block(state, crystal({.cell_mm = {6, 7, 5}})); }
void tcs_network_block(benchmark::State& state) { per_block(state, crystal({.form = TcsForm::Network})); }
void tcs_sheet_block(benchmark::State& state) { per_block(state, crystal({.form = TcsForm::Sheet})); }
void tcs_turned_block(benchmark::State& state) { per_block(state, crystal({.rotate_deg = {10, 20, 30}})); }
void tcs_point(benchmark::State& state) { per_point(state, crystal({})); }
void mfs_block(benchmark::State& state) { per_block(state, membranes()); }
void mfs_point(benchmark::State& state) { per_point(state, membranes()); }
void mfs_bent_block(benchmark::State& state) { per_block(state, bent_membranes({})); }
void mfs_tapered_block(benchmark::State& state) { per_block(state, bent_membranes({{1.2, 1.0, 0.9}, 0.1})); }
BENCHMARK(tcs_block);
BENCHMARK(tcs_stretched_block);
BENCHMARK(tcs_any_cell_block);
BENCHMARK(tcs_network_block);
BENCHMARK(tcs_sheet_block);
BENCHMARK(tcs_turned_block);
BENCHMARK(tcs_point);
BENCHMARK(mfs_block);
BENCHMARK(mfs_bent_block);
BENCHMARK(mfs_tapered_block);
BENCHMARK(mfs_point);

}  // namespace
