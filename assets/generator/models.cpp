// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundled_models.h"

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

/// A ball that a limb passes through.
struct Ball {
  Vec3d center;
  double radius_mm;
};
Ball operator+(Ball a, Ball b) { return {a.center + b.center, a.radius_mm + b.radius_mm}; }
Ball operator*(double s, Ball a) { return {s * a.center, s * a.radius_mm}; }

/// The hull of balls that glide along a Catmull-Rom spline, in centre and radius, through those given.
Shape limb(const std::vector<Ball>& balls) {
  constexpr int steps = 8;
  if (balls.size() == 1) return sphere(balls[0].center, balls[0].radius_mm);
  std::vector<Shape> pieces;
  Ball last = balls[0];
  for (std::size_t i = 0; i + 1 < balls.size(); ++i) {
    const Ball p1 = balls[i], p2 = balls[i + 1];
    const Ball p0 = i > 0 ? balls[i - 1] : 2.0 * p1 + -1.0 * p2;
    const Ball p3 = i + 2 < balls.size() ? balls[i + 2] : 2.0 * p2 + -1.0 * p1;
    for (int k = 1; k <= steps; ++k) {
      const double t = static_cast<double>(k) / steps, t2 = t * t, t3 = t2 * t;
      const Ball next =
          0.5 * ((-t + 2 * t2 - t3) * p0 + (2 - 5 * t2 + 3 * t3) * p1 + (t + 4 * t2 - 3 * t3) * p2 + (t3 - t2) * p3);
      pieces.push_back(round_cone(last.center, last.radius_mm, next.center, next.radius_mm));
      last = next;
    }
  }
  return unite(std::move(pieces));
}

/// The limb and its mirror image in x (axis 0) or y (axis 1), blended where they meet.
Shape pair(std::vector<Ball> balls, int axis, double blend_mm = 0) {
  const Shape one = limb(balls);
  for (Ball& ball : balls) (axis == 0 ? ball.center.x : ball.center.y) *= -1;
  return smooth_unite(one, limb(balls), blend_mm);
}

Shape smooth_subtract(const Shape& a, const Shape& b, double blend_mm) {
  return complement(smooth_unite(complement(a), b, blend_mm));
}

Shape rounded_cuboid(const Box3d& box, double edge_mm) { return offset(cuboid(box.grown(-edge_mm)), edge_mm); }

Shape rounded_cylinder(Vec3d a, Vec3d b, double radius_mm, double edge_mm) {
  const Vec3d inward = edge_mm * normalized(b - a);
  return offset(cylinder(a + inward, b - inward, radius_mm - edge_mm), edge_mm);
}

/// Flat feet with a soft edge: what lies below the ground is cut off.
Shape standing(const Shape& shape) { return smooth_subtract(shape, half_space({}, {0, 0, 1}), 2); }

// A hoofed animal, nose along +x. Legs, tail and ears are about equally thick, a quarter of the body, so that the legs
// stand out by their diameter, yet wide enough for fibres.
Shape quadruped() {
  const Shape trunk = limb({{{-31, 0, 48}, 14.0}, {{-10, 0, 46.5}, 14.4}, {{14, 0, 47}, 15.2}});
  const Shape neck = limb({{{14, 0, 49}, 12.5}, {{23, 0, 59}, 9.4}, {{31, 0, 70}, 7.2}, {{33, 0, 74}, 6.6}});
  const Shape head = limb({{{32, 0, 74}, 6.8}, {{40, 0, 70.5}, 6.0}, {{48.5, 0, 64.5}, 5.0}});
  const Shape ears = pair({{{31.5, 4.0, 77}, 3.0}, {{29.8, 5.6, 82}, 2.9}, {{29.0, 6.2, 85}, 2.4}}, 1);
  const Shape front =
      pair({{{17, 6.5, 45}, 8.5}, {{19.5, 8.2, 33}, 5.2}, {{20.5, 9.0, 20}, 4.0}, {{20, 9.2, 5}, 3.9}}, 1);
  const Shape hind =
      pair({{{-31, 6.5, 47}, 10.5}, {{-29.5, 8.2, 34}, 6.2}, {{-34, 9.0, 20}, 4.1}, {{-32.5, 9.2, 5}, 3.9}}, 1);
  std::vector<Shape> hooves;
  for (const double x : {20.5, -32.0}) {
    for (const double y : {-9.2, 9.2}) hooves.push_back(rounded_cylinder({x, y, 0}, {x, y, 5}, 4.5, 1.2));
  }
  const Shape tail = limb({{{-41, 0, 55}, 4.0}, {{-48, 0, 50}, 3.4}, {{-51.5, 0, 39}, 3.2}, {{-52, 0, 26}, 2.8}});
  Shape body = smooth_unite(trunk, neck, 5);
  body = smooth_unite(body, head, 2.5);
  body = smooth_unite(body, ears, 1.5);
  const Shape legs = smooth_unite(unite({front, hind}), unite(hooves), 2);
  body = smooth_unite(body, legs, 4);
  return smooth_unite(body, tail, 3);
}

