// SPDX-License-Identifier: GPL-3.0-or-later
#include "applied_load.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <variant>

#include "elasticity.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "load.h"

namespace fibrolite {
namespace {

/// What lies on the inner side: dot(p, normal) <= offset.
struct Plane {
  Vec3d normal;  // unit
  double offset;
  double tolerance;  // along the surface's normal
};

/// A selection as planes and a label; seen_from is not part of it.
struct Region {
  std::vector<Plane> planes;
  std::optional<int> label;

  [[nodiscard]] bool contains(Vec3d p, const Labels& labels) const {
    return std::all_of(planes.begin(), planes.end(),
                       [&](const Plane& plane) { return dot(p, plane.normal) <= plane.offset + plane.tolerance; }) &&
           (!label || labels.label(p) == *label);
  }
};

using Corner = std::array<double, 3>;  // barycentric, on a face
using Triangle = std::array<Corner, 3>;

Corner between(const Corner& a, const Corner& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

/// What is left of a polygon where a linear function (given at the face's corners) is at most 0 (Sutherland and Hodgman
/// 1974).
std::vector<Corner> clipped(const std::vector<Corner>& polygon, const Corner& value) {
  const auto at = [&](const Corner& c) { return c[0] * value[0] + c[1] * value[1] + c[2] * value[2]; };
  std::vector<Corner> rest;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double va = at(a), vb = at(b);
    if (va <= 0) rest.push_back(a);
    if ((va < 0 && vb > 0) || (va > 0 && vb < 0)) rest.push_back(between(a, b, va / (va - vb)));
  }
  return rest;
}

/// Calls visit(face, normal, triangle, area_mm2) for triangles that cover the part of each face that lies in the
/// region: exactly between planes; a label is asked for sixteen pieces of each.
template <class Visit>
void cover(const TetMesh& mesh, const std::vector<TetFace>& faces, const Region& region, const LoadSetting& setting,
           const Visit& visit) {
  constexpr std::size_t pieces_along = 4;
  for (const TetFace& face : faces) {
    const std::array<Vec3d, 3> p{mesh.nodes[face.nodes[0]], mesh.nodes[face.nodes[1]], mesh.nodes[face.nodes[2]]};
    const Vec3d double_area = cross(p[1] - p[0], p[2] - p[0]);
    const double area = 0.5 * norm(double_area);
    if (!(area > 0)) continue;
    const Vec3d normal = normalized(double_area);
    std::vector<Corner> polygon{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const Plane& plane : region.planes) {
      // The surface may lie that much off along its own normal; planes across it have nothing to forgive.
      const double limit = plane.offset + plane.tolerance * std::abs(dot(normal, plane.normal));
      Corner value{};
      for (std::size_t k = 0; k < 3; ++k) value[k] = dot(p[k], plane.normal) - limit;
      polygon = clipped(polygon, value);
      if (polygon.size() < 3) break;
    }
    const auto place = [&](const Corner& c) { return c[0] * p[0] + c[1] * p[1] + c[2] * p[2]; };
    const auto give = [&](const Triangle& t) {
      const double share =
          std::abs((t[1][1] - t[0][1]) * (t[2][2] - t[0][2]) - (t[2][1] - t[0][1]) * (t[1][2] - t[0][2]));
      if (share > 0) visit(face, normal, t, share * area);
    };
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const Triangle whole{polygon[0], polygon[i - 1], polygon[i]};
      if (!region.label) {
        give(whole);
        continue;
      }
      const auto corner = [&](std::size_t u, std::size_t v) {
        const double step = 1.0 / pieces_along;
        const double s = step * static_cast<double>(u), t = step * static_cast<double>(v);
        Corner c{};
        for (std::size_t k = 0; k < 3; ++k) c[k] = (1 - s - t) * whole[0][k] + s * whole[1][k] + t * whole[2][k];
        return c;
      };
      const auto ask = [&](const Triangle& piece) {
        Corner middle{};
        for (std::size_t k = 0; k < 3; ++k) middle[k] = (piece[0][k] + piece[1][k] + piece[2][k]) / 3;
        // Asked below the surface: a cut that runs in the surface itself would answer at random.
        if (setting.labels.label(place(middle) - setting.tolerance_mm * normal) == *region.label) give(piece);
      };
      for (std::size_t u = 0; u < pieces_along; ++u) {
        for (std::size_t v = 0; u + v < pieces_along; ++v) {
          ask({corner(u, v), corner(u + 1, v), corner(u, v + 1)});
          if (u + v + 1 < pieces_along) ask({corner(u + 1, v + 1), corner(u, v + 1), corner(u + 1, v)});
        }
      }
    }
  }
}

/// A constant traction on a triangle of a face: the rule of three edge middles is exact for six-node faces.
void spread(std::vector<Vec3d>& force_n, const TetFace& face, const Triangle& t, Vec3d total_n) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto n = fem::face_shape_functions(between(t[k], t[(k + 1) % 3], 0.5));
    for (std::size_t i = 0; i < 6; ++i) force_n[face.nodes[i]] = force_n[face.nodes[i]] + (n[i] / 3) * total_n;
  }
}

