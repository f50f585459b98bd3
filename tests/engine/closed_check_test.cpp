// SPDX-License-Identifier: GPL-3.0-or-later
#include "closed_check.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "closed_fan.h"
#include "fibrolite/random.h"
#include "mesh_checks.h"
#include "models.h"

namespace fibrolite {
namespace {

using namespace testing;

/// A mesh in layers: cut where no triangle reaches further than the next one.
class Cut final : public MeshLayers {
 public:
  Cut(const Mesh& mesh, std::size_t size) : mesh_(mesh), size_(size) {}
  [[nodiscard]] std::size_t vertices() const override { return mesh_.vertices.size(); }
  [[nodiscard]] std::size_t triangles() const override { return mesh_.triangles.size(); }
  void each(const std::function<void(const MeshLayer&)>& use, const Context&) const override {
    const std::size_t layers = (vertices() + size_ - 1) / size_;
    std::vector<std::vector<Mesh::Triangle>> of(layers);
    for (const auto& t : mesh_.triangles) of[std::max({t[0], t[1], t[2]}) / size_].push_back(t);
    for (std::size_t n = 0; n < layers; ++n) {
      const std::size_t first = n == 0 ? 0 : (n - 1) * size_, end = std::min(vertices(), (n + 1) * size_);
      use({std::span(mesh_.vertices).subspan(first, end - first), first, n * size_ - first, of[n], {}});
    }
  }

