// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/dangling.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "plane_image.h"

namespace fibrolite {
namespace {

constexpr std::size_t batch_size = 1 << 14;
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

/// Looks at the ends of sticks where the solid is known.
class Look {
 public:
  Look(const Solid& solid, double ball_mm) : solid_(solid), ball_mm_(ball_mm), skin_mm_(solid.grid().voxel_mm) {}

  /// Of a stick that runs on out of its part, from `in_mm` on as far as there is material.
  struct Leaving {
    bool holds = false;  ///< Its node.
    std::optional<LooseEnd> free{};
  };
  [[nodiscard]] Leaving leaving(const Capsule& stick, double in_mm) const {
    const double length = norm(stick.b - stick.a);
    const Vec3d along = (1 / length) * (stick.b - stick.a);
    double end = in_mm;
    while (end > 0 && !material(stick.a + end * along)) end -= skin_mm_;
    const auto knob = [&](double s) { return s > length - ball_mm_ - skin_mm_; };  // in the ball that was cut off
    double s = std::max(end, 0.0);
    for (; s < length && material(stick.a + s * along); s += skin_mm_) {
      if (beside(stick.a + s * along, -along, knob(s) ? ball_mm_ : stick.radius_mm)) return {true};
      end = s;
    }
    if (end > length - skin_mm_) return {true};
    for (int i = 0; i < 4; ++i) {
      const double middle = 0.5 * (end + s);
      (material(stick.a + middle * along) ? end : s) = middle;
    }
    if (end <= ball_mm_ + stick.radius_mm) return {};
    const Vec3d tip = stick.a + end * along;
    if (beside(tip, -along, knob(end) ? ball_mm_ : stick.radius_mm)) return {true};
    return {true, LooseEnd{held(tip, stick.a, stick.radius_mm), tip, stick.radius_mm, knob(end) ? ball_mm_ : 0}};
  }

  /// Of a node on one stick, which comes from `other`; or on none.
  [[nodiscard]] std::optional<LooseEnd> node(Vec3d at, const std::optional<Vec3d>& other, double radius_mm) const {
    if (!material(at)) return std::nullopt;
    const Vec3d own = other ? normalized(*other - at) : Vec3d{};
    if (touched(at, own, 0, ball_mm_ + skin_mm_)) return std::nullopt;
    return LooseEnd{other ? held(at, *other, radius_mm) : at, at, radius_mm, ball_mm_};
  }

  /// How far from a stick it looks.
  static double reach_mm(double ball_mm, double radius_mm, double voxel_mm) {
    return std::max(ball_mm, radius_mm) + 2 * voxel_mm;
  }

 private:
  [[nodiscard]] bool material(Vec3d at) const { return solid_.distance(at) < 0; }

  /// Is there material at this distance from a point, that the line through it along `own` with this radius does not
  /// explain? The cone around `own` is left out: there the stick's own node may be.
  [[nodiscard]] bool touched(Vec3d at, Vec3d own, double line_mm, double reach_mm) const {
    static const auto directions = even_directions();
    return std::any_of(directions.begin(), directions.end(), [&](Vec3d d) {
      const double along = dot(d, own);
      return along < own_cone && reach_mm * std::sqrt(1 - along * along) > line_mm && material(at + reach_mm * d);
    });
  }
  [[nodiscard]] bool beside(Vec3d at, Vec3d own, double radius_mm) const {
    return touched(at, own, radius_mm + 0.5 * skin_mm_, radius_mm + skin_mm_);
  }

  /// Where, from its end back to the ball of its node, something other than itself holds a stick.
  [[nodiscard]] Vec3d held(Vec3d end, Vec3d from, double radius_mm) const {
    const double length = std::max(0.0, norm(end - from) - ball_mm_);
    const Vec3d back = normalized(from - end);
    for (double s = 0; s < length; s += skin_mm_)
      if (material(end + s * back) && beside(end + s * back, back, radius_mm)) return end + s * back;
    return end + length * back;
  }

