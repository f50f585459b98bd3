// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/load_cores.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "body_solve.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "part_maker.h"

namespace fibrolite {
namespace {

constexpr double samples_inside = 40000;
constexpr double followed = 0.5;        // a core is followed down to this share of the body's mean stress
constexpr double same_way = 0.866;      // cosine of 30 degrees
constexpr double least_directed = 0.5;  // of a core's volume, with the load along it
constexpr double least_inside = 0.8;    // of a core's mantle, inside the body
constexpr double most_of_host = 0.5;    // of its volume
constexpr double least_weight = 0.05;   // of the weight of the strongest core
constexpr std::size_t most_cores = 16;

/// What all load cases together do to a point.
struct Flow {
  Vec3d direction{};
  double along = 0, across = 0;  // roots of the two largest eigenvalues of S, MPa
};

Flow flow(const SolvedBody& body, Vec3d p) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  body.each_stress(p, [&](const fem::Stress& s) {
    Eigen::Matrix3d m;
    m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    sum += m * m;
  });
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  const Eigen::Vector3d v = solver.eigenvectors().col(2);
  const auto root = [&](int i) { return std::sqrt(std::max(solver.eigenvalues()[i], 0.0)); };
  return {{v[0], v[1], v[2]}, root(2), root(1)};
}

/// Normal stress along a unit vector, root of the sum of squares over the load cases, MPa.
double stress_along(const SolvedBody& body, Vec3d p, Vec3d axis) {
  double sum = 0;
  body.each_stress(p, [&](const fem::Stress& s) { sum += std::pow(fem::normal_stress(s, axis), 2); });
  return std::sqrt(sum);
}

/// Samples of the body on a lattice about its middle.
struct Samples {
  Vec3d low{};
  double step_mm = 1;
  std::array<int, 3> size{};
  std::vector<Flow> flow;
  std::vector<int> host;  // a candidate that may have a core, -1: none, or outside
  double mean = 0;        // of Flow::along, over the body

