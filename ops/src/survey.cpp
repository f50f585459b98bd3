// SPDX-License-Identifier: GPL-3.0-or-later
#include "survey.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "fibrolite/mesh.h"
#include "fibrolite/ops/infill/gyroid.h"
#include "fibrolite/ops/infill/tcs.h"
#include "fibrolite/shape.h"
#include "fibrolite/winding.h"

namespace fibrolite {
namespace {

constexpr double band_vox = 3;
constexpr std::size_t most_draws = 80000, enough = 8000;  // points, and those in the model or near its surface

/// Crystal stands for what is not yet known.
Shape inside_of(const Recipe& recipe, InfillKind infill, const Shape& body) {
  switch (infill) {
    case InfillKind::Solid:
      return everything();
    case InfillKind::Shell:
      return nothing();
    case InfillKind::Gyroid:
      return gyroid(recipe.gyroid);
    case InfillKind::Tcs:
    case InfillKind::Mfs:
    case InfillKind::Hybrid:
      break;
  }
  const TcsParams tcs = sized(recipe.tcs);
  if (recipe.tcs.grade != TcsGrade::Surface || recipe.tcs.density) return crystal(tcs);
  return crystal(tcs, thicker_at_surface(tcs, body, recipe.shell.thickness_mm));
}

struct Count {
  double active = 0, crossings = 0, blocks = 0;
};
Count operator+(const Count& a, const Count& b) {
  return {a.active + b.active, a.crossings + b.crossings, a.blocks + b.blocks};
}

/// One point.
class Look {
 public:
  Look(Shape body, Shape inside, double shell_mm, double voxel_mm)
      : body_(std::move(body)), inside_(std::move(inside)), shell_mm_(shell_mm), voxel_mm_(voxel_mm) {}

  struct Found {
    bool near = false, body_block = false;
    Count all, shell;           ///< Of the structure, and of the shell with nothing in it.
    double body_crossings = 0;  ///< Of its outer face.
  };
  [[nodiscard]] Found at(Vec3d p) const {
    Found found;
    const double b = body_(p), band = band_vox * voxel_mm_;
    if (b > 16 * voxel_mm_) return found;
    const Vec3d middle = middle_of_block(p);
    const double around = body_(middle), half = 3.5 * voxel_mm_;
    found.body_block = around < band + half && around > -shell_mm_ - band - half;
    found.all.blocks = any_near(around, middle) ? 1 : 0;
    found.shell.blocks = any_shell(around) ? 1 : 0;
    if (b > band + voxel_mm_) return found;
    found.near = true;
    const double whole = solid(b, p), hollow = shell(b);
    found.all.active = std::abs(whole) < band ? 1 : 0;
    found.shell.active = std::abs(hollow) < band ? 1 : 0;
    if (std::min(std::abs(whole), std::abs(hollow)) > 1.2 * voxel_mm_) return found;
    for (const Vec3d step : {Vec3d{voxel_mm_, 0, 0}, Vec3d{0, voxel_mm_, 0}, Vec3d{0, 0, voxel_mm_}}) {
      const double there = body_(p + step);
      if ((solid(there, p + step) < 0) != (whole < 0)) found.all.crossings += 1;
      if ((shell(there) < 0) != (hollow < 0)) found.shell.crossings += 1;
      if ((there < 0) != (b < 0)) found.body_crossings += 1;
    }
    return found;
  }

 private:
  [[nodiscard]] double shell(double b) const { return std::max(b, -(b + shell_mm_)); }
  [[nodiscard]] double solid(double b, Vec3d p) const {
    if (b > 4 * voxel_mm_) return b;
    return std::max(b, std::min(-(b + shell_mm_), 1.0 * inside_(p)));
  }
  [[nodiscard]] Vec3d middle_of_block(Vec3d p) const {
    const auto middle = [&](double v) { return 8 * voxel_mm_ * std::floor(v / (8 * voxel_mm_)) + 3.5 * voxel_mm_; };
    return {middle(p.x), middle(p.y), middle(p.z)};
  }
  /// Has a block with this distance in its middle some of the band of a face that is `face_mm` deep?
  [[nodiscard]] bool any_shell(double around) const {
    const double reach = (band_vox + 4.5) * voxel_mm_;
    return std::abs(around) < reach || std::abs(around + shell_mm_) < reach;
  }
  [[nodiscard]] bool any_near(double around, Vec3d middle) const {
    const double reach = (band_vox + 4.5) * voxel_mm_;
    if (std::abs(around) < reach) return true;
    if (around > 0) return false;
    // Samples two apart: none is farther than 1.5 from one that is looked at.
    std::array<float, 64> x, y, z, value;
    for (std::size_t i = 0; i < 64; ++i) {
      const auto place = [&](std::size_t n) { return (2.0 * static_cast<double>(n) - 3) * voxel_mm_; };
      x[i] = static_cast<float>(middle.x + place(i / 16));
      y[i] = static_cast<float>(middle.y + place(i / 4 % 4));
      z[i] = static_cast<float>(middle.z + place(i % 4));
    }
    inside_.evaluate({x.data(), y.data(), z.data(), 64}, value.data());
    const auto near = [&](float d) { return std::abs(d) < (band_vox + 0.7) * voxel_mm_; };
    const bool void_there = std::any_of(value.begin(), value.end(), [](float d) { return d > 0; });
    return std::any_of(value.begin(), value.end(), near) || (void_there && std::abs(around + shell_mm_) < reach);
  }

