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

/// Is there material at this distance from a point, that the line through it along `own` with this radius does not
/// explain? The cone around `own` is left out: there the stick's own node may be.
bool touched(const Shape& solid, Vec3d at, Vec3d own, double line_mm, double reach_mm) {
  static const auto directions = even_directions();
  return std::any_of(directions.begin(), directions.end(), [&](Vec3d d) {
    const double along = dot(d, own);
    return along < own_cone && reach_mm * std::sqrt(1 - along * along) > line_mm && solid(at + reach_mm * d) < 0;
  });
}

class Search {
 public:
  Search(const Sticks& sticks, const Shape& body, double shell_mm, const Shape& solid, double voxel_mm)
      : ball_mm_(0.5 * sticks.ball_mm),
        skin_mm_(voxel_mm),
        region_(sticks.region),
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
        if (solid_(0.5 * (sticks[i].a + sticks[i].b)) >= 0) continue;
        hold(sticks[i].a, sticks[i]);
        hold(sticks[i].b, sticks[i]);
      } else if (a) {
        leave(sticks[i], false);
      } else if (b) {
        leave(sticks[i], true);
      }
    }
  }

  [[nodiscard]] std::vector<LooseEnd> result() const {
    std::vector<LooseEnd> free = free_;
    for (const auto& [key, node] : nodes_) {
      if (node.sticks > 1 || solid_(node.at) >= 0) continue;
      const bool alone = node.sticks == 0;
      const Vec3d own = alone ? Vec3d{} : normalized(node.other - node.at);
      if (touched(solid_, node.at, own, 0, ball_mm_ + skin_mm_)) continue;
      free.push_back({alone ? node.at : held(node.at, node.other, node.radius_mm), node.at, node.radius_mm, ball_mm_});
    }
    return free;
  }

 private:
  using Key = std::tuple<long, long, long>;
  struct Node {
    Vec3d at, other{};
    double radius_mm = 0;
    int sticks = 0;
  };

  static Key key(Vec3d p) { return {std::lround(1e4 * p.x), std::lround(1e4 * p.y), std::lround(1e4 * p.z)}; }
  Node& node(Vec3d p) { return nodes_.try_emplace(key(p), Node{p}).first->second; }
  void hold(Vec3d at, const Capsule& stick) {
    Node& n = node(at);
    ++n.sticks;
    n.other = key(at) == key(stick.a) ? stick.b : stick.a;
    n.radius_mm = stick.radius_mm;
  }
  [[nodiscard]] bool beside(Vec3d at, Vec3d own, double radius_mm) const {
    return touched(solid_, at, own, radius_mm + 0.5 * skin_mm_, radius_mm + skin_mm_);
  }

  /// Where, from its end back to the ball of its node, something other than itself holds a stick.
  [[nodiscard]] Vec3d held(Vec3d end, Vec3d from, double radius_mm) const {
    const double length = std::max(0.0, norm(end - from) - ball_mm_);
    const Vec3d back = normalized(from - end);
    for (double s = 0; s < length; s += skin_mm_)
      if (solid_(end + s * back) < 0 && beside(end + s * back, back, radius_mm)) return end + s * back;
    return end + length * back;
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
    if (solid_(from + 0.5 * in * (to - from)) >= 0) return;  // it is not there
    if (lumen_(from + out * (to - from)) >= 0) return hold(from, stick);
    // Out of the part: on and on, as far as there is material.
    const double length = norm(to - from);
    const Vec3d along = (1 / length) * (to - from);
    double end = in * length;
    while (end > 0 && solid_(from + end * along) >= 0) end -= skin_mm_;
    bool knob = false;  // some of the ball of the node that was cut off
    for (double s = std::max(end, 0.0); s < length && solid_(from + s * along) < 0; s += skin_mm_) {
      knob = s > length - ball_mm_ - skin_mm_;
      if (beside(from + s * along, -along, knob ? ball_mm_ : stick.radius_mm)) return hold(from, stick);
      end = s;
    }
    if (end > length - skin_mm_) return hold(from, stick);
    if (end <= ball_mm_ + stick.radius_mm) return;
    hold(from, stick);
    const Vec3d tip = from + end * along;
    free_.push_back({held(tip, from, stick.radius_mm), tip, stick.radius_mm, knob ? ball_mm_ : 0});
  }

  const double ball_mm_, skin_mm_;
  const Shape region_, lumen_;
  const Shape& solid_;
  std::map<Key, Node> nodes_;
  std::vector<LooseEnd> free_;
};

}  // namespace

std::vector<LooseEnd> loose_ends(const Sticks& sticks, const Shape& body, double shell_mm, const Shape& solid,
                                 double voxel_mm, const Context& context) {
  Search search(sticks, body, shell_mm, solid, voxel_mm);
  std::vector<Capsule> batch;
  sticks.visit(sticks.box, [&](const Capsule& stick) {
    batch.push_back(stick);
    if (batch.size() < batch_size) return;
    context.check();
    search.add(batch);
    batch.clear();
  });
  search.add(batch);
  return search.result();
}

std::vector<LooseEnd> loose_ends(const Sticks& sticks, const Shape& body, double shell_mm, const Solid& solid,
                                 const Context& context) {
  return loose_ends(sticks, body, shell_mm, distance_to(solid), solid.grid().voxel_mm, context);
}

}  // namespace fibrolite
