// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/to_solid.h"

#include <algorithm>
#include <cmath>
#include <memory>
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
  constexpr double least_voxel_mm = 2e-5;  // OpenVDB takes no voxel below 3e-15 mm3
  if (voxel < least_voxel_mm)
    throw Error(Code::BadRecipe, "the voxel is below 2e-5 mm", "voxel", "use a larger --voxel, or a larger model");
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

[[noreturn]] void no_volume() {
  throw Error(Code::BadInput, "the mesh encloses no volume at this voxel", {},
              "close it, give it thickness, or use a smaller --voxel");
}

BandParams band_params(const Mesh& mesh, const ToSolidParams& params) {
  // Nothing inside lies deeper than this: a band that reaches farther would only be looked for, with great cost, in a
  // model that is small beside it.
  const Vec3d size = bounds(mesh).size();
  const double deepest_mm = 0.5 * std::min({size.x, size.y, size.z});
  BandParams band;
  band.voxel_mm = params.grid.voxel_mm;
  band.outside_vox = params.grid.band_vox;
  band.inside_vox =
      static_cast<float>(std::min(params.inside_band_mm, deepest_mm) / params.grid.voxel_mm) + params.grid.band_vox;
  return band;
}

/// A mesh and what is asked of it.
struct Surface {
  explicit Surface(std::shared_ptr<const Mesh> m, const std::optional<WindingTree>& tree = {})
      : mesh(std::move(m)), topology(surface_topology(*mesh)), winding(tree ? *tree : WindingTree(*mesh)) {}
  std::shared_ptr<const Mesh> mesh;
  SurfaceTopology topology;
  WindingTree winding;
};

/// Where the winding number passes 1/2: a closed surface without overlaps.
std::unique_ptr<Surface> outermost(const Surface& from, const BandParams& wanted, const Context& context) {
  BandParams params = wanted;
  params.inside_vox = params.outside_vox = 2;
  params.by_winding = true;
  Band band = TriangleBand(*from.mesh, from.topology, from.winding, params).whole(context.part(0, 0.8, ""));
  if (!has_inside(*band.tree)) no_volume();
  if (2 * band.doubtful_samples > band.inside_samples) {
    throw Error(Code::BadInput, "the mesh is an open sheet, not the surface of a body", {},
                "close it, or give the sheet a thickness");
  }
  return std::make_unique<Surface>(
      std::make_shared<const Mesh>(sharp_zero_level(band.tree, params.voxel_mm, *from.mesh, from.winding, context)));
}

/// A mesh whose distances are the body's, found by looking at all of them once.
class Conversion {
 public:
  Conversion(std::shared_ptr<const Mesh> mesh, const ToSolidParams& params, const Context& context)
      : params_(band_params(*mesh, params)),
        most_bytes_(params.most_bytes),
        surface_(std::make_unique<Surface>(std::move(mesh), params.tree)) {
    if (!surface_->topology.closed()) {
      repairs_.emplace_back("open or irregular surface (" + std::to_string(surface_->topology.border.size()) +
                            " border edges): inside and outside were told by winding number");
      replace(context);
    } else if (signed_volume(*surface_->mesh) < 0) {
      repairs_.emplace_back("turned the surface outward: it was inside out");
      surface_ = std::make_unique<Surface>(std::make_shared<const Mesh>(turned_inside_out(*surface_->mesh)));
    }
    band_ = std::make_unique<TriangleBand>(*surface_->mesh, surface_->topology, surface_->winding, params_);
  }

  /// Looks at the whole band one way or the other, again if the mesh must be replaced.
  Band look(Band (TriangleBand::*way)(const Context&), const Context& context) {
    Band band = ((*band_).*way)(context.part(0, 0.5, ""));
    if (band.overlap && !replaced_) {
      band = {};
      repairs_.emplace_back("overlapping surfaces: the outermost one was found by winding number");
      band_.reset();
      replace(context.part(0.5, 0.75, ""));
      band_ = std::make_unique<TriangleBand>(*surface_->mesh, surface_->topology, surface_->winding, params_);
      band = ((*band_).*way)(context.part(0.75, 1, ""));
    } else if (band.cells_by_winding > 0 && !replaced_) {
      repairs_.emplace_back("self-intersections: sides decided by winding number around them");
    }
    context.progress(1);
    return band;
  }

