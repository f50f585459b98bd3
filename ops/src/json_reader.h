// SPDX-License-Identifier: GPL-3.0-or-later
// Values of a recipe that are more than one number, read strictly.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/mesh.h"

namespace fibrolite {

/// A value and where it stands. What it does not accept is an Error BadRecipe that names the place.
class JsonReader {
 public:
  using Json = nlohmann::ordered_json;

  /// All must outlive the reader but `key`. `source`: where the text comes from.
  JsonReader(const Json& json, std::string key, const std::string& source)
      : json_(json), key_(std::move(key)), source_(source) {}

  [[noreturn]] void refuse(const std::string& accepts) const;
  [[nodiscard]] double number() const;
  [[nodiscard]] double positive() const;
  [[nodiscard]] int count() const;
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] std::string text() const;
  [[nodiscard]] Rgb color() const;
  [[nodiscard]] Vec3d vector(const std::string& accepts = "[x, y, z]") const;
  /// The least and the greatest corner.
  [[nodiscard]] Box3d box() const;
  /// Calls the reader of each key that is there; the others keep what they are.
  using Keys = std::vector<std::pair<std::string, std::function<void(const JsonReader&)>>>;
  void object(const Keys& keys) const;
  void list(const std::function<void(const JsonReader&)>& entry) const;
  [[nodiscard]] bool has(const char* name) const { return json_.is_object() && json_.contains(name); }
  [[nodiscard]] bool is(const char* word) const { return json_ == word; }
  [[nodiscard]] bool is_list() const { return json_.is_array(); }

 private:
  const Json& json_;
  std::string key_;
  const std::string& source_;
};

[[nodiscard]] nlohmann::ordered_json written(Vec3d v);
[[nodiscard]] nlohmann::ordered_json written(const Box3d& box);

}  // namespace fibrolite
