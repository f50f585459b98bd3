// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel_body.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

// The way of a wave: shortest first, ties by sample, so the order never depends on chance.
struct Front {
  float distance;
  std::int32_t sample;
  friend bool operator>(const Front& a, const Front& b) {
    return a.distance != b.distance ? a.distance > b.distance : a.sample > b.sample;
  }
};
using Wave = std::priority_queue<Front, std::vector<Front>, std::greater<>>;

constexpr std::int32_t far_squared = 1 << 30;

// Lower envelope of the parabolas (x - i)^2 + squared[i] along one line of samples.
class Envelope {
 public:
  explicit Envelope(std::size_t length) : values_(length), owners_(length), vertex_(length), start_(length + 1) {}

  void run(std::vector<std::int32_t>& owner, std::vector<std::int32_t>& squared, std::size_t first,
           std::size_t stride) {
    const auto n = static_cast<std::int64_t>(values_.size());
    std::int64_t top = -1;
    for (std::int64_t i = 0; i < n; ++i) {
      const std::size_t at = first + static_cast<std::size_t>(i) * stride;
      const auto k = static_cast<std::size_t>(i);
      values_[k] = squared[at];
      owners_[k] = owner[at];
      if (values_[k] >= far_squared) continue;
      // From where on this parabola is the lowest.
      std::int64_t from = 0;
      while (top >= 0) {
        const std::int64_t v = vertex_[static_cast<std::size_t>(top)];
        const std::int64_t rise = values_[k] + i * i - values_[static_cast<std::size_t>(v)] - v * v;
        const std::int64_t run = 2 * (i - v);
        from = rise < 0 ? 0 : rise / run + 1;  // the earlier one keeps a tie
        if (from > start_[static_cast<std::size_t>(top)]) break;
        --top;
        from = 0;
      }
      ++top;
      vertex_[static_cast<std::size_t>(top)] = i;
      start_[static_cast<std::size_t>(top)] = top == 0 ? 0 : from;
    }
    if (top < 0) return;
    std::int64_t piece = 0;
    for (std::int64_t i = 0; i < n; ++i) {
      while (piece < top && start_[static_cast<std::size_t>(piece + 1)] <= i) ++piece;
      const std::int64_t v = vertex_[static_cast<std::size_t>(piece)];
      const std::size_t at = first + static_cast<std::size_t>(i) * stride;
      squared[at] = static_cast<std::int32_t>(values_[static_cast<std::size_t>(v)] + (i - v) * (i - v));
      owner[at] = owners_[static_cast<std::size_t>(v)];
    }
  }

 private:
  std::vector<std::int64_t> values_;
  std::vector<std::int32_t> owners_;
  std::vector<std::int64_t> vertex_, start_;
};

void lay_out(VoxelBody& body, const Solid& solid) {
  const double h = solid.grid().voxel_mm;
  const Box3d box = solid.bounds_mm();
  const auto low = [&](double p) { return static_cast<std::int32_t>(std::floor(p / h + 1e-6)) - VoxelBody::margin; };
  const auto samples = [&](double from, double to) {
    return static_cast<std::int32_t>(std::ceil(to / h - 1e-6)) + VoxelBody::margin - low(from) + 1;
  };
  body.voxel_mm = h;
  body.origin = h * Vec3d{static_cast<double>(low(box.min.x)), static_cast<double>(low(box.min.y)),
                          static_cast<double>(low(box.min.z))};
  body.size = {samples(box.min.x, box.max.x), samples(box.min.y, box.max.y), samples(box.min.z, box.max.z)};
  const double all = static_cast<double>(body.size.x) * body.size.y * body.size.z;
  if (all > 0.5 * std::numeric_limits<std::int32_t>::max()) {
    throw Error(Code::TooLarge, "the proxy has too many samples", "partition", "use a coarser proxy");
  }
  std::size_t d = 0;
  for (std::int32_t k = -1; k <= 1; ++k) {
    for (std::int32_t j = -1; j <= 1; ++j) {
      for (std::int32_t i = -1; i <= 1; ++i) {
        if (i == 0 && j == 0 && k == 0) continue;
        body.offset[d] = {i, j, k};
        body.step[d] = (k * body.size.y + j) * body.size.x + i;
        body.length_mm[d] = static_cast<float>(h * std::sqrt(static_cast<double>(i * i + j * j + k * k)));
        ++d;
      }
    }
  }
}

}  // namespace

Vec3i VoxelBody::coordinates(std::int32_t lattice_sample) const {
  const std::int32_t i = lattice_sample % size.x;
  const std::int32_t jk = lattice_sample / size.x;
  return {i, jk % size.y, jk / size.y};
}

