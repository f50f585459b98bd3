// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/to_solid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/winding.h"
#include "sharpen.h"
#include "surface_topology.h"
#include "triangle_band.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

void validate(const Mesh& mesh, const ToSolidParams& params) {
  const double voxel = params.grid.voxel_mm;
  if (!(voxel > 0) || !std::isfinite(voxel))
    throw Error(Code::BadRecipe, "the voxel must be a positive length", "voxel");
  if (!(params.grid.band_vox >= 2) || !(params.grid.band_vox <= 1000)) {
    throw Error(Code::BadRecipe, "the band must be 2 to 1000 voxels wide", "band_vox");
  }
  if (!(params.inside_band_mm >= 0) || !std::isfinite(params.inside_band_mm)) {
    throw Error(Code::BadRecipe, "the inside band must be a length of 0 mm or more", "inside_band_mm");
  }
  if (mesh.triangles.empty()) throw Error(Code::BadInput, "the mesh has no triangles");
  for (const Vec3f& v : mesh.vertices) {
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) {
      throw Error(Code::BadInput, "the mesh has a coordinate that is no number");
    }
  }
  const Box3d box = bounds(mesh);
  const double farthest = std::max({std::abs(box.min.x), std::abs(box.min.y), std::abs(box.min.z), std::abs(box.max.x),
                                    std::abs(box.max.y), std::abs(box.max.z)});
  if (farthest / voxel > 1e9) {
    throw Error(Code::TooLarge, "more than 2^31 voxels along an axis", {}, "use a larger --voxel");
  }
}

Mesh turned_inside_out(Mesh mesh) {
  for (Mesh::Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

bool has_inside(const openvdb::FloatTree& tree) {
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const float* v = leaf->buffer().data();
    if (std::any_of(v, v + openvdb::FloatTree::LeafNodeType::SIZE, [](float x) { return x < 0; })) return true;
  }
  return false;
}

class Conversion {
 public:
  Conversion(const ToSolidParams& params, const Context& context) : params_(params), context_(context) {
    const double voxel = params.grid.voxel_mm;
    band_.voxel_mm = voxel;
    band_.outside_vox = params.grid.band_vox;
    band_.inside_vox = static_cast<float>(params.inside_band_mm / voxel) + params.grid.band_vox;
  }

  ToSolidResult run(const Mesh& mesh) {
    const SurfaceTopology topology = surface_topology(mesh);
    if (topology.closed()) {
      if (signed_volume(mesh) < 0) {
        repairs_.emplace_back("turned the surface outward: it was inside out");
        return run(turned_inside_out(mesh));
      }
      if (auto tree = by_normals(mesh, topology, context_.part(0, 0.5, ""))) return result(std::move(tree));
      repairs_.emplace_back("overlapping surfaces: the outermost one was found by winding number");
    } else {
      repairs_.emplace_back("open or irregular surface (" + std::to_string(topology.border.size()) +
                            " border edges): inside and outside were told by winding number");
    }
    return result(by_winding(mesh, topology));
  }

 private:
  /// The distances of a closed mesh; nothing if it overlaps itself.
  openvdb::FloatTree::Ptr by_normals(const Mesh& mesh, const SurfaceTopology& topology, const Context& context) {
    const WindingTree winding(mesh);
    context.check();
    Band band = triangle_band(mesh, topology, winding, band_, context);
    if (band.overlap) return nullptr;
    if (band.cells_by_winding > 0)
      repairs_.emplace_back("self-intersections: sides decided by winding number around them");
    return band.tree;
  }

  /// Find the surface where the winding number passes 1/2, then the distances to that surface.
  openvdb::FloatTree::Ptr by_winding(const Mesh& mesh, const SurfaceTopology& topology) {
    BandParams params = band_;
    params.inside_vox = params.outside_vox = 2;
    params.by_winding = true;
    const WindingTree winding(mesh);
    Band band = triangle_band(mesh, topology, winding, params, context_.part(0, 0.4, ""));
    if (!has_inside(*band.tree)) no_volume();
    if (2 * band.doubtful_samples > band.inside_samples) {
      throw Error(Code::BadInput, "the mesh is an open sheet, not the surface of a body", {},
                  "close it, or give the sheet a thickness");
    }
    const Mesh surface = sharp_zero_level(band.tree, params.voxel_mm, mesh, winding, context_);
    band.tree.reset();
    return triangle_band(surface, surface_topology(surface), WindingTree(surface), band_, context_.part(0.5, 1, ""))
        .tree;
  }

  [[noreturn]] static void no_volume() {
    throw Error(Code::BadInput, "the mesh encloses no volume at this voxel", {},
                "close it, give it thickness, or use a smaller --voxel");
  }

  ToSolidResult result(openvdb::FloatTree::Ptr tree) {
    if (!has_inside(*tree)) no_volume();
    auto grid = make_grid(params_.grid);
    grid->setTree(std::move(tree));
    context_.progress(1);
    return {make_solid(std::move(grid), params_.grid), std::move(repairs_)};
  }

  const ToSolidParams params_;
  const Context& context_;
  BandParams band_;
  std::vector<std::string> repairs_;
};

}  // namespace

ToSolidResult to_solid(const Mesh& mesh, const ToSolidParams& params, const Context& context) {
  validate(mesh, params);
  initialize_openvdb();
  return Conversion(params, context).run(mesh);
}

}  // namespace fibrolite
