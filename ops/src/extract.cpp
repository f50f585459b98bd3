// SPDX-License-Identifier: GPL-3.0-or-later
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "fibrolite/disjoint_sets.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/tetrahedralize.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"

namespace fibrolite {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using CgalMesh = CGAL::Surface_mesh<Kernel::Point_3>;

/// Solid angle of a triangle seen from the origin, divided by 4 pi (van Oosterom and Strackee 1983).
double winding_share(Vec3d a, Vec3d b, Vec3d c) {
  const double la = norm(a), lb = norm(b), lc = norm(c);
  return 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb) /
         (4 * std::numbers::pi);
}

/// The shells of a closed surface, each as its triangles, and the volume it encloses (negative: a cavity).
struct Shell {
  std::vector<Mesh::Triangle> triangles;
  double volume_mm3 = 0;
};

std::vector<Shell> shells(const Mesh& mesh) {
  DisjointSets sets(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  std::map<std::uint32_t, std::size_t> number;
  std::vector<Shell> result;
  for (const auto& t : mesh.triangles) {
    const auto [at, fresh] = number.emplace(sets.root(t[0]), result.size());
    if (fresh) result.emplace_back();
    Shell& shell = result[at->second];
    shell.triangles.push_back(t);
    shell.volume_mm3 +=
        dot(cross(to_double(mesh.vertices[t[0]]), to_double(mesh.vertices[t[1]])), to_double(mesh.vertices[t[2]])) / 6;
  }
  return result;
}

/// The shell that encloses most, with its own cavities; loose islands and cavities of a few voxels go.
Mesh main_piece(const Mesh& mesh, double smallest_cavity_mm3) {
  const std::vector<Shell> all = shells(mesh);
  const auto largest = std::max_element(all.begin(), all.end(),
                                        [](const Shell& a, const Shell& b) { return a.volume_mm3 < b.volume_mm3; });
  if (largest == all.end() || !(largest->volume_mm3 > 0)) {
    throw Error(Code::SolverFailed, "the piece has no volume at the voxel it is analysed with", "extract",
                "take a finer proxy");
  }
  Mesh piece{mesh.vertices, largest->triangles, {}};
  for (const Shell& shell : all) {
    if (shell.volume_mm3 > -smallest_cavity_mm3) continue;
    const Vec3d eye = to_double(mesh.vertices[shell.triangles.front()[0]]);
    const auto seen = [&](std::uint32_t v) { return to_double(mesh.vertices[v]) - eye; };
    double winding = 0;
    for (const auto& t : largest->triangles) winding += winding_share(seen(t[0]), seen(t[1]), seen(t[2]));
    if (winding > 0.5) piece.triangles.insert(piece.triangles.end(), shell.triangles.begin(), shell.triangles.end());
  }
  return piece;
}

CgalMesh to_cgal(const Mesh& mesh) {
  constexpr auto unset = std::numeric_limits<CgalMesh::size_type>::max();
  CgalMesh result;
  std::vector<CgalMesh::Vertex_index> vertex(mesh.vertices.size(), CgalMesh::Vertex_index(unset));
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t v : t) {
      if (vertex[v] != CgalMesh::Vertex_index(unset)) continue;
      const Vec3d p = to_double(mesh.vertices[v]);
      vertex[v] = result.add_vertex({p.x, p.y, p.z});
    }
    if (result.add_face(vertex[t[0]], vertex[t[1]], vertex[t[2]]) == CgalMesh::null_face()) {
      throw Error(Code::Internal, "the surface of a solid is not manifold", "extract");
    }
  }
  return result;
}

Mesh from_cgal(CgalMesh& mesh) {
  mesh.collect_garbage();
  Mesh result;
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    result.vertices.push_back(to_float({p.x(), p.y(), p.z()}));
  }
  for (const auto f : mesh.faces()) {
    Mesh::Triangle triangle{};
    std::size_t k = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) triangle[k++] = v;
    result.triangles.push_back(triangle);
  }
  return result;
}

