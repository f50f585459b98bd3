// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/partition.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "decompose.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "label_samples.h"

namespace fibrolite {
namespace {

constexpr double sweep_from = 0.15;
constexpr double sweep_step = 0.025;
constexpr int sweep_count = 25;          // up to 0.75: above it nearly everything is thin
constexpr double same_next = 0.75;       // overlap of a limb at one threshold with itself at the next
constexpr double same_over_range = 0.6;  // and with itself at the first threshold of the range
constexpr std::size_t least_range = 3;   // thresholds in a row: fewer are chance
constexpr double even_diameters = 1.5;   // 90th over 10th percentile: below this a threshold only sorts noise

double threshold_at(std::size_t step) { return sweep_from + sweep_step * static_cast<double>(step); }

void check_params(const PartitionParams& p) {
  check_overrides(p.overrides);
  const auto out_of = [](double v, double lo, double hi) { return !(v >= lo && v <= hi); };
  if (p.threshold && out_of(*p.threshold, 0, 1)) {
    throw Error(Code::BadRecipe, "the threshold must be 0 to 1", "partition.threshold", "leave it out for auto");
  }
  if (out_of(p.min_area, 0, 0.5)) {
    throw Error(Code::BadRecipe, "the smallest area must be 0 to 0.5 of the surface", "partition.min_area",
                "try 0.012");
  }
  if (out_of(p.concentration, 0, 100)) {
    throw Error(Code::BadRecipe, "the concentration must be 0 to 100", "partition.concentration", "try 1.5");
  }
  if (!(p.core_share > 0 && p.core_share <= 2)) {
    throw Error(Code::BadRecipe, "the share must be above 0, up to 2", "partition.core_share", "try 0.5");
  }
  if (out_of(p.min_slenderness, 0, 100)) {
    throw Error(Code::BadRecipe, "the least slenderness must be 0 to 100", "partition.min_slenderness", "try 1");
  }
}

// 90th over 10th percentile of the diameters, by area.
double diameter_ratio(const Anatomy& anatomy) {
  std::vector<std::size_t> order(anatomy.graph.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::vector<double>& d = anatomy.field->diameter_mm;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return d[a] != d[b] ? d[a] < d[b] : a < b; });
  const auto percentile = [&](double share) {
    double sum = 0;
    for (const std::size_t f : order) {
      sum += anatomy.graph.area_mm2[f];
      if (sum >= share * anatomy.graph.total_area_mm2) return d[f];
    }
    return d[order.back()];
  };
  const double low = percentile(0.1);
  return low > 0 ? percentile(0.9) / low : std::numeric_limits<double>::infinity();
}

// Do two partitions have the same limbs? One to one, each sharing `overlap` of the samples of both (intersection over
// union).
bool same_limbs(const Limbs& a, const Limbs& b, double overlap) {
  if (a.count != b.count) return false;
  std::map<std::pair<int, int>, double> common;
  std::map<int, double> size_a;
  std::map<int, double> size_b;
  for (std::size_t s = 0; s < a.pieces.of.size(); ++s) {
    const int pa = a.pieces.of[s];
    const int pb = b.pieces.of[s];
    const bool in_a = a.limb[static_cast<std::size_t>(pa)] != 0;
    const bool in_b = b.limb[static_cast<std::size_t>(pb)] != 0;
    if (in_a) ++size_a[pa];
    if (in_b) ++size_b[pb];
    if (in_a && in_b) ++common[{pa, pb}];
  }
  int matched = 0;
  for (const auto& [pair, both] : common)
    if (both >= overlap * (size_a[pair.first] + size_b[pair.second] - both)) ++matched;
  return matched == a.count;
}

struct Choice {
  Limbs limbs;
  double threshold = 0, stable_from = 0, stable_to = 0;
  bool found = false;
};

// The partition whose limbs persist longest, summed over them: limbs times the range of thresholds over which they stay
// the same. Of its range the middle.
Choice most_stable(const Anatomy& anatomy, const PartitionParams& params, const Context& context) {
  std::vector<Limbs> sweep(sweep_count);
  tbb::parallel_for(0, sweep_count, [&](int i) {
    context.check();
    Limbs& limbs = sweep[static_cast<std::size_t>(i)];
    limbs = find_limbs(anatomy, threshold_at(static_cast<std::size_t>(i)), params.min_area, params.min_slenderness);
    limbs.pieces.links = {};  // the chosen one is made again: many fine proxies would fill the memory
  });
  std::size_t best_first = 0;
  std::size_t best_last = 0;
  std::size_t best_score = 0;
  for (std::size_t first = 0; first < sweep.size(); ++first) {
    std::size_t last = first;
    while (last + 1 < sweep.size() && same_limbs(sweep[last], sweep[last + 1], same_next) &&
           same_limbs(sweep[first], sweep[last + 1], same_over_range))
      ++last;
    const std::size_t range = last - first + 1;
    if (range < least_range) continue;
    // Of equals the one with the higher thresholds has the larger limbs.
    const std::size_t score = range * static_cast<std::size_t>(sweep[first].count);
    if (score == 0 || score < best_score) continue;
    best_score = score;
    best_first = first;
    best_last = last;
  }
  Choice choice;
  if (best_score == 0) return choice;
  const std::size_t middle = (best_first + best_last + 1) / 2;
  choice.threshold = threshold_at(middle);
  choice.stable_from = threshold_at(best_first);
  choice.stable_to = threshold_at(best_last);
  choice.limbs = find_limbs(anatomy, choice.threshold, params.min_area, params.min_slenderness);
  choice.found = true;
  return choice;
}

Choice whole_body(const Anatomy& anatomy, double min_area) {
  Choice choice;
  choice.limbs.pieces = cut_body(anatomy, {}, min_area);
  choice.limbs.limb.assign(static_cast<std::size_t>(choice.limbs.pieces.count), 0);
  return choice;
}

// The connected section of the body in a plane or bowl, through the point or the nearest place within a voxel of it.
Section own_section(const Anatomy& anatomy, const Overrides::Plane& plane, std::size_t number) {
  constexpr double steepest = 1;
  const std::string where = std::string("partition.overrides.cuts[").append(std::to_string(number)).append("]");
  const Vec3d here = anatomy.frame.to_local(plane.point_mm);
  const Frame frame = frame_along(here, anatomy.frame.to_local(plane.point_mm + normalized(plane.normal)) - here);
  const VoxelBody& body = anatomy.body;
  BentPlane surface{frame};
  if (plane.radius_mm != 0) surface.bend.xx = surface.bend.yy = 0.5 / plane.radius_mm;
  // A reach that is too small finds no end of the section, one that is too large sees it too coarsely.
  for (double reach = 2 * body.voxel_mm; reach < 2 * bounds(*anatomy.surface).longest_side(); reach *= 1.5)
    if (std::optional<Section> found = section(body, surface, reach)) {
      if (found->bend.steepest(found->radius_mm) <= steepest) return *found;
      throw Error(Code::BadRecipe, "the cut is bent too much for a section this wide", where,
                  "make radius_mm " +
                      number_text(std::ceil(std::abs(plane.radius_mm) * found->bend.steepest(found->radius_mm)), 4) +
                      " or more, or leave it out for a plane");
    }
  throw Error(Code::BadRecipe, "this cut meets no section of the model near its point", where,
              "put point_mm inside the model");
}

// The pieces between the user's own cuts; any of them may be a limb.
Choice own_choice(const Anatomy& anatomy, const PartitionParams& params) {
  std::vector<Section> cuts;
  for (std::size_t i = 0; i < params.overrides.cuts.size(); ++i)
    cuts.push_back(own_section(anatomy, params.overrides.cuts[i], i));
  const std::size_t wanted = cuts.size();
  Choice choice;
  choice.limbs.pieces = cut_body(anatomy, std::move(cuts), params.min_area);
  choice.limbs.limb.assign(static_cast<std::size_t>(choice.limbs.pieces.count), 1);
  const std::size_t left = choice.limbs.pieces.cuts.size();
  part_by_pairs(anatomy, choice.limbs.pieces);
  if (left < wanted) {
    choice.limbs.notes.push_back(
        std::to_string(wanted - left) +
        " of the cuts in partition.overrides part nothing: a ring takes two, and what is smaller than "
        "partition.min_area stays with its neighbour");
  }
  choice.found = true;
  return choice;
}

// Per inside sample: does it lie in a piece that may be a limb? Pieces without any cut (a whole body) may be one too.
std::vector<std::uint8_t> limb_samples(const Limbs& limbs) {
  std::vector<std::uint8_t> may = limbs.limb;
  std::vector<std::uint8_t> is_cut(may.size(), 0);
  for (const auto& side : limbs.pieces.sides)
    for (const int id : side) is_cut[static_cast<std::size_t>(id)] = 1;
  std::vector<std::uint8_t> samples(limbs.pieces.of.size());
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const auto id = static_cast<std::size_t>(limbs.pieces.of[s]);
    samples[s] = may[id] != 0 || is_cut[id] == 0 ? 1 : 0;
  }
  return samples;
}

