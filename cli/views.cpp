// SPDX-License-Identifier: GPL-3.0-or-later
#include "views.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>

#include "exit_codes.h"
#include "fibrolite/error.h"
#include "options.h"

namespace fibrolite::cli {
namespace {

constexpr const char* accepted = "cut, whole, part:ID, joint:NUMBER or joint:NUMBER:back";

struct View {
  std::string what;  // cut, whole, part, joint
  std::size_t number = 0;
  bool back = false;
};

std::optional<View> parsed(const std::string& text) {
  if (text == "cut" || text == "whole") return View{text, 0, false};
  View view;
  const auto colon = text.find(':');
  view.what = text.substr(0, colon);
  if (colon == std::string::npos || (view.what != "part" && view.what != "joint")) return std::nullopt;
  std::string number = text.substr(colon + 1);
  if (constexpr std::string_view back = ":back"; view.what == "joint" && number.ends_with(back)) {
    view.back = true;
    number.resize(number.size() - back.size());
  }
  if (number.empty() || number.size() > 4 || number.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  view.number = std::stoul(number);
  return view;
}

[[noreturn]] void not_there(const View& view, std::size_t count) {
  throw Error(Code::BadRecipe,
              std::string("there is no ").append(view.what).append(" ").append(std::to_string(view.number)), "--view",
              count == 0 ? "this model has none"
                         : std::string("use ").append(view.what).append(":0 to ").append(std::to_string(count - 1)));
}

}  // namespace

void add_pictures(CLI::App& command, PictureOptions& options) {
  command.add_option("--picture", options.files, "Picture of the solid; with --view as often as wanted")
      ->type_name("FILE.png")
      ->allow_extra_args(false)
      ->each([](const std::string& given) { require_ending("--picture", given, {".png"}); });
  command
      .add_option("--view", options.views,
                  std::string("What a picture shows, in their order: ").append(accepted).append(" (default: cut)"))
      ->type_name("VIEW")
      ->allow_extra_args(false)
      ->each([](const std::string& given) {
        if (!parsed(given))
          throw UsageError("there is no view '" + given + "'", "--view", std::string("use ") + accepted);
      });
}

PictureParams picture_params(const std::string& text, const Hybrid& hybrid, const Recipe& recipe) {
  PictureParams params;
  params.up = recipe.verify.up;
  const View view = parsed(text).value();
  params.cut = view.what != "whole";
  if (view.what == "part") {
    if (view.number >= hybrid.parts.parts.size()) not_there(view, hybrid.parts.parts.size());
    const Part& part = hybrid.parts.parts[view.number];
    if (part.kind() == Kind::Column) {  // across the fibres, in the middle
      const std::vector<Vec3d>& line = part.axis().centre_line();
      const Vec3d middle = line[line.size() / 2], along = part.axis().tangent(middle);
      params.cut_point = middle;
      params.cut_normal = dot(along, params.up) < 0 ? -along : along;
      params.focus_mm = 0.8 * part.diameter_mm();
    } else {
      params.cut_point = part.centroid_mm();
      params.focus_mm = 0.5 * part.bounds_mm().longest_side();
    }
  } else if (view.what == "joint") {
    if (view.number >= hybrid.joints.size()) not_there(view, hybrid.joints.size());
    const Interface& at = hybrid.interfaces[view.number];
    const Vec3d towards = view.back ? -at.frame.z : at.frame.z;
    // Just off the layer, so that it is seen with what stands on it.
    const JointParams joint = joint_params(recipe);
    params.cut_point = at.frame.origin + (0.5 * joint.layer_mm + 0.5 * joint.column_mm) * towards;
    params.cut_normal = towards;
    params.focus_mm = 1.15 * at.radius_mm;
  }
  return params;
}

void note_colors(Report& report) {
  for (PartReport& part : report.parts) {
    const bool column = part.kind == "column";
    part.color_name = color_name(part.id, column);
    part.color_hex = hex(part_color(part.id, column));
  }
}

}  // namespace fibrolite::cli
