// SPDX-License-Identifier: Apache-2.0
#include "voxel_aggregates.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

namespace fibrolite {
namespace {

constexpr std::uint32_t none = VoxelModel::none;

int third(int v) { return v >= 0 ? v / 3 : -((2 - v) / 3); }
Vec3i box_of(Vec3i n) { return {third(n.x), third(n.y), third(n.z)}; }

/// visit(place of the lowest corner, place in the block, fraction) of each cell with material.
template <class Visit>
void each_cell(const VoxelModel& model, std::size_t block, const Visit& visit) {
  for (int c = 0; c < 512; ++c) {
    const float f = model.fraction[512 * block + static_cast<std::size_t>(c)];
    if (f > 0) visit(VoxelModel::lowest_corner(c), c, f);
  }
}

}  // namespace

VoxelAggregates::VoxelAggregates(const VoxelOperator& fine) : fine_(fine) {
  const VoxelModel& model = fine.model();
  const std::size_t n = model.nodes();
  std::vector<std::uint8_t> held(n, 0);
  for (const std::uint32_t i : fine.fixed()) held[i / 3] |= static_cast<std::uint8_t>(1U << (i % 3));
  place_.resize(n);
  of_node_.resize(n);
  std::iota(of_node_.begin(), of_node_.end(), 0U);
  std::vector<std::uint32_t>& parent = of_node_;
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) {
      parent[i] = parent[parent[i]];
      i = parent[i];
    }
    return i;
  };
  std::vector<std::uint32_t> table(729);
  for (std::size_t b = 0; b < model.blocks(); ++b) {
    if (b % 256 == 0) fine.context().check();
    model.node_table(b, table.data());
    const Vec3i o = model.origin[b];
    each_cell(model, b, [&](int low, int c, float) {
      const Vec3i at{o.x + (c >> 6), o.y + ((c >> 3) & 7), o.z + (c & 7)};
      const Vec3i box = box_of(at);
      // Corners in different boxes differ in these bits.
      const int split = (at.x - 3 * box.x == 2 ? 4 : 0) + (at.y - 3 * box.y == 2 ? 2 : 0) + (at.z - 3 * box.z == 2);
      std::array<std::uint32_t, 8> first;
      first.fill(none);
      for (int a = 0; a < 8; ++a) {
        const std::uint32_t i = table[static_cast<std::size_t>(low + VoxelModel::corner[static_cast<std::size_t>(a)])];
        if (held[i] == 7) continue;
        auto& f = first[static_cast<std::size_t>(a & split)];
        const std::uint32_t r = root(i);
        if (f == none) {
          f = r;
        } else if (f != r) {
          parent[std::max(f, r)] = std::min(f, r);
          f = std::min(f, r);
        }
      }
    });
  }
  for (std::size_t b = 0; b < model.blocks(); ++b) {
    model.each_own_node(b, [&](std::uint32_t i, Vec3i at) {
      const Vec3i box = box_of(at);
      const int x = at.x - 3 * box.x, y = at.y - 3 * box.y, z = at.z - 3 * box.z;
      place_[i] = static_cast<std::uint8_t>(9 * x + 3 * y + z);
      if (held[i] == 7) {
        of_node_[i] = none;
        return;
      }
      // A root is the smallest of its nodes, and nodes come in order: boxes are numbered as the roots are below.
      if (root(i) == i) box_.push_back(box);
    });
  }
  std::vector<std::uint32_t> number(n, none);
  std::uint32_t next = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    if (of_node_[i] != none && of_node_[i] == i) number[i] = next++;
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    if (of_node_[i] != none) of_node_[i] = root(i);
  }
  for (auto& a : of_node_) a = a == none ? none : number[a];
  centre_.assign(next, {});
  begin_.assign(next + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    if (of_node_[i] == none) continue;
    ++begin_[of_node_[i] + 1];
    Vec3d& c = centre_[of_node_[i]];
    const int x = place_[i] / 9, y = place_[i] / 3 % 3, z = place_[i] % 3;
    c = c + Vec3d{1.0 * x, 1.0 * y, 1.0 * z};
  }
  for (std::size_t g = 0; g < next; ++g) {
    const Vec3i box = box_[g];
    centre_[g] = centre_[g] / static_cast<double>(begin_[g + 1]) + Vec3d{3.0 * box.x, 3.0 * box.y, 3.0 * box.z};
    begin_[g + 1] += begin_[g];
  }
  node_.resize(begin_.back());
  std::vector<std::uint32_t> fill(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t i = 0; i < n; ++i) {
    if (of_node_[i] != none) node_[fill[of_node_[i]]++] = i;
  }
}

