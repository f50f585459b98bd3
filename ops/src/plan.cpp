// SPDX-License-Identifier: GPL-3.0-or-later
// What a run will need, known before it starts.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/ops/solid_stream.h"
#include "fibrolite/reach.h"
#include "fibrolite/to_solid.h"
#include "survey.h"

namespace fibrolite {

double choose_voxel(const Box3d& model, const Recipe& recipe, InfillKind infill, std::optional<double> wanted) {
  if (wanted) return *wanted;
  const double thinnest = thinnest_mm(recipe, infill), held = coarsest_voxel(thinnest, recipe.print.wall_mm);
  const double voxel = std::min(model.longest_side() / 400, thinnest / 3);
  // Of members hardly thicker than a wall no voxel tells that: finer ones would be paid for nothing.
  return held < thinnest / 4 ? voxel : std::min(voxel, held);
}

namespace {

/// Surface of the structure for each mm2 of the model's surface and each mm3 of its volume; and what follows from it.
/// Fitted to runs of the horse, the armadillo and the molar at 0.1 to 0.25 mm.
struct Density {
  double faces_a_mm2 = 0, faces_a_mm3 = 0;
  double shell_mm = 0, voxel_mm = 0;
  double samples_a_face_mm2 = 0;    ///< In leaves of the solid: twelve voxels deep, with the band, for each of surface.
  double active_a_face_mm2 = 0;     ///< Band samples.
  double triangles_a_face_mm2 = 0;  ///< A surface crosses 1.5 edges of the lattice for each square of a voxel.
  /// Samples in leaves of the body: as deep as the shell, where it is so deep.
  [[nodiscard]] double body(double area_mm2, double volume_mm3) const {
    return (std::min(shell_mm * area_mm2, volume_mm3) + 12 * voxel_mm * area_mm2) / (voxel_mm * voxel_mm * voxel_mm);
  }
};

/// Surface per volume of lumen of balls and sticks: what shows of 16 sticks and 8 balls per cell.
double sticks_a_mm3(const TcsParams& t, double cell) {
  const double ball = std::max(t.ball_mm, t.stick_mm), chord = std::sqrt(ball * ball - t.stick_mm * t.stick_mm);
  const double stick = std::numbers::pi * t.stick_mm * std::max(0.433 * cell - chord, 0.0);
  const double knob = std::numbers::pi * ball * std::max(ball - 2 * (ball - chord), 0.0);
  return (16 * stick + 8 * knob) / (cell * cell * cell);
}

double tcs_a_mm3(const TcsParams& t) {
  const double cell = t.cell_mm.least();
  return t.form == TcsForm::Sticks ? sticks_a_mm3(t, cell) : (t.form == TcsForm::Sheet ? 2 : 1) * 3.84 / cell;
}
double mfs_a_mm3(const MfsParams& m) { return 2.4 / m.fibre_mm; }

Density density(double h, const Recipe& recipe, InfillKind infill) {
  const TcsParams t = sized(recipe.tcs);
  const double tcs = tcs_a_mm3(t), mfs = mfs_a_mm3(recipe.mfs);
  const auto per_mm3_of = [&] {
    switch (infill) {
      case InfillKind::Solid:
      case InfillKind::Shell:
        return 0.0;
      case InfillKind::Tcs:
        return tcs;
      case InfillKind::Mfs:
        return mfs;
      case InfillKind::Gyroid:
        return 2 * 3.09 / recipe.gyroid.cell_mm;
      case InfillKind::Hybrid:
        break;
    }
    return 0.8 * tcs + 0.2 * mfs;  // how much of it is limbs is not yet known
  };
  Density d;
  d.faces_a_mm3 = per_mm3_of();
  // The shell has two faces, and takes its thickness from the lumen.
  if (infill == InfillKind::Solid) {
    d.faces_a_mm2 = 1;
  } else {
    d.faces_a_mm2 = std::max(2 - d.faces_a_mm3 * recipe.shell.thickness_mm, 1.0);
  }
  d.shell_mm = recipe.shell.thickness_mm;
  d.voxel_mm = h;
  d.samples_a_face_mm2 = 12 / (h * h);
  d.active_a_face_mm2 = 6 / (h * h);
  d.triangles_a_face_mm2 = 3 / (h * h);
  return d;
}

constexpr double bytes_a_sample = 4.2;
/// While it is made, the body takes more than its samples; the solid is joined by labels of its pieces, some slabs'
/// worth at a time.
constexpr double body_times = 1.1, solid_times = 1.75;

/// All fits lie above what was measured by this at least.
constexpr double safety = 1.2;
/// What slab after slab leaves scattered in memory, and how much denser than the mean a slab full of limbs is: 4.8 GB
/// where 4.0 were allowed, of a horse of 300 mm at 0.05 mm, without it.
constexpr double slab_times = 1.35;

double fixed_bytes(const Mesh& model) { return 50e6 + 300.0 * static_cast<double>(model.triangles.size()); }
/// Of the proxy's finite elements, before there is a voxel.
double deciding_bytes(InfillKind infill) { return infill == InfillKind::Hybrid ? 270e6 : 0; }

double usual_deciding_bytes(InfillKind infill) { return infill == InfillKind::Hybrid ? 215e6 : 0; }

/// Of what is known along sticks while they are swept (StickSweep): 16 to a cell, and eight nodes.
double sticks_bytes(const Mesh& model, const Recipe& recipe, InfillKind infill) {
  constexpr double bytes_a_cell = 16 * 80 + 8 * 120;
  const TcsParams tcs = sized(recipe.tcs);
  if (tcs.form == TcsForm::Sheet || (infill != InfillKind::Tcs && infill != InfillKind::Hybrid)) return 0;
  const CellEdges& cell = tcs.cell_mm;
  return bytes_a_cell * std::abs(signed_volume(model)) / (cell.x * cell.y * cell.z);
}

/// Of the layers of a surface that are worked on at once: eight of some 100 bytes a vertex.
double layers_bytes(double triangles_a_layer) { return 8 * 50 * triangles_a_layer; }

/// Surface and volume of the model in each block of 8 samples along an axis.
struct Profile {
  int first = 0;  ///< Block.
  std::vector<double> area_mm2, volume_mm3;
};

Profile profile(const Mesh& model, double voxel_mm, int axis) {
  const double block_mm = 8 * voxel_mm;
  const Box3d box = bounds(model).grown(4 * voxel_mm);
  Profile p;
  p.first = static_cast<int>(std::floor(box.min[axis] / block_mm));
  const auto count = static_cast<std::size_t>(static_cast<int>(std::floor(box.max[axis] / block_mm)) - p.first + 1);
  p.area_mm2.assign(count, 0);
  // The section at a height is what faces that way above it, less what faces the other way.
  std::vector<double> facing(count, 0);
  for (const Mesh::Triangle& t : model.triangles) {
    const Vec3d a = to_double(model.vertices[t[0]]), b = to_double(model.vertices[t[1]]),
                c = to_double(model.vertices[t[2]]);
    const Vec3d n = 0.5 * cross(b - a, c - a);
    const auto place = [&](double mm) { return static_cast<std::size_t>(std::floor(mm / block_mm) - p.first); };
    const std::size_t low = place(std::min({a[axis], b[axis], c[axis]})),
                      high = place(std::max({a[axis], b[axis], c[axis]}));
    const double share = 1.0 / static_cast<double>(high - low + 1);
    for (std::size_t i = low; i <= high; ++i) {
      p.area_mm2[i] += share * norm(n);
      facing[i] += share * n[axis];
    }
  }
  p.volume_mm3.assign(count, 0);
  double section_mm2 = 0;
  for (std::size_t i = count; i-- > 0;) {
    p.volume_mm3[i] = std::abs(section_mm2 + 0.5 * facing[i]) * block_mm;
    section_mm2 += facing[i];
  }
  return p;
}

}  // namespace

double most_memory(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill, const Extras& extras) {
  const double surface_mm2 = area(model), volume_mm3 = std::abs(signed_volume(model));
  const Density d = density(voxel_mm, recipe, infill);
  const double faces_mm2 = d.faces_a_mm2 * surface_mm2 + d.faces_a_mm3 * volume_mm3;
  const double solid = bytes_a_sample * d.samples_a_face_mm2 * faces_mm2;
  const double body = bytes_a_sample * d.body(surface_mm2, volume_mm3);
  const double active = d.active_a_face_mm2 * faces_mm2, triangles = d.triangles_a_face_mm2 * faces_mm2;
  // The body is gone when the surface is made, which takes twenty bytes a triangle.
  const double voxels = body_times * body + solid_times * solid, mesh = solid + 20 * triangles;
  double most = std::max({safety * voxels, safety * mesh, deciding_bytes(infill)});
  if (extras.mends) most = std::max(most, 100 * active);
  if (extras.steps) most = std::max(most, 75 * active);
  if (extras.pictures) most = std::max(most, 185 * triangles);
  if (extras.open) most = std::max(most, repair_bytes(model, voxel_mm));
  return fixed_bytes(model) + most;
}

Prediction predict(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill, const Extras& extras) {
  // Fibres have so much more surface than the crystal that stands for them; in a hybrid limbs make that up.
  const TcsParams tcs = sized(recipe.tcs);
  const double fibres = infill != InfillKind::Mfs ? 1 : 0.92 * mfs_a_mm3(recipe.mfs) / tcs_a_mm3(tcs);
  const Survey found = survey(model, voxel_mm, recipe, infill, fibres);
  constexpr double bytes_a_block = 2100;
  const auto faces = static_cast<double>(model.triangles.size());
  const double body = bytes_a_block * found.body_blocks, solid = bytes_a_block * found.blocks;
  const double open_faces = extras.open ? area(model) / (voxel_mm * voxel_mm) : 0;
  Prediction result;
  result.active_voxels = found.active;
  result.triangles = 2 * found.crossings;
  result.faces_mm2 = found.crossings * voxel_mm * voxel_mm / 1.5;
  // All from here on fitted to some forty runs on two threads.
  const double until_solid = 0.9 * body + std::max(15 * found.active, solid);
  double least = std::max(usual_deciding_bytes(infill), 1000 * open_faces);
  if (extras.mends) least = std::max(least, 82 * found.active);
  if (extras.steps) least = std::max(least, 62 * found.active);
  result.sliced_memory_bytes = fixed_bytes(model) + std::max(least, until_solid);
  if (extras.pictures) least = std::max(least, 165 * result.triangles);
  result.memory_bytes =
      fixed_bytes(model) + std::max({least, until_solid, 0.9 * body + 0.08 * solid + 32 * result.triangles});

  const double deciding_s = infill == InfillKind::Hybrid ? 7.3 : infill == InfillKind::Mfs ? 1.1 : 0;
  const double body_s = 2.9e-6 * faces + 5e-9 * body + 14e-6 * open_faces;
  const double solid_s = (infill == InfillKind::Hybrid ? 50e-9 : 30e-9) * found.active;
  const double check_s = (recipe.print.check ? 75e-9 : 0) * found.active;
  result.solid_s = 0.15 + 0.65e-6 * faces + deciding_s + body_s + solid_s + check_s;
  if (extras.mends) result.solid_s += 0.8e-6 * found.active;
  if (extras.steps) result.solid_s += 0.25e-6 * found.active;
  result.cpu_s = result.solid_s + (extras.pictures ? 1e-6 : 125e-9) * result.triangles;
  result.slabs_s = body_s + 1.5 * solid_s;
  return result;
}

double machine_times() {
  constexpr double there_s = 1.32e-6;  // a block
  const Shape sticks = crystal(sized(TcsParams{}));
  std::array<float, PointBlock::capacity> x, y, z, out;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t slice = i / 64;
    x[i] = 0.25F * static_cast<float>(slice);
    y[i] = 0.25F * static_cast<float>(i / 8 % 8);
    z[i] = 0.25F * static_cast<float>(i % 8);
  }
  double best_s = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 8; ++round) {
    constexpr int blocks = 64;
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < blocks; ++i) sticks.evaluate({x.data(), y.data(), z.data(), PointBlock::capacity}, out.data());
    best_s = std::min(best_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / blocks);
  }
  return best_s / there_s;
}

