// SPDX-License-Identifier: GPL-3.0-or-later
// One table of keys drives reading, printing, --set, range checks and help.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "fibrolite/error.h"
#include "fibrolite/ops/recipe.h"
#include "fibrolite/ops/text.h"
#include "loads_json.h"
#include "overrides_json.h"

namespace fibrolite {
namespace {

using Json = nlohmann::ordered_json;

/// What a number may be; `least` itself is left out if `above`.
struct Range {
  double least, most;
  bool above = false;
  [[nodiscard]] bool holds(double value) const {  // false for NaN
    return (above ? value > least : value >= least) && value <= most;
  }
  [[nodiscard]] std::string words() const {
    return (above ? "above " : "") + number_text(least) + (above ? ", up to " : " to ") + number_text(most);
  }
};

/// Where a value stands, for messages.
struct Place {
  std::string key, source, accepts;
  [[noreturn]] void refuse(const Json& value) const {
    const std::string given = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    throw Error(Code::BadRecipe, key + " cannot be " + (given.size() > 60 ? given.substr(0, 57) + "..." : given),
                source, "use " + accepts);
  }
};

// How each type of value is worded, written and read. A read refuses what it does not accept.

std::string accepts(const double&, Range range) { return range.words(); }
Json write(double value) { return value; }
void read(const Json& json, double& value, Range range, const Place& place) {
  if (!json.is_number() || !range.holds(json.get<double>())) place.refuse(json);
  value = json.get<double>();
}

std::string accepts(const std::optional<double>&, Range range) { return "\"auto\" or " + range.words(); }
Json write(const std::optional<double>& value) { return value ? Json(*value) : Json("auto"); }
void read(const Json& json, std::optional<double>& value, Range range, const Place& place) {
  if (json == "auto") {
    value.reset();
  } else {
    read(json, value.emplace(), range, place);
  }
}

std::string accepts(const bool&, Range) { return "true or false"; }
Json write(bool value) { return value; }
void read(const Json& json, bool& value, Range, const Place& place) {
  if (!json.is_boolean()) place.refuse(json);
  value = json.get<bool>();
}

std::string accepts(const Vec3d&, Range range) { return "[x, y, z], each " + range.words(); }
Json write(const Vec3d& value) { return {value.x, value.y, value.z}; }
void read(const Json& json, Vec3d& value, Range range, const Place& place) {
  if (!json.is_array() || json.size() != 3) place.refuse(json);
  read(json[0], value.x, range, place);
  read(json[1], value.y, range, place);
  read(json[2], value.z, range, place);
}

std::string accepts(const std::optional<std::filesystem::path>&, Range) {
  return "the path of an image file, or null for the bundled one";
}
Json write(const std::optional<std::filesystem::path>& value) { return value ? Json(value->string()) : Json(nullptr); }
void read(const Json& json, std::optional<std::filesystem::path>& value, Range, const Place& place) {
  if (json.is_null()) {
    value.reset();
  } else if (json.is_string() && !json.get_ref<const std::string&>().empty()) {
    value = json.get<std::string>();
  } else {
    place.refuse(json);
  }
}

// The words of an enumeration, in the order of its enumerators.
constexpr std::array<const char*, 2> words(Walls) { return {"image", "delaunay"}; }
constexpr std::array<const char*, 3> words(PartBy) { return {"shape", "load", "both"}; }
constexpr std::array<const char*, 2> words(Bridge) { return {"mst", "bbox"}; }
constexpr std::array<const char*, 3> words(TcsForm) { return {"sticks", "network", "sheet"}; }
constexpr std::array<const char*, 3> words(TcsGrade) { return {"none", "surface", "stress"}; }

template <class Enum>
concept Worded = requires(Enum value) {
  words(value);
};
template <Worded Enum>
std::string accepts(const Enum& value, Range) {
  const auto all = words(value);
  std::string text;
  for (std::size_t i = 0; i < all.size(); ++i)
    text.append(i == 0 ? "\"" : i + 1 == all.size() ? "\" or \"" : "\", \"").append(all[i]);
  return text.append("\"");
}
template <Worded Enum>
Json write(Enum value) {
  return words(value)[static_cast<std::size_t>(value)];
}
template <Worded Enum>
void read(const Json& json, Enum& value, Range, const Place& place) {
  const auto all = words(value);
  const auto word = std::find(all.begin(), all.end(), json);
  if (word == all.end()) place.refuse(json);
  value = static_cast<Enum>(word - all.begin());
}

std::string accepts(const CellEdges&, Range range) { return range.words() + ", or three of them, [x, y, z]"; }
Json write(const CellEdges& value) {
  if (value.x == value.y && value.y == value.z) return value.x;
  return {value.x, value.y, value.z};
}
void read(const Json& json, CellEdges& value, Range range, const Place& place) {
  Vec3d edges;
  if (json.is_array()) {
    read(json, edges, range, place);
  } else {
    read(json, edges.x, range, place);
    edges.y = edges.z = edges.x;
  }
  value = {edges.x, edges.y, edges.z};
}

std::string accepts(const std::vector<LoadCase>&, Range) {
  std::string names;
  for (const std::string& name : load_preset_names()) names += "\"" + name + "\", ";
  return names + "or a list of cases, each with name, supports and forces: see docs/loads.md";
}
Json write(const std::vector<LoadCase>& value) { return written(value); }
void read(const Json& json, std::vector<LoadCase>& value, Range, const Place& place) {
  value = loads_from(json, place.source);
}

std::string accepts(const Overrides&, Range) {
  return "an object with parts, cuts and solid, each a list: see docs/parts.md";
}
Json write(const Overrides& value) { return written(value); }
void read(const Json& json, Overrides& value, Range, const Place& place) { value = overrides_from(json, place.source); }

std::string accepts(const std::uint64_t&, Range) { return "a whole number, 0 or more"; }
Json write(std::uint64_t value) { return value; }
void read(const Json& json, std::uint64_t& value, Range, const Place& place) {
  if (!json.is_number_unsigned()) place.refuse(json);
  value = json.get<std::uint64_t>();
}

/// One row of the table.
struct Field {
  RecipeKey about;
  std::function<Json(const Recipe&)> get;
  std::function<void(Recipe&, const Json&, const std::string& source)> put;
};

/// A row for whatever `value_of(recipe)` refers to.
template <class ValueOf>
Field field(const char* key, ValueOf value_of, Range range, const char* doc) {
  const Recipe defaults;
  const std::string words = accepts(value_of(defaults), range);
  return {{key, words, doc},
          [=](const Recipe& recipe) { return write(value_of(recipe)); },
          [=](Recipe& recipe, const Json& json, const std::string& source) {
            read(json, value_of(recipe), range, Place{key, source, words});
          }};
}
template <class Group, class Value>
Field field(const char* key, Group Recipe::*group, Value Group::*value, Range range, const char* doc) {
  return field(
      key, [=](auto& recipe) -> auto& { return (recipe.*group).*value; }, range, doc);
}
template <class Group, class Value>
Field field(const char* key, Group Recipe::*group, Value Group::*value, const char* doc) {
  return field(key, group, value, Range{0, 0}, doc);
}

const std::vector<Field>& table() {
  constexpr double huge = 1e9;
  using R = Recipe;
  static const std::vector<Field> rows = {
      field("shell.thickness_mm", &R::shell, &ShellParams::thickness_mm, {0.01, 1000}, "outer wall; 2 voxels or more"),

      field("partition.by", &R::partition, &PartitionParams::by,
            "columns are limbs by their shape (the paper), cores where the load runs, or both"),
      field("partition.threshold", &R::partition, &PartitionParams::threshold, {0, 1},
            "normalised diameter below which a region is column-like; auto takes the most stable partition"),
      field("partition.min_area", &R::partition, &PartitionParams::min_area, {0, 0.5},
            "regions below this share of the surface join a neighbour"),
      field("partition.min_slenderness", &R::partition, &PartitionParams::min_slenderness, {0, 100},
            "a limb or core shorter than this many diameters is no column"),
      field("partition.core_share", &R::partition, &PartitionParams::core_share, {0, 2, true},
            "section of a core, over one that would carry all of the load at the core's largest stress"),
      field("partition.concentration", &R::partition, &PartitionParams::concentration, {0, 100},
            "a core starts where the stress along one direction is this many times the body's mean"),
      field("partition.overrides", &R::partition, &PartitionParams::overrides,
            "infill of single parts, cuts of your own, regions that stay solid"),

      field("verify.dominance", &R::verify, &VerifyParams::dominance, {1, 1000, true},
            "a column carries at least this many times more stress along its axis than across"),
      field("verify.unloaded", &R::verify, &VerifyParams::unloaded, {0, 1},
            "a part stressed below this share of the body's mean is unloaded, so bulk"),
      field("verify.load_n", &R::verify, &VerifyParams::load_n, {0, huge, true}, "force on the model, newton"),
      field("verify.azimuth_deg", &R::verify, &VerifyParams::azimuth_deg, {-360, 360},
            "direction, about up, of the load at 45 degrees"),
      field("verify.support_share", &R::verify, &VerifyParams::support_share, {0.001, 0.5},
            "lowest share of the height that is held fast"),
      field("verify.world_axes", &R::verify, &VerifyParams::world_axes,
            "resolve stress along x, y, z as in the paper, not along each part's axis"),

      field("mfs.fibre_mm", &R::mfs, &MfsParams::fibre_mm, {0.02, 1000},
            "mean distance between fibre centres; more than 2 * mfs.wall_mm, and mfs.wall_mm + mfs.gap_mm (delaunay: "
            "twice that)"),
      field("mfs.wall_mm", &R::mfs, &MfsParams::wall_mm, {0.01, 1000}, "least membrane thickness; 2 voxels or more"),
      field("mfs.gap_mm", &R::mfs, &MfsParams::gap_mm, {0.01, 1000},
            "least width of a void between membranes; what is narrower becomes membrane"),
      field("mfs.walls", &R::mfs, &MfsParams::walls,
            "image: membranes as synthesised; delaunay: triangles between the same fibres, stiff across"),
      field("mfs.taper", &R::mfs, &MfsParams::taper,
            "fibres converge where the limb narrows and spread where it widens; membranes keep their thickness"),
      field("mfs.template", &R::mfs, &MfsParams::micrograph, "micrograph that the fibres are taken from"),

      field("tcs.form", &R::tcs, &TcsParams::form,
            "the paper's balls and sticks; the same network without sharp joints; the membrane between two of those"),
      field("tcs.cell_mm", &R::tcs, &TcsParams::cell_mm, {0.04, 1000},
            "edge of the cubic cell, or its three edges; 4 * tcs.stick_mm (sheet: 4 * tcs.wall_mm; network: 3 *) or "
            "more"),
      field("tcs.stick_mm", &R::tcs, &TcsParams::stick_mm, {0.01, 250},
            "diameter of sticks, of a network where it is thinnest; 2 voxels or more"),
      field("tcs.ball_mm", &R::tcs, &TcsParams::ball_mm, {0.01, 1000}, "ball diameter of sticks; tcs.stick_mm or more"),
      field("tcs.wall_mm", &R::tcs, &TcsParams::wall_mm, {0.01, 250}, "thickness of a sheet; 2 voxels or more"),
      field("tcs.density", &R::tcs, &TcsParams::density, {0, 1},
            "share of material in a cell: sticks and balls, necks or walls get as thick as that takes; auto: as given"),
      field("tcs.shift_mm", &R::tcs, &TcsParams::shift_mm, {-1e6, 1e6}, "lattice origin, world axes"),
      field("tcs.rotate_deg", &R::tcs, &TcsParams::rotate_deg, {-360, 360},
            "turns of the lattice about its origin: about world x, then y, then z"),
      field("tcs.stretch_z", &R::tcs, &TcsParams::stretch_z,
            "cells taller by sqrt(2) upward (--up): sticks at 45 degrees, printable without support"),
      field("tcs.grade", &R::tcs, &TcsParams::grade,
            "where members are thicker: nowhere, toward the surface, or where the body carries more"),
      field("tcs.grade_least", &R::tcs, &TcsParams::grade_least, {0.01, 10},
            "if graded, thickness of all members is multiplied by this deep inside, or where nothing is carried"),
      field("tcs.grade_most", &R::tcs, &TcsParams::grade_most, {0.01, 10},
            "and by this under the shell, or where most is carried; tcs.grade_least or more"),
      field("tcs.grade_depth_mm", &R::tcs, &TcsParams::grade_depth_mm, {0.04, 1000},
            "within what the one becomes the other; tcs.cell_mm or more"),

      field("gyroid.cell_mm", &R::gyroid, &GyroidParams::cell_mm, {0.04, 1000},
            "edge of the cubic cell; 4 * gyroid.wall_mm or more"),
      field("gyroid.wall_mm", &R::gyroid, &GyroidParams::wall_mm, {0.01, 250}, "thickness of walls; 2 voxels or more"),
      field("gyroid.density", &R::gyroid, &GyroidParams::density, {0, 1},
            "share of material in a cell: walls get as thick as that takes; auto: as given"),

      field("joint.enabled", &R::joint, &JointRecipe::enabled, "layers and columns where parts meet"),
      field("joint.columns", &R::joint, &JointRecipe::columns,
            "support columns from a layer to the crystal, too; false: the layer alone"),
      field("joint.bridge", &R::joint, &JointRecipe::bridge,
            "how separate regions of a layer are joined: minimum spanning tree, or the paper's bounding boxes"),
      field("joint.layer_mm", &R::joint, &JointRecipe::layer_mm, {0.01, 1000},
            "thickness of a layer; 2 voxels and print.wall_mm or more; auto: 1.2, or print.wall_mm if that is more"),
      field("joint.column_mm", &R::joint, &JointRecipe::column_mm, {0.01, 1000},
            "column diameter; 2 voxels and print.wall_mm or more; auto: 0.8, or print.wall_mm if that is more"),
      field("joint.spacing_mm", &R::joint, &JointRecipe::spacing_mm, {0.01, 1000},
            "distance between columns; more than joint.column_mm; auto: 3, or twice joint.column_mm if that is more"),
      field("joint.reach_mm", &R::joint, &JointRecipe::reach_mm, {0.01, 1000},
            "a column that meets no crystal within this is left out"),
      field("joint.min_wall_mm", &R::joint, &JointRecipe::min_wall_mm, {0.01, 1000},
            "width of a bridge; 2 voxels and print.wall_mm or more; auto: 0.8, or print.wall_mm if that is more"),

      field("print.wall_mm", &R::print, &PrintParams::wall_mm, {0.01, 1000},
            "walls and sticks thinner than this are reported, and thickened with --fix"),
      field("print.gap_mm", &R::print, &PrintParams::gap_mm, {0.01, 1000},
            "gaps inside narrower than this are reported, and closed with --fix"),
      field("print.overhang_deg", &R::print, &PrintParams::overhang_deg, {0, 90},
            "faces inside that lean more than this from upright are reported; 90 is a ceiling"),
      field("print.check", &R::print, &PrintParams::check, "look for thin walls, small gaps and overhangs"),
      field("print.drain_mm", &R::print, &PrintParams::drain_mm, {0, 1000},
            "diameter of a hole in every closed void, 2 voxels or more; 0: none; auto: none, with --fix 2 mm"),

      field("material.density_g_cm3", &R::material, &Material::density_g_cm3, {0, 30, true}, "density"),
      field("material.young_mpa", &R::material, &Material::young_mpa, {0, huge, true}, "Young's modulus"),
      field("material.poisson", &R::material, &Material::poisson, {0, 0.49}, "Poisson's ratio"),
      field("material.yield_mpa", &R::material, &Material::yield_mpa, {0, huge, true}, "yield stress"),

      field(
          "loads", [](auto& recipe) -> auto& { return recipe.verify.loads; }, Range{0, 0},
          "what the model has to carry; paper-verify: verify.load_n from above and at 45 degrees"),

      field(
          "seed", [](auto& recipe) -> auto& { return recipe.seed; }, Range{0, 0}, "of every random number"),
  };
  return rows;
}

const Field* find(std::string_view key) {
  for (const Field& row : table())
    if (row.about.key == key) return &row;
  return nullptr;
}

/// "tcs" is the group of "tcs.cell_mm".
bool is_group(std::string_view key) {
  for (const Field& row : table())
    if (row.about.key.size() > key.size() && row.about.key.starts_with(key) && row.about.key[key.size()] == '.')
      return true;
  return false;
}

[[noreturn]] void refuse_unknown(const std::string& key, const std::string& source) {
  std::vector<std::string> names;
  for (const Field& row : table()) names.push_back(row.about.key);
  throw Error(Code::BadRecipe, "unknown key " + key, source,
              std::string("did you mean ").append(nearest_name(key, names)).append("?"));
}

/// What depends on more than one key.
Recipe finished(Recipe recipe) {
  recipe.mfs.seed = recipe.seed;
  return recipe;
}

void apply(Recipe& recipe, const Json& object, const std::string& group, const std::string& source) {
  for (const auto& [name, value] : object.items()) {
    const std::string key = group.empty() ? name : std::string(group).append(".").append(name);
    if (const Field* row = find(key)) {
      row->put(recipe, value, source);
    } else if (!is_group(key)) {
      refuse_unknown(key, source);
    } else if (key == "material" && value.is_string()) {
      recipe.material = material(value.get<std::string>());
    } else if (value.is_object()) {
      apply(recipe, value, key, source);
    } else {
      Place{key, source, "an object, { ... }"}.refuse(value);
    }
  }
}

/// JSON in which no object has the same key twice (a plain parse keeps the last one without a word).
Json parse_strictly(std::string_view text, const std::string& source) {
  std::vector<std::set<std::string>> open_objects;
  const auto watch = [&](int, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == Json::parse_event_t::object_end) open_objects.pop_back();
    if (event == Json::parse_event_t::key && !open_objects.back().insert(parsed.get<std::string>()).second)
      throw Error(Code::BadRecipe, "key " + parsed.get<std::string>() + " appears twice", source, "leave one out");
    return true;
  };
  try {
    return Json::parse(text, watch);
  } catch (const Json::exception& problem) {
    std::string what = problem.what();  // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    if (const auto end = what.find("] "); end != std::string::npos) what.erase(0, end + 2);
    for (char& c : what)
      if (static_cast<unsigned char>(c) < ' ') c = ' ';
    throw Error(Code::BadRecipe, "the recipe is not valid JSON: " + what, source,
                "fibrolite recipe prints a valid one");
  }
}

}  // namespace

