// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/joint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "plane_image.h"
#include "support_columns.h"

namespace fibrolite {
namespace {

constexpr double max_section_px = 2048;

/// A section image made a solid.
class Extruded : public Shape::Function {
 public:
  /// Samples with a Lipschitz constant, plus what bilinear values can add at both ends (0.71 pixel each).
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Vec3f c = to_float(box.center());
    float value = 0;
    evaluate({&c.x, &c.y, &c.z, 1}, &value);
    const auto reach = static_cast<float>(lipschitz_ * (0.5 * norm(box.size()) + 1.5 * pixel_mm_));
    return {value - reach, value + reach};
  }
  [[nodiscard]] double lipschitz() const override { return lipschitz_ * std::sqrt(2.0); }

 protected:
  /// `lipschitz`: of the values, if they were not interpolated.
  Extruded(const Layer& layer, double lipschitz)
      : image_(layer.distance_mm), corner_(layer.origin_mm), pixel_mm_(layer.pixel_mm), lipschitz_(lipschitz) {}

  FloatImage image_;
  Vec2d corner_;
  double pixel_mm_, lipschitz_;
};

/// The layer's distance in the frame's plane, half the thickness to either side.
class Slab final : public Extruded {
 public:
  Slab(const Layer& layer, const Frame& frame, double thickness_mm, double lipschitz)
      : Extruded(layer, lipschitz), frame_(frame), half_(static_cast<float>(thickness_mm / 2)) {}

  void evaluate(const PointBlock& block, float* out) const override {
    const Vec3f o = to_float(frame_.origin), ux = to_float(frame_.x), uy = to_float(frame_.y), uz = to_float(frame_.z);
    const auto cx = static_cast<float>(corner_.x), cy = static_cast<float>(corner_.y);
    const auto pixel = static_cast<float>(pixel_mm_), per_pixel = 1 / pixel;
    const auto right = static_cast<float>(image_.width - 1), bottom = static_cast<float>(image_.height - 1);
    for (int i = 0; i < block.count; ++i) {
      const float dx = block.x[i] - o.x, dy = block.y[i] - o.y, dz = block.z[i] - o.z;
      const float px = (dx * ux.x + dy * ux.y + dz * ux.z - cx) * per_pixel;
      const float py = (dx * uy.x + dy * uy.y + dz * uy.z - cy) * per_pixel;
      const float height = std::abs(dx * uz.x + dy * uz.y + dz * uz.z) - half_;
      // Beyond the image, whose rim is outside the layer, the way back to the image counts.
      const float ox = px - std::clamp(px, 0.F, right), oy = py - std::clamp(py, 0.F, bottom);
      const float beyond = std::sqrt(ox * ox + oy * oy) * pixel;
      out[i] = std::max({height, bilinear(image_, px, py), beyond > 0 ? beyond : -far_mm});
    }
  }

 private:
  Frame frame_;
  float half_;
};

/// The same on a bent plane: each point asks at its foot. The surface counts within a cylinder
/// about the frame's z axis; beyond it, and far above or below, distances are lower bounds.
class BentSlab final : public Extruded {
 public:
  BentSlab(const Layer& layer, const BentPlane& surface, double thickness_mm, double lipschitz)
      : Extruded(layer, lipschitz),
        surface_(surface),
        radius_mm_(0.5 * (image_.width - 1) * pixel_mm_),
        half_mm_(thickness_mm / 2),
        steepest_(std::hypot(1, surface.bend.steepest(radius_mm_))),
        near_mm_(steepest_ * (half_mm_ + Layer::cap_px * pixel_mm_)) {
    // Feet draw near to each other towards the centre of curvature.
    constexpr double least_spread = 0.25;
    lipschitz_ *= steepest_ / std::max(1 - near_mm_ * surface.bend.curvature(), least_spread);
  }

  void evaluate(const PointBlock& block, float* out) const override {
    const Bend& bend = surface_.bend;
    const Frame& f = surface_.frame;
    for (int i = 0; i < block.count; ++i) {
      const Vec3d q = f.to_local({block.x[i], block.y[i], block.z[i]});
      const double off_axis = std::hypot(q.x, q.y), beyond = off_axis - radius_mm_;
      const Vec2d local = (beyond > 0 ? radius_mm_ / off_axis : 1.0) * Vec2d{q.x, q.y};
      const double above = q.z - bend.height(local);
      const double near = std::clamp(above, -near_mm_, near_mm_);
      const BentPlane::Foot foot = surface_.foot(f.to_world({local.x, local.y, bend.height(local) + near}));
      const double height = std::abs(foot.above_mm) + (std::abs(above) - std::abs(near)) / steepest_ - half_mm_;
      const Vec2d at = (1 / pixel_mm_) * (foot.local - corner_);
      const float layer = bilinear(image_, static_cast<float>(at.x), static_cast<float>(at.y));
      out[i] = std::max(static_cast<float>(std::max(height, beyond)), layer);
    }
  }

