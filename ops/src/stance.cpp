// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/stance.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include "fibrolite/error.h"
#include "load.h"
#include "part_maker.h"

namespace fibrolite {
namespace {

/// Unit vectors a rounding away from a world axis are that axis.
Vec3d tidy(Vec3d v) {
  const auto rounded = [](double x) { return std::abs(x - std::round(x)) < 1e-12 ? std::round(x) : x; };
  return {rounded(v.x), rounded(v.y), rounded(v.z)};
}

Vec3d turned(const Frame& frame, Vec3d direction) {
  return direction.x * frame.x + direction.y * frame.y + direction.z * frame.z;
}

Frame placed(const Frame& f, const Frame& frame) {
  return {frame.to_world(f.origin), turned(frame, f.x), turned(frame, f.y), turned(frame, f.z)};
}

constexpr double least_sine = 0.05;  // directions nearer to parallel say nothing of each other's side

/// Where the forces that decide go, one by one: unit vectors. Pressures have none.
std::vector<Vec3d> directions(const VerifyParams& params) {
  const Vec3d up = normalized(params.up);
  const auto unit = [&](const Direction& d) { return resolved(d, up, params.azimuth_deg); };
  std::vector<Vec3d> found;
  for (const LoadCase& one : params.loads) {
    if (one.unplanned) continue;
    for (const Force& force : one.forces) {
      if (const auto* total = std::get_if<TotalForce>(&force)) found.push_back(unit(total->direction));
      if (const auto* weight = std::get_if<Gravity>(&force)) found.push_back(unit(weight->direction));
    }
  }
  return found;
}

template <class Map>
Box3d mapped(const Box3d& box, Map&& map) {
  Box3d result;
  for (unsigned i = 0; i < 8; ++i) result.include(map(box.corner(i)));
  return result;
}

}  // namespace

Frame stance(const VerifyParams& params) {
  if (!(norm(params.up) > 0) || !std::isfinite(norm(params.up)) || !std::isfinite(params.azimuth_deg))
    throw Error(Code::BadRecipe, "up must be a direction and azimuth_deg a number", "verify");
  const Vec3d up = normalized(params.up);
  std::vector<Vec3d> along = directions(params);
  // A load that comes from above, up to the slant of the second one, is one on a model that stands as `up` says.
  constexpr double least_down = 0.7;
  if (!along.empty() && -dot(along.front(), up) > least_down) along.clear();
  const Vec3d z = tidy(along.empty() ? up : -along.front());
  Vec3d from = slanted_from(z, params.azimuth_deg);
  for (const Vec3d d : along)
    if (const Vec3d level = dot(d, z) * z - d; norm(level) > least_sine) {
      from = normalized(level);
      break;
    }
  from = tidy(from);
  return {{}, from, cross(z, from), z};
}

VerifyParams in_stance(const VerifyParams& params) {
  const Frame frame = stance(params);
  VerifyParams standing = params;
  const auto local = [&](Vec3d d) { return tidy(frame.to_local(d)); };
  const Vec3d up = normalized(params.up);
  standing.up = local(up);
  const Vec3d from = local(slanted_from(up, params.azimuth_deg));
  const Vec3d zero = slanted_from(standing.up, 0);
  standing.azimuth_deg = std::atan2(dot(from, cross(standing.up, zero)), dot(from, zero)) * 180 / std::numbers::pi;
  standing.loads = in_frame(frame, params.loads);
  if (params.load_box_mm)
    standing.load_box_mm = mapped(*params.load_box_mm, [&](Vec3d p) { return frame.to_local(p); });
  return standing;
}

Mesh seen_from(const Frame& frame, Mesh mesh) {
  for (Vec3f& v : mesh.vertices) v = to_float(frame.to_local(to_double(v)));
  return mesh;
}

Axis placed(const Axis& axis, const Frame& frame) {
  std::vector<Vec3d> points = axis.centre_line();
  for (Vec3d& p : points) p = frame.to_world(p);
  return Axis::along(std::move(points));
}

Cut placed(Cut cut, const Frame& frame) {
  cut.frame = placed(cut.frame, frame);
  return cut;
}

Core placed(Core core, const Frame& frame) {
  core.frame = placed(core.frame, frame);
  return core;
}

Partition placed(Partition partition, const Frame& frame) {
  for (Candidate& candidate : partition.candidates) {
    candidate.centroid_mm = frame.to_world(candidate.centroid_mm);
    candidate.axis = placed(candidate.axis, frame);
  }
  for (Cut& cut : partition.cuts) cut = placed(cut, frame);
  for (Core& core : partition.cores) core = placed(core, frame);
  partition.labels = partition.labels.placed(frame);
  return partition;
}

Parts placed(const Parts& parts, const Frame& frame) {
  Parts result;
  result.labels = parts.labels.placed(frame);
  for (const Cut& cut : parts.cuts) result.cuts.push_back(placed(cut, frame));
  for (const Core& core : parts.cores) result.cores.push_back(placed(core, frame));
  for (const Part& part : parts.parts) {
    PartStress stress = part.stress();
    for (CaseStress& c : stress.cases) c.principal_direction = turned(frame, c.principal_direction);
    result.parts.push_back(
        PartMaker::make({.id = part.id(),
                         .kind = part.kind(),
                         .candidates = part.candidates(),
                         .chosen = part.chosen(),
                         .region = result.labels.region(part.id()),
                         .bounds_mm = mapped(part.bounds_mm(), [&](Vec3d p) { return frame.to_world(p); }),
                         .axis = placed(part.axis(), frame),
                         .diameter_mm = part.diameter_mm(),
                         .volume_mm3 = part.volume_mm3(),
                         .centroid_mm = frame.to_world(part.centroid_mm()),
                         .stress = std::move(stress),
                         .reason = part.reason()}));
  }
  return result;
}

}  // namespace fibrolite