Vec3d resolved(const Direction& d, const LoadSetting& setting) {
  switch (d.of) {
    case Direction::Of::World:
      break;
    case Direction::Of::Up:
      return setting.up;
    case Direction::Of::Down:
      return -setting.up;
    case Direction::Of::Slanted:
      return load_directions(setting.up, setting.azimuth_deg)[1];
  }
  return normalized(d.vector);
}

Region resolved(const Selection& where, const TetMesh& body, const LoadSetting& setting) {
  Region region;
  region.label = where.label;
  const auto half = [&](Vec3d point, Vec3d normal) {
    const Vec3d n = normalized(normal);
    region.planes.push_back({n, dot(point, n), setting.tolerance_mm});
  };
  if (where.box_mm) {
    for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
      half(where.box_mm->max, axis);
      half(where.box_mm->min, -axis);
    }
  }
  for (const HalfSpace& h : where.half_spaces) half(h.point_mm, h.normal);
  // A share is one of the mesh's own extent: it needs no tolerance.
  const auto end = [&](const EndShare& e, Vec3d along) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vec3d& p : body.nodes) {
      low = std::min(low, dot(p, along));
      high = std::max(high, dot(p, along));
    }
    region.planes.push_back({along, low + e.share * (high - low), 0});
  };
  if (where.lowest) end(*where.lowest, resolved(where.lowest->along, setting));
  if (where.highest) end(*where.highest, -resolved(where.highest->along, setting));
  return region;
}

using Held = std::vector<std::array<bool, 3>>;

/// Do the held components stop all six rigid motions?
bool is_held(const TetMesh& mesh, const Held& held) {
  Box3d box;
  for (const Vec3d& p : mesh.nodes) box.include(p);
  Eigen::Matrix<double, 6, 6> stops = Eigen::Matrix<double, 6, 6>::Zero();
  for (std::size_t node = 0; node < held.size(); ++node) {
    const Vec3d arm = (2 / box.longest_side()) * (mesh.nodes[node] - box.center());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!held[node][axis]) continue;
      const Vec3d unit{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
      const Vec3d turn = cross(arm, unit);
      Eigen::Matrix<double, 6, 1> row;
      row << unit.x, unit.y, unit.z, turn.x, turn.y, turn.z;
      stops += row * row.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> modes(stops, Eigen::EigenvaluesOnly);
  return modes.eigenvalues()[0] > 1e-9 * std::max(1.0, modes.eigenvalues()[5]);
}

struct Hold {
  Region region;
  std::array<bool, 3> axes;
  bool by_face = false;  // too small to catch nodes that hold it: the faces it touches are held
};

void hold(Held& held, const Hold& h, const TetMesh& mesh, const LoadSetting& setting) {
  const auto add = [&](std::size_t node) {
    for (std::size_t axis = 0; axis < 3; ++axis) held[node][axis] = held[node][axis] || h.axes[axis];
  };
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node)
    if (h.region.contains(mesh.nodes[node], setting.labels)) add(node);
  if (!h.by_face) return;
  cover(mesh, boundary(mesh), h.region, setting, [&](const TetFace& face, Vec3d, const Triangle&, double) {
    for (const std::uint32_t node : face.nodes) add(node);
  });
}

// What acts, found on the body.
struct Traction {
  Region region;
  Vec3d n_per_mm2;
};
struct Push {
  Region region;
  double mpa;
};
struct Shower {
  Footprint footprint;
  Vec3d to_eye;
  Vec3d force_n;
};
struct Weight {
  Vec3d n_per_mm3;
};
using Action = std::variant<Traction, Push, Shower, Weight>;

using Mine = std::function<bool(Vec3d, Vec3d)>;

/// Adds an action to the nodal forces of a mesh.
struct Put {
  const TetMesh& mesh;
  const std::vector<TetFace>& faces;
  const LoadSetting& setting;
  const Mine& mine;
  std::vector<Vec3d>& force_n;

