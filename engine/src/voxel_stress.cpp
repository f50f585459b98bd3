// SPDX-License-Identifier: Apache-2.0
#include "voxel_stress.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace fibrolite {

CellStress cell_stress(const VoxelModel& model, const VoxelElement& element, double young_mpa, double poisson,
                       const std::vector<double>& u, const std::uint32_t* table, int low) {
  std::array<double, 6> strain{};
  for (std::size_t a = 0; a < 8; ++a) {
    const double* v = u.data() + std::size_t{3} * table[low + VoxelModel::corner[a]];
    for (std::size_t e = 0; e < 6; ++e) {
      for (std::size_t i = 0; i < 3; ++i) strain[e] += element.centre[e][3 * a + i] * v[i];
    }
  }
  const double mu = 0.5 * young_mpa / ((1 + poisson) * model.edge_mm);
  const double lambda = young_mpa * poisson / ((1 + poisson) * (1 - 2 * poisson) * model.edge_mm);
  const double spread = lambda * (strain[0] + strain[1] + strain[2]);
  return {spread + 2 * mu * strain[0],
          spread + 2 * mu * strain[1],
          spread + 2 * mu * strain[2],
          mu * strain[3],
          mu * strain[4],
          mu * strain[5]};
}

namespace {

class Measure {
 public:
  Measure(const VoxelModel& m, const VoxelElement& e, double y, double p, const std::vector<double>& d, const Shape& s)
      : model_(m), element_(e), young_(y), poisson_(p), u_(d), unmeasured_(s) {
    least_ = 0.5F * *std::max_element(m.fraction.begin(), m.fraction.end());
  }

  StressSummary run(const Context& context) {
    std::vector<std::vector<std::pair<float, float>>> values(model_.blocks());  // stress, fraction
    at_node_.assign(model_.nodes(), {});
    for (const auto& blocks : model_.colour) {
      context.check();
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 8), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) first_pass(blocks[i], values[blocks[i]]);
      });
    }
    StressSummary result;
    std::vector<std::pair<float, float>> all;
    double volume = 0;
    for (const auto& list : values) {
      for (const auto& v : list) {
        all.push_back(v);
        volume += static_cast<double>(v.second);
      }
    }
    values = {};
    if (all.empty()) return result;
    context.check();
    std::sort(all.begin(), all.end());
    context.check();
    result.max_mpa = static_cast<double>(all.back().first);
    double below = 0;
    for (const auto& [stress, fraction] : all) {
      below += static_cast<double>(fraction);
      result.p99_mpa = static_cast<double>(stress);
      if (below >= 0.99 * volume) break;
    }
    std::vector<std::pair<double, int>> peak(model_.blocks(), {-1, 0});
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, model_.blocks(), 16), [&](const auto& range) {
      for (std::size_t b = range.begin(); b < range.end(); ++b) peak[b] = second_pass(b);
    });
    for (std::size_t b = 0; b < peak.size(); ++b) {
      if (!(peak[b].first > result.peak_mpa)) continue;
      result.peak_mpa = peak[b].first;
      result.weakest_mm = centre(b, peak[b].second);
    }
    return result;
  }

 private:
  struct Sum {
    std::array<float, 6> stress{};
    float weight = 0;
  };

  [[nodiscard]] Vec3d centre(std::size_t b, int c) const {
    return model_.centre_mm(model_.node_at(b, VoxelModel::lowest_corner(c)));
  }
  /// Cells of a block that count.
  [[nodiscard]] std::vector<int> measured(std::size_t b) const {
    std::vector<int> list;
    for (int c = 0; c < 512; ++c) {
      if (model_.fraction[512 * b + static_cast<std::size_t>(c)] >= least_) list.push_back(c);
    }
    const Vec3i o = model_.origin[b];
    const Box3d box{model_.node_mm(o), model_.node_mm({o.x + 8, o.y + 8, o.z + 8})};
    if (list.empty() || unmeasured_.bound(box).lo > 0) return list;
    std::vector<Vec3d> points;
    for (const int c : list) points.push_back(centre(b, c));
    std::vector<float> distance(points.size());
    unmeasured_.evaluate(points, distance);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (!(distance[k] < 0)) list[kept++] = list[k];
    }
    list.resize(kept);
    return list;
  }

  void first_pass(std::size_t b, std::vector<std::pair<float, float>>& values) {
    std::array<std::uint32_t, 729> table;
    model_.node_table(b, table.data());
    for (const int c : measured(b)) {
      const float f = model_.fraction[512 * b + static_cast<std::size_t>(c)];
      const int low = VoxelModel::lowest_corner(c);
      const CellStress s = cell_stress(model_, element_, young_, poisson_, u_, table.data(), low);
      values.emplace_back(static_cast<float>(von_mises(s)), f);
      for (const int k : VoxelModel::corner) {
        Sum& sum = at_node_[table[static_cast<std::size_t>(low + k)]];
        for (std::size_t e = 0; e < 6; ++e) sum.stress[e] += f * static_cast<float>(s[e]);
        sum.weight += f;
      }
    }
  }
  std::pair<double, int> second_pass(std::size_t b) const {
    std::array<std::uint32_t, 729> table;
    model_.node_table(b, table.data());
    std::pair<double, int> best{-1, 0};
    for (const int c : measured(b)) {
      CellStress mean{};
      for (const int k : VoxelModel::corner) {
        const Sum& sum = at_node_[table[static_cast<std::size_t>(VoxelModel::lowest_corner(c) + k)]];
        for (std::size_t e = 0; e < 6; ++e) mean[e] += static_cast<double>(sum.stress[e] / sum.weight) / 8;
      }
      const double v = von_mises(mean);
      if (v > best.first) best = {v, c};
    }
    return best;
  }

  const VoxelModel& model_;
  const VoxelElement& element_;
  double young_, poisson_;
  const std::vector<double>& u_;
  const Shape& unmeasured_;
  float least_ = 0;
  std::vector<Sum> at_node_;
};

}  // namespace

StressSummary measure_stress(const VoxelModel& model, const VoxelElement& element, double young_mpa, double poisson,
                             const std::vector<double>& u, const Shape& unmeasured, const Context& context) {
  return Measure(model, element, young_mpa, poisson, u, unmeasured).run(context);
}

}  // namespace fibrolite
