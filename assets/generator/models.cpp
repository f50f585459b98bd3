// SPDX-License-Identifier: GPL-3.0-or-later
#include "models.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/realize.h"
#include "fibrolite/shape.h"
#include "fibrolite/surface.h"

namespace fibrolite {
namespace {

/// A limb through balls given by centre and radius.
struct Ball {
  Vec3d center;
  double radius_mm;
};
Shape limb(const std::vector<Ball>& balls, double blend_mm) {
  Shape whole = sphere(balls[0].center, balls[0].radius_mm);
  for (std::size_t i = 1; i < balls.size(); ++i) {
    const Ball &a = balls[i - 1], &b = balls[i];
    whole = smooth_unite(whole, round_cone(a.center, a.radius_mm, b.center, b.radius_mm), blend_mm);
  }
  return whole;
}

/// The limb and its mirror image across the plane y = 0 (axis 1) or x = 0 (axis 0).
Shape pair(std::vector<Ball> balls, double blend_mm, int axis) {
  const Shape one = limb(balls, blend_mm);
  for (Ball& ball : balls) (axis == 0 ? ball.center.x : ball.center.y) *= -1;
  return unite({one, limb(balls, blend_mm)});
}

Shape smooth_subtract(const Shape& a, const Shape& b, double blend_mm) {
  return complement(smooth_unite(complement(a), b, blend_mm));
}

Shape rounded_cuboid(const Box3d& box, double edge_mm) { return offset(cuboid(box.grown(-edge_mm)), edge_mm); }

Shape rounded_cylinder(Vec3d a, Vec3d b, double radius_mm, double edge_mm) {
  const Vec3d inward = edge_mm * normalized(b - a);
  return offset(cylinder(a + inward, b - inward, radius_mm - edge_mm), edge_mm);
}

/// Flat feet: what lies below the ground is cut off.
Shape standing(const Shape& shape) { return intersect({shape, half_space({}, {0, 0, -1})}); }

// A stocky hoofed animal, nose along +x. The legs are about a third of the body's thickness, yet wide enough for
// fibres.
Shape quadruped() {
  Shape body = limb({{{-31, 0, 47}, 13.5}, {{-10, 0, 45}, 14.0}, {{16, 0, 46}, 15.0}}, 4);
  const Shape neck = limb({{{20, 0, 52}, 11}, {{32, 0, 68}, 7.5}}, 2);
  const Shape head = limb({{{33, 0, 71}, 7.2}, {{40, 0, 68.5}, 6.0}, {{49, 0, 63}, 4.6}}, 2);
  const Shape ears = pair({{{31, 4.2, 76}, 2.6}, {{29.5, 5.6, 82.5}, 1.4}}, 0.5, 1);
  const Shape front =
      pair({{{19, 7, 42}, 8.0}, {{20.5, 8, 28}, 6.0}, {{20.5, 8.3, 17}, 5.0}, {{20, 8.5, 7}, 4.6}}, 2, 1);
  const Shape hind =
      pair({{{-32, 7, 44}, 10.5}, {{-27.5, 8, 30}, 7.2}, {{-34, 8.5, 18}, 5.0}, {{-32.5, 8.5, 7}, 4.6}}, 2.5, 1);
  const Shape hooves = unite({pair({{{20, 8.5, 7}, 4.4}, {{21, 8.5, -1}, 6.0}}, 1, 1),
                              pair({{{-32.5, 8.5, 7}, 4.4}, {{-31.5, 8.5, -1}, 6.0}}, 1, 1)});
  const Shape tail = limb({{{-42, 0, 53}, 3.4}, {{-48.5, 0, 46}, 3.0}, {{-51, 0, 34}, 3.0}, {{-51, 0, 24}, 2.0}}, 1.5);
  body = smooth_unite(body, neck, 7);
  body = smooth_unite(body, head, 3.5);
  body = smooth_unite(body, ears, 1.5);
  body = smooth_unite(body, unite({smooth_unite(front, hooves, 1.5), smooth_unite(hind, hooves, 1.5)}), 5);
  return standing(smooth_unite(body, tail, 3));
}

// A lower molar: four cusps round a fossa, two roots that are free from about half the height down.
Shape molar() {
  Shape crown = nothing();
  for (const double sx : {-1.0, 1.0}) {
    for (const double sy : {-1.0, 1.0}) {
      const Shape lobe =
          limb({{{sx * 11, sy * 7, 53}, 10}, {{sx * 13.2, sy * 9.2, 64}, 11}, {{sx * 12, sy * 8.6, 76}, 4.6}}, 2);
      crown = smooth_unite(crown, lobe, 7);
    }
  }
  crown = smooth_unite(crown, round_cone({0, 0, 55}, 15, {0, 0, 62}, 15), 6);
  crown = smooth_subtract(crown, sphere({0, 0, 83}, 11.5), 6);
  crown = smooth_subtract(crown, capsule({-40, 0, 80}, {40, 0, 80}, 3.6), 5);
  crown = smooth_subtract(crown, capsule({0, -40, 80}, {0, 40, 80}, 3.2), 5);
  std::vector<Shape> roots;
  for (const double sx : {-1.0, 1.0}) {
    std::vector<Shape> halves;
    for (const double sy : {-1.0, 1.0}) {  // roots are broader across than along the jaw
      halves.push_back(limb(
          {{{sx * 12, sy * 4.0, 50}, 8.4}, {{sx * 14.2, sy * 3.2, 28}, 6.4}, {{sx * 12.5, sy * 1.0, 4.5}, 4.4}}, 2));
    }
    roots.push_back(smooth_unite(halves[0], halves[1], 4));
  }
  return smooth_unite(crown, unite(roots), 5);
}

// A standing human figure that faces -y, arms held a little away.
Shape figure() {
  const Shape chest = pair({{{6.2, 0.5, 91}, 8.6}, {{4.0, 0, 76}, 7.4}}, 3, 0);
  const Shape hips = pair({{{5.0, 0.5, 66}, 8.2}}, 2, 0);
  const Shape shoulders = capsule({-13.5, 0.5, 95}, {13.5, 0.5, 95}, 5.4);
  const Shape neck = capsule({0, 0.5, 98}, {0, 0, 107}, 4.0);
  const Shape head = limb({{{0, 0.3, 114}, 7.0}, {{0, -1.3, 109.5}, 5.2}}, 2);
  const Shape arms = pair({{{14.5, 0.5, 95}, 5.2},
                           {{23, 1.5, 76}, 4.2},
                           {{23.7, 1.0, 73}, 4.3},
                           {{29.5, -2.5, 57}, 3.3},
                           {{31.5, -3.5, 51}, 3.9},
                           {{32.5, -4.2, 47}, 2.6}},
                          1.5, 0);
  const Shape legs =
      pair({{{7.2, 0.5, 62}, 8.2}, {{8.8, -0.5, 36}, 5.8}, {{9.4, 1.2, 25}, 5.7}, {{10, 0.8, 7}, 4.1}}, 2.5, 0);
  const Shape feet = pair({{{10, 1.6, 3.2}, 4.4}, {{11.2, -10, 1.6}, 4.2}}, 1, 0);
  Shape body = smooth_unite(chest, hips, 6);
  body = smooth_unite(body, shoulders, 5);
  body = smooth_unite(body, neck, 4);
  body = smooth_unite(body, head, 2);
  body = smooth_unite(body, arms, 3);
  body = smooth_unite(body, smooth_unite(legs, feet, 3), 4);
  return standing(body);
}

// A plate with two screw bosses that carries a bearing ring on three struts.
Shape bracket() {
  Shape body = rounded_cuboid({{-52, -30, -6}, {52, 30, 9}}, 3);
  for (const double sx : {-1.0, 1.0}) {
    body = smooth_unite(body, rounded_cylinder({sx * 38, 0, 0}, {sx * 38, 0, 17}, 11.5, 1.2), 3);
  }
  Shape hub = rounded_cylinder({0, 0, 62}, {0, 0, 80}, 20, 1.5);
  const std::array<Vec2d, 3> feet{{{0, 20}, {-19, -15}, {19, -15}}};
  for (const Vec2d& foot : feet) {
    const double inward = 15 / norm(foot);
    hub = smooth_unite(hub, capsule({foot.x, foot.y, 4}, {inward * foot.x, inward * foot.y, 68}, 5.2), 2.5);
  }
  body = smooth_unite(body, hub, 4);
  body = smooth_subtract(body, cylinder({0, 0, 50}, {0, 0, 90}, 11), 1.5);
  for (const double sx : {-1.0, 1.0}) {
    body = smooth_subtract(body, cylinder({sx * 38, 0, -20}, {sx * 38, 0, 30}, 5), 1.2);
  }
  return standing(body);
}

Shape cylinder_on_box() { return unite({cuboid({{-20, -20, 0}, {20, 20, 20}}), cylinder({0, 0, 10}, {0, 0, 70}, 8)}); }

// A round bar that rises, bends by 60 degrees about an axis along y and runs on straight. The arc laps half a
// millimetre over the straight ends (0.003 mm off their surface): bodies that only touch leave a sheet of zeros between
// them.
Shape bent_tube() {
  constexpr double radius = 9, bend = 40, rise = 32, run = 32, lap = 0.5;
  constexpr double sine = 0.86602540378443865, cosine = 0.5;  // of 60 degrees
  const Vec3d middle{bend, 0, rise};                          // of the bend's circle
  const Vec3d end = middle + Vec3d{-bend * cosine, 0, bend * sine};
  const Vec3d direction{sine, 0, cosine};
  const Shape arc =
      intersect({torus(frame_along(middle, {0, 1, 0}), bend, radius), half_space({0, 0, rise - lap}, {0, 0, -1}),
                 half_space(end + lap * direction, direction)});
  return unite({cylinder({0, 0, 0}, {0, 0, rise}, radius), arc, cylinder(end, end + run * direction, radius)});
}

Shape y_branch() {
  const Shape arms = unite({capsule({0, 0, 44}, {-32, 0, 90}, 8), capsule({0, 0, 44}, {32, 0, 90}, 8)});
  return standing(smooth_unite(capsule({0, 0, -20}, {0, 0, 44}, 9.5), arms, 5));
}

Shape ring() { return torus(Frame{}, 36, 9); }

struct Model {
  const char* name;
  Shape (*shape)();
  Box3d region;
  double voxel_mm;
  std::optional<Vec3d> size_mm;  ///< Stretched to this box.
  double longest_mm = 0;         ///< Or scaled to this longest side; 0: as it is.
};

const std::array<Model, 8>& models() {
  static const std::array<Model, 8> list{{
      {"quadruped", quadruped, {{-60, -26, -4}, {60, 26, 90}}, 0.85, {}, 100},
      {"molar", molar, {{-32, -28, -6}, {32, 28, 90}}, 1.0, Vec3d{50, 40, 80}},
      {"figure", figure, {{-42, -22, -4}, {42, 18, 126}}, 0.8, {}, 120},
      {"bracket", bracket, {{-58, -36, -4}, {58, 36, 86}}, 1.1, {}, 0},
      {"cylinder_on_box", cylinder_on_box, {{-25, -25, -5}, {25, 25, 75}}, 0.8, {}, 0},
      {"bent_tube", bent_tube, {{-14, -14, -4}, {70, 14, 96}}, 0.8, {}, 0},
      {"y", y_branch, {{-46, -16, -4}, {46, 16, 104}}, 0.8, {}, 0},
      {"torus", ring, {{-50, -50, -14}, {50, 50, 14}}, 0.9, {}, 0},
  }};
  return list;
}

/// Onto the z axis and the plane z = 0, at the wanted size.
void place(Mesh& mesh, const Model& model) {
  const Box3d box = bounds(mesh);
  const Vec3d foot{box.center().x, box.center().y, box.min.z}, size = box.size();
  Vec3d scale{1, 1, 1};
  if (model.size_mm) scale = {model.size_mm->x / size.x, model.size_mm->y / size.y, model.size_mm->z / size.z};
  if (model.longest_mm > 0) scale = (model.longest_mm / box.longest_side()) * scale;
  for (Vec3f& vertex : mesh.vertices) {
    const Vec3d p = to_double(vertex) - foot;
    vertex = to_float({p.x * scale.x, p.y * scale.y, p.z * scale.z});
  }
}

}  // namespace

std::vector<std::string> bundled_model_names() {
  std::vector<std::string> names;
  for (const Model& model : models()) names.emplace_back(model.name);
  return names;
}

Mesh bundled_model(const std::string& name, const Context& context) {
  const auto found = std::find_if(models().begin(), models().end(), [&](const Model& m) { return m.name == name; });
  if (found == models().end()) throw Error(Code::BadInput, "no bundled model of this name", name);
  const Solid solid = realize(found->shape(), found->region, Grid{found->voxel_mm, 3}, context.part(0, 0.6, "voxels"));
  Mesh mesh = surface(solid, {}, context.part(0.6, 1, "surface"));
  place(mesh, *found);
  return mesh;
}

}  // namespace fibrolite