std::vector<std::uint8_t> limb_pieces(const CutPieces& pieces, const std::vector<std::uint8_t>& samples) {
  std::vector<std::size_t> votes(static_cast<std::size_t>(pieces.count), 0);
  std::vector<std::size_t> size(votes.size(), 0);
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const auto id = static_cast<std::size_t>(pieces.of[s]);
    ++size[id];
    votes[id] += samples[s];
  }
  std::vector<std::uint8_t> limb(votes.size());
  for (std::size_t i = 0; i < limb.size(); ++i) limb[i] = 2 * votes[i] > size[i] ? 1 : 0;
  return limb;
}

bool contains(const std::vector<Section>& list, const Section& cut) {
  return std::any_of(list.begin(), list.end(), [&](const Section& other) {
    return other.frame.origin == cut.frame.origin && other.frame.z == cut.frame.z && other.bend == cut.bend;
  });
}

// A branching limb is parted into its branches; what would be too small stays with its neighbour.
CutPieces split_branches(const Anatomy& anatomy, CutPieces pieces, const std::vector<std::uint8_t>& limb_sample,
                         double min_area, const Context& context) {
  constexpr int rounds = 4;  // a branch may branch again
  for (int round = 0; round < rounds; ++round) {
    const std::vector<std::uint8_t> limb = limb_pieces(pieces, limb_sample);
    std::vector<Section> cuts = pieces.cuts;
    for (int id = 0; id < pieces.count; ++id) {
      context.check();
      if (limb[static_cast<std::size_t>(id)] == 0) continue;
      std::vector<Split> found = branch_cuts(anatomy.body, pieces.links, pieces.piece(anatomy, id));
      cuts.insert(cuts.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
    }
    if (cuts.size() == pieces.cuts.size()) break;
    CutPieces next = cut_body(anatomy, std::move(cuts), min_area);
    if (next.cuts.size() <= pieces.cuts.size()) break;
    pieces = std::move(next);
  }
  return pieces;
}

struct Described {
  Candidate candidate;
  int piece = 0;
};

// Samples count with the share of their cell that is inside; what rounding and kinks leave is spread evenly, so that
// the parts add up to the proxy's own volume.
std::vector<double> piece_volumes(const Anatomy& anatomy, const CutPieces& pieces, double all_mm3) {
  const VoxelBody& body = anatomy.body;
  std::vector<double> volume(static_cast<std::size_t>(pieces.count), 0);
  double sum = 0;
  for (std::size_t at = 0; at < body.distance.size(); ++at) {
    const double share = std::clamp(0.5 - static_cast<double>(body.distance[at]) / body.voxel_mm, 0.0, 1.0);
    if (share <= 0) continue;
    volume[static_cast<std::size_t>(pieces.of[static_cast<std::size_t>(anatomy.nearest[at])])] += share;
    sum += share;
  }
  for (double& v : volume) v *= all_mm3 / sum;
  return volume;
}

Candidate describe(const Anatomy& anatomy, const CutPieces& pieces, int id, bool may_be_limb, double least_slenderness,
                   double volume, const Context& context) {
  const LimbPiece piece = pieces.piece(anatomy, id);
  Candidate c;
  c.volume_mm3 = volume;
  c.diameter_mm = piece.diameter_mm;
  for (const std::int32_t s : piece.samples) c.centroid_mm = c.centroid_mm + anatomy.body.position(s);
  c.centroid_mm = c.centroid_mm / static_cast<double>(piece.samples.size());
  c.axis = principal_axis(anatomy.body, piece.samples);
  c.length_mm = c.axis.length_mm();
  if (!may_be_limb) {
    c.reason = "thick: median diameter " + number_text(c.diameter_mm, 3) + " mm";
    return c;
  }
  const LimbShape shape = limb_shape(anatomy.body, pieces.links, piece, least_slenderness, context);
  const double slenderness = shape.slenderness();
  const bool flat = shape.width_mm > flattest_limb * piece.diameter_mm;
  const bool slender = slenderness >= least_slenderness;
  c.column_like = slender && !flat;
  c.reason = std::string(shape.ring ? "a ring " : "a limb ") + number_text(shape.length_mm, 3) + " mm long, " +
             number_text(shape.width_mm, 3) + " mm wide, " + number_text(piece.diameter_mm, 3) + " mm thick: " +
             (flat      ? "flat"
              : slender ? "slender"
                        : "stout") +
             " (slenderness " + number_text(slenderness, 3) + ", limit " + number_text(least_slenderness, 3) + ")";
  if (!c.column_like) return c;
  c.axis = shape.axis;
  c.length_mm = shape.length_mm;
  return c;
}

std::vector<Described> describe_all(const Anatomy& anatomy, const CutPieces& pieces,
                                    const std::vector<std::uint8_t>& limb_sample, double least_slenderness,
                                    const Context& context) {
  const std::vector<std::uint8_t> may_be_limb = limb_pieces(pieces, limb_sample);
  const std::vector<double> volume = piece_volumes(anatomy, pieces, anatomy.volume_mm3);
  std::vector<Described> described(static_cast<std::size_t>(pieces.count));
  tbb::parallel_for(0, pieces.count, [&](int id) {
    const auto i = static_cast<std::size_t>(id);
    described[i] = {describe(anatomy, pieces, id, may_be_limb[i] != 0, least_slenderness, volume[i], context), id};
  });
  return described;
}

/// What a threshold means in this model: the largest diameter below it, mm.
double diameter_at(const DiameterField& field, double threshold) {
  double mm = 0;
  for (std::size_t f = 0; f < field.normalized.size(); ++f)
    if (field.normalized[f] < threshold) mm = std::max(mm, field.diameter_mm[f]);
  return mm;
}

}  // namespace