  [[nodiscard]] Vec3d place(std::size_t at) const {
    const auto i = at % width(), j = at / width() % height(), k = at / width() / height();
    return low + step_mm * Vec3d{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
  }
  template <class Visit>
  void each_neighbour(std::size_t at, const Visit& visit) const {
    const std::array<std::size_t, 3> stride{1, width(), width() * height()};
    const std::array<std::size_t, 3> index{at % width(), at / width() % height(), at / width() / height()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (index[axis] > 0) visit(at - stride[axis]);
      if (index[axis] + 1 < static_cast<std::size_t>(size[axis])) visit(at + stride[axis]);
    }
  }

 private:
  [[nodiscard]] std::size_t width() const { return static_cast<std::size_t>(size[0]); }
  [[nodiscard]] std::size_t height() const { return static_cast<std::size_t>(size[1]); }
};

Samples sample(const Proxy& proxy, const Partition& partition, const SolvedBody& body) {
  const Box3d box = proxy.solid.bounds_mm();
  Samples s;
  s.step_mm = std::cbrt(proxy.solid.volume_mm3() / samples_inside);
  std::size_t all = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int n = 2 * static_cast<int>(0.5 * box.size()[axis] / s.step_mm) + 2;
    s.size[static_cast<std::size_t>(axis)] = n;
    all *= static_cast<std::size_t>(n);
  }
  s.low = box.center() - 0.5 * s.step_mm * Vec3d{s.size[0] - 1.0, s.size[1] - 1.0, s.size[2] - 1.0};
  s.flow.resize(all);
  s.host.assign(all, -1);
  double count = 0;
  for (std::size_t at = 0; at < all; ++at) {
    const Vec3d p = s.place(at);
    if (proxy.solid.distance(p) >= 0) continue;
    s.flow[at] = flow(body, p);
    s.mean += s.flow[at].along;
    ++count;
    const int label = partition.labels.label(p);
    if (!partition.candidates[static_cast<std::size_t>(label)].column_like) s.host[at] = label;
  }
  if (count > 0) s.mean /= count;
  return s;
}

/// Neighbours through which the load runs the same way.
struct Stream {
  int host = 0;
  Vec3d axis{}, centre{};
  double weight = 0;
};

/// All samples that can be reached from a seed over neighbours of its host that are `stressed` and point along `axis`.
std::vector<std::size_t> reach(const Samples& s, std::size_t seed, Vec3d axis, const std::vector<char>& stressed) {
  std::vector<char> seen(s.flow.size(), 0);
  std::vector<std::size_t> found{seed};
  seen[seed] = 1;
  for (std::size_t next = 0; next < found.size(); ++next)
    s.each_neighbour(found[next], [&](std::size_t n) {
      if (seen[n] != 0 || stressed[n] == 0 || s.host[n] != s.host[seed]) return;
      if (std::abs(dot(s.flow[n].direction, axis)) < same_way) return;
      seen[n] = 1;
      found.push_back(n);
    });
  return found;
}

Stream mean_of(const Samples& s, const std::vector<std::size_t>& members) {
  Eigen::Matrix3d directions = Eigen::Matrix3d::Zero();
  Stream stream;
  stream.host = s.host[members.front()];
  for (const std::size_t at : members) {
    const Flow& f = s.flow[at];
    const double weight = f.along * f.along;
    const Eigen::Vector3d d(f.direction.x, f.direction.y, f.direction.z);
    directions += weight * d * d.transpose();
    stream.centre = stream.centre + weight * s.place(at);
    stream.weight += weight;
  }
  stream.centre = stream.centre / stream.weight;
  const Eigen::Vector3d v = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(directions).eigenvectors().col(2);
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  stream.axis = (v[largest] < 0 ? -1.0 : 1.0) * Vec3d{v[0], v[1], v[2]};
  return stream;
}

/// Strongest first.
std::vector<Stream> streams(const Samples& s, double dominance, double concentration, const Context& context) {
  std::vector<char> stressed(s.flow.size(), 0), taken(s.flow.size(), 0);
  std::vector<std::size_t> seeds;
  for (std::size_t at = 0; at < s.flow.size(); ++at) {
    const Flow& f = s.flow[at];
    if (s.host[at] < 0 || !(f.along >= dominance * f.across)) continue;
    stressed[at] = f.along >= followed * s.mean ? 1 : 0;
    if (f.along >= concentration * s.mean) seeds.push_back(at);
  }
  std::stable_sort(seeds.begin(), seeds.end(),
                   [&](std::size_t a, std::size_t b) { return s.flow[a].along > s.flow[b].along; });
  std::vector<Stream> found;
  for (const std::size_t seed : seeds) {
    if (taken[seed] != 0) continue;
    context.check();
    // Once along the seed's own direction, then along the mean of what that found.
    Stream stream = mean_of(s, reach(s, seed, s.flow[seed].direction, stressed));
    const std::vector<std::size_t> members = reach(s, seed, stream.axis, stressed);
    // The rim of a stream points elsewhere, and leads back into it.
    const auto known = std::count_if(members.begin(), members.end(), [&](std::size_t at) { return taken[at] != 0; });
    taken[seed] = 1;
    for (const std::size_t at : members) taken[at] = 1;
    if (2 * known > static_cast<std::ptrdiff_t>(members.size())) continue;
    stream = mean_of(s, members);
    if (!found.empty() && stream.weight < least_weight * found.front().weight) continue;
    found.push_back(stream);
    if (found.size() == most_cores) break;
  }
  std::stable_sort(found.begin(), found.end(), [](const Stream& a, const Stream& b) { return a.weight > b.weight; });
  return found;
}

/// The stretch of a line through `p` that lies in the body, around the inside point nearest to p.
std::optional<std::pair<double, double>> chord(const Proxy& proxy, Vec3d p, Vec3d along) {
  const double step = 0.25 * proxy.solid.grid().voxel_mm, far = 2 * proxy.solid.bounds_mm().longest_side();
  const auto inside = [&](double t) { return proxy.solid.distance(p + t * along) < 0; };
  if (!inside(0)) return std::nullopt;
  double low = 0, high = 0;
  while (low > -far && inside(low - step)) low -= step;
  while (high < far && inside(high + step)) high += step;
  return std::pair(low, high);
}

/// Calls visit(point) on rings about the axis.
template <class Visit>
void each_on_ring(const Frame& section, double radius, const Visit& visit) {
  constexpr int places = 32;
  for (int k = 0; k < places; ++k) {
    const double turn = 2 * std::numbers::pi * (k + 0.5) / places;
    visit(section.to_world({radius * std::cos(turn), radius * std::sin(turn), 0}));
  }
}

/// Where along its axis a core is stressed most, and what runs through the section there.
struct Waist {
  double stress_mpa = 0;  // along the axis, weighted mean within three samples of it
  double force_n = 0;     // integral of the magnitude of the stress along the axis over the host's section
};

Waist waist_of(const SolvedBody& body, const Samples& samples, const Stream& stream, const Frame& frame,
               std::pair<double, double> chord) {
  // Means over a stretch on either side of each place, so that one ill-shaped tetrahedron decides nothing. Weights fall
  // to nothing at its ends: they sum to the same wherever the samples' layers lie, where a slab would hold a layer more
  // or less. No stretch reaches beyond the body.
  constexpr int beside = 2;     // samples on either side
  constexpr double around = 3;  // samples
  const double h = samples.step_mm, reach = beside * h;
  const double low = chord.first + reach, room = chord.second - reach - low;
  if (!(room > 0)) return {};
  struct Place {
    double near = 0, near_weight = 0, all = 0;
  };
  std::vector<Place> places(static_cast<std::size_t>(std::ceil(room / h)) + 1);
  const double apart = room / static_cast<double>(places.size() - 1);
  for (std::size_t at = 0; at < samples.flow.size(); ++at) {
    if (samples.host[at] != stream.host) continue;
    const Vec3d p = samples.place(at), local = frame.to_local(p);
    if (local.z <= chord.first || local.z >= chord.second) continue;
    const double stress = stress_along(body, p, frame.z);
    const bool near = std::hypot(local.x, local.y) <= around * h;
    const double first = std::max(std::ceil((local.z - reach - low) / apart), 0.0);
    for (auto k = static_cast<std::size_t>(first); k < places.size(); ++k) {
      const double weight = (1 - std::abs(low + apart * static_cast<double>(k) - local.z) / reach) / beside;
      if (weight <= 0) break;
      places[k].all += weight * stress;
      if (!near) continue;
      places[k].near += weight * stress;
      places[k].near_weight += weight;
    }
  }
  Waist waist;
  for (const Place& place : places)
    if (place.near_weight > 0 && place.near / place.near_weight > waist.stress_mpa)
      waist = {place.near / place.near_weight, place.all * h * h};
  return waist;
}

struct Found {
  Core core;
  Candidate candidate;
  std::string why_not;
};

Found measure(const Proxy& proxy, const Partition& partition, const SolvedBody& body, const Samples& samples,
              const Stream& stream, const CoreParams& params, double dominance) {
  Found found;
  const double voxel = proxy.solid.grid().voxel_mm;
  const auto through = chord(proxy, stream.centre, stream.axis);
  if (!through) {
    found.why_not = "the load runs around a hollow";
    return found;
  }
  const Frame frame = frame_along(stream.centre, stream.axis);
  const double length = through->second - through->first;
  const Waist waist = waist_of(body, samples, stream, frame, *through);
  double radius = std::sqrt(params.share * waist.force_n / (std::numbers::pi * std::max(waist.stress_mpa, 1e-12)));
  const bool widened = radius < 0.5 * params.least_mm;
  radius = std::max(radius, 0.5 * params.least_mm);

  double mantle = 0, mantle_inside = 0;
  for (double t = through->first + voxel; t <= through->second - voxel; t += samples.step_mm) {
    Frame section = frame;
    section.origin = frame.to_world({0, 0, t});
    each_on_ring(section, radius, [&](Vec3d p) {
      ++mantle;
      if (proxy.solid.distance(p) < 0) ++mantle_inside;
    });
  }
  double count = 0, directed = 0, stress = 0;
  Vec3d sum{};
  for (std::size_t at = 0; at < samples.flow.size(); ++at) {
    if (samples.host[at] != stream.host) continue;
    const Vec3d p = samples.place(at), local = frame.to_local(p);
    if (std::hypot(local.x, local.y) >= radius || local.z < through->first || local.z > through->second) continue;
    const Flow& f = samples.flow[at];
    ++count;
    sum = sum + p;
    stress += f.along;
    if (f.along >= dominance * f.across && std::abs(dot(f.direction, stream.axis)) >= same_way) ++directed;
  }
  const Candidate& host = partition.candidates[static_cast<std::size_t>(stream.host)];
  const double volume = count * std::pow(samples.step_mm, 3), share = volume / host.volume_mm3;
  const auto percent = [](double value) { return number_text(100 * value, 2) + " %"; };
  if (!(count > 0) || length < params.min_slenderness * 2 * radius) {
    found.why_not = number_text(length, 3) + " mm long and " + number_text(2 * radius, 3) + " mm wide: too stout";
  } else if (mantle_inside < least_inside * mantle) {
    found.why_not = "only " + percent(mantle_inside / mantle) + " of its mantle would lie inside the body";
  } else if (share > most_of_host) {
    found.why_not = "it would be " + percent(share) + " of the part";
  } else if (stress < params.concentration * count * samples.mean) {
    found.why_not = "its mean stress is " + number_text(stress / count / samples.mean, 3) + " times the body's";
  } else if (directed < least_directed * count) {
    found.why_not = "the load runs along it in only " + percent(directed / count) + " of it";
  }
  if (!found.why_not.empty()) return found;

  // The ends lie beyond the surface, also where that is as steep as 45 degrees to the axis.
  const double beyond = radius + 2 * voxel;
  found.core.host = stream.host;
  found.core.frame = frame;
  found.core.frame.origin = frame.to_world({0, 0, through->first - beyond});
  found.core.length_mm = length + 2 * beyond;
  found.core.radius_mm = radius;
  Candidate& c = found.candidate;
  c.column_like = true;
  c.volume_mm3 = volume;
  c.centroid_mm = sum / count;
  c.diameter_mm = 2 * radius;
  c.length_mm = length;
  c.axis = Axis::straight(frame.to_world({0, 0, through->first}), frame.to_world({0, 0, through->second}));
  c.reason = std::string("a core under load, ")
                 .append(number_text(2 * radius, 3))
                 .append(widened ? " mm wide (widened to hold fibres), " : " mm wide, ")
                 .append(number_text(length, 3))
                 .append(" mm long, ")
                 .append(percent(share))
                 .append(" of part ")
                 .append(std::to_string(stream.host))
                 .append(": stress ")
                 .append(number_text(stress / count / samples.mean, 3))
                 .append(" times the body's mean, in one direction in ")
                 .append(percent(directed / count))
                 .append(" of it");
  return found;
}

/// Least distance between the axes, less what both are thick.
double gap(const Core& a, const Core& b) {
  constexpr int places = 64;
  double least = far_mm;
  for (int i = 0; i <= places; ++i)
    for (int j = 0; j <= places; ++j) {
      const Vec3d p = a.frame.origin + (a.length_mm * i / places) * a.frame.z;
      const Vec3d q = b.frame.origin + (b.length_mm * j / places) * b.frame.z;
      least = std::min(least, norm(p - q));
    }
  return least - a.radius_mm - b.radius_mm;
}

/// A core that crosses a cut of its host meets what lies behind it there.
void cross_cuts(Partition& partition, const Core& core) {
  const std::size_t before = partition.cuts.size();
  for (std::size_t c = 0; c < before; ++c) {
    Cut cut = partition.cuts[c];
    if (cut.a != core.host && cut.b != core.host) continue;
    const Vec3d way = cut.frame.origin - core.frame.origin;
    double t = std::clamp(dot(way, core.frame.z), 0.0, core.length_mm), reach_mm = cut.radius_mm;
    if (cut.bend.flat()) {
      const double slope = dot(cut.frame.z, core.frame.z);
      if (std::abs(slope) < 1e-6) continue;
      t = dot(cut.frame.z, way) / slope;
    } else {
      // A bowl may be met beside its plane: whatever comes near it, for where nothing meets there is no section.
      reach_mm *= std::hypot(1, cut.bend.steepest(cut.radius_mm));
    }
    const Vec3d at = core.frame.origin + t * core.frame.z;
    if (t < 0 || t > core.length_mm || norm(at - cut.frame.origin) > reach_mm + core.radius_mm) continue;
    (cut.a == core.host ? cut.a : cut.b) = core.id;
    partition.cuts.push_back(cut);
  }
}

}  // namespace

