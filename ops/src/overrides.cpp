// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/overrides.h"

#include <cmath>
#include <set>
#include <string>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"

namespace fibrolite {
namespace {

template <class... Cases>
struct Match : Cases... {
  using Cases::operator()...;
};

[[noreturn]] void refuse(const char* list, std::size_t entry, const std::string& what, const std::string& attempt) {
  throw Error(Code::BadRecipe, what,
              std::string("partition.overrides.").append(list).append("[").append(std::to_string(entry)).append("]"),
              attempt);
}

bool finite(Vec3d v) { return std::isfinite(norm(v)); }

Box3d box_of(const KeptRegion& region) {
  return std::visit(Match{[](const Box3d& box) { return box; },
                          [](const Cylinder& c) {
                            Box3d box;
                            box.include(c.from_mm);
                            box.include(c.to_mm);
                            return box.grown(c.diameter_mm / 2);
                          }},
                    region);
}

}  // namespace

const char* name(PartInfill infill) {
  switch (infill) {
    case PartInfill::Mfs:
      return "mfs";
    case PartInfill::Tcs:
      return "tcs";
    case PartInfill::Solid:
      return "solid";
    case PartInfill::Gyroid:
      return "gyroid";
    case PartInfill::Shell:
      return "shell";
  }
  return "";
}

void check_overrides(const Overrides& overrides) {
  std::set<int> named;
  for (std::size_t i = 0; i < overrides.parts.size(); ++i) {
    if (overrides.parts[i].id < 0) refuse("parts", i, "a part's id is 0 or more", "see fibrolite partition");
    if (!named.insert(overrides.parts[i].id).second) refuse("parts", i, "this part is named twice", "leave one out");
  }
  for (std::size_t i = 0; i < overrides.cuts.size(); ++i) {
    const auto& cut = overrides.cuts[i];
    if (!finite(cut.point_mm) || !finite(cut.normal) || !(norm(cut.normal) > 0))
      refuse("cuts", i, "a cut needs a point and a normal with a length",
             R"(e.g. {"point_mm": [0, 0, 5], "normal": [0, 0, 1]})");
    if (!std::isfinite(cut.radius_mm)) refuse("cuts", i, "the radius is no number", "leave it out for a plane");
  }
  for (std::size_t i = 0; i < overrides.solid.size(); ++i) {
    std::visit(Match{[&](const Box3d& box) {
                       const Vec3d size = box.size();
                       if (!finite(box.min) || !finite(box.max) || !(size.x > 0 && size.y > 0 && size.z > 0))
                         refuse("solid", i, "the box is empty", "give its least corner first");
                     },
                     [&](const Cylinder& c) {
                       if (!finite(c.from_mm) || !finite(c.to_mm) || !(norm(c.to_mm - c.from_mm) > 0) ||
                           !(c.diameter_mm > 0) || !std::isfinite(c.diameter_mm))
                         refuse("solid", i, "the cylinder has no volume", "give two ends and a diameter above 0");
                     }},
               overrides.solid[i]);
  }
}

void check_overrides(const Overrides& overrides, const Box3d& model) {
  const auto text = [](Vec3d p) {
    std::string list;
    for (const double value : {p.x, p.y, p.z}) list.append(list.empty() ? "(" : ", ").append(number_text(value, 4));
    return list.append(")");
  };
  for (std::size_t i = 0; i < overrides.solid.size(); ++i) {
    const Box3d box = box_of(overrides.solid[i]);
    for (int axis = 0; axis < 3; ++axis)
      if (box.min[axis] > model.max[axis] || box.max[axis] < model.min[axis])
        refuse("solid", i, "this region lies beside the model",
               std::string("the model reaches from ")
                   .append(text(model.min))
                   .append(" to ")
                   .append(text(model.max))
                   .append(" mm"));
  }
}

Shape kept_solid(const Overrides& overrides) {
  std::vector<Shape> shapes;
  for (const KeptRegion& region : overrides.solid) {
    shapes.push_back(
        std::visit(Match{[](const Box3d& box) { return cuboid(box); },
                         [](const Cylinder& c) { return cylinder(c.from_mm, c.to_mm, c.diameter_mm / 2); }},
                   region));
  }
  return unite(std::move(shapes));
}

}  // namespace fibrolite