// A lower molar: four cusps round a fossa, two roots that are free from about half the height down.
Shape molar() {
  Shape crown = round_cone({0, 0, 54}, 15, {0, 0, 63}, 16);
  for (const double sx : {-1.0, 1.0}) {
    for (const double sy : {-1.0, 1.0}) {
      const Shape lobe = limb({{{sx * 10, sy * 6.5, 49}, 8.6},
                               {{sx * 13, sy * 9, 59}, 10.6},
                               {{sx * 13, sy * 9, 68}, 9},
                               {{sx * 12, sy * 8.4, 75}, 5}});
      crown = smooth_unite(crown, lobe, 6);
    }
  }
  crown = smooth_subtract(crown, sphere({0, 0, 84}, 12), 7);
  crown = smooth_subtract(crown, capsule({-40, 0, 81.5}, {40, 0, 81.5}, 3.5), 6);
  crown = smooth_subtract(crown, capsule({0, -40, 81.5}, {0, 40, 81.5}, 3.2), 6);
  std::vector<Shape> roots;
  for (const double sx : {-1.0, 1.0}) {  // broader across the jaw than along it
    roots.push_back(pair({{{sx * 11.5, 4.2, 52}, 8.0},
                          {{sx * 13.4, 3.6, 36}, 6.6},
                          {{sx * 13.8, 2.6, 20}, 5.6},
                          {{sx * 12, 1.0, 4}, 4.0}},
                         1, 4));
  }
  return smooth_unite(crown, unite(roots), 5);
}

// A standing human figure that faces -y, arms held a little away.
Shape figure() {
  const Shape chest =
      pair({{{6.4, 0.6, 92}, 7.8}, {{5.4, 0.2, 82}, 7.4}, {{4.4, 0.4, 73}, 6.8}, {{5.0, 0.8, 65}, 7.6}}, 0, 9);
  const Shape shoulders =
      limb({{{-14.6, 0.8, 95.0}, 4.6}, {{-7, 0.4, 97}, 4.8}, {{7, 0.4, 97}, 4.8}, {{14.6, 0.8, 95.0}, 4.6}});
  const Shape neck = capsule({0, 0.8, 98}, {0, 0, 108}, 3.7);
  const Shape head = limb({{{0, 0.6, 114.0}, 6.4}, {{0, -0.6, 110.5}, 5.6}, {{0, -1.8, 107.6}, 4.0}});
  const Shape arms = pair({{{15.4, 0.8, 95}, 4.8},
                           {{20, 1.4, 85}, 4.5},
                           {{24, 1.2, 74}, 3.8},
                           {{27.4, -0.6, 65}, 3.8},
                           {{30.2, -2.6, 56}, 2.9},
                           {{31.8, -3.8, 50.5}, 3.5},
                           {{32.8, -4.8, 45.5}, 2.4}},
                          0);
  const Shape legs = pair({{{6.8, 0.8, 63}, 7.6},
                           {{8.0, 0.2, 50}, 6.7},
                           {{9.0, -0.2, 35}, 5.3},
                           {{9.4, 1.2, 26}, 5.5},
                           {{10, 1.2, 13}, 4.1},
                           {{10.2, 1.2, 4}, 3.9}},
                          0);
  const Shape feet = pair({{{10.2, 2.4, 2.6}, 4.0}, {{10.8, -4, 2.4}, 3.8}, {{11.6, -11, 1.2}, 3.6}}, 0);
  Shape body = smooth_unite(chest, shoulders, 6);
  body = smooth_unite(body, neck, 4);
  body = smooth_unite(body, head, 2);
  body = smooth_unite(body, arms, 3);
  body = smooth_unite(body, smooth_unite(legs, feet, 3), 4);
  return standing(body);
}

