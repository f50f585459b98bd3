// SPDX-License-Identifier: GPL-3.0-or-later
#include "loads_json.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"

namespace fibrolite {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::pair<Direction::Of, const char*> words[] = {
    {Direction::Of::Up, "up"}, {Direction::Of::Down, "down"}, {Direction::Of::Slanted, "slanted"}};

/// A value and where it stands.
class Reader {
 public:
  Reader(const Json& json, std::string key, const std::string& source)
      : json_(json), key_(std::move(key)), source_(source) {}

  [[noreturn]] void refuse(const std::string& accepts) const {
    const std::string given = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    throw Error(Code::BadRecipe, key_ + " cannot be " + (given.size() > 60 ? given.substr(0, 57) + "..." : given),
                source_, "use " + accepts);
  }
  [[nodiscard]] double number() const {
    if (!json_.is_number()) refuse("a number");
    return json_.get<double>();
  }
  [[nodiscard]] int count() const {
    if (!json_.is_number_unsigned() || json_.get<std::uint64_t>() > 1000000) refuse("a whole number, 0 or more");
    return json_.get<int>();
  }
  [[nodiscard]] bool boolean() const {
    if (!json_.is_boolean()) refuse("true or false");
    return json_.get<bool>();
  }
  [[nodiscard]] std::string text() const {
    if (!json_.is_string()) refuse("a name in quotes");
    return json_.get<std::string>();
  }
  [[nodiscard]] Rgb color() const {
    const std::string given = json_.is_string() ? json_.get<std::string>() : std::string();
    if (given.size() != 7 || given[0] != '#' || given.find_first_not_of("0123456789abcdefABCDEF", 1) != given.npos)
      refuse("a colour, \"#rrggbb\"");
    const unsigned long value = std::stoul(given.substr(1), nullptr, 16);
    return {static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>((value >> 8) & 255U),
            static_cast<std::uint8_t>(value & 255U)};
  }
  [[nodiscard]] Vec3d vector(const std::string& accepts = "[x, y, z]") const {
    if (!json_.is_array() || json_.size() != 3) refuse(accepts);
    for (const Json& entry : json_)
      if (!entry.is_number()) refuse(accepts);
    return {json_[0].get<double>(), json_[1].get<double>(), json_[2].get<double>()};
  }
  [[nodiscard]] Direction direction() const {
    for (const auto& [of, word] : words)
      if (json_ == word) return {of, {}};
    return {Direction::Of::World, vector("[x, y, z] or \"up\", \"down\", \"slanted\"")};
  }
  /// Calls the reader of each key that is there; the others keep what they are.
  using Keys = std::vector<std::pair<std::string, std::function<void(const Reader&)>>>;
  void object(const Keys& keys) const {
    if (!json_.is_object()) refuse("an object, { ... }");
    for (const auto& item : json_.items()) {
      const std::string& name = item.key();
      const auto known = std::find_if(keys.begin(), keys.end(), [&](const auto& key) { return key.first == name; });
      if (known != keys.end()) {
        known->second(Reader(item.value(), key_ + "." + name, source_));
        continue;
      }
      std::vector<std::string> names;
      for (const auto& key : keys) names.push_back(key.first);
      throw Error(Code::BadRecipe, "unknown key " + key_ + "." + name, source_,
                  "did you mean " + nearest_name(name, names) + "?");
    }
  }
  void list(const std::function<void(const Reader&)>& entry) const {
    if (!json_.is_array()) refuse("a list, [ ... ]");
    for (std::size_t i = 0; i < json_.size(); ++i)
      entry(Reader(json_[i], key_ + "[" + std::to_string(i) + "]", source_));
  }
  [[nodiscard]] bool has(const char* name) const { return json_.is_object() && json_.contains(name); }
  [[nodiscard]] bool is_list() const { return json_.is_array(); }

