// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "fibrolite/error.h"
#include "fibrolite/ops/diameter.h"
#include "fibrolite/ops/stance.h"
#include "fibrolite/surface.h"
#include "fibrolite/to_solid.h"

namespace fibrolite {
namespace {

constexpr double finest_share = 4;          // up to this many times the triangles asked for
constexpr double unreached_allowed = 0.01;  // of the model's area
constexpr double dense_limit = 24e6;        // samples of the box: what the partition may hold at once

// Share of the model's area that the solid's surface does not come near: limbs lost because they are thinner than the
// voxel.
double unreached(const Mesh& model, const Solid& solid) {
  const double near = 0.5 * solid.grid().voxel_mm;
  double lost = 0;
  double all = 0;
  for (const auto& t : model.triangles) {
    const Vec3d a = to_double(model.vertices[t[0]]);
    const Vec3d b = to_double(model.vertices[t[1]]);
    const Vec3d c = to_double(model.vertices[t[2]]);
    const double weight = norm(cross(b - a, c - a));
    all += weight;
    if (static_cast<double>(solid.distance((a + b + c) / 3)) > near) lost += weight;
  }
  return all > 0 ? lost / all : 0;
}

double coarsest_for(const Box3d& box) {
  const Vec3d s = box.size();
  double voxel = std::cbrt(std::max(s.x * s.y * s.z, 0.0) / dense_limit);
  // Flat or thin boxes: the margins count as well.
  return std::max(voxel, box.longest_side() / 2000);
}

}  // namespace

Proxy make_proxy(const Mesh& world, const ProxyParams& params, const Context& context) {
  const Mesh model = seen_from(params.frame, world);
  if (params.triangles < 1000 || params.triangles > 200000) {
    throw Error(Code::BadRecipe, "the proxy must have 1000 to 200000 triangles", "proxy.triangles", "try 30000");
  }
  const double model_area = area(model);
  if (!(model_area > 0)) throw Error(Code::BadInput, "the model has no area", "proxy", "give a closed surface");
  const double least_voxel = coarsest_for(bounds(model));
  // A surface crosses 1.5 lattice edges per square voxel on average; each gives two triangles.
  double voxel = std::max(std::sqrt(3 * model_area / params.triangles), least_voxel);
  const double finest = std::max(voxel / std::sqrt(finest_share), least_voxel);
  const WindingTree tree(model);
  for (int round = 0;; ++round) {
    context.check();
    Proxy proxy;
    proxy.frame = params.frame;
    bool last = voxel <= finest * 1.001;
    try {
      proxy.solid =
          to_solid(model, {.grid = {.voxel_mm = voxel, .band_vox = 3}, .tree = tree}, context.part(0.0, 0.8, "proxy"))
              .solid;
    } catch (const Error& error) {
      if (error.code() != Code::BadInput || last) throw;
      proxy.solid = {};
    }
    if (!proxy.solid.empty() && (last || unreached(model, proxy.solid) <= unreached_allowed)) {
      proxy.surface = surface(proxy.solid, {.stand_in = true}, context.part(0.8, 1.0, "proxy"));
      if (proxy.surface.triangles.empty()) break;
      context.progress(1);
      return proxy;
    }
    if (last) break;
    voxel = std::max(voxel / std::sqrt(2.0), finest);
  }
  throw Error(Code::BadInput, "the model has no volume at a voxel of " + std::to_string(voxel) + " mm", "proxy",
              "give a closed surface thicker than that");
}

}  // namespace fibrolite
