// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/tetrahedralize.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "child_process.h"
#include "fibrolite/disjoint_sets.h"
#include "fibrolite/error.h"
#include "helper_program.h"

namespace fibrolite {
namespace {

using Corners = std::array<std::uint32_t, 3>;
using Tet = std::array<std::uint32_t, 4>;

[[noreturn]] void fail(const std::string& what) {
  throw Error(Code::SolverFailed, what, "making tetrahedra", "try a coarser or cleaner surface");
}

/// The surface as TetGen needs it: one vertex per place, no vertex without a triangle.
struct Input {
  std::vector<Vec3d> vertices;
  std::vector<Corners> triangles;
};

Input weld(const Mesh& mesh) {
  const auto key = [&](std::uint32_t v) {
    const Vec3f& p = mesh.vertices[v];
    return std::tie(p.x, p.y, p.z);
  };
  std::vector<std::uint32_t> used;
  for (const auto& triangle : mesh.triangles) used.insert(used.end(), triangle.begin(), triangle.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::sort(used.begin(), used.end(), [&](auto a, auto b) { return key(a) < key(b); });
  Input input;
  std::vector<std::uint32_t> renamed(mesh.vertices.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (i == 0 || key(used[i]) != key(used[i - 1])) input.vertices.push_back(to_double(mesh.vertices[used[i]]));
    renamed[used[i]] = static_cast<std::uint32_t>(input.vertices.size() - 1);
  }
  for (const auto& t : mesh.triangles) {
    const Corners c{renamed[t[0]], renamed[t[1]], renamed[t[2]]};
    if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) input.triangles.push_back(c);
  }
  return input;
}

double volume(const Input& input) {
  double six_volumes = 0;
  for (const auto& t : input.triangles) {
    six_volumes += dot(cross(input.vertices[t[0]], input.vertices[t[1]]), input.vertices[t[2]]);
  }
  return six_volumes / 6;
}

/// TetGen takes an open surface without a word and gives nothing back: ask before.
void require_closed(const Input& input) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(3 * input.triangles.size());
  for (const auto& t : input.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(t[k], t[(k + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) fail("the surface is not manifold");
  for (const auto& [from, to] : edges) {
    if (!std::binary_search(edges.begin(), edges.end(), std::pair{to, from})) fail("the surface is open");
  }
  if (!(volume(input) > 0)) fail("the surface is inside out or encloses nothing");
}

/// Little-endian and packed, see ops/tetgen/main.cpp.
class Writer {
 public:
  template <class T>
  void put(const T& value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

std::vector<std::byte> encode(const Input& input) {
  Writer writer;
  writer.put(std::array{'F', 'B', 'L', 'T', 'S', 'R', 'F', '1'});
  writer.put(std::array{std::uint64_t{input.vertices.size()}, std::uint64_t{input.triangles.size()}});
  for (const Vec3d& v : input.vertices) writer.put(std::array{v.x, v.y, v.z});
  for (const Corners& t : input.triangles) writer.put(t);
  return writer.bytes();
}

struct Answer {
  std::vector<Vec3d> nodes;
  std::vector<Tet> tets;
};

/// Nothing the child wrote is believed: counts, finiteness and indices are checked.
Answer decode(std::span<const std::byte> bytes) {
  constexpr std::size_t head = 24, node_bytes = 3 * sizeof(double), tet_bytes = sizeof(Tet);
  std::array<std::uint64_t, 2> counts{};
  if (bytes.size() < head || std::memcmp(bytes.data(), "FBLTTET1", 8) != 0) fail("TetGen gave no mesh");
  std::memcpy(counts.data(), bytes.data() + 8, sizeof counts);
  const std::size_t body = bytes.size() - head;
  if (counts[0] > body / node_bytes || counts[1] > body / tet_bytes ||
      body != counts[0] * node_bytes + counts[1] * tet_bytes) {
    fail("TetGen's answer is cut off");
  }
  if (counts[1] == 0) fail("TetGen found no inside");
  Answer answer{std::vector<Vec3d>(counts[0]), std::vector<Tet>(counts[1])};
  static_assert(sizeof(Vec3d) == node_bytes);
  std::memcpy(answer.nodes.data(), bytes.data() + head, counts[0] * node_bytes);
  std::memcpy(answer.tets.data(), bytes.data() + head + counts[0] * node_bytes, counts[1] * tet_bytes);
  for (const Vec3d& p : answer.nodes) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) fail("TetGen's answer is not finite");
  }
  for (const Tet& tet : answer.tets) {
    for (const std::uint32_t node : tet) {
      if (node >= counts[0]) fail("TetGen's answer has an index out of range");
    }
  }
  return answer;
}

/// True if `a` is `b` with its corners in an even permutation; they are known to have the same corners.
bool same_turn(const Corners& a, const Corners& b) {
  const auto at = std::find(b.begin(), b.end(), a[0]) - b.begin();
  return b[static_cast<std::size_t>(at + 1) % 3] == a[1];
}

/// Keeps the tetrahedra on the inner side of the surface (TetGen fills closed cavities too) and proves on the way that
/// every triangle of the surface is a side of one of them.
void keep_inside(Answer& answer, const Input& input) {
  struct Side {
    Corners sorted, outward;
    std::uint32_t tet;  // or `of_surface`
  };
  constexpr std::uint32_t of_surface = 0xffffffffU;
  std::vector<Side> sides;
  sides.reserve(4 * answer.tets.size() + input.triangles.size());
  const auto add = [&](const Corners& outward, std::uint32_t tet) {
    Side side{outward, outward, tet};
    std::sort(side.sorted.begin(), side.sorted.end());
    sides.push_back(side);
  };
  for (std::uint32_t t = 0; t < answer.tets.size(); ++t) {
    const Tet& n = answer.tets[t];
    add({n[0], n[2], n[1]}, t);
    add({n[0], n[1], n[3]}, t);
    add({n[0], n[3], n[2]}, t);
    add({n[1], n[2], n[3]}, t);
  }
  for (const Corners& triangle : input.triangles) add(triangle, of_surface);
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return std::tie(a.sorted, a.tet) < std::tie(b.sorted, b.tet); });

  DisjointSets sets(answer.tets.size());
  std::vector<std::pair<std::uint32_t, bool>> seeds;  // tet beside the surface, on its inner side?
  for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
    while (last < sides.size() && sides[last].sorted == sides[first].sorted) ++last;
    const bool surface = sides[last - 1].tet == of_surface;
    const std::size_t tets = last - first - (surface ? 1 : 0);
    if (tets == 0) fail("TetGen lost a part of the surface");
    if (tets > 2 || (tets == 1 && !surface)) fail("TetGen's tetrahedra do not fit together");
    if (surface) {
      for (std::size_t i = first; i < first + tets; ++i) {
        seeds.emplace_back(sides[i].tet, same_turn(sides[i].outward, sides[last - 1].outward));
      }
    } else {
      sets.join(sides[first].tet, sides[first + 1].tet);
    }
  }
  std::vector<bool> inside(answer.tets.size(), false), outside(answer.tets.size(), false);
  for (const auto& [tet, inner] : seeds) (inner ? inside : outside)[sets.root(tet)] = true;