// A thick plate with two screw bosses that carries a bearing ring on three struts, half as thick as plate and ring.
Shape bracket() {
  Shape body = rounded_cuboid({{-52, -30, -6}, {52, 30, 16}}, 3);
  for (const double sx : {-1.0, 1.0}) {
    body = smooth_unite(body, rounded_cylinder({sx * 36, 0, 0}, {sx * 36, 0, 22}, 14, 1.5), 3);
  }
  Shape hub = rounded_cylinder({0, 0, 64}, {0, 0, 82}, 23, 2);
  const std::array<Vec2d, 3> feet{{{0, 21}, {-18, -14}, {18, -14}}};
  for (const Vec2d& foot : feet) {
    const double inward = 16 / norm(foot);
    hub = smooth_unite(hub, capsule({foot.x, foot.y, 10}, {inward * foot.x, inward * foot.y, 70}, 3.9), 2);
  }
  body = smooth_unite(body, hub, 4);
  body = smooth_subtract(body, cylinder({0, 0, 50}, {0, 0, 100}, 9), 2.5);
  for (const double sx : {-1.0, 1.0}) {
    body = smooth_subtract(body, cylinder({sx * 36, 0, -20}, {sx * 36, 0, 40}, 4), 1.2);
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
  const Vec3d tip = end + run * direction;
  const Shape bar =
      unite({cylinder({0, 0, -10}, {0, 0, rise}, radius), arc, cylinder(end, tip + 10 * direction, radius)});
  return standing(smooth_subtract(bar, half_space(tip, -direction), 2));
}

Shape y_branch() {
  const Shape arms = unite({capsule({0, 0, 44}, {-32, 0, 90}, 8), capsule({0, 0, 44}, {32, 0, 90}, 8)});
  return standing(smooth_unite(capsule({0, 0, -20}, {0, 0, 44}, 9.5), arms, 5));
}

/// On its edge, so that a load from above runs along it.
Shape ring() { return torus(frame_along({}, {0, 1, 0}), 36, 9); }

/// Bulky from every side: its shape says nothing of where a load runs.
Shape rounded_box() { return rounded_cuboid({{-20, -20, 0}, {20, 20, 40}}, 3); }

struct Model {
  const char* name;
  Shape (*shape)();
  Box3d region;
  double voxel_mm;
  std::optional<Vec3d> size_mm;  ///< Stretched to this box.
  double longest_mm = 0;         ///< Or scaled to this longest side; 0: as it is.
};

const std::array<Model, 9>& models() {
  static const std::array<Model, 9> list{{
      {"quadruped", quadruped, {{-60, -26, -4}, {60, 26, 90}}, 0.85, {}, 100},
      {"molar", molar, {{-32, -28, -6}, {32, 28, 90}}, 1.0, Vec3d{50, 40, 80}},
      {"figure", figure, {{-42, -22, -4}, {42, 18, 126}}, 0.8, {}, 120},
      {"bracket", bracket, {{-58, -36, -4}, {58, 36, 88}}, 1.05, {}, 0},
      {"cylinder_on_box", cylinder_on_box, {{-25, -25, -5}, {25, 25, 75}}, 0.65, {}, 0},
      {"bent_tube", bent_tube, {{-14, -14, -4}, {70, 14, 96}}, 0.8, {}, 0},
      {"y", y_branch, {{-46, -16, -4}, {46, 16, 104}}, 0.8, {}, 0},
      {"torus", ring, {{-50, -14, -50}, {50, 14, 50}}, 0.9, {}, 0},
      {"rounded_box", rounded_box, {{-25, -25, -5}, {25, 25, 45}}, 0.8, {}, 0},
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
  // Plain vertices: moved ones would stand proud of the flat faces along sharp edges.
  Mesh mesh = surface(solid, {.keep_volume = false}, context.part(0.6, 1, "surface"));
  place(mesh, *found);
  return mesh;
}

}  // namespace fibrolite