  const Solid& solid_;
  double ball_mm_, skin_mm_;
};

using Key = std::tuple<long, long, long>;
Key key(Vec3d p) { return {std::lround(1e4 * p.x), std::lround(1e4 * p.y), std::lround(1e4 * p.z)}; }

int place(Vec3i v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// Samples along a stick, from one node to the other.
class Line {
 public:
  static constexpr std::uint8_t lumen = 1, material = 2;

  Line(const Capsule& stick, double voxel_mm)
      : stick_(stick), known_(static_cast<std::size_t>(std::ceil(norm(stick.b - stick.a) / voxel_mm)) + 2) {}
  /// From now on from the other end. Places stay the same to the last bit.
  void turn() { turned_ = !turned_; }
  [[nodiscard]] Capsule stick() const { return turned_ ? Capsule{stick_.b, stick_.a, stick_.radius_mm} : stick_; }
  [[nodiscard]] std::size_t size() const { return known_.size(); }
  [[nodiscard]] std::size_t last() const { return size() - 1; }
  [[nodiscard]] Vec3d point(std::size_t k) const {
    const auto n = static_cast<double>(index(k));
    return index(k) == last() ? stick_.b : stick_.a + (n / static_cast<double>(last())) * (stick_.b - stick_.a);
  }
  [[nodiscard]] bool is(std::uint8_t what, std::size_t k) const { return (known_[index(k)] & what) != 0; }
  void note(std::size_t k, bool in_lumen, bool in_material) {
    known_[index(k)] = static_cast<std::uint8_t>((in_lumen ? lumen : 0) | (in_material ? material : 0));
  }

 private:
  [[nodiscard]] std::size_t index(std::size_t k) const { return turned_ ? last() - k : k; }

  Capsule stick_;
  std::vector<std::uint8_t> known_;  // of each sample; outside and void where nothing was noted
  bool turned_ = false;
};

/// A stick with a node in the lumen of the part: `stick.a`.
struct Record {
  enum class Kind : std::uint8_t { Inside, IntoShell, Leaving };
  Capsule stick;
  double in_mm = 0;  // how far it runs within that lumen
  Vec3i sample{};    // in the middle of that
  Kind kind = Kind::Inside;
  bool material = false;  // there
};

}  // namespace

struct StickSweep::Impl {
  Impl(const Sticks& s, double shell, double voxel)
      : sticks(s), ball_mm(0.5 * s.ball_mm), shell_mm(shell), voxel_mm(voxel) {
    sticks.visit(sticks.box, [&](const Capsule& stick) { longest_mm = std::max(longest_mm, norm(stick.b - stick.a)); });
  }

  [[nodiscard]] Vec3i nearest(Vec3d p) const {
    const auto sample = [&](double v) { return static_cast<int>(std::lround(v / voxel_mm)); };
    return {sample(p.x), sample(p.y), sample(p.z)};
  }

