// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>

#include "label_samples.h"

namespace fibrolite {
namespace {

constexpr double clamp_vox = 4;      // how far from a cut the fields are distances
constexpr double rim_vox = 2;        // the disc of a cut is this much wider than the section
constexpr double outside_vox = 3.5;  // how far outside of the body the plane of a cut still decides

// Distance to the disc of a cut, bent or not; the sign of z says on which side.
struct DiscDistance {
  double mm = 0;
  bool far_side = false;
  bool in_cylinder = false;
};
DiscDistance disc_distance(const BentPlane& surface, double radius, Vec3d p) {
  const Vec3d q = surface.flattened(p);
  const double beyond = std::hypot(q.x, q.y) - radius, away = std::abs(surface.foot(p).above_mm);
  return {beyond > 0 ? std::hypot(away, beyond) : away, q.z >= 0, beyond <= 0};
}

}  // namespace

LabelSamples make_label_samples(const Anatomy& anatomy, const CutPieces& pieces, const std::vector<int>& name) {
  const VoxelBody& body = anatomy.body;
  const double h = body.voxel_mm;
  LabelSamples s;
  s.origin = body.origin;
  s.voxel_mm = h;
  s.size = body.size;
  s.count = pieces.count;
  s.clamp_mm = clamp_vox * h;
  const auto name_of = [&](std::int32_t inside_sample) {
    return static_cast<std::uint16_t>(
        name[static_cast<std::size_t>(pieces.of[static_cast<std::size_t>(inside_sample)])]);
  };
  s.label.resize(anatomy.nearest.size());
  for (std::size_t at = 0; at < s.label.size(); ++at) s.label[at] = name_of(anatomy.nearest[at]);
  if (pieces.cuts.empty()) return s;

  // An outside sample near two cuts belongs to the nearer one.
  std::vector<float> decided(s.label.size(), std::numeric_limits<float>::infinity());
  for (std::size_t k = 0; k < pieces.cuts.size(); ++k) {
    const Section& cut = pieces.cuts[k];
    const double radius = cut.radius_mm + rim_vox * h;
    const auto a = static_cast<std::uint16_t>(name[static_cast<std::size_t>(pieces.sides[k][0])]);
    const auto b = static_cast<std::uint16_t>(name[static_cast<std::size_t>(pieces.sides[k][1])]);
    std::vector<std::int32_t> beside = pieces.severed[k].near;
    beside.insert(beside.end(), pieces.severed[k].far.begin(), pieces.severed[k].far.end());
    // Through the body, so that a neighbouring limb that passes the disc closely knows nothing of the cut.
    const std::vector<float> way = geodesic(body, body.links, beside, 1.6 * s.clamp_mm + rim_vox * h);
    const double reach = radius * (1 + cut.bend.steepest(radius)) + s.clamp_mm;
    const BentPlane surface = cut.surface();
    const auto sample = [&](double p, double origin, std::int32_t n) {
      return std::clamp(static_cast<std::int32_t>(std::floor((p - origin) / h)), 0, n - 1);
    };
    const Vec3d middle = cut.frame.origin;
    const Vec3i low{sample(middle.x - reach, s.origin.x, s.size.x), sample(middle.y - reach, s.origin.y, s.size.y),
                    sample(middle.z - reach, s.origin.z, s.size.z)};
    const Vec3i high{sample(middle.x + reach, s.origin.x, s.size.x), sample(middle.y + reach, s.origin.y, s.size.y),
                     sample(middle.z + reach, s.origin.z, s.size.z)};
    const auto look = [&](std::size_t at, Vec3d p) {
      const std::int32_t inside = anatomy.nearest[at];
      const float from_cut = way[static_cast<std::size_t>(inside)];
      if (from_cut < 0) return;
      const DiscDistance disc = disc_distance(surface, radius, p);
      double mm = disc.mm;
      if (mm >= s.clamp_mm) return;
      if (body.inside[at] < 0) {
        if (norm(p - body.position(inside)) > outside_vox * h) return;
        const std::uint16_t owner = name_of(inside);
        if (disc.in_cylinder && (owner == a || owner == b) && static_cast<float>(mm) < decided[at]) {
          s.label[at] = disc.far_side ? b : a;
          decided[at] = static_cast<float>(mm);
        }
      } else if (disc.in_cylinder && ((s.label[at] == a && disc.far_side) || (s.label[at] == b && !disc.far_side))) {
        // A limb that bends back past the plane: what counts is how far the cut is along the body.
        mm = std::max(mm, static_cast<double>(from_cut));
      }
      if (mm < s.clamp_mm) s.near.push_back({static_cast<std::int64_t>(at), a, b, static_cast<float>(mm)});
    };
    for (std::int32_t z = low.z; z <= high.z; ++z) {
      for (std::int32_t y = low.y; y <= high.y; ++y) {
        for (std::int32_t x = low.x; x <= high.x; ++x) {
          const auto at =
              (static_cast<std::size_t>(z) * static_cast<std::size_t>(s.size.y) + static_cast<std::size_t>(y)) *
                  static_cast<std::size_t>(s.size.x) +
              static_cast<std::size_t>(x);
          look(at, s.origin + h * Vec3d{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
        }
      }
    }
  }
  std::stable_sort(s.near.begin(), s.near.end(), [](const auto& x, const auto& y) { return x.sample < y.sample; });
  return s;
}

}  // namespace fibrolite
