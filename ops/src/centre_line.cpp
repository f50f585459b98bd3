// SPDX-License-Identifier: GPL-3.0-or-later
#include "centre_line.h"

#include <algorithm>
#include <cmath>

namespace fibrolite {
namespace {

constexpr std::size_t least_samples = 12;  // in a level set
constexpr double most_levels = 300;

struct Level {
  Vec3d centroid{};
  std::size_t first = 0, last = 0;  // of the order
  double width_mm = 0;
};

// About one level per voxel of the way; each takes its neighbours in, since one layer of voxels is no section: it is a
// staircase.
std::vector<Level> levels(const VoxelBody& body, const std::vector<std::int32_t>& order, double way_mm, bool ring) {
  const auto by_length = static_cast<std::size_t>(std::clamp(way_mm / body.voxel_mm, 1.0, most_levels));
  const std::size_t count = std::max<std::size_t>(std::min(by_length, order.size() / least_samples), 1);
  const std::size_t n = order.size();
  std::vector<Level> result(count);
  for (std::size_t l = 0; l < count; ++l) {
    Level& level = result[l];
    const std::size_t half = n / count;
    const std::size_t from = l * n / count;
    const std::size_t to = (l + 1) * n / count;
    // The window shrinks evenly towards the ends of an open line, so that it stays centred.
    const std::size_t grow = ring ? half : std::min({half, from, n - to});
    level.first = from >= grow ? from - grow : 0;
    level.last = std::min(to + grow, n);
    for (std::size_t i = level.first; i < level.last; ++i) level.centroid = level.centroid + body.position(order[i]);
    level.centroid = level.centroid / static_cast<double>(level.last - level.first);
  }
  return result;
}

double length_of(const std::vector<Vec3d>& p) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < p.size(); ++i) length += norm(p[i + 1] - p[i]);
  return length;
}

std::vector<Vec3d> resampled(const std::vector<Vec3d>& p, std::size_t pieces) {
  const double length = length_of(p);
  std::vector<Vec3d> even{p.front()};
  std::size_t segment = 0;
  double before = 0;
  for (std::size_t i = 1; i < pieces; ++i) {
    const double wanted = length * static_cast<double>(i) / static_cast<double>(pieces);
    double step = norm(p[segment + 1] - p[segment]);
    while (before + step < wanted && segment + 2 < p.size()) {
      before += step;
      ++segment;
      step = norm(p[segment + 1] - p[segment]);
    }
    const double t = step > 0 ? std::clamp((wanted - before) / step, 0.0, 1.0) : 0;
    even.push_back((1 - t) * p[segment] + t * p[segment + 1]);
  }
  even.push_back(p.back());
  return even;
}

// One pass of weights 1 2 1; the ends of an open line stay, a ring has none.
void relax(std::vector<Vec3d>& p, bool ring) {
  const std::vector<Vec3d> q = p;
  const std::size_t last = p.size() - 1;
  for (std::size_t i = 1; i < last; ++i) p[i] = 0.25 * q[i - 1] + 0.5 * q[i] + 0.25 * q[i + 1];
  if (ring) p[0] = p[last] = 0.25 * q[last - 1] + 0.5 * q[0] + 0.25 * q[1];
}

// Largest turn of the line per mm.
double sharpest_turn(const std::vector<Vec3d>& p, bool ring) {
  double sharpest = 0;
  const std::size_t last = p.size() - 1;
  for (std::size_t i = 1; i < last + (ring ? 1 : 0); ++i) {
    const Vec3d before = p[i] - p[i - 1];
    const Vec3d after = (i == last ? p[1] : p[i + 1]) - p[i];
    const double step = 0.5 * (norm(before) + norm(after));
    if (step > 0) sharpest = std::max(sharpest, norm(normalized(after) - normalized(before)) / step);
  }
  return sharpest;
}

void measure_widths(const VoxelBody& body, const std::vector<std::int32_t>& order, std::vector<Level>& list,
                    bool ring) {
  const std::size_t n = list.size();
  for (std::size_t l = 0; l < n; ++l) {
    // Neighbouring centroids are noisy: the direction is taken over several levels.
    const std::size_t reach = std::max<std::size_t>(n / 16, 1);
    const std::size_t a = ring ? (l + n - reach) % n : l - std::min(l, reach);
    const std::size_t b = ring ? (l + reach) % n : std::min(l + reach, n - 1);
    const Vec3d along = normalized(list[b].centroid - list[a].centroid);
    const Frame frame = frame_along(list[l].centroid, along == Vec3d{} ? Vec3d{0, 0, 1} : along);
    double xx = 0;
    double xy = 0;
    double yy = 0;
    for (std::size_t i = list[l].first; i < list[l].last; ++i) {
      const Vec3d p = frame.to_local(body.position(order[i]));
      xx += p.x * p.x;
      xy += p.x * p.y;
      yy += p.y * p.y;
    }
    const auto count = static_cast<double>(list[l].last - list[l].first);
    const double mean = 0.5 * (xx + yy) / count;
    const double apart = std::hypot(0.5 * (xx - yy), xy) / count;
    // A disc of diameter d has second moment d^2 / 16.
    list[l].width_mm = 4 * std::sqrt(mean + apart);
  }
}