std::vector<RecipeKey> recipe_keys() {
  std::vector<RecipeKey> keys;
  for (const Field& row : table()) keys.push_back(row.about);
  return keys;
}

Recipe parse_recipe(std::string_view json, const Recipe& base, std::string_view source_name) {
  const std::string source(source_name);
  const Json parsed = parse_strictly(json, source);
  if (!parsed.is_object()) throw Error(Code::BadRecipe, "the recipe is not a JSON object", source, "start it with {");
  Recipe recipe = base;
  apply(recipe, parsed, "", source);
  return finished(recipe);
}

Recipe set(const Recipe& base, std::string_view assignment) {
  const auto equals = assignment.find('=');
  const std::string source = "--set " + std::string(assignment);
  if (equals == std::string_view::npos)
    throw Error(Code::BadRecipe, "no value given", source, "write it as --set tcs.cell_mm=5");
  const std::string key(assignment.substr(0, equals));
  const std::string text(assignment.substr(equals + 1));
  const Field* row = find(key);
  if (key == "material" && !text.empty()) {  // the one group that has values with names
    Recipe recipe = base;
    recipe.material = material(text);
    return finished(recipe);
  }
  if (row == nullptr && is_group(key)) {
    Place{key, source, "one of its keys, e.g. --set " + key + ".NAME=VALUE"}.refuse(text);
  }
  if (row == nullptr) refuse_unknown(key, source);
  Json value = Json::parse(text, nullptr, false);
  if (value.is_discarded()) value = text;  // plain words need no quotes: joint.bridge=bbox, mfs.template=/a/b.png
  Recipe recipe = base;
  row->put(recipe, value, source);
  return finished(recipe);
}

std::string to_json(const Recipe& recipe) {
  Json json = Json::object();
  for (const Field& row : table()) {
    const std::string& key = row.about.key;
    const auto dot = key.find('.');
    if (dot == std::string::npos) {
      json[key] = row.get(recipe);
    } else {
      json[key.substr(0, dot)][key.substr(dot + 1)] = row.get(recipe);
    }
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace fibrolite
