// SPDX-License-Identifier: GPL-3.0-or-later
// What a run will need, known before it starts.
#include <algorithm>
#include <cmath>

#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/solid_stream.h"

namespace fibrolite {

double choose_voxel(const Box3d& model, const Recipe& recipe, InfillKind infill, std::optional<double> wanted) {
  return wanted ? *wanted : std::min(model.longest_side() / 400, thinnest_mm(recipe, infill) / 3);
}

namespace {

/// Samples in leaves of body and solid for each mm2 of the model's surface and each mm3 of its volume.
struct Samples {
  double body_a_mm2 = 0, solid_a_mm2 = 0, solid_a_mm3 = 0, faces_a_mm2 = 0, faces_a_mm3 = 0;
};

Samples samples(double h, const Recipe& recipe, InfillKind infill) {
  // Surface of the structure per volume of lumen: 16 sticks and 8 balls per cell; both sides of the membrane, or one;
  // walls with two sides per fibre.
  const TcsParams t = sized(recipe.tcs);
  const double cell = t.cell_mm.least();
  const double sticks = 3.15 * (16 * t.stick_mm * 0.433 * cell + 8 * t.ball_mm * t.ball_mm) / (cell * cell * cell);
  const double tcs = t.form == TcsForm::Sticks ? sticks : (t.form == TcsForm::Sheet ? 2 : 1) * 3.84 / cell;
  const double mfs = 4 / recipe.mfs.fibre_mm;
  const auto per_mm3_of = [&] {
    switch (infill) {
      case InfillKind::Solid:
      case InfillKind::Shell:
        return 0.0;
      case InfillKind::Tcs:
        return tcs;
      case InfillKind::Gyroid:
        return 2 * 3.09 / recipe.gyroid.cell_mm;
      default:
        return std::max(tcs, mfs);
    }
  };
  Samples s;
  s.faces_a_mm2 = infill == InfillKind::Solid ? 1 : 2;
  s.faces_a_mm3 = per_mm3_of();
  // Leaves are 8 voxels wide and the band 6: a surface fills about two voxels of leaf for each of its band.
  s.solid_a_mm2 = 12 * s.faces_a_mm2 / (h * h);
  s.solid_a_mm3 = 12 * s.faces_a_mm3 / (h * h);
  s.body_a_mm2 = (recipe.shell.thickness_mm + 12 * h) / (h * h * h);
  return s;
}

constexpr double program_bytes = 120e6, bytes_a_triangle = 400, bytes_a_sample = 4.2;

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

double predict_memory(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill) {
  const double surface_mm2 = area(model), volume_mm3 = std::abs(signed_volume(model));
  const Samples s = samples(voxel_mm, recipe, infill);
  const double faces_mm2 = s.faces_a_mm2 * surface_mm2 + s.faces_a_mm3 * volume_mm3;
  const double solid_voxels = s.solid_a_mm2 * surface_mm2 + s.solid_a_mm3 * volume_mm3;
  const double body_voxels = s.body_a_mm2 * surface_mm2;
  const double triangles = 2.4 * faces_mm2 / (voxel_mm * voxel_mm);
  const double model_bytes = bytes_a_triangle * static_cast<double>(model.triangles.size());
  const double grids = bytes_a_sample * (body_voxels + solid_voxels);
  // The body is gone when the surface is made; the surface peaks at about twice itself.
  return program_bytes + model_bytes +
         std::max(grids + 2.1 * solid_voxels, bytes_a_sample * solid_voxels + 48 * triangles);
}

SlabPlan plan_slabs(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill, int axis,
                    double margin_mm, double allowed_bytes) {
  const Profile p = profile(model, voxel_mm, axis);
  const Samples s = samples(voxel_mm, recipe, infill);
  const auto count = static_cast<int>(p.area_mm2.size());
  SlabPlan plan{.axis = axis};
  // Whether a stick's end hangs free is seen with the whole stick.
  const TcsParams tcs = sized(recipe.tcs);
  const double stick_mm = tcs.form == TcsForm::Sticks ? 0.5 * tcs.cell_mm.most() + tcs.ball_mm : 0;
  const double most_mm = std::max(margin_mm, stick_mm + 2 * voxel_mm);
  const int margin = std::max(1, static_cast<int>(std::ceil(most_mm / (8 * voxel_mm))));
  plan.margin_vox = 8 * margin;
  // Of the solid: its samples twice, in case some of them change, and their labels.
  std::vector<double> sum{0};
  for (std::size_t i = 0; i < p.area_mm2.size(); ++i) {
    const double solid = s.solid_a_mm2 * p.area_mm2[i] + s.solid_a_mm3 * p.volume_mm3[i];
    sum.push_back(sum.back() + bytes_a_sample * s.body_a_mm2 * p.area_mm2[i] + (2 * bytes_a_sample + 2.1) * solid);
  }
  const auto bytes = [&](int from, int to) {
    return sum[static_cast<std::size_t>(std::min(to + margin, count))] -
           sum[static_cast<std::size_t>(std::max(from - margin, 0))];
  };
  const double fixed = program_bytes + bytes_a_triangle * static_cast<double>(model.triangles.size());
  plan.borders.push_back(8 * p.first);
  for (int from = 0; from < count;) {
    int to = from + 1;
    while (to < count && fixed + bytes(from, to + 1) <= allowed_bytes) ++to;
    plan.memory_bytes = std::max(plan.memory_bytes, fixed + bytes(from, to));
    plan.borders.push_back(8 * (p.first + to));
    from = to;
  }
  return plan;
}

}  // namespace fibrolite