  void operator()(const Traction& a) const {
    cover(mesh, faces, a.region, setting, [&](const TetFace& face, Vec3d, const Triangle& t, double area) {
      spread(force_n, face, t, area * a.n_per_mm2);
    });
  }
  void operator()(const Push& a) const {
    cover(mesh, faces, a.region, setting, [&](const TetFace& face, Vec3d normal, const Triangle& t, double area) {
      spread(force_n, face, t, (-a.mpa * area) * normal);
    });
  }
  void operator()(const Shower& a) const {
    const std::vector<double> shares =
        nodal_shares(mesh, a.footprint, setting.reach_mm, [&](Vec3d p) { return mine(p, a.to_eye); });
    for (std::size_t node = 0; node < shares.size(); ++node) force_n[node] = force_n[node] + shares[node] * a.force_n;
  }
  void operator()(const Weight& a) const {
    // The integrals of the ten shape functions over a straight-sided tetrahedron: -1/20 and 1/5 of its volume.
    for (const auto& tet : mesh.tets) {
      const Vec3d o = mesh.nodes[tet[0]];
      const double volume = dot(cross(mesh.nodes[tet[1]] - o, mesh.nodes[tet[2]] - o), mesh.nodes[tet[3]] - o) / 6;
      for (std::size_t i = 0; i < 10; ++i)
        force_n[tet[i]] = force_n[tet[i]] + (i < 4 ? -volume / 20 : volume / 5) * a.n_per_mm3;
    }
  }
};

std::string area_text(double mm2) { return number_text(mm2, 4) + " mm2"; }
std::string place_text(Vec3d p) {
  return std::string("(") + number_text(p.x, 4) + ", " + number_text(p.y, 4) + ", " + number_text(p.z, 4) + ")";
}

}  // namespace

struct AppliedLoad::Impl {
  LoadSetting setting;
  std::vector<Hold> holds;
  std::vector<Action> actions;
  double magnitude_n = 0;
  std::vector<Selected> selected;

  Impl(const LoadCase& load, const std::string& key, const TetMesh& body, const LoadSetting& given);
};

namespace {

/// Finds the selections of one load case on the body.
struct Finder {
  AppliedLoad::Impl& out;
  const LoadCase& load;
  const TetMesh& body;
  std::vector<TetFace> faces;
  double surface_mm2 = 0;

  Finder(AppliedLoad::Impl& impl, const LoadCase& c, const TetMesh& mesh)
      : out(impl), load(c), body(mesh), faces(boundary(mesh)) {
    cover(body, faces, {}, out.setting, [&](const auto&, Vec3d, const auto&, double area) { surface_mm2 += area; });
  }

  [[noreturn]] void refuse(const std::string& what, const std::string& at, const std::string& hint) const {
    throw Error(Code::BadRecipe, "load case '" + load.name + "' " + what, at, hint);
  }

  Region region(const Selection& where, const std::string& at) const {
    if (where.label && *where.label >= out.setting.labels.count())
      refuse("wants label " + std::to_string(*where.label), at,
             "the partition has " + std::to_string(out.setting.labels.count()) + ", counted from 0");
    return resolved(where, body, out.setting);
  }
  /// Area of the body in a region, mm2; it must be something.
  double area(const Region& region, const std::string& at) const {
    Selected found{at, load.name, 0, 0};
    const TetFace* last = nullptr;
    cover(body, faces, region, out.setting, [&](const TetFace& face, Vec3d, const auto&, double area) {
      found.area_mm2 += area;
      if (&face != last) ++found.faces;
      last = &face;
    });
    note(found);
    return found.area_mm2;
  }
  void note(const Selected& found, const std::string& hint = {}) const {
    if (!(found.area_mm2 > 1e-9 * surface_mm2)) {
      Box3d box;
      for (const Vec3d& p : body.nodes) box.include(out.setting.frame.to_world(p));
      refuse("selects nothing: " + area_text(found.area_mm2) + " on " + std::to_string(found.faces) + " of " +
                 std::to_string(faces.size()) + " faces, of " + area_text(surface_mm2),
             found.key, "the body reaches from " + place_text(box.min) + " to " + place_text(box.max) + " mm" + hint);
    }
    out.selected.push_back(found);
  }

  void support(const Support& support, const std::string& at) const {
    Hold h{region(support.where, at), {true, true, true}};
    if (support.sliding) {
      const Vec3d along = resolved(*support.sliding, out.setting);
      for (int axis = 0; axis < 3; ++axis) h.axes[static_cast<std::size_t>(axis)] = std::abs(along[axis]) > 1 - 1e-9;
      if (!h.axes[0] && !h.axes[1] && !h.axes[2])
        refuse("slides across a direction that is no axis of the model as it stands", at + ".sliding",
               "use up, or an axis level with it that verify.azimuth_deg points along or across");
    }
    static_cast<void>(area(h.region, at + ".where"));
    Held alone(body.nodes.size(), {false, false, false});
    hold(alone, {h.region, {true, true, true}}, body, out.setting);
    h.by_face = !is_held(body, alone);
    out.holds.push_back(std::move(h));
  }