SlabNeeds needs_of_layers(Up up, double layer_mm, double voxel_mm) {
  const Vec3d d = direction(up);
  return {.axis = d.x != 0 ? 0 : d.y != 0 ? 1 : 2, .margin_mm = 0.5 * layer_mm + 4 * voxel_mm};
}

SlabPlan plan_slabs(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill, const SlabNeeds& needs,
                    double allowed_bytes) {
  constexpr double most_blocks = 1e6;  // no machine has the memory for one of such slabs
  if (!(bounds(model).size()[needs.axis] < most_blocks * 8 * voxel_mm))
    return {.axis = needs.axis, .memory_bytes = std::numeric_limits<double>::infinity()};
  const Profile p = profile(model, voxel_mm, needs.axis);
  const Density d = density(voxel_mm, recipe, infill);
  const auto count = static_cast<int>(p.area_mm2.size());
  SlabPlan plan{.axis = needs.axis, .allowed_bytes = allowed_bytes};
  // The print checks look through walls and gaps up to their limits, and some voxels on.
  const PrintParams& limits = recipe.print;
  const double checked_mm = limits.check ? std::max(limits.wall_mm, limits.gap_mm) + 5 * voxel_mm : 0;
  const int margin = std::max(1, static_cast<int>(std::ceil(std::max(needs.margin_mm, checked_mm) / (8 * voxel_mm))));
  plan.margin_vox = 8 * margin;
  std::vector<double> sum{0};
  double largest_layer = 0;  // triangles
  for (std::size_t i = 0; i < p.area_mm2.size(); ++i) {
    const double faces_mm2 = d.faces_a_mm2 * p.area_mm2[i] + d.faces_a_mm3 * p.volume_mm3[i];
    sum.push_back(sum.back() + slab_times * safety * bytes_a_sample *
                                   (body_times * d.body(p.area_mm2[i], p.volume_mm3[i]) +
                                    solid_times * d.samples_a_face_mm2 * faces_mm2));
    largest_layer = std::max(largest_layer, d.triangles_a_face_mm2 * faces_mm2);
  }
  const auto bytes = [&](int from, int to) {
    return sum[static_cast<std::size_t>(std::min(to + margin, count))] -
           sum[static_cast<std::size_t>(std::max(from - margin, 0))];
  };
  plan.memory_bytes = fixed_bytes(model) + deciding_bytes(infill);
  const double fixed =
      fixed_bytes(model) + sticks_bytes(model, recipe, infill) + (needs.surface ? layers_bytes(largest_layer) : 0);
  plan.borders.push_back(8 * p.first);
  for (int from = 0; from < count;) {
    int to = from + 1;
    while (to < count && fixed + bytes(from, to + 1) <= allowed_bytes) ++to;
    plan.memory_bytes = std::max(plan.memory_bytes, fixed + bytes(from, to));
    plan.borders.push_back(8 * (p.first + to));
    from = to;
  }
  const double decided = fixed_bytes(model) + usual_deciding_bytes(infill);
  plan.usual_bytes = std::max(decided, plan.memory_bytes / 1.4);
  return plan;
}

}  // namespace fibrolite
