// SPDX-License-Identifier: GPL-3.0-or-later
// Finite elements. Ten-node tetrahedra: assembly, preconditioner or factor, and one load case on a beam of bricks of
// six; the argument is the number of unknowns in thousands. Voxels: a diamond lattice between two plates; the argument
// is the number of its cells along an edge. peak_mb is that of the whole process so far, so filter for one case to
// trust it.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "elasticity.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/realize.h"
#include "fibrolite/voxel_fem.h"

namespace {

using namespace fibrolite;

double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024 / 1e6;
}

/// A box of nx * ny * nz bricks, six tetrahedra each: the six ways from a corner to the opposite one along edges.
TetMesh bricks(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz, Vec3d size) {
  const auto corner = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return (z * (ny + 1) + y) * (nx + 1) + x;
  };
  std::vector<Vec3d> corners;
  std::vector<std::array<std::uint32_t, 4>> tets;
  for (std::uint32_t z = 0; z <= nz; ++z) {
    for (std::uint32_t y = 0; y <= ny; ++y) {
      for (std::uint32_t x = 0; x <= nx; ++x) {
        corners.push_back({size.x * x / nx, size.y * y / ny, size.z * z / nz});
        if (x == nx || y == ny || z == nz) continue;
        const std::uint32_t c0 = corner(x, y, z), c7 = corner(x + 1, y + 1, z + 1);
        const std::uint32_t cx = corner(x + 1, y, z), cy = corner(x, y + 1, z), cz = corner(x, y, z + 1);
        const std::uint32_t cxy = corner(x + 1, y + 1, z), cyz = corner(x, y + 1, z + 1), czx = corner(x + 1, y, z + 1);
        for (const auto& [a, b] : {std::pair{cx, cxy}, {cxy, cy}, {cy, cyz}, {cyz, cz}, {cz, czx}, {czx, cx}}) {
          tets.push_back({c0, a, b, c7});
        }
      }
    }
  }
  return ten_node(std::move(corners), tets);
}

struct Beam {
  TetMesh mesh;
  std::vector<fem::Fixed> fixed;
  fem::LoadCase load;

  /// 8 x 10 x 100 mm, held at one end, pushed at the other, with about so many unknowns.
  explicit Beam(double unknowns) {
    // a x b x 10 b bricks have (2 a + 1)(2 b + 1)(20 b + 1) nodes, a = 0.8 b
    const auto b = static_cast<std::uint32_t>(std::lround(std::cbrt(unknowns / 3 / 64)));
    const auto a = static_cast<std::uint32_t>(std::lround(0.8 * b));
    mesh = bricks(10 * b, a, b, {100, 8, 10});
    load.force_n.resize(mesh.nodes.size());
    for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
      if (mesh.nodes[node].x == 0) {
        for (int axis = 0; axis < 3; ++axis) fixed.push_back({node, axis});
      }
      if (mesh.nodes[node].x == 100) load.force_n[node] = {0, 0, -1};
    }
  }
};

void solve_beam(benchmark::State& state, std::int64_t direct_limit) {
  const Beam beam(1000.0 * static_cast<double>(state.range(0)));
  fem::Solution solution;
  for (auto _ : state) {
    solution = fem::solve(beam.mesh, {}, beam.fixed, {beam.load}, {.direct_limit = direct_limit}).front();
  }
  state.counters["unknowns"] = 3 * static_cast<double>(beam.mesh.nodes.size());
  state.counters["iterations"] = solution.iterations;
  state.counters["residual"] = solution.residual;
  state.counters["peak_mb"] = peak_mb();
}
void tetrahedra(benchmark::State& state) { solve_beam(state, fem::SolveParams{}.direct_limit); }
void tetrahedra_cholesky(benchmark::State& state) { solve_beam(state, std::numeric_limits<std::int64_t>::max()); }

void voxels(benchmark::State& state) {
  const double size = 4 * static_cast<double>(state.range(0));
  const auto slab = [&](double from, double to) { return cuboid({{0, 0, from}, {size, size, to}}); };
  const Shape lattice = intersect({crystal({.cell_mm = 4, .stick_mm = 1, .ball_mm = 1.2}), slab(0, size)});
  VoxelFemProblem problem;
  problem.solid = realize(unite({lattice, slab(0, 1), slab(size - 1, size)}), {{0, 0, 0}, {size, size, size}},
                          Grid{.voxel_mm = 0.25});
  problem.supports = {{slab(-1, 0.3), {true, true, true}, {}}};
  problem.forces = {{slab(size - 0.3, size + 1), {0, 30, -100}}};
  std::optional<VoxelFemResult> result;
  for (auto _ : state) result = solve(problem);
  state.counters["voxels"] = static_cast<double>(result->cells);
  state.counters["iterations"] = result->iterations;
  state.counters["residual"] = result->residual;
  state.counters["peak_mb"] = peak_mb();
}

BENCHMARK(tetrahedra)
    ->Arg(100)
    ->Arg(400)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Iterations(1);
BENCHMARK(tetrahedra_cholesky)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Iterations(1);
BENCHMARK(voxels)->Arg(4)->Arg(9)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime()->Iterations(1);

}  // namespace