Vec3d VoxelBody::position(std::int32_t inside_sample) const {
  const Vec3i c = coordinates(lattice[static_cast<std::size_t>(inside_sample)]);
  return origin + voxel_mm * Vec3d{static_cast<double>(c.x), static_cast<double>(c.y), static_cast<double>(c.z)};
}

float VoxelBody::distance_at(Vec3d p) const {
  const Vec3d s = (p - origin) / voxel_mm;
  const auto corner = [](double value, std::int32_t samples) {
    return std::clamp(static_cast<std::int32_t>(std::floor(value)), 0, samples - 2);
  };
  const std::int32_t i = corner(s.x, size.x);
  const std::int32_t j = corner(s.y, size.y);
  const std::int32_t k = corner(s.z, size.z);
  const auto u = static_cast<float>(std::clamp(s.x - i, 0.0, 1.0));
  const auto v = static_cast<float>(std::clamp(s.y - j, 0.0, 1.0));
  const auto w = static_cast<float>(std::clamp(s.z - k, 0.0, 1.0));
  const std::int32_t row = size.x;
  const std::int32_t slab = size.x * size.y;
  const float* c = distance.data() + (static_cast<std::int64_t>(k) * slab + static_cast<std::int64_t>(j) * row + i);
  const float y0 = (c[0] + u * (c[1] - c[0])) * (1 - v) + (c[row] + u * (c[row + 1] - c[row])) * v;
  const float* e = c + slab;
  const float y1 = (e[0] + u * (e[1] - e[0])) * (1 - v) + (e[row] + u * (e[row + 1] - e[row])) * v;
  return y0 + w * (y1 - y0);
}

VoxelBody make_voxel_body(const Solid& solid, const Context& context) {
  if (solid.empty()) throw Error(Code::BadInput, "the proxy is empty", "partition", "give a solid model");
  VoxelBody body;
  lay_out(body, solid);
  const std::size_t slab = static_cast<std::size_t>(body.size.x) * static_cast<std::size_t>(body.size.y);
  body.distance.resize(slab * static_cast<std::size_t>(body.size.z));
  tbb::parallel_for(0, body.size.z, [&](std::int32_t k) {
    context.check();
    std::size_t at = static_cast<std::size_t>(k) * slab;
    for (std::int32_t j = 0; j < body.size.y; ++j) {
      for (std::int32_t i = 0; i < body.size.x; ++i, ++at) {
        body.distance[at] =
            solid.distance(body.origin + body.voxel_mm * Vec3d{static_cast<double>(i), static_cast<double>(j),
                                                               static_cast<double>(k)});
      }
    }
  });
  body.inside.assign(body.distance.size(), -1);
  for (std::size_t at = 0; at < body.distance.size(); ++at) {
    if (body.distance[at] >= 0) continue;
    body.inside[at] = static_cast<std::int32_t>(body.lattice.size());
    body.lattice.push_back(static_cast<std::int32_t>(at));
  }
  if (body.lattice.empty()) throw Error(Code::BadInput, "the proxy has no inside", "partition", "give a solid model");
  body.links.assign(body.count(), 0);
  tbb::parallel_for(std::size_t{0}, body.count(), [&](std::size_t s) {
    const Vec3d here = body.position(static_cast<std::int32_t>(s));
    for (int d = 0; d < VoxelBody::directions; ++d) {
      const std::int32_t other = body.neighbour(static_cast<std::int32_t>(s), d);
      if (other < 0) continue;
      const Vec3i o = body.offset[static_cast<std::size_t>(d)];
      // A diagonal step must not jump a gap between two limbs.
      if (std::abs(o.x) + std::abs(o.y) + std::abs(o.z) > 1) {
        const Vec3d half{0.5 * o.x, 0.5 * o.y, 0.5 * o.z};
        if (body.distance_at(here + body.voxel_mm * half) >= 0) continue;
      }
      body.links[s] |= 1U << static_cast<unsigned>(d);
    }
  });
  return body;
}

Components components(const VoxelBody& body, const Links& links) {
  Components result;
  result.of.assign(body.count(), -1);
  std::vector<std::int32_t> stack;
  for (std::size_t first = 0; first < body.count(); ++first) {
    if (result.of[first] >= 0) continue;
    const int id = result.count++;
    result.of[first] = id;
    stack.push_back(static_cast<std::int32_t>(first));
    while (!stack.empty()) {
      const std::int32_t s = stack.back();
      stack.pop_back();
      for (int d = 0; d < VoxelBody::directions; ++d) {
        if ((links[static_cast<std::size_t>(s)] >> static_cast<unsigned>(d) & 1U) == 0) continue;
        const std::int32_t n = body.neighbour(s, d);
        if (result.of[static_cast<std::size_t>(n)] >= 0) continue;
        result.of[static_cast<std::size_t>(n)] = id;
        stack.push_back(n);
      }
    }
  }
  return result;
}