  void add(const Solid& body, const Solid& solid, const SampleRange& range, const Context& context) {
    const auto inside = static_cast<float>(-shell_mm);
    const auto look = [&](Line& line, std::size_t k) {
      const Vec3i at = nearest(line.point(k));
      if (range.holds(at)) line.note(k, body.at(at) < inside, solid.at(at) < 0);
    };
    std::vector<Capsule> within;  // the slab
    const auto look_along = [&] {
      std::vector<std::optional<Line>> lines(within.size());
      tbb::parallel_for(std::size_t{0}, within.size(), [&](std::size_t i) {
        Line line(within[i], voxel_mm);
        look(line, 0);
        look(line, line.last());
        if (!line.is(Line::lumen, 0) && !line.is(Line::lumen, line.last())) return;
        for (std::size_t k = 1; k < line.last(); ++k) look(line, k);
        lines[i] = std::move(line);
      });
      for (std::optional<Line>& line : lines)
        if (line) complete.push_back(*std::move(line));
      within.clear();
    };
    sticks.visit(part_of_box(range), [&](const Capsule& stick) {
      const int a = place(nearest(stick.a), range.axis), b = place(nearest(stick.b), range.axis);
      const int low = std::min(a, b) - 1, high = std::max(a, b) + 1;  // one more: places between them are rounded too
      if (high < range.low || low >= range.high) return;
      if (low >= range.low && high < range.high) {
        within.push_back(stick);
      } else {
        const auto at = open.try_emplace({key(stick.a), key(stick.b)}, stick, voxel_mm).first;
        Line& line = at->second;
        for (std::size_t k = 0; k < line.size(); ++k) look(line, k);
        if (high >= range.high) return;
        complete.push_back(std::move(line));
        open.erase(at);
      }
      if (within.size() + complete.size() < batch_size) return;
      context.check();
      look_along();
      record();
    });
    look_along();
    record();
  }

  /// Where a slab's share of the sticks with a node in the box may be.
  [[nodiscard]] Box3d part_of_box(const SampleRange& range) const {
    Box3d box = sticks.box.grown(longest_mm);
    const double low = (range.low - 2.0) * voxel_mm, high = (range.high + 2.0) * voxel_mm;
    double& from = range.axis == 0 ? box.min.x : range.axis == 1 ? box.min.y : box.min.z;
    double& to = range.axis == 0 ? box.max.x : range.axis == 1 ? box.max.y : box.max.z;
    from = std::max(from, low);
    to = std::max(from, std::min(to, high));
    return box;
  }

  void record() {
    std::vector<Vec3d> nodes;
    for (const Line& line : complete) {
      nodes.push_back(line.point(0));
      nodes.push_back(line.point(line.last()));
    }
    std::vector<float> region;
    evaluate_parallel(sticks.region, nodes, region);
    for (std::size_t i = 0; i < complete.size(); ++i) {
      Line& line = complete[i];
      const auto inside = [&](std::size_t node, std::size_t k) {
        return line.is(Line::lumen, k) && region[node] < 0 && sticks.box.contains(nodes[node]);
      };
      const bool a = inside(2 * i, 0), b = inside(2 * i + 1, line.last());
      if (a && b) {
        records.push_back(seen(line, line.size() / 2, norm(nodes[2 * i + 1] - nodes[2 * i]), Record::Kind::Inside));
      } else if (a || b) {
        if (b) line.turn();
        records.push_back(partly(line));
      }
    }
    complete.clear();
  }

  [[nodiscard]] Record seen(const Line& line, std::size_t middle, double in_mm, Record::Kind kind) const {
    return {line.stick(), in_mm, nearest(line.point(middle)), kind, line.is(Line::material, middle)};
  }
  /// From its node on, until it leaves the part or goes into the shell.
  [[nodiscard]] Record partly(const Line& line) const {
    std::vector<Vec3d> points;
    for (std::size_t k = 0; k < line.size(); ++k) points.push_back(line.point(k));
    std::vector<float> region(points.size());
    sticks.region.evaluate(points, region);
    std::size_t out = 1;
    while (out < line.last() && line.is(Line::lumen, out) && region[out] < 0) ++out;
    return seen(line, (out - 1) / 2, norm(points[out - 1] - points[0]),
                line.is(Line::lumen, out) ? Record::Kind::Leaving : Record::Kind::IntoShell);
  }

