// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/dangling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <vector>

#include "plane_image.h"

namespace fibrolite {
namespace {

constexpr std::size_t batch_size = 1 << 16;
constexpr int probe_count = 96;
constexpr double own_cone = 0.64;  // cosine of 50 degrees: what lies so near to a stick's own direction is that stick

/// Points spread evenly over a sphere (a Fibonacci lattice).
std::array<Vec3d, probe_count> even_directions() {
  std::array<Vec3d, probe_count> directions;
  for (int i = 0; i < probe_count; ++i) {
    const double z = 1 - (2.0 * i + 1) / probe_count, ring = std::sqrt(1 - z * z);
    const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    directions[static_cast<std::size_t>(i)] = {ring * std::cos(turn), ring * std::sin(turn), z};
  }
  return directions;
}

/// Is there material at this distance from an end but in the direction its own stick comes from?
bool touches(const Solid& solid, Vec3d end, Vec3d own, double reach_mm) {
  static const auto directions = even_directions();
  return std::any_of(directions.begin(), directions.end(),
                     [&](Vec3d d) { return dot(d, own) < own_cone && solid.distance(end + reach_mm * d) < 0; });
}

class Count {
 public:
  Count(const Fill& fill, const Shape& region, const Shape& body, double shell_mm, const Solid& solid)
      : ball_mm_(0.5 * fill.ball_mm),
        skin_mm_(solid.grid().voxel_mm),
        region_(region),
        lumen_(offset(body, -shell_mm)),
        solid_(solid) {}

  void add(const std::vector<Capsule>& sticks) {
    std::vector<Vec3d> points;
    for (const Capsule& s : sticks) {
      points.push_back(s.a);
      points.push_back(s.b);
    }
    std::vector<float> lumen, region;
    evaluate_parallel(lumen_, points, lumen);
    evaluate_parallel(region_, points, region);
    for (std::size_t i = 0; i < sticks.size(); ++i) {
      const auto inside = [&](std::size_t k) { return lumen[k] < 0 && region[k] < 0; };
      const bool a = inside(2 * i), b = inside(2 * i + 1);
      if (a) node(sticks[i].a);
      if (b) node(sticks[i].b);
      if (a && b) {
        hold(sticks[i].a, sticks[i].b);
        hold(sticks[i].b, sticks[i].a);
      } else if (a) {
        leave(sticks[i], false);
      } else if (b) {
        leave(sticks[i], true);
      }
    }
  }

  [[nodiscard]] std::int64_t result() const {
    std::int64_t free = free_;
    for (const auto& [key, node] : nodes_) {
      if (node.sticks > 1 || solid_.distance(node.at) >= 0) continue;
      if (node.sticks == 0 || !touches(solid_, node.at, node.towards, ball_mm_ + skin_mm_)) ++free;
    }
    return free;
  }

 private:
  using Key = std::tuple<long, long, long>;
  struct Node {
    Vec3d at, towards{};
    int sticks = 0;
  };

  static Key key(Vec3d p) { return {std::lround(1e4 * p.x), std::lround(1e4 * p.y), std::lround(1e4 * p.z)}; }
  Node& node(Vec3d p) { return nodes_.try_emplace(key(p), Node{p}).first->second; }
  void hold(Vec3d at, Vec3d other) {
    Node& n = node(at);
    ++n.sticks;
    n.towards = normalized(other - at);
  }

  /// A stick with one node inside: into the shell, or out of the part.
  void leave(const Capsule& stick, bool from_b) {
    const Vec3d from = from_b ? stick.b : stick.a, to = from_b ? stick.a : stick.b;
    double in = 0, out = 1;
    for (int i = 0; i < 12; ++i) {
      const double middle = 0.5 * (in + out);
      const Vec3d p = from + middle * (to - from);
      (lumen_(p) < 0 && region_(p) < 0 ? in : out) = middle;
    }
    const Vec3d end = from + in * (to - from);
    const bool in_shell = lumen_(from + out * (to - from)) >= 0;
    if (in_shell || touches(solid_, end, normalized(from - to), stick.radius_mm + skin_mm_)) {
      hold(from, to);
    } else if (norm(end - from) > ball_mm_ + stick.radius_mm) {
      ++free_;
      hold(from, to);
    }
  }

  const double ball_mm_, skin_mm_;
  const Shape region_, lumen_;
  const Solid& solid_;
  std::map<Key, Node> nodes_;
  std::int64_t free_ = 0;
};

}  // namespace

std::int64_t dangling_sticks(const Fill& fill, const Box3d& box, const Shape& region, const Shape& body,
                             double shell_mm, const Solid& solid, const Context& context) {
  Count count(fill, region, body, shell_mm, solid);
  std::vector<Capsule> batch;
  fill.sticks(box, [&](const Capsule& stick) {
    batch.push_back(stick);
    if (batch.size() < batch_size) return;
    context.check();
    count.add(batch);
    batch.clear();
  });
  count.add(batch);
  return count.result();
}

}  // namespace fibrolite