/// Places that a vertex may not go to are refused by asking the grid the surface came from: a tree over its triangles,
/// as CGAL offers it, costs most of the simplification.
class BoundedPlacement {
 public:
  BoundedPlacement(const Solid& solid, double bound_mm) : solid_(&solid), bound_mm_(bound_mm) {}
  template <class Profile>
  auto operator()(const Profile& profile) const -> boost::optional<typename Profile::Point> {
    auto place = free_(profile);
    if (!place) return place;
    const float off = solid_->distance({place->x(), place->y(), place->z()});
    return std::abs(static_cast<double>(off)) <= bound_mm_ ? place : boost::none;
  }

 private:
  const Solid* solid_;
  double bound_mm_;
  sms::LindstromTurk_placement<CgalMesh> free_;
};

/// Edge collapse that keeps the volume (Lindstrom and Turk 1998); no vertex goes farther than `bound_mm` from the
/// surface, and no triangle turns over.
Mesh simplified(const Mesh& mesh, const Solid& solid, int triangles, double bound_mm, const Context& context) {
  using Cost = sms::LindstromTurk_cost<CgalMesh>;
  // On a flat face volume alone makes every collapse free: all but a handful of its triangles would go, those that
  // rounding chose, and whatever presses on a patch of it would act on a mesh as coarse as the patch. The paper's term
  // for the shape of triangles parts them; where the surface bends by more than a fortieth of an edge, volume decides.
  constexpr double shape_weight = 1e-5;
  CgalMesh fine = to_cgal(mesh);
  context.check();
  const auto edges = static_cast<std::size_t>(triangles) * 3 / 2;
  if (fine.number_of_edges() > edges) {
    sms::edge_collapse(fine, sms::Count_stop_predicate<CgalMesh>(edges),
                       CGAL::parameters::get_cost(Cost(Cost::LindstromTurk_params(0.5, 0.5, shape_weight)))
                           .get_placement(BoundedPlacement(solid, bound_mm))
                           .filter(sms::Bounded_normal_change_filter<>()));
  }
  context.check();
  // Judged at the floats that go on, not at the doubles they came from.
  Mesh result = from_cgal(fine);
  if (CGAL::Polygon_mesh_processing::does_self_intersect(to_cgal(result))) {
    throw Error(Code::SolverFailed, "the simplified surface cuts itself", "extract", "take a finer proxy");
  }
  return result;
}

struct Attempt {
  double voxel;     ///< Times the wanted one.
  double distance;  ///< Times the wanted bound; 0: not simplified at all.
};

}  // namespace

TetMesh extract(const Proxy& proxy, const Shape& region, const ExtractParams& params, const Context& context) {
  if (!(params.voxel_mm >= 0) || params.max_surface_triangles < 100 || !(params.max_distance_vox > 0)) {
    throw Error(Code::BadRecipe, "a parameter of the extraction is out of range");
  }
  const double wanted_voxel = params.voxel_mm > 0 ? params.voxel_mm : proxy.solid.grid().voxel_mm;
  const Shape shape = intersect({distance_to(proxy.solid), region});
  std::string reason;
  // A surface that cannot be meshed is made again coarser, which moves every triangle.
  for (const Attempt attempt : {Attempt{1, 1}, Attempt{1.19, 0.5}, Attempt{1.57, 0}}) {
    const double voxel = attempt.voxel * wanted_voxel;
    const Solid solid = realize(shape, proxy.solid.bounds_mm().grown(4 * voxel), Grid{.voxel_mm = voxel},
                                context.part(0, 0.2, "extract"));
    Mesh piece =
        main_piece(surface(solid, {.stand_in = true}, context.part(0.2, 0.3, "extract")), 27 * voxel * voxel * voxel);
    try {
      if (attempt.distance > 0) {
        piece = simplified(piece, solid, params.max_surface_triangles,
                           attempt.distance * params.max_distance_vox * voxel, context);
      }
      context.progress(0.6);
      return tetrahedralize(piece, {}, context.part(0.6, 1, "extract"));
    } catch (const Error& error) {
      if (error.code() != Code::SolverFailed) throw;
      reason = error.what();
    } catch (const CGAL::Failure_exception& error) {
      reason = error.what();
    }
  }
  throw Error(Code::SolverFailed, "no tetrahedra in three attempts: " + reason);
}

}  // namespace fibrolite
