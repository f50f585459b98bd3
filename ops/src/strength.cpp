// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/strength.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>

#include "applied_load.h"
#include "fibrolite/blocks.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/assemble.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/realize.h"
#include "fibrolite/voxel_fem.h"
#include "load.h"

namespace fibrolite {
namespace {

constexpr std::int64_t least_cells = 100;  // of fewer, one in a hundred is none

/// What is seen first from a direction: the heights of the material along it, one per pixel across it. Negative on the
/// topmost layer of each pixel, as thick as `layer_mm`.
class Seen final : public Shape::Function {
 public:
  Seen(const Solid& solid, Vec3d to_eye, double pixel_mm, double layer_mm)
      : frame_(frame_along({}, to_eye)), pixel_mm_(pixel_mm), layer_mm_(layer_mm) {
    Box3d box;  // in the frame
    const Box3d world = solid.bounds_mm().grown(2 * pixel_mm);
    for (unsigned i = 0; i < 8; ++i) box.include(frame_.to_local(world.corner(i)));
    low_ = box.min - Vec3d{0.5 * pixel_mm, 0.5 * pixel_mm, 0};  // samples in the middle of pixels
    width_ = static_cast<std::size_t>(std::ceil(box.size().x / pixel_mm)) + 1;
    height_.assign(width_ * (static_cast<std::size_t>(std::ceil(box.size().y / pixel_mm)) + 1), -far_mm);
    const Shape material = distance_to(solid);
    std::mutex mutex;
    for_each_block(blocks(solid), solid.grid().voxel_mm, [&](std::size_t, const PointBlock& block) {
      std::array<float, PointBlock::capacity> value;
      material.evaluate(block, value.data());
      std::vector<std::pair<std::size_t, float>> found;
      for (int i = 0; i < block.count; ++i) {
        // The surface lies as far above a sample as its distance says, at most half a voxel; a sample that far outside
        // still has material in its cell.
        const double depth = -static_cast<double>(value[static_cast<std::size_t>(i)]), half = 0.5 * pixel_mm_;
        if (depth <= -half) continue;
        const Vec3d p = frame_.to_local({block.x[i], block.y[i], block.z[i]});
        const double top = p.z + std::min(depth, half);
        found.emplace_back(pixel(p), static_cast<float>(top));
      }
      const std::lock_guard lock(mutex);  // the largest, whoever comes first
      for (const auto& [at, top] : found) height_[at] = std::max(height_[at], top);
    });
  }

  void evaluate(const PointBlock& block, float* out) const override {
    for (int i = 0; i < block.count; ++i) {
      const Vec3d p = frame_.to_local({block.x[i], block.y[i], block.z[i]});
      const Vec3d q{p.x - low_.x, p.y - low_.y, 0};
      const bool beside =
          q.x < 0 || q.y < 0 || q.x >= static_cast<double>(width_) * pixel_mm_ || pixel(p) >= height_.size();
      float top = -far_mm;
      if (!beside) {
        // Where a point lies on the border of pixels the highest of them counts.
        const double near = 0.25 * pixel_mm_;
        for (const Vec3d step :
             {Vec3d{-near, -near, 0}, Vec3d{near, -near, 0}, Vec3d{-near, near, 0}, Vec3d{near, near, 0}})
          if (const std::size_t at = pixel(p + step); at < height_.size()) top = std::max(top, height_[at]);
      }
      const double below = top > -far_mm ? static_cast<double>(top) - p.z : far_mm;  // nothing to be seen: far
      out[i] = static_cast<float>(below - layer_mm_);
    }
  }
  [[nodiscard]] Interval bound(const Box3d&) const override { return {-far_mm, far_mm}; }

 private:
  [[nodiscard]] std::size_t pixel(Vec3d local) const {
    const auto at = [&](double x) { return static_cast<std::size_t>(std::max(0.0, x / pixel_mm_)); };
    return at(local.y - low_.y) * width_ + at(local.x - low_.x);
  }

  Frame frame_;
  double pixel_mm_, layer_mm_;
  Vec3d low_{};
  std::size_t width_ = 0;
  std::vector<float> height_;
};

/// Turns load cases into supports and forces on cells.
class OnVoxels {
 public:
  OnVoxels(const Hybrid& hybrid, const Recipe& recipe, double cell_mm)
      : solid_(hybrid.solid),
        hybrid_(hybrid),
        up_(normalized(recipe.verify.up)),
        verify_(recipe.verify),
        material_(recipe.material),
        cell_mm_(cell_mm) {
    // Where the outside presses: the steps of the skin, but not the far side of the shell.
    skin_ = complement(offset(hybrid.body, -std::min(1.5 * cell_mm, 0.5 * recipe.shell.thickness_mm)));
  }

