// SPDX-License-Identifier: Apache-2.0
#include "weld.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "fibrolite/random.h"

namespace fibrolite {
namespace {

constexpr std::size_t chunk_size = std::size_t{1} << 16;
constexpr std::uint32_t none = 0xffffffff;

std::uint64_t hash(Vec3f p) {
  // + 0.0f turns -0 into 0: the two are the same place.
  const std::uint64_t x = std::bit_cast<std::uint32_t>(p.x + 0.0f), y = std::bit_cast<std::uint32_t>(p.y + 0.0f),
                      z = std::bit_cast<std::uint32_t>(p.z + 0.0f);
  return mix((x | (y << 32)) ^ (z * 0x9e3779b97f4a7c15ULL));
}

struct Entry {
  std::uint32_t hash, vertex;
};

// Writes to `id` the first vertex with the same coordinates, for each vertex of
// one bucket (in rising order).
void weld_bucket(std::span<const Vec3f> vertices, const Entry* begin, const Entry* end, std::vector<Entry>& table,
                 std::vector<std::uint32_t>& id) {
  const auto mask = std::bit_ceil(static_cast<std::size_t>(end - begin) * 2 + 1) - 1;
  table.assign(mask + 1, Entry{0, none});
  for (const Entry* e = begin; e < end; ++e) {
    std::size_t place = e->hash & mask;
    while (table[place].vertex != none &&
           !(table[place].hash == e->hash && vertices[table[place].vertex] == vertices[e->vertex]))
      place = (place + 1) & mask;
    if (table[place].vertex == none) table[place] = *e;
    id[e->vertex] = table[place].vertex;
  }
}

}  // namespace

std::vector<std::uint32_t> first_equal(std::span<const Vec3f> vertices) {
  const std::size_t n = vertices.size();
  const std::size_t chunks = (n + chunk_size - 1) / chunk_size;
  // Buckets by the top bits of the hash, small enough that their tables stay in
  // cache.
  const std::size_t buckets = std::clamp<std::size_t>(std::bit_ceil(n / 16384 + 1), 1, 4096);
  const int shift = 64 - std::countr_zero(buckets);
  const auto bucket_of = [&](std::uint64_t h) { return buckets == 1 ? 0 : static_cast<std::size_t>(h >> shift); };
  const auto for_chunk = [&](std::size_t chunk, const auto& visit) {
    const std::size_t end = std::min(n, (chunk + 1) * chunk_size);
    for (std::size_t v = chunk * chunk_size; v < end; ++v) visit(v, hash(vertices[v]));
  };

  // A stable counting sort by bucket: count per chunk, add up in order, place.
  std::vector<std::uint32_t> place(chunks * buckets, 0);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    for_chunk(chunk, [&](std::size_t, std::uint64_t h) { ++place[chunk * buckets + bucket_of(h)]; });
  });
  std::vector<std::uint32_t> start(buckets + 1, 0);
  std::uint32_t sum = 0;
  for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
    start[bucket] = sum;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      std::uint32_t& slot = place[chunk * buckets + bucket];
      sum += slot;
      slot = sum - slot;
    }
  }
  start[buckets] = sum;

  std::vector<std::uint32_t> id(n);
  {
    std::vector<Entry> entries(n);
    tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
      for_chunk(chunk, [&](std::size_t v, std::uint64_t h) {
        entries[place[chunk * buckets + bucket_of(h)]++] = {static_cast<std::uint32_t>(h),
                                                            static_cast<std::uint32_t>(v)};
      });
    });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, buckets), [&](const tbb::blocked_range<std::size_t>& range) {
      std::vector<Entry> table;
      for (std::size_t bucket = range.begin(); bucket < range.end(); ++bucket)
        weld_bucket(vertices, entries.data() + start[bucket], entries.data() + start[bucket + 1], table, id);
    });
  }
  return id;
}

Weld weld(const std::vector<Vec3f>& vertices) {
  Weld result{first_equal(vertices), 0};
  // A first vertex comes before its copies, so one pass in order turns first
  // vertices into numbers.
  for (std::size_t v = 0; v < vertices.size(); ++v)
    result.id[v] = result.id[v] == v ? result.count++ : result.id[result.id[v]];
  return result;
}

Mesh welded(const Mesh& mesh) {
  const Weld weld_of = weld(mesh.vertices);
  std::vector<std::uint32_t> number(weld_of.count, none);
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) number[weld_of.id[v]] = 0;
  std::uint32_t used = 0;
  for (std::uint32_t& n : number)
    if (n != none) n = used++;
  Mesh result;
  result.vertices.resize(used);
  // Backwards, so that the first vertex of a place is the one that stays.
  for (std::size_t v = mesh.vertices.size(); v-- > 0;)
    if (const std::uint32_t n = number[weld_of.id[v]]; n != none) result.vertices[n] = mesh.vertices[v];
  result.triangles.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    result.triangles.push_back({number[weld_of.id[a]], number[weld_of.id[b]], number[weld_of.id[c]]});
  result.triangle_colors = mesh.triangle_colors;
  return result;
}

bool zero_area(Vec3f fa, Vec3f fb, Vec3f fc) {
  // Nearly always rounding leaves no doubt: each product is right to 2e-7 of itself.
  const Vec3f fu{fb.x - fa.x, fb.y - fa.y, fb.z - fa.z}, fv{fc.x - fa.x, fc.y - fa.y, fc.z - fa.z};
  const auto clearly_differ = [](float pq, float rs) {
    return std::abs(pq - rs) > 1e-6F * (std::abs(pq) + std::abs(rs)) + 1e-30F;
  };
  if (clearly_differ(fu.y * fv.z, fu.z * fv.y) || clearly_differ(fu.z * fv.x, fu.x * fv.z) ||
      clearly_differ(fu.x * fv.y, fu.y * fv.x))
    return false;
  const Vec3d a = to_double(fa), u = to_double(fb) - a, v = to_double(fc) - a;
  const auto equal_products = [](double p, double q, double r, double s) {
    const double pq = p * q, rs = r * s;
    return pq == rs && std::fma(p, q, -pq) == std::fma(r, s, -rs);
  };
  return equal_products(u.y, v.z, u.z, v.y) && equal_products(u.z, v.x, u.x, v.z) && equal_products(u.x, v.y, u.y, v.x);
}

}  // namespace fibrolite
