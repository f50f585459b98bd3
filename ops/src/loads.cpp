// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/loads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/winding.h"

namespace fibrolite {
namespace {

constexpr double stand_share = 0.05;  // of the height that presets stand on, as the verification does

Support on_its_foot() {
  Support foot;
  foot.where.lowest = EndShare{.share = stand_share};
  return foot;
}

LoadCase pressed_from_above(double newton) {
  TotalForce force{.newton = newton};
  force.where.seen_from = Direction{Direction::Of::Up, {}};
  return {"pressed from above", {on_its_foot()}, {force}};
}

struct Preset {
  const char* name;
  std::vector<LoadCase> (*make)();
};
constexpr Preset presets[] = {{"paper-verify", [] { return std::vector<LoadCase>{}; }},
                              {"paper-compare", [] { return std::vector<LoadCase>{pressed_from_above(110)}; }},
                              {"stand", [] {
                                 return std::vector<LoadCase>{{"own weight", {on_its_foot()}, {Gravity{}}}};
                               }}};

bool is_finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Checks one load case; `key` is where it stands in the recipe.
struct Check {
  std::string name, key;

  [[noreturn]] void refuse(const std::string& what, const std::string& at, const std::string& hint) const {
    throw Error(Code::BadRecipe, "load case '" + name + "' " + what, key + at, hint);
  }
  void direction(const Direction& d, const std::string& at) const {
    if (d.of == Direction::Of::World && !(is_finite(d.vector) && norm(d.vector) > 0))
      refuse("has a direction without length", at, "use [x, y, z] or a word: up, down, slanted");
  }
  void end(const std::optional<EndShare>& end, const std::string& at) const {
    if (!end) return;
    if (!(end->share > 0 && end->share <= 1))
      refuse("takes a share of " + number_text(end->share), at + ".share", "use above 0, up to 1");
    direction(end->along, at + ".along");
  }
  void selection(const Selection& where, const std::string& at) const {
    if (!where.box_mm && where.half_spaces.empty() && !where.lowest && !where.highest && !where.label &&
        !where.painted && !where.seen_from)
      refuse("selects by nothing", at, "give box_mm, half_space, lowest, highest, label, painted or seen_from");
    if (where.box_mm && (!is_finite(where.box_mm->min) || !is_finite(where.box_mm->max) || where.box_mm->empty()))
      refuse("has a box that holds nothing", at + ".box_mm", "give the least corner first: [[x, y, z], [x, y, z]]");
    for (const HalfSpace& half : where.half_spaces)
      if (!is_finite(half.point_mm) || !is_finite(half.normal) || !(norm(half.normal) > 0))
        refuse("has a half-space without a normal", at + ".half_space", "give point_mm and a normal that points out");
    end(where.lowest, at + ".lowest");
    end(where.highest, at + ".highest");
    if (where.label && *where.label < 0) refuse("has a label below 0", at + ".label", "labels count from 0");
    if (where.seen_from) direction(*where.seen_from, at + ".seen_from");
  }
  void support(const Support& support, const std::string& at) const {
    selection(support.where, at + ".where");
    if (support.where.seen_from)
      refuse("has a support by seen_from", at + ".where", "seen_from is for forces; use lowest, a box or a half-space");
    if (support.sliding) direction(*support.sliding, at + ".sliding");
  }
  void force(const TotalForce& force, const std::string& at) const {
    if (!(force.newton > 0 && std::isfinite(force.newton)))
      refuse("has a force of " + number_text(force.newton) + " N", at + ".force_n",
             "use above 0 and turn the direction if need be");
    direction(force.direction, at + ".direction");
    selection(force.where, at + ".where");
  }
  void force(const Pressure& force, const std::string& at) const {
    if (!(std::isfinite(force.mpa) && force.mpa != 0))
      refuse("has a pressure of " + number_text(force.mpa) + " MPa", at + ".pressure_mpa", "use any number but 0");
    selection(force.where, at + ".where");
    if (force.where.seen_from)
      refuse("has a pressure by seen_from", at + ".where", "a pressure acts on a surface: use another selector");
  }
  void force(const Gravity& force, const std::string& at) const { direction(force.direction, at + ".gravity"); }
};

std::string indexed(const char* key, std::size_t i) { return std::string(".") + key + "[" + std::to_string(i) + "]"; }

Vec3d turned(const Frame& frame, Vec3d v) { return {dot(v, frame.x), dot(v, frame.y), dot(v, frame.z)}; }

void turn(const Frame& frame, Direction& d) {
  if (d.of == Direction::Of::World) d.vector = turned(frame, d.vector);
}

void turn(const Frame& frame, Selection& where) {
  if (where.box_mm) {
    const Box3d box = *where.box_mm;
    for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
      where.half_spaces.push_back({box.max, axis});
      where.half_spaces.push_back({box.min, -axis});
    }
    where.box_mm.reset();
  }
  for (HalfSpace& half : where.half_spaces) half = {frame.to_local(half.point_mm), turned(frame, half.normal)};
  if (where.lowest) turn(frame, where.lowest->along);
  if (where.highest) turn(frame, where.highest->along);
  if (where.painted) where.painted->distance = placed(where.painted->distance, inverse(frame));
  if (where.seen_from) turn(frame, *where.seen_from);
}

void turn(const Frame& frame, TotalForce& force) {
  turn(frame, force.direction);
  turn(frame, force.where);
}
void turn(const Frame& frame, Pressure& force) { turn(frame, force.where); }
void turn(const Frame& frame, Gravity& force) { turn(frame, force.direction); }

}  // namespace