  std::vector<std::uint32_t> renamed(answer.nodes.size(), of_surface);
  Answer kept;
  for (std::uint32_t t = 0; t < answer.tets.size(); ++t) {
    const std::uint32_t piece = sets.root(t);
    if (inside[piece] && outside[piece]) fail("TetGen lost a part of the surface");
    if (!inside[piece]) continue;
    Tet tet = answer.tets[t];
    for (std::uint32_t& node : tet) {
      if (renamed[node] == of_surface) {
        renamed[node] = static_cast<std::uint32_t>(kept.nodes.size());
        kept.nodes.push_back(answer.nodes[node]);
      }
      node = renamed[node];
    }
    kept.tets.push_back(tet);
  }
  answer = std::move(kept);
}

std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr;
  return {text.data(), end};
}

std::string switches(const TetrahedralizeParams& params) {
  // p: a surface; Y: not one point more on it; M: merge nothing flat; q: quality; a: size; Q: quiet.
  std::string text = "pYMQq";
  text += number(params.radius_edge);
  if (params.max_volume_mm3 > 0) text.append("a").append(number(params.max_volume_mm3));
  return text;
}

}  // namespace

TetMesh tetrahedralize(const Mesh& closed_surface, const TetrahedralizeParams& params, const Context& context) {
  if (!(params.radius_edge > 1.2) || !(params.max_volume_mm3 >= 0) || params.cpu_limit_s < 1 ||
      params.memory_limit_mb < 1) {
    throw Error(Code::BadRecipe, "a tetrahedralisation parameter is out of range");
  }
  context.check();
  const Input input = weld(closed_surface);
  require_closed(input);

  // The wall clock only catches a child that hangs without computing; a busy machine must not end it.
  const ChildLimits limits{.wall_s = 10.0 + 4.0 * params.cpu_limit_s};
  const ChildResult result = run_child(tetgen_program(),
                                       {"--cpu-s", std::to_string(params.cpu_limit_s), "--memory-mb",
                                        std::to_string(params.memory_limit_mb), switches(params)},
                                       encode(input), limits, context);
  if (!result.failure.empty()) fail("TetGen gave up on the surface: " + result.failure);

  Answer answer = decode(result.output);
  keep_inside(answer, input);
  TetMesh mesh = ten_node(std::move(answer.nodes), answer.tets);
  for (const auto& tet : mesh.tets) {
    const Vec3d a = mesh.nodes[tet[0]];
    if (!(dot(cross(mesh.nodes[tet[1]] - a, mesh.nodes[tet[2]] - a), mesh.nodes[tet[3]] - a) > 0)) {
      fail("TetGen made a tetrahedron without volume");
    }
  }
  const double wanted = volume(input);
  if (std::abs(volume_mm3(mesh) - wanted) > 1e-3 * wanted) fail("the tetrahedra do not fill the surface");
  return mesh;
}

std::filesystem::path tetgen_program() { return helper_program("fibrolite-tetgen", "FIBROLITE_TETGEN"); }

}  // namespace fibrolite