 private:
  BentPlane surface_;
  double radius_mm_, half_mm_;
  double steepest_;  // of an upward path on it, over that of the plane below
  double near_mm_;   // so far along z, feet are looked for
};

void check(const JointParams& p) {
  const auto positive = [](double value, const char* key) {
    if (!(value > 0) || !std::isfinite(value))
      throw Error(Code::BadRecipe, "must be above zero", std::string("joint.") + key);
  };
  positive(p.layer_mm, "layer_mm");
  positive(p.column_mm, "column_mm");
  positive(p.reach_mm, "reach_mm");
  positive(p.min_wall_mm, "min_wall_mm");
  if (!(p.spacing_mm > p.column_mm) || !std::isfinite(p.spacing_mm))
    throw Error(Code::BadRecipe, "support columns must be further apart than they are thick", "joint.spacing_mm",
                "raise spacing_mm or lower column_mm");
}

/// The surface seen from part b: z points from b into a.
BentPlane turned(const BentPlane& s) {
  const Frame& f = s.frame;
  return {{f.origin, f.x, -f.y, -f.z}, s.bend.turned()};
}

/// The layer seen from part b: rows run the other way.
Layer turned(const Layer& layer) {
  Layer other = layer;
  for (int y = 0; y < layer.solid.height; ++y)
    for (int x = 0; x < layer.solid.width; ++x) {
      const int row = layer.solid.height - 1 - y;
      other.solid(x, row) = layer.solid(x, y);
      other.distance_mm(x, row) = layer.distance_mm(x, y);
    }
  other.origin_mm.y = -(layer.origin_mm.y + (layer.solid.height - 1) * layer.pixel_mm);
  return other;
}

}  // namespace

Joint join(const Interface& interface, const Shape& fill_a, const Shape& fill_b, bool crystal_a, bool crystal_b,
           double stick_mm, const Shape& body, double shell_mm, std::uint64_t seed, int index,
           const JointParams& params, const Context& context) {
  Joint joint;
  if (!params.enabled) return joint;
  check(params);
  if ((crystal_a || crystal_b) && !(stick_mm > 0)) throw Error(Code::BadRecipe, "must be above zero", "tcs.stick_mm");
  const double pixel = std::max(std::min(params.min_wall_mm / 4, 0.1), 2 * interface.radius_mm / max_section_px);
  joint.layer = transient_layer(interface, fill_a, fill_b, body, shell_mm, pixel, params);
  context.check();
  context.progress(0.5);

  const Shape lumen = offset(body, -shell_mm);
  const auto contact_of_side = [&](const Layer& layer, const BentPlane& surface, const Shape& fill, bool is_crystal,
                                   std::string_view name) {
    const Face face = face_of(layer, surface, fill, lumen, params.layer_mm);
    const double touching = contact_area_mm2(layer, surface, face);
    if (!is_crystal || !params.columns) return touching;
    const Random own(seed, name, static_cast<std::uint64_t>(index));
    SupportColumns found = support_columns(layer, surface, fill, face, stick_mm, lumen, params, own, context);
    joint.columns.insert(joint.columns.end(), found.columns.begin(), found.columns.end());
    joint.columns_dropped += found.dropped;
    return touching +
           static_cast<double>(found.columns.size()) * std::numbers::pi / 4 * params.column_mm * params.column_mm;
  };
  joint.contact_area_mm2 =
      std::min(contact_of_side(turned(joint.layer), turned(interface.surface()), fill_a, crystal_a, "joint.a"),
               contact_of_side(joint.layer, interface.surface(), fill_b, crystal_b, "joint"));

  const double lipschitz = std::max({1.0, fill_a.lipschitz(), fill_b.lipschitz(), body.lipschitz()});
  const Shape slab =
      interface.bend.flat()
          ? Shape(std::make_shared<Slab>(joint.layer, interface.frame, params.layer_mm, lipschitz))
          : Shape(std::make_shared<BentSlab>(joint.layer, interface.surface(), params.layer_mm, lipschitz));
  joint.shape = joint.columns.empty() ? slab : unite({slab, capsules(joint.columns)});
  const std::string where = "joint " + std::to_string(index) + " between parts " + std::to_string(interface.a) +
                            " and " + std::to_string(interface.b);
  if (joint.layer.regions_after > 1)
    joint.warnings.push_back(where + ": its transient layer is in " + std::to_string(joint.layer.regions_after) +
                             " pieces");
  if (joint.layer.regions_after == 0) joint.warnings.push_back(where + ": its transient layer holds no material");
  if ((crystal_a || crystal_b) && joint.columns.empty() && joint.columns_dropped > 0)
    joint.warnings.push_back(where + ": no support column found crystal within reach");
  context.progress(1);
  return joint;
}

}  // namespace fibrolite
