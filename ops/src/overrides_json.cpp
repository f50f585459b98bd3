// SPDX-License-Identifier: GPL-3.0-or-later
#include "overrides_json.h"

#include "json_reader.h"

namespace fibrolite {
namespace {

using Json = nlohmann::ordered_json;
using Reader = JsonReader;

PartInfill infill(const Reader& reader) {
  for (const PartInfill one :
       {PartInfill::Mfs, PartInfill::Tcs, PartInfill::Solid, PartInfill::Gyroid, PartInfill::Shell})
    if (reader.is(name(one))) return one;
  reader.refuse("\"mfs\", \"tcs\", \"solid\", \"gyroid\" or \"shell\"");
}

Overrides::PartChoice part_choice(const Reader& reader) {
  Overrides::PartChoice choice;
  reader.object({{"id", [&](const Reader& r) { choice.id = r.count(); }},
                 {"infill", [&](const Reader& r) { choice.infill = infill(r); }}});
  if (!reader.has("id") || !reader.has("infill")) reader.refuse(R"(both: {"id": 1, "infill": "solid"})");
  return choice;
}

Overrides::Plane plane(const Reader& reader) {
  Overrides::Plane cut;
  reader.object({{"point_mm", [&](const Reader& r) { cut.point_mm = r.vector(); }},
                 {"normal", [&](const Reader& r) { cut.normal = r.vector(); }},
                 {"radius_mm", [&](const Reader& r) { cut.radius_mm = r.number(); }}});
  if (!reader.has("point_mm") || !reader.has("normal"))
    reader.refuse(R"(both: {"point_mm": [0, 0, 5], "normal": [0, 0, 1]})");
  return cut;
}

Cylinder cylinder(const Reader& reader) {
  Cylinder c;
  reader.object({{"from_mm", [&](const Reader& r) { c.from_mm = r.vector(); }},
                 {"to_mm", [&](const Reader& r) { c.to_mm = r.vector(); }},
                 {"diameter_mm", [&](const Reader& r) { c.diameter_mm = r.positive(); }}});
  return c;
}

KeptRegion region(const Reader& reader) {
  KeptRegion found;
  reader.object({{"box_mm", [&](const Reader& r) { found = r.box(); }},
                 {"cylinder", [&](const Reader& r) { found = cylinder(r); }}});
  if (reader.has("box_mm") == reader.has("cylinder")) reader.refuse("one of box_mm and cylinder");
  return found;
}

Json written(const KeptRegion& region) {
  if (const auto* box = std::get_if<Box3d>(&region)) return Json{{"box_mm", written(*box)}};
  const auto& c = std::get<Cylinder>(region);
  return Json{
      {"cylinder", Json{{"from_mm", written(c.from_mm)}, {"to_mm", written(c.to_mm)}, {"diameter_mm", c.diameter_mm}}}};
}

}  // namespace

Overrides overrides_from(const Json& json, const std::string& source) {
  Overrides result;
  const auto each = [](auto& list, auto entry) {
    return [&list, entry](const Reader& r) { r.list([&](const Reader& one) { list.push_back(entry(one)); }); };
  };
  const Reader reader(json, "partition.overrides", source);
  reader.object({{"parts", each(result.parts, part_choice)},
                 {"cuts", each(result.cuts, plane)},
                 {"solid", each(result.solid, region)}});
  check_overrides(result);
  return result;
}

Json written(const Overrides& overrides) {
  Json parts = Json::array(), cuts = Json::array(), solid = Json::array();
  for (const auto& choice : overrides.parts) parts.push_back(Json{{"id", choice.id}, {"infill", name(choice.infill)}});
  for (const auto& cut : overrides.cuts) {
    cuts.push_back(Json{{"point_mm", written(cut.point_mm)}, {"normal", written(cut.normal)}});
    if (cut.radius_mm != 0) cuts.back()["radius_mm"] = cut.radius_mm;
  }
  for (const KeptRegion& region : overrides.solid) solid.push_back(written(region));
  return {{"parts", parts}, {"cuts", cuts}, {"solid", solid}};
}

}  // namespace fibrolite