std::vector<float> geodesic(const VoxelBody& body, const Links& links, const std::vector<std::int32_t>& sources,
                            double reach_mm) {
  std::vector<float> distance(body.count(), -1);
  Wave wave;
  for (const std::int32_t s : sources) {
    if (distance[static_cast<std::size_t>(s)] == 0) continue;
    distance[static_cast<std::size_t>(s)] = 0;
    wave.push({0, s});
  }
  while (!wave.empty()) {
    const Front front = wave.top();
    wave.pop();
    const auto s = static_cast<std::size_t>(front.sample);
    if (front.distance > distance[s]) continue;
    for (int d = 0; d < VoxelBody::directions; ++d) {
      if ((links[s] >> static_cast<unsigned>(d) & 1U) == 0) continue;
      const std::int32_t n = body.neighbour(front.sample, d);
      const float way = front.distance + body.length_mm[static_cast<std::size_t>(d)];
      if (static_cast<double>(way) > reach_mm) continue;
      float& known = distance[static_cast<std::size_t>(n)];
      if (known >= 0 && known <= way) continue;
      known = way;
      wave.push({way, n});
    }
  }
  return distance;
}

std::vector<std::int32_t> nearest_inside(const VoxelBody& body) {
  std::vector<std::int32_t> owner = body.inside;
  std::vector<std::int32_t> squared(owner.size(), far_squared);  // distance to the owner, voxels^2
  for (const std::int32_t at : body.lattice) squared[static_cast<std::size_t>(at)] = 0;
  const auto nx = static_cast<std::size_t>(body.size.x);
  const auto ny = static_cast<std::size_t>(body.size.y);
  const auto nz = static_cast<std::size_t>(body.size.z);
  // Axis by axis: after the last one the owner is the nearest of all (Felzenszwalb and Huttenlocher 2012).
  const auto pass = [&](std::size_t lines, std::size_t length, std::size_t stride, auto&& first_of) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, lines, 64), [&](const auto& range) {
      Envelope envelope(length);
      for (std::size_t line = range.begin(); line < range.end(); ++line)
        envelope.run(owner, squared, first_of(line), stride);
    });
  };
  pass(ny * nz, nx, 1, [&](std::size_t l) { return l * nx; });
  pass(nx * nz, ny, nx, [&](std::size_t l) { return l / nx * nx * ny + l % nx; });
  pass(nx * ny, nz, nx * ny, [](std::size_t l) { return l; });
  return owner;
}

std::vector<std::int32_t> nearest_face(const VoxelBody& body, const std::vector<Vec3d>& face_centroids) {
  std::vector<std::int32_t> owner(body.count(), -1);
  std::vector<float> distance(body.count(), std::numeric_limits<float>::infinity());
  Wave wave;
  const auto offer = [&](std::int32_t sample, std::int32_t face) {
    const auto s = static_cast<std::size_t>(sample);
    const auto way = static_cast<float>(norm(body.position(sample) - face_centroids[static_cast<std::size_t>(face)]));
    if (way > distance[s] || (way == distance[s] && owner[s] <= face)) return;
    distance[s] = way;
    owner[s] = face;
    wave.push({way, sample});
  };
  for (std::size_t f = 0; f < face_centroids.size(); ++f) {
    const Vec3d p = (face_centroids[f] - body.origin) / body.voxel_mm;
    const Vec3i c{static_cast<std::int32_t>(std::floor(p.x)), static_cast<std::int32_t>(std::floor(p.y)),
                  static_cast<std::int32_t>(std::floor(p.z))};
    for (std::int32_t corner = 0; corner < 8; ++corner) {
      const Vec3i n{c.x + (corner & 1), c.y + (corner >> 1 & 1), c.z + (corner >> 2)};
      if (n.x < 0 || n.y < 0 || n.z < 0 || n.x >= body.size.x || n.y >= body.size.y || n.z >= body.size.z) continue;
      const std::int32_t sample = body.inside[static_cast<std::size_t>((n.z * body.size.y + n.y) * body.size.x + n.x)];
      if (sample >= 0) offer(sample, static_cast<std::int32_t>(f));
    }
  }
  while (!wave.empty()) {
    const Front front = wave.top();
    wave.pop();
    const auto s = static_cast<std::size_t>(front.sample);
    if (front.distance > distance[s]) continue;
    const std::int32_t face = owner[s];
    for (int d = 0; d < VoxelBody::directions; ++d)
      if ((body.links[s] >> static_cast<unsigned>(d) & 1U) != 0) offer(body.neighbour(front.sample, d), face);
  }
  for (std::int32_t& face : owner) face = std::max(face, 0);
  return owner;
}

}  // namespace fibrolite