void VoxelAggregates::to_nodes(const float* c, float* u) const {
  chunked(of_node_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t g = of_node_[i];
      float* to = u + 3 * i;
      if (g == none) {
        to[0] = to[1] = to[2] = 0;
        continue;
      }
      const float* m = c + std::size_t{6} * g;
      const auto [x, y, z] = from_centre(i, g);
      to[0] = m[0] + m[4] * z - m[5] * y;
      to[1] = m[1] + m[5] * x - m[3] * z;
      to[2] = m[2] + m[3] * y - m[4] * x;
    }
  });
  fine_.mask(u);
}

void VoxelAggregates::from_nodes(const float* f, float* c) const {
  chunked(size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t g = begin; g < end; ++g) {
      float* m = c + 6 * g;
      std::fill_n(m, 6, 0.0F);
      for (std::uint32_t k = begin_[g]; k < begin_[g + 1]; ++k) {
        const std::uint32_t i = node_[k];
        const float* v = f + std::size_t{3} * i;
        const auto [x, y, z] = from_centre(i, g);
        m[0] += v[0];
        m[1] += v[1];
        m[2] += v[2];
        m[3] += y * v[2] - z * v[1];
        m[4] += z * v[0] - x * v[2];
        m[5] += x * v[1] - y * v[0];
      }
    }
  });
}

/// The rows of P at one block's nodes, and the block's share of P^T K P.
struct VoxelAggregates::Worker {
  /// Six columns and two of padding.
  using Row = std::array<float, 8>;
  using Columns = std::array<Row, 24>;
  struct Entry {
    std::uint32_t aggregate;
    std::array<Row, 3> value;
  };

  Worker(const VoxelAggregates& a, const std::vector<float>& inverse, float om, const std::vector<std::uint8_t>& h)
      : all(a), model(a.fine_.model()), element(a.fine_.element()), inverse_diagonal(inverse), omega(om), held(h) {
    for (std::size_t c = 0; c < 8; ++c) {
      for (std::size_t k = 0; k < 6; ++k) modal[c][k] = static_cast<float>(element.modal[c][k]);
    }
  }

  void run(std::size_t block) {
    sum.clear();
    rows(block);
    products(block);
  }