  [[nodiscard]] const TriangleBand& band() const { return *band_; }
  [[nodiscard]] const std::vector<std::string>& repairs() const { return repairs_; }

 private:
  void replace(const Context& context) {
    constexpr double bytes_a_triangle = 300, process_bytes = 50e6;
    const double needed = process_bytes + bytes_a_triangle * static_cast<double>(surface_->mesh->triangles.size()) +
                          repair_bytes(*surface_->mesh, params_.voxel_mm);
    if (needed > most_bytes_)
      throw Error(Code::TooLarge,
                  "the model overlaps itself or is open: finding its outermost surface takes about " +
                      std::to_string(std::llround(needed / (1 << 20))) + " MB of memory",
                  {}, "raise --max-memory, use a larger --voxel, or mend the model first");
    surface_ = outermost(*surface_, params_, context);
    replaced_ = true;
  }

  const BandParams params_;
  const double most_bytes_;
  std::unique_ptr<Surface> surface_;
  std::unique_ptr<TriangleBand> band_;
  bool replaced_ = false;
  std::vector<std::string> repairs_;
};

Solid as_solid(openvdb::FloatTree::Ptr tree, Grid spec) {
  auto grid = make_grid(spec);
  grid->setTree(std::move(tree));
  return make_solid(std::move(grid), spec);
}

}  // namespace

double repair_bytes(const Mesh& mesh, double voxel_mm) {
  constexpr double bytes_a_face = 1150;  // of a voxel; 970 to 1100 of five models at two voxels
  return bytes_a_face * area(mesh) / (voxel_mm * voxel_mm);
}

bool is_open(const Mesh& mesh) { return !surface_topology(mesh).closed(); }

ToSolidResult to_solid(const Mesh& mesh, const ToSolidParams& params, const Context& context) {
  validate(mesh, params);
  initialize_openvdb();
  const std::shared_ptr<const Mesh> lent(std::shared_ptr<const Mesh>(), &mesh);
  Conversion conversion(lent, params, context.part(0, 0.3, ""));
  Band band = conversion.look(&TriangleBand::whole, context.part(0.3, 1, ""));
  if (!has_inside(*band.tree)) no_volume();
  return {as_solid(std::move(band.tree), params.grid), conversion.repairs()};
}

struct MeshVoxels::Impl {
  Grid spec;
  Conversion conversion;
};

MeshVoxels::MeshVoxels(const Mesh& mesh, const ToSolidParams& params, const Context& context) {
  validate(mesh, params);
  initialize_openvdb();
  Conversion conversion(std::make_shared<const Mesh>(mesh), params, context.part(0, 0.3, ""));
  conversion.look(&TriangleBand::survey, context.part(0.3, 1, ""));
  impl_ = std::make_shared<const Impl>(Impl{params.grid, std::move(conversion)});
}

SampleBox MeshVoxels::samples() const {
  const openvdb::CoordBBox box = impl_->conversion.band().samples();
  return {{box.min().x(), box.min().y(), box.min().z()}, {box.max().x() + 1, box.max().y() + 1, box.max().z() + 1}};
}

const std::vector<std::string>& MeshVoxels::repairs() const { return impl_->conversion.repairs(); }

Solid MeshVoxels::within(const SampleBox& box, const Context& context) const {
  const auto down = [](int v) { return v & ~7; };
  const openvdb::Coord low(down(box.min.x), down(box.min.y), down(box.min.z));
  const openvdb::Coord high(down(box.max.x + 7) - 1, down(box.max.y + 7) - 1, down(box.max.z + 7) - 1);
  return as_solid(impl_->conversion.band().within({low, high}, context), impl_->spec);
}

}  // namespace fibrolite
