// SPDX-License-Identifier: GPL-3.0-or-later
#include "loads_json.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "json_reader.h"

namespace fibrolite {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::pair<Direction::Of, const char*> words[] = {
    {Direction::Of::Up, "up"}, {Direction::Of::Down, "down"}, {Direction::Of::Slanted, "slanted"}};

using Reader = JsonReader;

Direction direction(const Reader& reader) {
  for (const auto& [of, word] : words)
    if (reader.is(word)) return {of, {}};
  return {Direction::Of::World, reader.vector("[x, y, z] or \"up\", \"down\", \"slanted\"")};
}

EndShare end_share(const Reader& reader) {
  EndShare end;
  reader.object({{"share", [&](const Reader& r) { end.share = r.number(); }},
                 {"along", [&](const Reader& r) { end.along = direction(r); }}});
  return end;
}

HalfSpace half_space(const Reader& reader) {
  HalfSpace half;
  reader.object({{"point_mm", [&](const Reader& r) { half.point_mm = r.vector(); }},
                 {"normal", [&](const Reader& r) { half.normal = r.vector(); }}});
  return half;
}

Selection selection(const Reader& reader) {
  Selection where;
  reader.object({{"box_mm", [&](const Reader& r) { where.box_mm = r.box(); }},
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
                 {"seen_from", [&](const Reader& r) { where.seen_from = direction(r); }}});
  return where;
}

Support support(const Reader& reader) {
  Support support;
  reader.object({{"where", [&](const Reader& r) { support.where = selection(r); }},
                 {"sliding", [&](const Reader& r) { support.sliding = direction(r); }}});
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
    reader.object({{"gravity", [&](const Reader& r) { gravity.direction = direction(r); }}});
    return gravity;
  }
  TotalForce total;
  // The other two are named here for the sake of "did you mean".
  reader.object({{"force_n", [&](const Reader& r) { total.newton = r.number(); }},
                 {"direction", [&](const Reader& r) { total.direction = direction(r); }},
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

Json written(const Direction& d) {
  for (const auto& [of, word] : words)
    if (d.of == of) return word;
  return written(d.vector);
}
Json written(const EndShare& end) { return {{"share", end.share}, {"along", written(end.along)}}; }
Json written(const Selection& where) {
  Json json = Json::object();
  if (where.box_mm) json["box_mm"] = written(*where.box_mm);
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