 private:
  const Mesh& mesh_;
  std::size_t size_;
};

/// The same with its vertices in any order.
Mesh shuffled(const Mesh& mesh, Random& random) {
  std::vector<std::uint32_t> place(mesh.vertices.size());
  std::iota(place.begin(), place.end(), 0U);
  for (std::size_t i = place.size(); i > 1; --i)
    std::swap(place[i - 1], place[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
  Mesh result = mesh;
  for (std::size_t i = 0; i < place.size(); ++i) result.vertices[place[i]] = mesh.vertices[i];
  for (auto& t : result.triangles)
    for (std::uint32_t& v : t) v = place[v];
  return result;
}

TEST(ClosedCheck, counts_shells_in_any_order_of_vertices) {
  Random random(1, "shells");
  Mesh mesh;
  for (int i = 0; i < 12; ++i) {
    mesh = joined(mesh, moved(icosphere(1, i % 4), {3.0 * i, 0, 0}));
    mesh = joined(mesh, moved(torus_mesh(3, 1, 20 + i, 8), {0, 9.0 * i + 10, 0}));
    const Mesh other = shuffled(mesh, random);
    for (const int threads : {1, 2}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
      const auto found = check_closed(WholeMesh(other), {});
      ASSERT_TRUE(found);
      EXPECT_EQ(found->shells, 2 * (i + 1));
      EXPECT_EQ(found->vertices, static_cast<std::int64_t>(mesh.vertices.size()));
      EXPECT_EQ(found->triangles, static_cast<std::int64_t>(mesh.triangles.size()));
      EXPECT_EQ(found->degenerate_triangles, 0);
      EXPECT_NEAR(found->volume_mm3, count(mesh).volume_mm3, 1e-6 * found->volume_mm3);
    }
  }
}

TEST(ClosedCheck, layer_by_layer_says_the_same) {
  // Rings of a torus follow each other, and the last one closes it: in halves from there each triangle spans two
  // layers.
  const Mesh torus = torus_mesh(9, 3, 64, 24);
  Mesh folded = torus;  // rings 0, 63, 1, 62, ...: no triangle reaches far
  const auto place = [](std::uint32_t ring) { return ring < 32 ? 2 * ring : 2 * (63 - ring) + 1; };
  for (std::uint32_t v = 0; v < 64 * 24; ++v) folded.vertices[place(v / 24) * 24 + v % 24] = torus.vertices[v];
  for (auto& t : folded.triangles)
    for (std::uint32_t& v : t) v = place(v / 24) * 24 + v % 24;
  Mesh both = folded;  // a second one between its layers
  for (std::size_t v = 0; v < folded.vertices.size(); v += 24) {
    const auto at = static_cast<std::ptrdiff_t>(2 * v + 24);
    const Mesh far = moved(folded, {0, 0, 50});
    both.vertices.insert(both.vertices.begin() + at, far.vertices.begin() + static_cast<std::ptrdiff_t>(v),
                         far.vertices.begin() + static_cast<std::ptrdiff_t>(v + 24));
  }
  both.triangles.clear();
  for (const std::uint32_t which : {0U, 24U}) {
    for (auto t : folded.triangles) {
      for (std::uint32_t& v : t) v = v / 24 * 48 + v % 24 + which;
      both.triangles.push_back(t);
    }
  }
  ASSERT_TRUE(count(both).sound());
  for (const std::size_t size : {96U, 150U, 200U, 1000U, 5000U}) {
    const auto found = check_closed(Cut(both, size), {});
    ASSERT_TRUE(found) << size;
    EXPECT_EQ(found->shells, 2) << size;
    EXPECT_EQ(found->vertices, 2 * 64 * 24) << size;
    EXPECT_EQ(found->triangles, 4 * 64 * 24) << size;
  }
}

TEST(ClosedCheck, leaves_whatever_is_wrong_to_the_other_check) {
  const Mesh ball = icosphere(5, 2);
  const auto with = [&](const auto& fault) {
    Mesh mesh = ball;
    fault(mesh);
    return check_closed(WholeMesh(mesh), {}).has_value();
  };
  EXPECT_TRUE(with([](Mesh&) {}));
  EXPECT_FALSE(with([](Mesh& m) { m.triangles.pop_back(); }));
  EXPECT_FALSE(with([](Mesh& m) { m.triangles.push_back(m.triangles.front()); }));
  EXPECT_FALSE(with([](Mesh& m) { std::swap(m.triangles[7][0], m.triangles[7][1]); }));
  EXPECT_FALSE(with([](Mesh& m) { m.triangles[7][0] = m.triangles[7][1]; }));
  EXPECT_FALSE(with([](Mesh& m) { m.vertices[3] = m.vertices[4]; }));
  EXPECT_FALSE(with([](Mesh& m) {  // two balls that share a vertex
    const auto first = static_cast<std::uint32_t>(m.vertices.size());
    m = joined(m, moved(m, {20, 0, 0}));
    for (auto& t : m.triangles)
      for (std::uint32_t& v : t) v = v == first ? 0 : v;
  }));
  // A cone of many triangles is a closed fan, but too large a one.
  for (const int sides : {3, 8, 9, 16, 17, 300}) {
    Mesh cone;
    cone.vertices = {{0, 0, 1}, {0, 0, -1}};
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * 3.14159265358979 * i / sides;
      cone.vertices.push_back({static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0});
      const auto a = static_cast<std::uint32_t>(2 + i), b = static_cast<std::uint32_t>(2 + (i + 1) % sides);
      cone.triangles.push_back({0, a, b});
      cone.triangles.push_back({1, b, a});
    }
    EXPECT_EQ(check_closed(WholeMesh(cone), {}).has_value(), sides <= 16) << sides;
    EXPECT_TRUE(check(cone).closed()) << sides;
    EXPECT_EQ(check(cone).nonmanifold_vertices, 0) << sides;
    EXPECT_EQ(check(cone).shells, 1) << sides;
  }
}

/// By walking.
bool walks_once_around(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& triangles) {
  std::map<std::uint32_t, std::uint32_t> to;
  std::set<std::uint32_t> from;
  for (const auto& [out, in] : triangles) {
    if (!to.emplace(out, in).second || !from.insert(in).second) return false;
  }
  std::uint32_t at = triangles.front().first;
  std::size_t steps = 0;
  do {
    const auto next = to.find(at);
    if (next == to.end()) return false;
    at = next->second;
    ++steps;
  } while (at != triangles.front().first && steps <= triangles.size());
  return at == triangles.front().first && steps == triangles.size();
}

template <std::uint32_t most>
void compare_with_walks() {
  Random random(most, "fans");
  const auto below = [&](std::size_t n) {
    return static_cast<std::uint32_t>(random.uniform() * static_cast<double>(n));
  };
  int closed = 0, open = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::uint32_t count = 3 + below(most - 2);
    std::vector<std::uint32_t> around(count);
    for (std::uint32_t i = 0; i < count; ++i) around[i] = 1000 + 7 * i;
    for (std::size_t i = count; i > 1; --i) std::swap(around[i - 1], around[below(i)]);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> triangles;
    for (std::uint32_t i = 0; i < count; ++i) triangles.emplace_back(around[i], around[(i + 1) % count]);
    // Some with ends exchanged (two circles, then), turned or doubled.
    for (std::uint32_t faults = below(3); faults > 0; --faults) {
      const std::uint32_t a = below(count), b = below(count);
      switch (below(4)) {
        case 0:
          std::swap(triangles[a].second, triangles[b].second);
          break;
        case 1:
          std::swap(triangles[a].first, triangles[a].second);
          break;
        case 2:
          triangles[a] = triangles[b];
          break;
        default:
          triangles[a].second = triangles[b].second;
          break;
      }
    }
    for (std::size_t i = count; i > 1; --i) std::swap(triangles[i - 1], triangles[below(i)]);
    Fan<most> fan;
    fan.clear();
    for (std::uint32_t i = 0; i < count; ++i) fan.put(i, triangles[i].first, triangles[i].second);
    // An edge that is no edge, from a vertex to itself, cannot be here: such triangles have no place in a mesh.
    if (std::any_of(triangles.begin(), triangles.end(), [](const auto& t) { return t.first == t.second; })) continue;
    const bool expected = walks_once_around(triangles);
    ASSERT_EQ(is_closed(fan, count), expected) << round;
    (expected ? closed : open) += 1;
  }
  EXPECT_GT(closed, 5000);
  EXPECT_GT(open, 5000);
}

TEST(ClosedFan, agrees_with_a_walk) {
  compare_with_walks<8>();
  compare_with_walks<16>();
}

}  // namespace
}  // namespace fibrolite