 private:
  const Json& json_;
  std::string key_;
  const std::string& source_;
};

EndShare end_share(const Reader& reader) {
  EndShare end;
  reader.object({{"share", [&](const Reader& r) { end.share = r.number(); }},
                 {"along", [&](const Reader& r) { end.along = r.direction(); }}});
  return end;
}

HalfSpace half_space(const Reader& reader) {
  HalfSpace half;
  reader.object({{"point_mm", [&](const Reader& r) { half.point_mm = r.vector(); }},
                 {"normal", [&](const Reader& r) { half.normal = r.vector(); }}});
  return half;
}

Box3d box(const Reader& reader) {
  std::vector<Vec3d> corners;
  reader.list([&](const Reader& r) { corners.push_back(r.vector()); });
  if (corners.size() != 2) reader.refuse("the least and the greatest corner, [[x, y, z], [x, y, z]]");
  return {corners[0], corners[1]};
}

Selection selection(const Reader& reader) {
  Selection where;
  reader.object({{"box_mm", [&](const Reader& r) { where.box_mm = box(r); }},
                 {"half_space",
                  [&](const Reader& r) {
                    const auto add = [&](const Reader& one) { where.half_spaces.push_back(half_space(one)); };
                    r.is_list() ? r.list(add) : add(r);
                  }},
                 {"lowest", [&](const Reader& r) { where.lowest = end_share(r); }},
                 {"highest", [&](const Reader& r) { where.highest = end_share(r); }},
                 {"label", [&](const Reader& r) { where.label = r.count(); }},
                 {"painted",
                  [&](const Reader& r) {
                    where.painted = Paint{r.color(), {}};
                  }},
                 {"seen_from", [&](const Reader& r) { where.seen_from = r.direction(); }}});
  return where;
}

Support support(const Reader& reader) {
  Support support;
  reader.object({{"where", [&](const Reader& r) { support.where = selection(r); }},
                 {"sliding", [&](const Reader& r) { support.sliding = r.direction(); }}});
  return support;
}

Force force(const Reader& reader) {
  const int kinds = int{reader.has("force_n")} + int{reader.has("pressure_mpa")} + int{reader.has("gravity")};
  if (kinds > 1) reader.refuse("one of force_n, pressure_mpa, gravity; each force is an entry of its own");
  if (reader.has("pressure_mpa")) {
    Pressure pressure;
    reader.object({{"pressure_mpa", [&](const Reader& r) { pressure.mpa = r.number(); }},
                   {"where", [&](const Reader& r) { pressure.where = selection(r); }}});
    return pressure;
  }
  if (reader.has("gravity")) {
    Gravity gravity;
    reader.object({{"gravity", [&](const Reader& r) { gravity.direction = r.direction(); }}});
    return gravity;
  }
  TotalForce total;
  // The other two are named here for the sake of "did you mean".
  reader.object({{"force_n", [&](const Reader& r) { total.newton = r.number(); }},
                 {"direction", [&](const Reader& r) { total.direction = r.direction(); }},
                 {"where", [&](const Reader& r) { total.where = selection(r); }},
                 {"pressure_mpa", [](const Reader&) {}},
                 {"gravity", [](const Reader&) {}}});
  if (!reader.has("force_n")) reader.refuse("an object with force_n, pressure_mpa or gravity");
  return total;
}

LoadCase load_case(const Reader& reader) {
  LoadCase load;
  reader.object(
      {{"name", [&](const Reader& r) { load.name = r.text(); }},
       {"supports", [&](const Reader& r) { r.list([&](const Reader& s) { load.supports.push_back(support(s)); }); }},
       {"forces", [&](const Reader& r) { r.list([&](const Reader& f) { load.forces.push_back(force(f)); }); }},
       {"unplanned", [&](const Reader& r) { load.unplanned = r.boolean(); }}});
  return load;
}

Json written(Vec3d v) { return Json::array({v.x, v.y, v.z}); }
Json written(const Direction& d) {
  for (const auto& [of, word] : words)
    if (d.of == of) return word;
  return written(d.vector);
}
Json written(const EndShare& end) { return {{"share", end.share}, {"along", written(end.along)}}; }
Json written(const Selection& where) {
  Json json = Json::object();
  if (where.box_mm) json["box_mm"] = Json::array({written(where.box_mm->min), written(where.box_mm->max)});
  for (const HalfSpace& half : where.half_spaces)
    json["half_space"].push_back(Json{{"point_mm", written(half.point_mm)}, {"normal", written(half.normal)}});
  if (where.lowest) json["lowest"] = written(*where.lowest);
  if (where.highest) json["highest"] = written(*where.highest);
  if (where.label) json["label"] = *where.label;
  if (where.painted) json["painted"] = color_text(where.painted->color);
  if (where.seen_from) json["seen_from"] = written(*where.seen_from);
  return json;
}
Json written(const Support& support) {
  Json json{{"where", written(support.where)}};
  if (support.sliding) json["sliding"] = written(*support.sliding);
  return json;
}
Json written(const TotalForce& force) {
  return {{"force_n", force.newton}, {"direction", written(force.direction)}, {"where", written(force.where)}};
}
Json written(const Pressure& force) { return {{"pressure_mpa", force.mpa}, {"where", written(force.where)}}; }
Json written(const Gravity& force) { return {{"gravity", written(force.direction)}}; }

}  // namespace

std::vector<LoadCase> loads_from(const Json& json, const std::string& source) {
  if (json.is_string()) return load_preset(json.get<std::string>());
  const Reader reader(json, "loads", source);
  if (!json.is_array() || json.empty())
    reader.refuse("a list of load cases, or one of the names of `fibrolite recipe --keys`");
  std::vector<LoadCase> cases;
  reader.list([&](const Reader& r) { cases.push_back(load_case(r)); });
  check_loads(cases);
  return cases;
}

Json written(const std::vector<LoadCase>& cases) {
  if (cases.empty()) return load_preset_names().front();
  Json json = Json::array();
  for (const LoadCase& load : cases) {
    Json supports = Json::array(), forces = Json::array();
    for (const Support& support : load.supports) supports.push_back(written(support));
    for (const Force& force : load.forces)
      forces.push_back(std::visit([](const auto& f) { return written(f); }, force));
    json.push_back(Json{{"name", load.name}, {"supports", supports}, {"forces", forces}});
    if (load.unplanned) json.back()["unplanned"] = true;
  }
  return json;
}

}  // namespace fibrolite
