// SPDX-License-Identifier: GPL-3.0-or-later
#include "decompose.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "fibrolite/ops/text.h"

namespace fibrolite {
namespace {

constexpr double clean_area = 3;         // a section larger than this many discs of the loop's radius is not the limb's
constexpr std::size_t least_links = 12;  // between two pieces; fewer are where cuts cross
constexpr double least_purity = 0.5;     // of a piece: the share that a thin region fills

const char* const no_piece = "no plane parts it from the rest, or what it parts is below partition.min_area";

int most_frequent(const std::vector<std::int32_t>& samples, const std::vector<std::int32_t>& of) {
  std::map<int, std::size_t> votes;
  for (const std::int32_t s : samples) ++votes[of[static_cast<std::size_t>(s)]];
  int best = -1;
  std::size_t most = 0;
  for (const auto& [id, count] : votes) {
    if (count <= most) continue;
    most = count;
    best = id;
  }
  return best;
}

// Crumbs that a section leaves at its rim join the piece they hang on by the body's own links.
void absorb_crumbs(const Anatomy& anatomy, double min_area, Components& c) {
  const VoxelBody& body = anatomy.body;
  constexpr std::size_t least_samples = 20;
  std::vector<std::size_t> size(static_cast<std::size_t>(c.count), 0);
  for (const std::int32_t id : c.of) ++size[static_cast<std::size_t>(id)];
  std::vector<double> area(size.size(), 0);
  for (std::size_t f = 0; f < anatomy.sample_of_face.size(); ++f)
    area[static_cast<std::size_t>(c.of[static_cast<std::size_t>(anatomy.sample_of_face[f])])] +=
        anatomy.graph.area_mm2[f];
  const auto main = std::max_element(size.begin(), size.end()) - size.begin();
  std::vector<std::uint8_t> is_crumb(size.size(), 0);
  for (std::size_t i = 0; i < size.size(); ++i)
    is_crumb[i] = size[i] < least_samples || area[i] < min_area * anatomy.graph.total_area_mm2 ? 1 : 0;
  is_crumb[static_cast<std::size_t>(main)] = 0;
  std::map<int, std::map<int, std::size_t>> hangs_on;
  for (std::size_t s = 0; s < c.of.size(); ++s) {
    const std::int32_t id = c.of[s];
    if (is_crumb[static_cast<std::size_t>(id)] == 0) continue;
    auto& around = hangs_on[id];
    for (int d = 0; d < VoxelBody::directions; ++d) {
      if ((body.links[s] >> static_cast<unsigned>(d) & 1U) == 0) continue;
      const std::int32_t n = c.of[static_cast<std::size_t>(body.neighbour(static_cast<std::int32_t>(s), d))];
      if (is_crumb[static_cast<std::size_t>(n)] == 0) ++around[n];
    }
  }
  std::vector<int> into(static_cast<std::size_t>(c.count));
  for (int i = 0; i < c.count; ++i) into[static_cast<std::size_t>(i)] = i;
  for (const auto& [crumb, around] : hangs_on) {
    int host = static_cast<int>(main);
    std::size_t most = 0;
    for (const auto& [id, links] : around) {
      if (links <= most) continue;
      most = links;
      host = id;
    }
    into[static_cast<std::size_t>(crumb)] = host;
  }
  std::map<int, int> name;
  for (std::int32_t& id : c.of) {
    id = into[static_cast<std::size_t>(id)];
    id = name.try_emplace(id, static_cast<int>(name.size())).first->second;
  }
  c.count = static_cast<int>(name.size());
}

double median_diameter(const Anatomy& anatomy, const std::vector<std::int32_t>& of, int id) {
  std::vector<double> d;
  for (std::size_t f = 0; f < anatomy.sample_of_face.size(); ++f)
    if (of[static_cast<std::size_t>(anatomy.sample_of_face[f])] == id) d.push_back(anatomy.field->diameter_mm[f]);
  if (d.empty()) return 2 * anatomy.body.voxel_mm;
  const auto middle = d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2);
  std::nth_element(d.begin(), middle, d.end());
  return *middle;
}

struct RegionCuts {
  int region = 0;
  std::vector<Section> cuts;
};

// Which piece a region is, and whether it may be called a limb; the reason if not.
struct Verdict {
  int piece = -1;
  std::string why_not;
};

Verdict judge(const Anatomy& anatomy, const CutPieces& pieces, const std::vector<std::size_t>& size,
              const std::vector<std::int32_t>& samples, double min_slenderness) {
  Verdict v;
  v.piece = most_frequent(samples, pieces.of);
  const auto p = static_cast<std::size_t>(v.piece);
  std::size_t here = 0;
  for (const std::int32_t s : samples) here += pieces.of[static_cast<std::size_t>(s)] == v.piece ? 1 : 0;
  const double purity = static_cast<double>(here) / static_cast<double>(size[p]);
  if (purity < least_purity) {
    v.why_not = no_piece;
    return v;
  }
  const LimbPiece piece = pieces.piece(anatomy, v.piece);
  if (piece.faces.empty()) {
    v.why_not = no_piece;
    return v;
  }
  const QuickShape shape = quick_shape(anatomy.body, pieces.links, piece);
  if (shape.slenderness < min_slenderness) {
    v.why_not = "it is only " + number_text(shape.slenderness, 3) + " times as long as wide";
  } else if (shape.width_mm > flattest_limb * piece.diameter_mm) {
    v.why_not = "it is flat: " + number_text(shape.width_mm, 3) + " mm wide, " + number_text(piece.diameter_mm, 3) +
                " mm thick";
  }
  return v;
}

}  // namespace

