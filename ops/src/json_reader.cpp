// SPDX-License-Identifier: GPL-3.0-or-later
#include "json_reader.h"

#include <algorithm>
#include <cstdint>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"

namespace fibrolite {

void JsonReader::refuse(const std::string& accepts) const {
  const std::string given = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
  throw Error(Code::BadRecipe, key_ + " cannot be " + (given.size() > 60 ? given.substr(0, 57) + "..." : given),
              source_, "use " + accepts);
}

double JsonReader::number() const {
  if (!json_.is_number()) refuse("a number");
  return json_.get<double>();
}

double JsonReader::positive() const {
  if (!(number() > 0)) refuse("a number above 0");
  return number();
}

int JsonReader::count() const {
  if (!json_.is_number_unsigned() || json_.get<std::uint64_t>() > 1000000) refuse("a whole number, 0 or more");
  return json_.get<int>();
}

bool JsonReader::boolean() const {
  if (!json_.is_boolean()) refuse("true or false");
  return json_.get<bool>();
}

std::string JsonReader::text() const {
  if (!json_.is_string()) refuse("a name in quotes");
  return json_.get<std::string>();
}

Rgb JsonReader::color() const {
  const std::string given = json_.is_string() ? json_.get<std::string>() : std::string();
  if (given.size() != 7 || given[0] != '#' || given.find_first_not_of("0123456789abcdefABCDEF", 1) != given.npos)
    refuse("a colour, \"#rrggbb\"");
  const unsigned long value = std::stoul(given.substr(1), nullptr, 16);
  return {static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>((value >> 8) & 255U),
          static_cast<std::uint8_t>(value & 255U)};
}

Vec3d JsonReader::vector(const std::string& accepts) const {
  if (!json_.is_array() || json_.size() != 3) refuse(accepts);
  for (const Json& entry : json_)
    if (!entry.is_number()) refuse(accepts);
  return {json_[0].get<double>(), json_[1].get<double>(), json_[2].get<double>()};
}

Box3d JsonReader::box() const {
  std::vector<Vec3d> corners;
  list([&](const JsonReader& r) { corners.push_back(r.vector()); });
  if (corners.size() != 2) refuse("the least and the greatest corner, [[x, y, z], [x, y, z]]");
  return {corners[0], corners[1]};
}

void JsonReader::object(const Keys& keys) const {
  if (!json_.is_object()) refuse("an object, { ... }");
  for (const auto& item : json_.items()) {
    const std::string& name = item.key();
    const auto known = std::find_if(keys.begin(), keys.end(), [&](const auto& key) { return key.first == name; });
    if (known != keys.end()) {
      known->second(JsonReader(item.value(), std::string(key_).append(".").append(name), source_));
      continue;
    }
    std::vector<std::string> names;
    for (const auto& key : keys) names.push_back(key.first);
    throw Error(Code::BadRecipe, std::string("unknown key ").append(key_).append(".").append(name), source_,
                std::string("did you mean ").append(nearest_name(name, names)).append("?"));
  }
}

void JsonReader::list(const std::function<void(const JsonReader&)>& entry) const {
  if (!json_.is_array()) refuse("a list, [ ... ]");
  for (std::size_t i = 0; i < json_.size(); ++i)
    entry(JsonReader(json_[i], std::string(key_).append("[").append(std::to_string(i)).append("]"), source_));
}

nlohmann::ordered_json written(Vec3d v) { return nlohmann::ordered_json::array({v.x, v.y, v.z}); }
nlohmann::ordered_json written(const Box3d& box) {
  return nlohmann::ordered_json::array({written(box.min), written(box.max)});
}

}  // namespace fibrolite