  static void hadamard(Columns& v, bool back) {
    for (std::size_t bit = 1; bit < 8; bit *= 2) {
      for (std::size_t a = 0; a < 8; ++a) {
        if ((a & bit) != 0) continue;
        for (std::size_t i = 0; i < 3; ++i) {
          Row& low = v[3 * a + i];
          Row& high = v[3 * (a + bit) + i];
          for (std::size_t k = 0; k < 8; ++k) {
            const float p = low[k], q = high[k];
            low[k] = back ? p - q : p + q;
            high[k] = back ? p + q : q - p;
          }
        }
      }
    }
  }
  void stiffness(Columns& v) const {
    hadamard(v, false);
    for (std::size_t c = 0; c < 8; ++c) {
      Row &x = v[3 * (c ^ 4U)], &y = v[3 * (c ^ 2U) + 1], &z = v[3 * (c ^ 1U) + 2];
      const auto& m = modal[c];
      for (std::size_t k = 0; k < 8; ++k) {
        const float p = x[k], q = y[k], r = z[k];
        x[k] = m[0] * p + m[3] * q + m[5] * r;
        y[k] = m[3] * p + m[1] * q + m[4] * r;
        z[k] = m[5] * p + m[4] * q + m[2] * r;
      }
    }
    hadamard(v, true);
  }
  /// The three rows of T at a node.
  void rigid(std::uint32_t node, Row* out) const {
    const std::uint32_t g = all.of_node_[node];
    const auto [x, y, z] = all.from_centre(node, g);
    out[0] = {1, 0, 0, 0, z, -y, 0, 0};
    out[1] = {0, 1, 0, -z, 0, x, 0, 0};
    out[2] = {0, 0, 1, y, -x, 0, 0, 0};
    for (std::size_t i = 0; i < 3; ++i) {
      if (((held[node] >> i) & 1U) != 0) out[i] = {};
    }
  }
  static Entry& entry(std::vector<Entry>& list, std::uint32_t aggregate) {
    for (Entry& e : list) {
      if (e.aggregate == aggregate) return e;
    }
    list.push_back({aggregate, {}});
    return list.back();
  }

  void rows(std::size_t block) {
    model.node_table(block, own.data());
    for (std::size_t p = 0; p < 729; ++p) {
      row[p].clear();
      if (own[p] == none || all.of_node_[own[p]] == none) continue;
      rigid(own[p], entry(row[p], all.of_node_[own[p]]).value.data());
    }
    const Vec3i o = model.origin[block];
    for (int k = 0; k < 27; ++k) {
      const int dx = k / 9 - 1, dy = k / 3 % 3 - 1, dz = k % 3 - 1;
      const std::uint32_t other =
          k == 13 ? static_cast<std::uint32_t>(block) : model.find({o.x + 8 * dx, o.y + 8 * dy, o.z + 8 * dz});
      if (other == none) continue;
      model.node_table(other, table.data());
      each_cell(model, other, [&](int low, int c, float fraction) {
        const int x = 8 * dx + (c >> 6), y = 8 * dy + ((c >> 3) & 7), z = 8 * dz + (c & 7);
        if (x < -1 || y < -1 || z < -1 || x > 8 || y > 8 || z > 8) return;
        smooth_cell(low, x, y, z, fraction);
      });
    }
  }

  void smooth_cell(int low, int x, int y, int z, float fraction) {
    std::array<std::uint32_t, 8> node, near;
    std::size_t n = 0;
    bool any_held = false;
    for (std::size_t a = 0; a < 8; ++a) {
      node[a] = table[static_cast<std::size_t>(low + VoxelModel::corner[a])];
      any_held |= held[node[a]] != 0;
      const std::uint32_t g = all.of_node_[node[a]];
      if (g != none && std::find(near.begin(), near.begin() + n, g) == near.begin() + n) near[n++] = g;
    }
    if (n == 1 && !any_held) return;  // moves rigidly
    for (std::size_t s = 0; s < n; ++s) {
      Columns v{};
      for (std::size_t a = 0; a < 8; ++a) {
        if (all.of_node_[node[a]] == near[s]) rigid(node[a], v.data() + 3 * a);
      }
      stiffness(v);
      for (int a = 0; a < 8; ++a) {
        const int nx = x + (a >> 2), ny = y + ((a >> 1) & 1), nz = z + (a & 1);
        if (nx < 0 || ny < 0 || nz < 0 || nx > 8 || ny > 8 || nz > 8) continue;
        const auto p = static_cast<std::size_t>((nx * 9 + ny) * 9 + nz);
        if (own[p] == none || held[own[p]] == 7) continue;
        Entry& e = entry(row[p], near[s]);
        const float scale = omega * fraction * inverse_diagonal[own[p]];
        for (std::size_t i = 0; i < 3; ++i) {
          if (((held[own[p]] >> i) & 1U) != 0) continue;
          for (std::size_t j = 0; j < 8; ++j) e.value[i][j] -= scale * v[3 * static_cast<std::size_t>(a) + i][j];
        }
      }
    }
  }