Anatomy make_anatomy(const Proxy& proxy, const DiameterField& field, const Context& context) {
  Anatomy a;
  a.surface = &proxy.surface;
  a.field = &field;
  a.frame = proxy.frame;
  a.volume_mm3 = proxy.solid.volume_mm3();
  a.graph = make_face_graph(proxy.surface);
  a.body = make_voxel_body(proxy.solid, context);
  context.check();
  a.nearest = nearest_inside(a.body);
  context.check();
  a.face_of_sample = nearest_face(a.body, a.graph.centroid);
  for (const Vec3d p : a.graph.centroid) {
    const Vec3d s = (p - a.body.origin) / a.body.voxel_mm;
    const auto at = [](double v, std::int32_t n) {
      return std::clamp(static_cast<std::int32_t>(std::lround(v)), 0, n - 1);
    };
    const std::int32_t i = at(s.x, a.body.size.x);
    const std::int32_t j = at(s.y, a.body.size.y);
    const std::int32_t k = at(s.z, a.body.size.z);
    a.sample_of_face.push_back(a.nearest[static_cast<std::size_t>((k * a.body.size.y + j) * a.body.size.x + i)]);
  }
  for (std::size_t s = 0; s < a.body.count(); ++s) a.centre = a.centre + a.body.position(static_cast<std::int32_t>(s));
  a.centre = a.centre / static_cast<double>(a.body.count());
  return a;
}

LimbPiece CutPieces::piece(const Anatomy& anatomy, int id) const {
  LimbPiece p;
  for (std::size_t s = 0; s < of.size(); ++s)
    if (of[s] == id) p.samples.push_back(static_cast<std::int32_t>(s));
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    if (sides[c][0] != id && sides[c][1] != id) continue;
    std::vector<std::int32_t> face;
    for (const auto* side : {&severed[c].near, &severed[c].far})
      for (const std::int32_t s : *side)
        if (of[static_cast<std::size_t>(s)] == id) face.push_back(s);
    std::sort(face.begin(), face.end());
    if (!face.empty()) p.faces.push_back(std::move(face));
  }
  p.diameter_mm = median_diameter(anatomy, of, id);
  return p;
}

CutPieces cut_body(const Anatomy& anatomy, std::vector<Section> cuts, double min_area) {
  const VoxelBody& body = anatomy.body;
  CutPieces result;
  for (;;) {
    result = {};
    result.links = body.links;
    for (const Section& cut : cuts) result.severed.push_back(sever(body, cut, result.links));
    Components c = components(body, result.links);
    absorb_crumbs(anatomy, min_area, c);
    std::vector<Section> separating;
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      const int near = most_frequent(result.severed[i].near, c.of);
      const int far = most_frequent(result.severed[i].far, c.of);
      if (near < 0 || far < 0 || near == far) continue;
      separating.push_back(cuts[i]);
      result.sides.push_back({near, far});
    }
    if (separating.size() == cuts.size()) {
      result.cuts = std::move(cuts);
      result.shared.assign(result.cuts.size(), 0);
      result.of = std::move(c.of);
      result.count = c.count;
      return result;
    }
    cuts = std::move(separating);
  }
}