Partition undivided(const Proxy& proxy) {
  Partition whole;
  const PartGeometry geometry = part_geometry(proxy, Labels()).front();
  Candidate body;
  body.volume_mm3 = proxy.solid.volume_mm3();
  body.centroid_mm = geometry.centroid_mm;
  body.axis = geometry.axis;
  body.length_mm = geometry.axis.length_mm();
  body.diameter_mm = std::cbrt(6 * body.volume_mm3 / std::numbers::pi);
  body.reason = "one piece, not parted by shape";
  whole.candidates.push_back(std::move(body));
  return whole;
}

Partition find_cores(const Proxy& proxy, Partition partition, const CoreParams& params, const VerifyParams& loads,
                     const Material& material, const Context& context) {
  check_params(loads);
  check_material(material);
  check_loads(loads.loads);
  if (!(params.least_mm > 0) || !(params.concentration >= 0) || !(params.share > 0) || !(params.min_slenderness >= 0))
    throw Error(Code::BadRecipe, "the numbers of a core must be above zero", "partition");
  std::vector<std::string> notes;
  TetMesh mesh = body_mesh(proxy, loads.triangles, notes, context.part(0, 0.4, "cores"));
  const auto body =
      solve_body(proxy, std::move(mesh), partition.labels, loads, material, context.part(0.4, 0.7, "cores"));
  const Samples samples = sample(proxy, partition, *body);
  context.check();

  std::vector<Core> cores;
  for (const Stream& stream : streams(samples, loads.dominance, params.concentration, context)) {
    Found found = measure(proxy, partition, *body, samples, stream, params, loads.dominance);
    const bool crosses = found.why_not.empty() && std::any_of(cores.begin(), cores.end(), [&](const Core& other) {
                           return gap(found.core, other) < 0.25 * params.least_mm;
                         });
    if (crosses) found.why_not = "it would cross another core";
    if (!found.why_not.empty()) {
      const Vec3d at = proxy.frame.to_world(stream.centre);
      partition.notes.push_back("no core at (" + number_text(at.x, 4) + ", " + number_text(at.y, 4) + ", " +
                                number_text(at.z, 4) + ") mm: " + found.why_not);
      continue;
    }
    found.core.id = found.candidate.id = static_cast<int>(partition.candidates.size());
    partition.candidates.push_back(std::move(found.candidate));
    cores.push_back(found.core);
  }
  for (const Core& core : cores) {
    Candidate& host = partition.candidates[static_cast<std::size_t>(core.host)];
    host.volume_mm3 -= partition.candidates[static_cast<std::size_t>(core.id)].volume_mm3;
    cross_cuts(partition, core);
  }
  if (!cores.empty()) partition.labels = partition.labels.carved(cores);
  if (cores.empty() && partition.notes.empty())
    partition.notes.emplace_back("no core: nowhere does the stress of all load cases run in one direction");
  partition.cores = std::move(cores);
  context.progress(1);
  return partition;
}

}  // namespace fibrolite
