// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/tcs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "nodal.h"
#include "sticks.h"

namespace fibrolite {
namespace {

/// One side of a level set.
struct Network final : Shape::Function {
  Network(const CellEdges& cell, double level, Vec3d shift_mm) : table(Surface::D, cell, level), shift(shift_mm) {}
  void evaluate(const PointBlock& block, float* out) const override { table.evaluate(block, shift, out); }
  [[nodiscard]] double lipschitz() const override { return DistanceTable::lipschitz; }
  DistanceTable table;
  Vec3d shift;
};

using Values = std::array<float, PointBlock::capacity>;

/// Distance to a surface, less half of a wall that is `thickness` times as thick as a given one.
struct GradedSheet final : Shape::Function {
  GradedSheet(Shape surface, double wall_mm, Shape factors)
      : middle(std::move(surface)), half_mm(0.5 * wall_mm), thickness(std::move(factors)) {}
  void evaluate(const PointBlock& block, float* out) const override {
    Values factor;
    thickness.evaluate(block, factor.data());
    middle.evaluate(block, out);
    const auto half = static_cast<float>(half_mm);
    for (int i = 0; i < block.count; ++i) out[i] -= half * factor[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double lipschitz() const override { return middle.lipschitz() + half_mm * thickness.lipschitz(); }
  Shape middle;
  double half_mm;
  Shape thickness;
};

/// Networks of thicknesses evenly spaced from grade_least to grade_most; linear between the two that are next.
struct Between final : Shape::Function {
  Between(std::vector<Shape> list, Shape factors, const TcsParams& p)
      : networks(std::move(list)),
        thickness(std::move(factors)),
        least(p.grade_least),
        step((p.grade_most - p.grade_least) / static_cast<double>(networks.size() - 1)),
        stick_mm(p.stick_mm) {}
  void evaluate(const PointBlock& block, float* out) const override {
    Values place, value;
    thickness.evaluate(block, place.data());
    std::fill_n(out, block.count, 0.0F);
    const auto count = static_cast<std::size_t>(block.count);
    const auto top = static_cast<float>(networks.size() - 1), from = static_cast<float>(least);
    const float per_step = step > 0 ? static_cast<float>(1 / step) : 0;
    for (std::size_t i = 0; i < count; ++i) place[i] = std::clamp((place[i] - from) * per_step, 0.0F, top);
    const auto [low, high] = std::minmax_element(place.begin(), place.begin() + block.count);
    const auto first = static_cast<std::size_t>(*low), last = static_cast<std::size_t>(std::ceil(*high));
    for (std::size_t n = first; n <= last; ++n) {
      networks[n].evaluate(block, value.data());
      for (std::size_t i = 0; i < count; ++i)
        out[i] += value[i] * std::max(0.0F, 1 - std::abs(place[i] - static_cast<float>(n)));
    }
  }
  /// A thicker network's surface lies outside a thinner one's by less than its neck is thicker.
  [[nodiscard]] double lipschitz() const override {
    return DistanceTable::lipschitz + stick_mm * thickness.lipschitz();
  }
  std::vector<Shape> networks;
  Shape thickness;
  double least, step, stick_mm;
};

/// grade_most at the inner face of the shell, falling evenly to grade_least.
struct ByDepth final : Shape::Function {
  ByDepth(const TcsParams& p, Shape distance, double shell_mm)
      : body(std::move(distance)),
        least(static_cast<float>(p.grade_least)),
        most(static_cast<float>(p.grade_most)),
        shell(static_cast<float>(shell_mm)),
        depth(static_cast<float>(p.grade_depth_mm)) {}
  void evaluate(const PointBlock& block, float* out) const override {
    body.evaluate(block, out);
    for (int i = 0; i < block.count; ++i)
      out[i] = most + (least - most) * std::clamp((-out[i] - shell) / depth, 0.0F, 1.0F);
  }
  [[nodiscard]] double lipschitz() const override {
    return static_cast<double>((most - least) / depth) * body.lipschitz();
  }
  Shape body;
  float least, most, shell, depth;
};

CellEdges cell_of(const TcsParams& p) {
  return {p.cell_mm.x, p.cell_mm.y, p.cell_mm.z * (p.stretch_z ? std::numbers::sqrt2 : 1)};
}

/// The lattice's own axes.
Frame lattice(const TcsParams& p) {
  const auto turned = [&](Vec3d v) {
    const double to_rad = std::numbers::pi / 180;
    const double a = p.rotate_deg.x * to_rad, b = p.rotate_deg.y * to_rad, c = p.rotate_deg.z * to_rad;
    v = {v.x, std::cos(a) * v.y - std::sin(a) * v.z, std::sin(a) * v.y + std::cos(a) * v.z};
    v = {std::cos(b) * v.x + std::sin(b) * v.z, v.y, std::cos(b) * v.z - std::sin(b) * v.x};
    return Vec3d{std::cos(c) * v.x - std::sin(c) * v.y, std::sin(c) * v.x + std::cos(c) * v.y, v.z};
  };
  const Frame stands = p.stretch_z && !(p.up == Vec3d{0, 0, 1}) ? frame_along({}, p.up) : Frame{};
  return {p.shift_mm, turned(stands.x), turned(stands.y), turned(stands.z)};
}

}  // namespace

double steepest_overhang_deg(const TcsParams& params) {
  const CellEdges cell = cell_of(params);
  const Frame axes = lattice(params);
  const Vec3d up = normalized(params.up);
  double least = 1;
  for (const Vec3d s : {Vec3d{1, 1, 1}, Vec3d{1, -1, -1}, Vec3d{-1, 1, -1}, Vec3d{-1, -1, 1}}) {
    const Vec3d bond = normalized(s.x * cell.x * axes.x + s.y * cell.y * axes.y + s.z * cell.z * axes.z);
    least = std::min(least, std::abs(dot(bond, up)));
  }
  return std::acos(least) * 180 / std::numbers::pi;
}

namespace {

bool is_turned(const TcsParams& p) { return !(p.rotate_deg == Vec3d{}) || (p.stretch_z && !(p.up == Vec3d{0, 0, 1})); }

Shape in_lattice(const TcsParams& p, Vec3d shift) {
  const CellEdges cell = cell_of(p);
  switch (p.form) {
    case TcsForm::Sticks:
      return sticks_and_balls(cell, {0.5 * p.stick_mm, 0.5 * p.ball_mm}, shift);
    case TcsForm::Network:
      return Shape(std::make_shared<const Network>(cell, neck_level(cell, p.stick_mm), shift));
    case TcsForm::Sheet:
      return sheet(Surface::D, cell, p.wall_mm, shift);
  }
  return nothing();
}

/// Of balls and sticks, by sampling a brick of the cell (see DistanceTable).
double sticks_density(const TcsParams& p) {
  const CellEdges cell = cell_of(p);
  const Shape shape = in_lattice(p, {});
  constexpr int samples = 40;
  const Vec3d step{cell.x / (2 * samples), cell.y / (2 * samples), cell.z / (2 * samples)};
  const double size = std::cbrt(step.x * step.y * step.z);
  std::array<Vec3d, 2 * samples> row;
  std::array<float, 2 * samples> value{};
  double inside = 0;
  for (int i = 0; i < samples; ++i)
    for (int j = 0; j < samples; ++j) {
      for (std::size_t k = 0; k < row.size(); ++k)
        row[k] = {(i + 0.5) * step.x, (j + 0.5) * step.y, (static_cast<double>(k) + 0.5) * step.z};
      shape.evaluate(row, value);
      for (const float v : value) inside += std::clamp(0.5 - v / size, 0.0, 1.0);
    }
  return inside / (2.0 * samples * samples * samples);
}

/// Share of material; `membrane` is the sheet's area in a cell, so that a search need not measure it again.
double measured(const TcsParams& p, double membrane) {
  switch (p.form) {
    case TcsForm::Sticks:
      return sticks_density(p);
    case TcsForm::Network:
      return network_density(neck_level(cell_of(p), p.stick_mm));
    case TcsForm::Sheet:
      return sheet_density(Surface::D, cell_of(p), p.wall_mm, membrane);
  }
  return 0;
}

/// Members `scale` times as thick.
TcsParams scaled(TcsParams p, double scale) {
  p.stick_mm *= scale;
  p.ball_mm *= scale;
  p.wall_mm *= scale;
  return p;
}

double member_mm(const TcsParams& p) { return p.form == TcsForm::Sheet ? p.wall_mm : p.stick_mm; }

[[noreturn]] void refuse(const std::string& what, const char* key, const std::string& hint = {}) {
  throw Error(Code::BadRecipe, what, key, hint);
}

void check_cell(const TcsParams& p) {
  const CellEdges& cell = p.cell_mm;
  if (!(cell.least() > 0) || !(cell.most() <= 3 * cell.least()))
    refuse("the edges of the cell must be positive and none more than 3 times another", "tcs.cell_mm");
}

void check(const TcsParams& p) {
  check_cell(p);
  const bool sheet = p.form == TcsForm::Sheet;
  const std::string key = sheet ? "tcs.wall_mm" : "tcs.stick_mm";
  if (!(member_mm(p) > 0)) refuse("must be above zero", key.c_str());
  if (p.form == TcsForm::Sticks && !(p.ball_mm >= p.stick_mm))
    refuse("balls are thinner than sticks", "tcs.ball_mm", "use tcs.stick_mm or more");
  const double times = cell_per_member(p.form);
  if (!(p.cell_mm.least() >= times * members(p).most_mm * (1 - 1e-12)))
    refuse(sheet ? "the cell is too small for its walls" : "the cell is too small for its sticks", "tcs.cell_mm",
           "use " + number_text(times) + " times " + key + " or more");
  if (p.stretch_z && !(norm(p.up) > 0)) refuse("up must be a direction", "tcs.stretch_z");
  if (p.grade == TcsGrade::None) return;
  if (!(p.grade_least > 0) || !(p.grade_most >= p.grade_least))
    refuse("must be above zero, and grade_most no less", "tcs.grade_least");
  if (!(p.grade_depth_mm >= p.cell_mm.most()))
    refuse("thickness may not change within less than a cell", "tcs.grade_depth_mm", "use tcs.cell_mm or more");
}

void visit_sticks(const TcsParams& p, const Box3d& box, const std::function<void(const Capsule&)>& visit) {
  const CellEdges cell = cell_of(p);
  const Frame frame = lattice(p);
  Box3d local;
  for (int corner = 0; corner < 8; ++corner)
    local.include(frame.to_local({(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                                  (corner & 4) != 0 ? box.max.z : box.min.z}));
  // Even coordinates from one stick before the box to one after it.
  const auto first = [](double low, double edge) {
    return 2 * static_cast<int>(std::floor(0.5 * (4 * low / edge - 1)));
  };
  const auto last = [](double high, double edge) { return static_cast<int>(std::ceil(4 * high / edge + 1)); };
  const auto place = [&](Vec3i q) {
    return frame.to_world({0.25 * cell.x * q.x, 0.25 * cell.y * q.y, 0.25 * cell.z * q.z});
  };
  each_diamond_bond(
      {first(local.min.x, cell.x), first(local.min.y, cell.y), first(local.min.z, cell.z)},
      {last(local.max.x, cell.x), last(local.max.y, cell.y), last(local.max.z, cell.z)}, [&](Vec3i node, Vec3i along) {
        visit({place(node), place({node.x + along.x, node.y + along.y, node.z + along.z}), 0.5 * p.stick_mm});
      });
}

Fill filled(const TcsParams& p, Shape shape, const std::optional<Shape>& thickness) {
  Fill fill{.shape = std::move(shape)};
  if (p.form == TcsForm::Sheet) return fill;  // a membrane has no tips
  TcsParams seen = p;
  if (p.form == TcsForm::Network) seen.stick_mm = seen.ball_mm = bulge_mm(cell_of(p), p.stick_mm);  // it has no sides
  fill.sticks = [seen, thickness](const Box3d& box, const std::function<void(const Capsule&)>& visit) {
    visit_sticks(seen, box, [&](Capsule stick) {
      if (thickness) stick.radius_mm *= (*thickness)(0.5 * (stick.a + stick.b));
      visit(stick);
    });
  };
  fill.ball_mm = seen.ball_mm * (thickness ? p.grade_most : 1);
  return fill;
}

/// How much thicker than given the thickest members of a cell can be.
double most_scale(const TcsParams& p, double thickest_mm) {
  return p.cell_mm.least() / cell_per_member(p.form) / thickest_mm;
}

double membrane_of(const TcsParams& p) { return p.form == TcsForm::Sheet ? membrane_mm2(Surface::D, cell_of(p)) : 0; }

/// Share of material against how many times as thick members are, linear between values.
class DensityCurve {
 public:
  DensityCurve(const TcsParams& p, double least, double most) : least_(least), step_((most - least) / steps) {
    const double area = membrane_of(p);
    for (std::size_t i = 0; i < value_.size(); ++i)
      value_[i] = measured(scaled(p, least + step_ * static_cast<double>(i)), area);
  }
  /// Over all places, each with members `scale` times its factor times as thick.
  [[nodiscard]] double mean(std::span<const float> factors, double scale) const {
    double sum = 0;
    for (const float f : factors) {
      const double place =
          step_ > 0 ? std::clamp((scale * static_cast<double>(f) - least_) / step_, 0.0, 1.0 * steps) : 0;
      const auto below = std::min(static_cast<std::size_t>(place), value_.size() - 2);
      sum += std::lerp(value_[below], value_[below + 1], place - static_cast<double>(below));
    }
    return sum / static_cast<double>(factors.size());
  }

 private:
  static constexpr int steps = 32;
  double least_, step_;
  std::array<double, steps + 1> value_{};
};

}  // namespace

MemberRange members(const TcsParams& params) {
  const double given = member_mm(sized(params));
  if (params.grade == TcsGrade::None || params.density) return {given, given};
  return {params.grade_least * given, params.grade_most * given};
}

double density(const TcsParams& params) {
  const TcsParams p = sized(params);
  check(p);
  return measured(p, membrane_of(p));
}

TcsParams sized(const TcsParams& params) {
  if (!params.density) return params;
  TcsParams p = params;
  p.density.reset();
  check_cell(p);
  const double wanted = *params.density, area = membrane_of(p);
  const auto of = [&](double scale) { return measured(scaled(p, scale), area); };
  // The thickest members a cell may have, and the thinnest worth a name; density rises with thickness.
  double high = most_scale(p, member_mm(p)), low = 0.04 * high;
  const double most = of(high), least = of(low);
  if (!(wanted >= least && wanted <= most))
    refuse(std::string("no ")
               .append(p.form == TcsForm::Sheet ? "walls" : "sticks")
               .append(" give a density of ")
               .append(number_text(wanted)),
           "tcs.density",
           std::string("use ")
               .append(number_text(std::ceil(1000 * least) / 1000))
               .append(" to ")
               .append(number_text(std::floor(1000 * most) / 1000)));
  for (int i = 0; i < 16; ++i) {
    const double middle = 0.5 * (low + high);
    (of(middle) < wanted ? low : high) = middle;
  }
  return scaled(p, 0.5 * (low + high));
}

GradedSizes sized(const TcsParams& params, std::span<const float> factors, double least_mm) {
  const TcsParams p = sized(params);
  const MemberRange given = members(p);
  double high = most_scale(p, given.most_mm), low = std::max(least_mm / given.least_mm, 0.04 * high);
  if (!(low <= high))
    refuse("no cell of this size has room for members from " + number_text(least_mm) + " mm up to " +
               number_text(p.grade_most / p.grade_least) + " times that",
           "tcs.grade_most", "use a larger tcs.cell_mm, or a grade_most nearer to grade_least");
  const DensityCurve curve(p, low * p.grade_least, high * p.grade_most);
  const double wanted = params.density.value_or(curve.mean(factors, 1));
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (curve.mean(factors, middle) < wanted ? low : high) = middle;
  }
  const double scale = 0.5 * (low + high);
  return {scaled(p, scale), curve.mean(factors, scale)};
}

Shape crystal(const TcsParams& params) {
  const TcsParams p = sized(params);
  check(p);
  return is_turned(p) ? placed(in_lattice(p, {}), lattice(p)) : in_lattice(p, p.shift_mm);
}

Shape crystal(const TcsParams& params, const Shape& thickness) {
  const TcsParams p = sized(params);
  check(p);
  // Sizes are taken off distances to what has none; for a network, which has no such middle, between several sizes.
  const auto of = [&](const auto& change) {
    TcsParams other = p;
    change(other);
    return is_turned(p) ? placed(in_lattice(other, {}), lattice(p)) : in_lattice(other, p.shift_mm);
  };
  switch (p.form) {
    case TcsForm::Sticks: {
      const Radii radii{0.5 * p.stick_mm, 0.5 * p.ball_mm};
      if (!is_turned(p)) return sticks_and_balls(cell_of(p), radii, p.shift_mm, thickness);
      const Frame frame = lattice(p);
      return placed(sticks_and_balls(cell_of(p), radii, {}, placed(thickness, inverse(frame))), frame);
    }
    case TcsForm::Sheet:
      return Shape(std::make_shared<const GradedSheet>(of([](TcsParams& q) { q.wall_mm = 0; }), p.wall_mm, thickness));
    case TcsForm::Network:
      break;
  }
  constexpr int sizes = 5;
  std::vector<Shape> network;
  for (int i = 0; i < sizes; ++i)
    network.push_back(
        of([&](TcsParams& q) { q.stick_mm *= p.grade_least + (p.grade_most - p.grade_least) * i / (sizes - 1); }));
  return Shape(std::make_shared<const Between>(std::move(network), thickness, p));
}

Shape thicker_at_surface(const TcsParams& params, const Shape& body, double shell_mm) {
  return Shape(std::make_shared<const ByDepth>(params, body, shell_mm));
}

void each_stick(const TcsParams& params, const Box3d& box, const std::function<void(const Capsule&)>& visit) {
  const TcsParams p = sized(params);
  check(p);
  visit_sticks(p, box, visit);
}

Fill generate(const Part&, const TcsParams& params) {
  const TcsParams p = sized(params);
  return filled(p, crystal(p), {});
}

Fill generate(const Part&, const TcsParams& params, const Shape& thickness) {
  const TcsParams p = sized(params);
  return filled(p, crystal(p, thickness), thickness);
}

}  // namespace fibrolite