  VoxelFemProblem problem(const LoadCase& load) {
    VoxelFemProblem problem;
    problem.solid = solid_;
    problem.young_mpa = material_.young_mpa;
    problem.poisson = material_.poisson;
    std::vector<Shape> clamped, fast;
    for (const Support& support : load.supports) {
      VoxelSupport held{.where = shape(support.where, load.name), .axes = {true, true, true}, .displacement_mm = {}};
      if (support.sliding) held.axes = axes_of(*support.sliding, load.name);
      clamped.push_back(offset(held.where, cell_mm_));
      if (!support.sliding) fast.push_back(held.where);
      problem.supports.push_back(std::move(held));
    }
    const Shape supports = unite(fast);
    for (const Force& force : load.forces) {
      if (const auto* total = std::get_if<TotalForce>(&force)) {
        const Shape where = subtract(shape(total->where, load.name), supports);
        const Vec3d facing = total->where.seen_from ? unit(*total->where.seen_from) : Vec3d{};
        problem.forces.push_back({where, total->newton * unit(total->direction), facing});
        clamped.push_back(offset(where, 2 * cell_mm_));
        load_n_ += total->newton;
      } else if (const auto* gravity = std::get_if<Gravity>(&force)) {
        const Vec3d weight = weight_n_per_mm3(material_) * unit(gravity->direction);
        problem.body_force_n_mm3 = [weight](Vec3d) { return weight; };
        load_n_ += norm(weight) * solid_.volume_mm3();
      } else if (const auto* pressure = std::get_if<Pressure>(&force)) {
        problem.pressures.push_back({intersect({shape(pressure->where, load.name), skin_}), pressure->mpa});
      }
    }
    problem.unmeasured = unite(clamped);
    return problem;
  }
  [[nodiscard]] double load_n() const { return load_n_; }

 private:
  [[nodiscard]] Vec3d unit(const Direction& d) const { return resolved(d, up_, verify_.azimuth_deg); }
  [[nodiscard]] std::array<bool, 3> axes_of(const Direction& d, const std::string& name) const {
    const Vec3d along = unit(d);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(std::abs(along[axis]) - 1) > 1e-6) continue;
      std::array<bool, 3> axes{};
      axes[static_cast<std::size_t>(axis)] = true;
      return axes;
    }
    throw Error(Code::Unsupported, "on a finished solid a support slides across x, y or z alone", name,
                "turn the model, or hold it fast");
  }
  /// Reaches half a cell farther, as on tetrahedra: a plane stated in a face holds that face.
  Shape shape(const Selection& where, const std::string& name) {
    std::vector<Shape> all;
    if (where.box_mm) all.push_back(cuboid(where.box_mm->grown(0.5 * cell_mm_)));
    for (const HalfSpace& half : where.half_spaces)
      all.push_back(half_space(half.point_mm + 0.5 * cell_mm_ * normalized(half.normal), half.normal));
    if (where.lowest) all.push_back(end(*where.lowest, unit(where.lowest->along)));
    if (where.highest) all.push_back(end(*where.highest, -unit(where.highest->along)));
    if (where.label) {
      const int count = hybrid_.candidates.count();
      if (*where.label >= count)
        throw Error(Code::BadRecipe, "wants label " + std::to_string(*where.label), name,
                    "the partition of this run has " + std::to_string(count) + ", counted from 0");
      all.push_back(offset(hybrid_.candidates.region(*where.label), 0.5 * cell_mm_));
    }
    if (where.painted) all.push_back(offset(where.painted->distance, cell_mm_));
    if (where.seen_from)
      all.push_back(
          Shape(std::make_shared<Seen>(solid_, unit(*where.seen_from), solid_.grid().voxel_mm, 0.75 * cell_mm_)));
    return intersect(std::move(all));
  }
  [[nodiscard]] Shape end(const EndShare& share, Vec3d along) const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const Box3d box = solid_.bounds_mm();  // along other directions than x, y, z the corners of the box count
    for (unsigned i = 0; i < 8; ++i) {
      const double at = dot(along, box.corner(i));
      low = std::min(low, at);
      high = std::max(high, at);
    }
    return half_space((low + share.share * (high - low)) * along, along);
  }

  const Solid& solid_;
  const Hybrid& hybrid_;
  const Vec3d up_;
  const VerifyParams& verify_;
  const Material& material_;
  const double cell_mm_;
  Shape skin_;
  double load_n_ = 0;
};

/// Of what a point is: a joint, or a part's shell or infill.
class Places {
 public:
  Places(const Hybrid& hybrid, double shell_mm) : hybrid_(hybrid), shell_mm_(shell_mm) {}