  void operator()(const TotalForce& force, const std::string& at) const {
    const Region where = region(force.where, at);
    const Vec3d force_n = force.newton * resolved(force.direction, out.setting);
    out.magnitude_n += force.newton;
    if (!force.where.seen_from) {
      out.actions.push_back(Traction{where, force_n / area(where, at + ".where")});
      return;
    }
    const Vec3d to_eye = resolved(*force.where.seen_from, out.setting);
    Footprint footprint = seen_from_above(body, to_eye, [&](Vec3d p) {
      for (const Hold& h : out.holds)
        if (h.region.contains(p, out.setting.labels)) return false;
      for (const Plane& plane : where.planes)
        if (dot(p, plane.normal) > plane.offset + plane.tolerance * std::abs(dot(to_eye, plane.normal))) return false;
      return !where.label || out.setting.labels.label(p - out.setting.tolerance_mm * to_eye) == *where.label;
    });
    const double pixel_mm2 = footprint.pixel_mm * footprint.pixel_mm;
    const double seen_mm2 = pixel_mm2 * static_cast<double>(footprint.points.size());
    note({at + ".where", load.name, seen_mm2, footprint.faces},
         "; what is hidden or held, or outside of its box (box_mm, load_box_mm), is not seen");
    out.actions.push_back(Shower{std::move(footprint), to_eye, force_n});
  }
  void operator()(const Pressure& pressure, const std::string& at) const {
    const Region where = region(pressure.where, at);
    out.magnitude_n += std::abs(pressure.mpa) * area(where, at + ".where");
    out.actions.push_back(Push{where, pressure.mpa});
  }
  void operator()(const Gravity& gravity, const std::string&) const {
    const double n_per_mm3 = weight_n_per_mm3(out.setting.material);
    out.magnitude_n += n_per_mm3 * volume_mm3(body);
    out.actions.push_back(Weight{n_per_mm3 * resolved(gravity.direction, out.setting)});
  }
};

}  // namespace

AppliedLoad::Impl::Impl(const LoadCase& load, const std::string& key, const TetMesh& body, const LoadSetting& given)
    : setting(given) {
  const Finder find(*this, load, body);
  const auto indexed = [&](const char* list, std::size_t i) {
    return key + "." + list + "[" + std::to_string(i) + "]";
  };
  for (std::size_t i = 0; i < load.supports.size(); ++i) find.support(load.supports[i], indexed("supports", i));
  for (std::size_t i = 0; i < load.forces.size(); ++i)
    std::visit([&](const auto& force) { find(force, indexed("forces", i)); }, load.forces[i]);

  Held held(body.nodes.size(), {false, false, false});
  for (const Hold& h : holds) hold(held, h, body, setting);
  if (!is_held(body, held)) {
    double area = 0;
    for (std::size_t i = 0; i < holds.size(); ++i) area += selected[i].area_mm2;
    find.refuse("leaves the body free to move: it is held on " + area_text(area) + " alone", key + ".supports",
                "hold it fast somewhere, or let it slide on planes that cross");
  }
}

AppliedLoad::AppliedLoad(const std::vector<LoadCase>& cases, std::size_t index, const TetMesh& body,
                         const LoadSetting& setting)
    : impl_(
          std::make_shared<const Impl>(cases[index], setting.key + "[" + std::to_string(index) + "]", body, setting)) {}

std::vector<Vec3d> AppliedLoad::forces_n(const TetMesh& mesh, const Mine& mine) const {
  std::vector<Vec3d> force_n(mesh.nodes.size());
  const std::vector<TetFace> faces = boundary(mesh);
  const Put put{mesh, faces, impl_->setting, mine, force_n};
  for (const Action& action : impl_->actions) std::visit(put, action);
  return force_n;
}

std::vector<std::array<bool, 3>> AppliedLoad::held(const TetMesh& mesh) const {
  Held held(mesh.nodes.size(), {false, false, false});
  for (const Hold& h : impl_->holds) hold(held, h, mesh, impl_->setting);
  return held;
}

double AppliedLoad::magnitude_n() const { return impl_->magnitude_n; }
const std::vector<Selected>& AppliedLoad::selected() const { return impl_->selected; }

double weight_n_per_mm3(const Material& material) {
  constexpr double g_m_s2 = 9.80665, kg_mm3 = 1e-6;  // standard gravity; 1 g/cm3
  return material.density_g_cm3 * kg_mm3 * g_m_s2;
}

}  // namespace fibrolite