std::vector<std::string> load_preset_names() {
  std::vector<std::string> names;
  for (const Preset& preset : presets) names.emplace_back(preset.name);
  return names;
}

std::vector<LoadCase> load_preset(std::string_view name) {
  for (const Preset& preset : presets)
    if (preset.name == name) return preset.make();
  throw Error(Code::BadRecipe, "no loads are called '" + std::string(name) + "'", "loads",
              "did you mean " + nearest_name(name, load_preset_names()) + "?");
}

void check_loads(const std::vector<LoadCase>& cases) {
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const LoadCase& load = cases[i];
    const Check check{load.name, "loads[" + std::to_string(i) + "]"};
    if (load.name.empty()) check.refuse("has no name", ".name", "give each case a name");
    for (std::size_t j = 0; j < i; ++j)
      if (cases[j].name == load.name) check.refuse("appears twice", ".name", "give each case its own name");
    if (load.supports.empty()) check.refuse("has no support", ".supports", "say where the body is held");
    if (load.forces.empty()) check.refuse("has no force", ".forces", "say what acts on the body");
    for (std::size_t k = 0; k < load.supports.size(); ++k) check.support(load.supports[k], indexed("supports", k));
    for (std::size_t k = 0; k < load.forces.size(); ++k)
      std::visit([&](const auto& force) { check.force(force, indexed("forces", k)); }, load.forces[k]);
  }
  if (!cases.empty() && std::all_of(cases.begin(), cases.end(), [](const LoadCase& c) { return c.unplanned; }))
    throw Error(Code::BadRecipe, "every load case is unplanned", "loads", "let one of them decide about the parts");
}

std::string color_text(Rgb color) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "#%02x%02x%02x", unsigned{color.r}, unsigned{color.g}, unsigned{color.b});
  return text.data();
}

std::vector<LoadCase> with_paint(std::vector<LoadCase> cases, const Mesh& colored) {
  const auto find = [&](Selection& where, const std::string& name) {
    if (!where.painted) return;
    Mesh chosen{colored.vertices, {}, {}};
    std::set<std::string> others;
    for (std::size_t t = 0; t < colored.triangle_colors.size(); ++t) {
      if (colored.triangle_colors[t] == where.painted->color) {
        chosen.triangles.push_back(colored.triangles[t]);
      } else if (others.size() < 8) {
        others.insert(color_text(colored.triangle_colors[t]));
      }
    }
    if (chosen.triangles.empty()) {
      std::string hint = "the model has no colours: give a .ply whose faces have red, green and blue";
      if (!others.empty()) hint = "its triangles are";
      for (const std::string& other : others) hint.append(" ").append(other);
      throw Error(Code::BadRecipe,
                  std::string("no triangle of the model is painted ").append(color_text(where.painted->color)),
                  std::string("load case '").append(name).append("'"), hint);
    }
    const Shape distance = distance_to(WindingTree(chosen));
    where.painted->distance = complement(unite({distance, complement(distance)}));  // of an open piece: no sides
  };
  for (LoadCase& load : cases) {
    for (Support& support : load.supports) find(support.where, load.name);
    for (Force& force : load.forces) {
      if (auto* total = std::get_if<TotalForce>(&force)) find(total->where, load.name);
      if (auto* pressure = std::get_if<Pressure>(&force)) find(pressure->where, load.name);
    }
  }
  return cases;
}

std::vector<LoadCase> in_frame(const Frame& frame, std::vector<LoadCase> cases) {
  for (LoadCase& load : cases) {
    for (Support& support : load.supports) {
      turn(frame, support.where);
      if (support.sliding) turn(frame, *support.sliding);
    }
    for (Force& force : load.forces) std::visit([&](auto& f) { turn(frame, f); }, force);
  }
  return cases;
}

}  // namespace fibrolite