  void operator()(std::span<const Vec3d> points, std::span<std::uint16_t> place) const {
    Box3d box;
    for (const Vec3d p : points) box.include(p);
    std::vector<float> distance(points.size());
    hybrid_.body.evaluate(points, distance);
    const auto first_of_parts = static_cast<std::uint16_t>(hybrid_.joints.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int infill = static_cast<double>(distance[i]) > -shell_mm_ ? 0 : 1;
      place[i] = static_cast<std::uint16_t>(first_of_parts + 2 * hybrid_.parts.labels.label(points[i]) + infill);
    }
    for (std::size_t j = hybrid_.joints.size(); j-- > 0;) {  // where joints meet, the first of them
      const Shape& joint = hybrid_.joints[j].shape;
      if (joint.bound(box).lo > 0) continue;
      joint.evaluate(points, distance);
      for (std::size_t i = 0; i < points.size(); ++i)
        if (distance[i] < 0) place[i] = static_cast<std::uint16_t>(j);
    }
  }
  [[nodiscard]] std::string name(std::uint16_t place) const {
    const std::size_t joints = hybrid_.joints.size();
    if (place < joints) {
      const Interface& between = hybrid_.interfaces[place];
      return "joint " + std::to_string(place) + " between parts " + std::to_string(between.a) + " and " +
             std::to_string(between.b);
    }
    const Part& part = hybrid_.parts.parts[(place - joints) / 2];
    return std::string((place - joints) % 2 == 0 ? "shell" : "infill") + " of part " + std::to_string(part.id()) +
           " (" + fibrolite::name(part.kind()) + ")";
  }

 private:
  const Hybrid& hybrid_;
  const double shell_mm_;
};

/// Weakest first.
std::vector<PlaceReport> places_of(const VoxelFemResult& solved, const Places& places, double yield_mpa,
                                   double load_n) {
  std::vector<PlaceReport> list;
  for (const PlaceStress& stress : solved.places) {
    if (stress.cells < least_cells) continue;
    list.push_back({places.name(stress.place), stress.volume_mm3, stress.max_von_mises_mpa, stress.p99_von_mises_mpa,
                    load_n * yield_mpa / stress.p99_von_mises_mpa, stress.weakest_mm});
  }
  std::stable_sort(list.begin(), list.end(), [](const PlaceReport& a, const PlaceReport& b) {
    return a.p99_von_mises_mpa > b.p99_von_mises_mpa;
  });
  return list;
}

std::string quoted_case(const std::string& name) { return std::string("load case '").append(name).append("'"); }

/// Cells with material at most: what the finest grid has, less by the cube of the coarsening.
int choose_coarsening(const Solid& solid, std::int64_t most_cells) {
  const double voxel = solid.grid().voxel_mm, cells = solid.volume_mm3() / (voxel * voxel * voxel);
  for (const int coarsen : {1, 2}) {
    // Surfaces cut cells: the coarser, the more of them hold little.
    if (1.3 * coarsen * cells / (coarsen * coarsen * coarsen) <= static_cast<double>(most_cells)) return coarsen;
  }
  return 4;
}

}  // namespace

std::vector<StrengthReport> strength(const Hybrid& hybrid, const Recipe& recipe, const StrengthParams& params,
                                     const Context& context) {
  if (params.coarsen != 0 && params.coarsen != 1 && params.coarsen != 2 && params.coarsen != 4)
    throw Error(Code::BadRecipe, "cells are coarsened by 1, 2 or 4", "coarsen", "use 0 to have it chosen");
  const VerifyParams& verify = recipe.verify;
  const std::vector<LoadCase> cases = load_cases(verify);
  const int coarsen = params.coarsen != 0 ? params.coarsen : choose_coarsening(hybrid.solid, params.most_cells);
  const double cell_mm = coarsen * hybrid.solid.grid().voxel_mm;
  const Places places(hybrid, recipe.shell.thickness_mm);
  std::vector<StrengthReport> result;
  for (std::size_t c = 0; c < cases.size(); ++c) {
    const auto share = [&](std::size_t i) { return static_cast<double>(i) / static_cast<double>(cases.size()); };
    OnVoxels voxels(hybrid, recipe, cell_mm);
    VoxelFemProblem problem = voxels.problem(cases[c]);
    problem.coarsen = coarsen;
    problem.residual = params.residual;
    problem.place_of = places;
    const VoxelFemResult solved = [&] {
      try {
        return solve(problem, context.part(share(c), share(c + 1), cases[c].name));
      } catch (const Error& error) {
        if (error.code() != Code::BadRecipe && error.code() != Code::SolverFailed) throw;
        throw Error(error.code(), quoted_case(cases[c].name).append(": ").append(error.what()));
      }
    }();
    StrengthReport& answer = result.emplace_back();
    answer.load_case = cases[c].name;
    answer.load_n = voxels.load_n() + solved.pressed_n;
    answer.compliance_n_mm = solved.compliance_n_mm;
    answer.max_displacement_mm = solved.max_displacement_mm;
    answer.max_von_mises_mpa = solved.max_von_mises_mpa;
    answer.p99_von_mises_mpa = solved.p99_von_mises_mpa;
    answer.safety_factor = recipe.material.yield_mpa / solved.p99_von_mises_mpa;
    answer.failure_load_n = answer.load_n * answer.safety_factor;
    answer.places = places_of(solved, places, recipe.material.yield_mpa, answer.load_n);
    if (!answer.places.empty()) {
      answer.weakest = answer.places.front().name;
      answer.weakest_mm = answer.places.front().weakest_mm;
    }
    answer.cells = solved.cells;
    answer.cell_mm = cell_mm;
    answer.iterations = solved.iterations;
    answer.residual = solved.residual;
  }
  return result;
}

}  // namespace fibrolite