  void products(std::size_t block) {
    each_cell(model, block, [&](int low, int, float fraction) {
      groups.clear();
      for (const int k : VoxelModel::corner) {
        for (const Entry& e : row[static_cast<std::size_t>(low + k)]) groups.push_back(e.aggregate);
      }
      std::sort(groups.begin(), groups.end());
      groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
      modes.resize(groups.size());
      for (std::size_t s = 0; s < groups.size(); ++s) {
        Columns v{};
        for (std::size_t a = 0; a < 8; ++a) {
          for (const Entry& e : row[static_cast<std::size_t>(low + VoxelModel::corner[a])]) {
            if (e.aggregate == groups[s]) std::copy(e.value.begin(), e.value.end(), v.begin() + 3 * a);
          }
        }
        hadamard(v, false);
        for (std::size_t r = 0; r < element.root.size(); ++r) {
          const auto& root = element.root[r];
          const auto& [p, q, t] = root.coefficient;
          const Row &x = v[3 * (root.cls ^ 4U)], &y = v[3 * (root.cls ^ 2U) + 1], &z = v[3 * (root.cls ^ 1U) + 2];
          for (std::size_t k = 0; k < 6; ++k) {
            modes[s][6 * r + k] =
                p * static_cast<double>(x[k]) + q * static_cast<double>(y[k]) + t * static_cast<double>(z[k]);
          }
        }
      }
      for (std::size_t s = 0; s < groups.size(); ++s) {
        for (std::size_t t = s; t < groups.size(); ++t) {
          Block6 product{};
          for (std::size_t r = 0; r < 18; ++r) {
            const double* left = modes[s].data() + 6 * r;
            const double* right = modes[t].data() + 6 * r;
            for (std::size_t i = 0; i < 6; ++i) {
              for (std::size_t j = 0; j < 6; ++j) product[6 * i + j] += left[i] * right[j];
            }
          }
          Block6& into = sum.at(groups[s], groups[t]);
          for (std::size_t k = 0; k < 36; ++k) into[k] += static_cast<double>(fraction) * product[k];
        }
      }
    });
  }

  const VoxelAggregates& all;
  const VoxelModel& model;
  const VoxelElement& element;
  const std::vector<float>& inverse_diagonal;
  float omega;
  const std::vector<std::uint8_t>& held;
  float modal[8][6];
  std::array<std::uint32_t, 729> own, table;
  std::array<std::vector<Entry>, 729> row;
  std::vector<std::uint32_t> groups;
  std::vector<std::array<double, 108>> modes;
  BlockSum sum;
};

BlockMatrix VoxelAggregates::coarse_matrix(double omega, const std::vector<float>& inverse_diagonal,
                                           const Context& context) const {
  const VoxelModel& model = fine_.model();
  std::vector<std::uint8_t> held(model.nodes(), 0);
  for (const std::uint32_t i : fine_.fixed()) held[i / 3] |= static_cast<std::uint8_t>(1U << (i % 3));
  BlockMatrix result(size());
  // Batches are worked out in parallel and added in order.
  constexpr std::size_t batch = 64;
  tbb::enumerable_thread_specific<Worker> workers(
      [&] { return Worker(*this, inverse_diagonal, static_cast<float>(omega), held); });
  std::vector<BlockSum> sums(batch);
  for (std::size_t start = 0; start < model.blocks(); start += batch) {
    context.check();
    context.progress(static_cast<double>(start) / static_cast<double>(model.blocks()));
    const std::size_t n = std::min(batch, model.blocks() - start);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 1), [&](const auto& range) {
      Worker& worker = workers.local();
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        std::swap(worker.sum, sums[i]);
        worker.run(start + i);
        std::swap(worker.sum, sums[i]);
      }
    });
    for (std::size_t i = 0; i < n; ++i) result.add(sums[i]);
  }
  result.finish();
  return result;
}

}  // namespace fibrolite
