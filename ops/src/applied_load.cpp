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
#include "region.h"

namespace fibrolite {
namespace {

template <class Visit>
void cover(const TetMesh& mesh, const std::vector<TetFace>& faces, const Region& region, const LoadSetting& setting,
           const Visit& visit) {
  cover(mesh, faces, region, setting.labels, setting.tolerance_mm, visit);
}

/// A constant traction on a triangle of a face: the rule of three edge middles is exact for six-node faces.
void spread(std::vector<Vec3d>& force_n, const TetFace& face, const CornerTriangle& t, Vec3d total_n) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto n = fem::face_shape_functions(between(t[k], t[(k + 1) % 3], 0.5));
    for (std::size_t i = 0; i < 6; ++i) force_n[face.nodes[i]] = force_n[face.nodes[i]] + (n[i] / 3) * total_n;
  }
}

Vec3d resolved(const Direction& d, const LoadSetting& setting) { return resolved(d, setting.up, setting.azimuth_deg); }

Region resolved(const Selection& where, const TetMesh& body, const LoadSetting& setting) {
  Region region;
  region.label = where.label;
  if (where.painted) {
    region.paint = where.painted->distance;
    region.paint_mm = std::max(setting.tolerance_mm, 1e-3);
  }
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
bool is_held(const TetMesh& mesh, const Frame& frame, const Held& held) {
  Box3d box;
  for (const Vec3d& p : mesh.nodes) box.include(p);
  Eigen::Matrix<double, 6, 6> stops = Eigen::Matrix<double, 6, 6>::Zero();
  for (std::size_t node = 0; node < held.size(); ++node) {
    const Vec3d arm = (2 / box.longest_side()) * (mesh.nodes[node] - box.center());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!held[node][axis]) continue;
      const Vec3d unit = axis == 0 ? frame.x : axis == 1 ? frame.y : frame.z;
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
  cover(mesh, boundary(mesh), h.region, setting, [&](const TetFace& face, Vec3d, const CornerTriangle&, double) {
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
    cover(mesh, faces, a.region, setting, [&](const TetFace& face, Vec3d, const CornerTriangle& t, double area) {
      spread(force_n, face, t, area * a.n_per_mm2);
    });
  }
  void operator()(const Push& a) const {
    cover(mesh, faces, a.region, setting, [&](const TetFace& face, Vec3d normal, const CornerTriangle& t, double area) {
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
  Frame frame{};  // whose axes the holds speak of
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

  /// The frame in which every sliding support slides across an axis: the mesh's own if it will do.
  Frame slides() const {
    std::vector<Vec3d> across;
    const auto along_axis = [](Vec3d v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) > 1 - 1e-9; };
    for (const Support& support : load.supports)
      if (support.sliding) across.push_back(resolved(*support.sliding, out.setting));
    if (std::all_of(across.begin(), across.end(), along_axis)) return {};
    Frame frame = frame_along({}, across.front());
    for (const Vec3d& v : across) {
      if (std::abs(dot(v, frame.z)) > 1e-6) continue;
      frame.x = normalized(v - dot(v, frame.z) * frame.z);
      frame.y = cross(frame.z, frame.x);
      break;
    }
    return frame;
  }
  std::array<bool, 3> axes_along(Vec3d v, const std::string& at) const {
    const std::array<bool, 3> axes{std::abs(dot(v, out.frame.x)) > 1 - 1e-9, std::abs(dot(v, out.frame.y)) > 1 - 1e-9,
                                   std::abs(dot(v, out.frame.z)) > 1 - 1e-9};
    if (!axes[0] && !axes[1] && !axes[2])
      refuse("slides across directions that are neither parallel nor at right angles", at, "turn one of them");
    return axes;
  }

  void support(const Support& support, const std::string& at) const {
    Hold h{region(support.where, at), {true, true, true}};
    if (support.sliding) h.axes = axes_along(resolved(*support.sliding, out.setting), at + ".sliding");
    static_cast<void>(area(h.region, at + ".where"));
    Held alone(body.nodes.size(), {false, false, false});
    hold(alone, {h.region, {true, true, true}}, body, out.setting);
    h.by_face = !is_held(body, out.frame, alone);
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
      if (where.paint && static_cast<double>((*where.paint)(p)) > where.paint_mm) return false;
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
  frame = find.slides();
  const auto indexed = [&](const char* list, std::size_t i) {
    return key + "." + list + "[" + std::to_string(i) + "]";
  };
  for (std::size_t i = 0; i < load.supports.size(); ++i) find.support(load.supports[i], indexed("supports", i));
  for (std::size_t i = 0; i < load.forces.size(); ++i)
    std::visit([&](const auto& force) { find(force, indexed("forces", i)); }, load.forces[i]);

  Held held(body.nodes.size(), {false, false, false});
  for (const Hold& h : holds) hold(held, h, body, setting);
  if (!is_held(body, frame, held)) {
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

const Frame& AppliedLoad::held_in() const { return impl_->frame; }
double AppliedLoad::magnitude_n() const { return impl_->magnitude_n; }
const std::vector<Selected>& AppliedLoad::selected() const { return impl_->selected; }

double weight_n_per_mm3(const Material& material) {
  constexpr double g_m_s2 = 9.80665, kg_mm3 = 1e-6;  // standard gravity; 1 g/cm3
  return material.density_g_cm3 * kg_mm3 * g_m_s2;
}

}  // namespace fibrolite