// The width that nine tenths of the levels keep below: a limb is as stout as its thickest stretch.
double usual_width(const std::vector<Level>& list) {
  std::vector<double> widths;
  for (const Level& level : list) widths.push_back(level.width_mm);
  const auto at = widths.begin() + static_cast<std::ptrdiff_t>(9 * widths.size() / 10);
  std::nth_element(widths.begin(), at, widths.end());
  return *at;
}

// How far the samples of the levels beyond `p` reach along `t`.
double reach_beyond(const VoxelBody& body, const std::vector<std::int32_t>& order, std::size_t from, std::size_t to,
                    Vec3d p, Vec3d t) {
  double reach = 0;
  for (std::size_t i = from; i < to; ++i) reach = std::max(reach, dot(body.position(order[i]) - p, t));
  return reach + 0.5 * body.voxel_mm;
}

Vec3d end_direction(const std::vector<Vec3d>& p, double over_mm) {
  const Vec3d end = p.back();
  for (std::size_t i = p.size() - 1; i-- > 0;)
    if (norm(end - p[i]) >= over_mm || i == 0) return normalized(end - p[i]);
  return {};
}

}  // namespace

CentreLine centre_line(const VoxelBody& body, const std::vector<std::int32_t>& order, double way_mm, bool ring,
                       bool first_is_cut, bool second_is_cut) {
  CentreLine line;
  std::vector<Level> list = levels(body, order, way_mm, ring);
  if (list.size() < 3) return line;
  measure_widths(body, order, list, ring);
  line.width_mm = usual_width(list);

  std::vector<Vec3d> p;
  for (const Level& level : list) p.push_back(level.centroid);
  if (ring) {
    p.push_back(p.front());
  } else {
    // Level sets bend round the corners of a tip: leave half a width of it out, if so much is left.
    const double whole = length_of(p);
    const double trim = std::min(0.5 * line.width_mm, 0.25 * whole);
    std::size_t first = 0;
    std::size_t last = p.size() - 1;
    double passed = 0;
    if (!first_is_cut)
      while (first + 1 < last && passed < trim) {
        passed += norm(p[first + 1] - p[first]);
        ++first;
      }
    passed = 0;
    if (!second_is_cut)
      while (last > first + 1 && passed < trim) {
        passed += norm(p[last] - p[last - 1]);
        --last;
      }
    p = {p.begin() + static_cast<std::ptrdiff_t>(first), p.begin() + static_cast<std::ptrdiff_t>(last) + 1};
  }

  const double length = length_of(p);
  if (!(length > 0)) return line;
  const auto pieces = static_cast<std::size_t>(std::clamp(length / (0.5 * body.voxel_mm), 8.0, 400.0));
  p = resampled(p, pieces);
  const double step = length / static_cast<double>(pieces);
  // A pass spreads by sqrt(1/2) steps: enough passes for a quarter of the width.
  const auto passes = static_cast<int>(std::clamp(2 * std::pow(0.25 * line.width_mm / step, 2.0), 4.0, 400.0));
  for (int pass = 0; pass < passes; ++pass) relax(p, ring);
  // Normal planes of a line that turns within half a width would cross inside the limb.
  for (int pass = 0; pass < 4000 && sharpest_turn(p, ring) * 0.6 * line.width_mm > 1; ++pass) relax(p, ring);

  if (ring) {
    line.length_mm = length_of(p);
    line.points = resampled(p, pieces);
    return line;
  }
  const double over = std::min(line.width_mm, 0.4 * length);
  const std::size_t tail = order.size() / 4 + 1;
  const Vec3d forward = end_direction(p, over);
  const double ahead = reach_beyond(body, order, order.size() - tail, order.size(), p.back(), forward);
  std::reverse(p.begin(), p.end());
  const Vec3d backward = end_direction(p, over);
  const double behind = reach_beyond(body, order, 0, tail, p.back(), backward);
  std::reverse(p.begin(), p.end());
  line.length_mm = behind + length_of(p) + ahead;
  const double past = 0.25 * line.width_mm;
  p.insert(p.begin(), p.front() + (behind + past) * backward);
  p.push_back(p.back() + (ahead + past) * forward);
  line.points = resampled(p, pieces);
  return line;
}

}  // namespace fibrolite