  Shape body_, inside_;
  double shell_mm_, voxel_mm_;
};

struct Sums {
  std::size_t near = 0;
  double body_blocks = 0, body_crossings = 0;
  Count all, shell;
};
Sums operator+(Sums a, const Sums& b) {
  a.near += b.near;
  a.body_blocks += b.body_blocks;
  a.body_crossings += b.body_crossings;
  a.all = a.all + b.all;
  a.shell = a.shell + b.shell;
  return a;
}

/// Edges of the lattice that a surface crosses: what of it faces along each axis.
double crossings_of(const Mesh& mesh, double voxel_mm) {
  double sum = 0;
  for (const Mesh::Triangle& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices[t[0]]);
    const Vec3d n = cross(to_double(mesh.vertices[t[1]]) - a, to_double(mesh.vertices[t[2]]) - a);
    sum += 0.5 * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
  }
  return sum / (voxel_mm * voxel_mm);
}

}  // namespace

Survey survey(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill, double parts_share) {
  const Shape body = distance_to(WindingTree(model));
  const Look look(body, inside_of(recipe, infill, body), recipe.shell.thickness_mm, voxel_mm);
  const Box3d box = bounds(model).grown(12 * voxel_mm);
  // Roberts' sequence: as even as points can be whose number is not known.
  const auto point = [&](std::size_t n) {
    const auto along = [&](double step, double low, double high) {
      const double place = 0.5 + step * static_cast<double>(n + 1);
      // A sample: members in step with the lattice cross it the same way everywhere.
      return voxel_mm * std::round((low + (place - std::floor(place)) * (high - low)) / voxel_mm);
    };
    return Vec3d{along(0.8191725133961645, box.min.x, box.max.x), along(0.6710436067037893, box.min.y, box.max.y),
                 along(0.5497004779019703, box.min.z, box.max.z)};
  };
  Sums sums;
  std::size_t draws = 0;
  for (constexpr std::size_t batch = 4000; draws < most_draws && sums.near < enough; draws += batch) {
    sums = sums + tbb::parallel_reduce(
                      tbb::blocked_range<std::size_t>(draws, draws + batch, 100), Sums{},
                      [&](const auto& range, Sums mine) {
                        for (std::size_t n = range.begin(); n < range.end(); ++n) {
                          const Look::Found found = look.at(point(n));
                          mine = mine + Sums{found.near ? 1U : 0U, found.body_block ? 1.0 : 0, found.body_crossings,
                                             found.all, found.shell};
                        }
                        return mine;
                      },
                      [](const Sums& a, const Sums& b) { return a + b; });
  }
  const Vec3d size = box.size();
  const double samples = size.x * size.y * size.z / std::pow(voxel_mm, 3) / static_cast<double>(draws);
  const auto mixed = [&](double Count::*what) {
    if (parts_share == 1) return samples * sums.all.*what;
    return samples * (sums.shell.*what + parts_share * std::max(0.0, sums.all.*what - sums.shell.*what));
  };
  // Of the outer face the number is known: what the points missed of it is made good.
  const double missed = crossings_of(model, voxel_mm) - samples * sums.body_crossings;
  // Blocks between members are as many, whatever the members are.
  return {.active = mixed(&Count::active),
          .crossings = mixed(&Count::crossings) + missed,
          .blocks = samples * sums.all.blocks / 512,
          .body_blocks = samples * sums.body_blocks / 512};
}

}  // namespace fibrolite