void part_by_pairs(const Anatomy& anatomy, CutPieces& pieces) {
  const VoxelBody& body = anatomy.body;
  const CutPieces whole = std::move(pieces);
  pieces = {};
  pieces.links = whole.links;
  pieces.of = whole.of;
  pieces.count = whole.count;
  for (std::size_t c = 0; c < whole.cuts.size(); ++c) {
    const std::vector<std::int32_t>&near = whole.severed[c].near, &far = whole.severed[c].far;
    std::map<std::array<int, 2>, Severed> pairs;
    for (const std::int32_t s : near) {
      for (int d = 0; d < VoxelBody::directions; ++d) {
        if ((body.links[static_cast<std::size_t>(s)] >> static_cast<unsigned>(d) & 1U) == 0) continue;
        const std::int32_t n = body.neighbour(s, d);
        const std::array<int, 2> pair{whole.of[static_cast<std::size_t>(s)], whole.of[static_cast<std::size_t>(n)]};
        if (pair[0] == pair[1] || !std::binary_search(far.begin(), far.end(), n)) continue;
        pairs[pair].near.push_back(s);
        pairs[pair].far.push_back(n);
      }
    }
    std::erase_if(pairs, [](const auto& pair) { return pair.second.near.size() < least_links; });
    for (auto& [sides, severed] : pairs) {
      for (auto* side : {&severed.near, &severed.far}) {
        std::sort(side->begin(), side->end());
        side->erase(std::unique(side->begin(), side->end()), side->end());
      }
      pieces.cuts.push_back(whole.cuts[c]);
      pieces.sides.push_back(sides);
      pieces.severed.push_back(std::move(severed));
      pieces.shared.push_back(pairs.size() > 1 ? 1 : 0);
    }
  }
}

Limbs find_limbs(const Anatomy& anatomy, double threshold, double min_area, double min_slenderness) {
  const Segmentation seg = segment(*anatomy.surface, anatomy.graph, anatomy.field->normalized, threshold, min_area);
  Limbs limbs;
  std::vector<std::vector<std::int32_t>> samples(seg.regions.size());
  for (std::size_t s = 0; s < anatomy.body.count(); ++s) {
    const int region = seg.region[static_cast<std::size_t>(anatomy.face_of_sample[s])];
    samples[static_cast<std::size_t>(region)].push_back(static_cast<std::int32_t>(s));
  }
  std::vector<RegionCuts> candidates;
  for (std::size_t r = 0; r < seg.regions.size(); ++r) {
    const SurfaceRegion& region = seg.regions[r];
    if (!region.thin || region.loops.empty() || samples[r].empty()) continue;
    RegionCuts candidate{static_cast<int>(r), {}};
    for (const BorderLoop& loop : region.loops) {
      auto cut = cleanest_section(anatomy.body, loop.centre, loop.direction,
                                  std::max(loop.radius_mm, anatomy.body.voxel_mm), loop.centre - anatomy.centre);
      if (!cut || cut->area_mm2 > clean_area * std::numbers::pi * loop.radius_mm * loop.radius_mm) continue;
      candidate.cuts.push_back(std::move(*cut));
    }
    if (!candidate.cuts.empty()) candidates.push_back(std::move(candidate));
  }
  for (;;) {
    std::vector<Section> cuts;
    for (const RegionCuts& candidate : candidates)
      cuts.insert(cuts.end(), candidate.cuts.begin(), candidate.cuts.end());
    limbs.pieces = cut_body(anatomy, std::move(cuts), min_area);
    limbs.limb.assign(static_cast<std::size_t>(limbs.pieces.count), 0);
    limbs.count = 0;
    std::vector<std::size_t> size(static_cast<std::size_t>(limbs.pieces.count), 0);
    for (const std::int32_t id : limbs.pieces.of) ++size[static_cast<std::size_t>(id)];
    std::vector<RegionCuts> kept;
    for (RegionCuts& candidate : candidates) {
      const auto r = static_cast<std::size_t>(candidate.region);
      const Verdict v = judge(anatomy, limbs.pieces, size, samples[r], min_slenderness);
      if (v.why_not.empty()) {
        limbs.limb[static_cast<std::size_t>(v.piece)] = 1;
        ++limbs.count;
        kept.push_back(std::move(candidate));
      } else {
        const Vec3d at = anatomy.frame.to_world(seg.regions[r].loops.front().centre);
        limbs.notes.push_back("the thin region at (" + number_text(at.x, 4) + ", " + number_text(at.y, 4) + ", " +
                              number_text(at.z, 4) + ") mm joins its neighbour: " + v.why_not);
      }
    }
    if (kept.size() == candidates.size()) return limbs;
    candidates = std::move(kept);
  }
}

}  // namespace fibrolite