Partition partition(const Proxy& proxy, const DiameterField& field, const PartitionParams& params,
                    const Context& context) {
  check_params(params);
  if (field.normalized.size() != proxy.surface.triangles.size() ||
      field.diameter_mm.size() != field.normalized.size()) {
    throw Error(Code::Internal, "the diameters do not belong to the proxy's surface", "partition");
  }
  const Anatomy anatomy = make_anatomy(proxy, field, context);
  context.progress(0.2);

  Partition result;
  Choice choice;
  const double ratio = diameter_ratio(anatomy);
  const bool own = !params.overrides.cuts.empty();
  if (own) {
    choice = own_choice(anatomy, params);
  } else if (ratio < even_diameters) {
    choice = whole_body(anatomy, params.min_area);
    result.notes.push_back("the diameters hardly differ (90th over 10th percentile " + number_text(ratio, 3) +
                           "): the model is parted by its branches alone");
  } else if (params.threshold) {
    choice.limbs = find_limbs(anatomy, *params.threshold, params.min_area, params.min_slenderness);
    choice.threshold = *params.threshold;
    if (choice.limbs.count == 0)
      result.notes.push_back("the threshold " + number_text(choice.threshold) + ", a diameter of " +
                             number_text(diameter_at(field, choice.threshold), 3) +
                             " mm in this model, cuts off no limb; partition.threshold=auto looks for one that does");
  } else {
    choice = most_stable(anatomy, params, context);
    if (!choice.found) {
      choice = whole_body(anatomy, params.min_area);
      result.notes.push_back("no threshold from " + number_text(sweep_from) + " to " +
                             number_text(threshold_at(sweep_count - 1)) + " cuts off a limb");
    }
  }
  context.progress(0.6);
  result.threshold = choice.threshold;
  result.stable_from = choice.stable_from;
  result.stable_to = choice.stable_to;
  result.notes.insert(result.notes.end(), choice.limbs.notes.begin(), choice.limbs.notes.end());

  const std::vector<std::uint8_t> limb_sample = limb_samples(choice.limbs);
  const std::vector<Section> by_threshold = choice.limbs.pieces.cuts;
  // A body of uneven thickness without limbs is a lump until it is clearly drawn out.
  const double least_slenderness = params.min_slenderness * (by_threshold.empty() && ratio >= even_diameters ? 2 : 1);
  CutPieces pieces = std::move(choice.limbs.pieces);
  if (!own) pieces = split_branches(anatomy, std::move(pieces), limb_sample, params.min_area, context);
  std::vector<Described> described = describe_all(anatomy, pieces, limb_sample, least_slenderness, context);
  for (;;) {
    // A fork between lumps that no fibre could run through: parting them gains nothing.
    std::vector<Section> kept;
    for (std::size_t c = 0; c < pieces.cuts.size(); ++c) {
      const bool column = described[static_cast<std::size_t>(pieces.sides[c][0])].candidate.column_like ||
                          described[static_cast<std::size_t>(pieces.sides[c][1])].candidate.column_like;
      if (column || contains(by_threshold, pieces.cuts[c])) kept.push_back(pieces.cuts[c]);
    }
    if (kept.size() == pieces.cuts.size()) break;
    pieces = cut_body(anatomy, std::move(kept), params.min_area);
    described = describe_all(anatomy, pieces, limb_sample, least_slenderness, context);
  }
  context.progress(0.8);
  // Largest first: an order that turns with the model.
  std::sort(described.begin(), described.end(), [](const Described& a, const Described& b) {
    return a.candidate.volume_mm3 != b.candidate.volume_mm3 ? a.candidate.volume_mm3 > b.candidate.volume_mm3
                                                            : a.piece < b.piece;
  });
  std::vector<int> name(described.size());
  for (std::size_t i = 0; i < described.size(); ++i) {
    described[i].candidate.id = static_cast<int>(i);
    name[static_cast<std::size_t>(described[i].piece)] = static_cast<int>(i);
    result.candidates.push_back(std::move(described[i].candidate));
  }
  for (std::size_t c = 0; c < pieces.cuts.size(); ++c) {
    const auto& side = pieces.sides[c];
    result.cuts.push_back({name[static_cast<std::size_t>(side[0])], name[static_cast<std::size_t>(side[1])],
                           pieces.cuts[c].frame, pieces.cuts[c].radius_mm, own, pieces.shared[c] != 0,
                           pieces.cuts[c].bend});
  }
  context.progress(0.9);
  if (pieces.count > 1) result.labels = make_labels(make_label_samples(anatomy, pieces, name));
  context.progress(1);
  return result;
}

void choose_infills(Partition& partition, const Overrides& overrides) {
  for (const Overrides::PartChoice& named : overrides.parts) {
    if (const auto last = static_cast<int>(partition.candidates.size()) - 1; named.id > last) {
      throw Error(Code::BadRecipe, "there is no part " + std::to_string(named.id), "partition.overrides.parts",
                  "use 0 to " + std::to_string(last) + "; fibrolite partition shows them");
    }
    partition.candidates[static_cast<std::size_t>(named.id)].chosen = named.infill;
  }
}

}  // namespace fibrolite