  std::vector<LooseEnd> finish(const Flips& flips, const Surroundings& around) {
    for (auto& [ends, line] : open) complete.push_back(std::move(line));
    open.clear();
    record();

    struct Node {
      Vec3d at, other{};
      double radius_mm = 0;
      int sticks = 0;
    };
    std::map<Key, Node> nodes;
    const auto node = [&](Vec3d at) -> Node& { return nodes.try_emplace(key(at), Node{at}).first->second; };
    const auto hold = [&](Vec3d at, Vec3d other, double radius_mm) {
      Node& n = node(at);
      n = {n.at, other, radius_mm, n.sticks + 1};
    };
    const auto box = [&](Vec3d a, Vec3d b, double radius_mm) {
      Box3d both;
      both.include(a);
      both.include(b);
      return both.grown(Look::reach_mm(ball_mm, radius_mm, voxel_mm));
    };
    std::vector<const Record*> leaving;
    std::vector<Box3d> boxes;
    for (const Record& r : records) {
      const Capsule& s = r.stick;
      node(s.a);
      if (r.kind == Record::Kind::Inside) node(s.b);
      if (r.material == flips.holds(r.sample)) continue;  // it is not there
      if (r.kind == Record::Kind::Leaving) {
        leaving.push_back(&r);
        boxes.push_back(box(s.a, s.b, s.radius_mm));
        continue;
      }
      hold(s.a, s.b, s.radius_mm);
      if (r.kind == Record::Kind::Inside) hold(s.b, s.a, s.radius_mm);
    }
    std::vector<LooseEnd> free;
    around(boxes, [&](std::size_t i, const Solid& solid) {
      const Capsule& s = leaving[i]->stick;
      const Look::Leaving found = Look(solid, ball_mm).leaving(s, leaving[i]->in_mm);
      if (found.holds) hold(s.a, s.b, s.radius_mm);
      if (found.free) free.push_back(*found.free);
    });

    std::vector<const Node*> few;
    boxes.clear();
    for (const auto& [place, n] : nodes) {
      if (n.sticks > 1) continue;
      few.push_back(&n);
      boxes.push_back(box(n.at, n.sticks == 1 ? n.other : n.at, n.radius_mm));
    }
    around(boxes, [&](std::size_t i, const Solid& solid) {
      const Node& n = *few[i];
      const auto end =
          Look(solid, ball_mm).node(n.at, n.sticks == 1 ? std::optional(n.other) : std::nullopt, n.radius_mm);
      if (end) free.push_back(*end);
    });
    const auto order = [](const LooseEnd& end) { return std::pair(key(end.end_mm), key(end.held_mm)); };
    std::sort(free.begin(), free.end(), [&](const LooseEnd& a, const LooseEnd& b) { return order(a) < order(b); });
    return free;
  }

  const Sticks sticks;
  const double ball_mm, shell_mm, voxel_mm;
  double longest_mm = 0;
  std::map<std::pair<Key, Key>, Line> open;  // sticks that reach into the next slab
  std::vector<Line> complete;
  std::vector<Record> records;
};

StickSweep::StickSweep(const Sticks& sticks, double shell_mm, double voxel_mm)
    : impl_(std::make_shared<Impl>(sticks, shell_mm, voxel_mm)) {}

void StickSweep::add(const Solid& body, const Solid& solid, const SampleRange& range, const Context& context) {
  impl_->add(body, solid, range, context);
}

std::vector<LooseEnd> StickSweep::finish(const Flips& flips, const Surroundings& around) {
  return impl_->finish(flips, around);
}

Surroundings surroundings(const Solid& solid) {
  return [solid](const std::vector<Box3d>& boxes, const std::function<void(std::size_t, const Solid&)>& visit) {
    for (std::size_t i = 0; i < boxes.size(); ++i) visit(i, solid);
  };
}

std::vector<LooseEnd> loose_ends(const Sticks& sticks, const Solid& body, double shell_mm, const Solid& solid,
                                 const Context& context) {
  constexpr int all = std::numeric_limits<int>::max() / 16 * 8;
  StickSweep sweep(sticks, shell_mm, solid.grid().voxel_mm);
  sweep.add(body, solid, {.low = -all, .high = all}, context);
  return sweep.finish({}, surroundings(solid));
}

}  // namespace fibrolite
