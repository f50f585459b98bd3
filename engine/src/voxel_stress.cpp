// SPDX-License-Identifier: Apache-2.0
#include "voxel_stress.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>

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
  Measure(const VoxelModel& m, const VoxelElement& e, const VoxelFemProblem& p, const std::vector<double>& d)
      : model_(m), element_(e), problem_(p), u_(d) {
    least_ = 0.5F * *std::max_element(m.fraction.begin(), m.fraction.end());
  }

  StressSummary run(const Context& context) {
    std::vector<std::vector<Value>> values(model_.blocks());
    at_node_.assign(model_.nodes(), {});
    for (const auto& blocks : model_.colour) {
      context.check();
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 8), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) first_pass(blocks[i], values[blocks[i]]);
      });
    }
    StressSummary result;
    std::vector<Value> all;
    for (const auto& list : values) all.insert(all.end(), list.begin(), list.end());
    values = {};
    if (all.empty()) return result;
    context.check();
    std::sort(all.begin(), all.end(), [](const Value& a, const Value& b) {
      return std::tie(a.stress, a.fraction, a.place) < std::tie(b.stress, b.fraction, b.place);
    });
    context.check();
    std::map<std::uint16_t, PlaceStress> places;
    for (const Value& v : all) {
      for (PlaceStress* sum : {&result.whole, &places[v.place]}) {
        ++sum->cells;
        sum->volume_mm3 += static_cast<double>(v.fraction);  // in cells, until the end
        sum->max_von_mises_mpa = static_cast<double>(v.stress);
      }
    }
    // From the top down: the first value with more than a hundredth of the material above it or at it.
    std::map<std::uint16_t, double> above;
    double above_whole = 0;
    for (auto v = all.rbegin(); v != all.rend(); ++v) {
      const auto down_to = [&](PlaceStress& sum, double& over) {
        if (over > 0.01 * sum.volume_mm3) return;
        over += static_cast<double>(v->fraction);
        sum.p99_von_mises_mpa = static_cast<double>(v->stress);
      };
      down_to(result.whole, above_whole);
      down_to(places[v->place], above[v->place]);
    }
    std::vector<std::vector<Peak>> peaks(model_.blocks());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, model_.blocks(), 16), [&](const auto& range) {
      for (std::size_t b = range.begin(); b < range.end(); ++b) peaks[b] = second_pass(b);
    });
    for (std::size_t b = 0; b < peaks.size(); ++b) {
      for (const Peak& peak : peaks[b]) {
        for (PlaceStress* sum : {&result.whole, &places[peak.place]}) {
          if (!(peak.stress > sum->peak_von_mises_mpa)) continue;
          sum->peak_von_mises_mpa = peak.stress;
          sum->weakest_mm = centre(b, peak.cell);
        }
      }
    }
    const double cell_mm3 = model_.edge_mm * model_.edge_mm * model_.edge_mm;
    result.whole.volume_mm3 *= cell_mm3;
    if (!problem_.place_of) return result;
    for (auto& [place, sum] : places) {
      sum.place = place;
      sum.volume_mm3 *= cell_mm3;
      result.places.push_back(sum);
    }
    return result;
  }

 private:
  struct Value {
    float stress, fraction;
    std::uint16_t place;
  };
  struct Sum {
    std::array<float, 6> stress{};
    float weight = 0;
  };
  struct Peak {
    double stress = -1;
    int cell = 0;
    std::uint16_t place = 0;
  };
  /// Cells of a block that count, and the place of each.
  struct Measured {
    std::vector<int> cells;
    std::vector<std::uint16_t> place;
  };

  [[nodiscard]] Vec3d centre(std::size_t b, int c) const {
    return model_.centre_mm(model_.node_at(b, VoxelModel::lowest_corner(c)));
  }
  [[nodiscard]] Measured measured(std::size_t b) const {
    Measured result;
    std::vector<int>& list = result.cells;
    for (int c = 0; c < 512; ++c) {
      if (model_.fraction[512 * b + static_cast<std::size_t>(c)] >= least_) list.push_back(c);
    }
    std::vector<Vec3d> points;
    for (const int c : list) points.push_back(centre(b, c));
    const Vec3i o = model_.origin[b];
    const Box3d box{model_.node_mm(o), model_.node_mm({o.x + 8, o.y + 8, o.z + 8})};
    if (!list.empty() && problem_.unmeasured.bound(box).lo <= 0) {
      std::vector<float> distance(points.size());
      problem_.unmeasured.evaluate(points, distance);
      std::size_t kept = 0;
      for (std::size_t k = 0; k < list.size(); ++k) {
        if (distance[k] < 0) continue;
        points[kept] = points[k];
        list[kept++] = list[k];
      }
      list.resize(kept);
      points.resize(kept);
    }
    result.place.assign(list.size(), 0);
    if (problem_.place_of && !list.empty()) problem_.place_of(points, result.place);
    return result;
  }

  void first_pass(std::size_t b, std::vector<Value>& values) {
    std::array<std::uint32_t, 729> table;
    model_.node_table(b, table.data());
    const Measured cells = measured(b);
    for (std::size_t i = 0; i < cells.cells.size(); ++i) {
      const int c = cells.cells[i];
      const float f = model_.fraction[512 * b + static_cast<std::size_t>(c)];
      const int low = VoxelModel::lowest_corner(c);
      const CellStress s = cell_stress(model_, element_, problem_.young_mpa, problem_.poisson, u_, table.data(), low);
      values.push_back({static_cast<float>(von_mises(s)), f, cells.place[i]});
      for (const int k : VoxelModel::corner) {
        Sum& sum = at_node_[table[static_cast<std::size_t>(low + k)]];
        for (std::size_t e = 0; e < 6; ++e) sum.stress[e] += f * static_cast<float>(s[e]);
        sum.weight += f;
      }
    }
  }
  /// The largest of each place in the block.
  [[nodiscard]] std::vector<Peak> second_pass(std::size_t b) const {
    std::array<std::uint32_t, 729> table;
    model_.node_table(b, table.data());
    std::vector<Peak> best;
    const Measured cells = measured(b);
    for (std::size_t i = 0; i < cells.cells.size(); ++i) {
      CellStress mean{};
      for (const int k : VoxelModel::corner) {
        const Sum& sum = at_node_[table[static_cast<std::size_t>(VoxelModel::lowest_corner(cells.cells[i]) + k)]];
        for (std::size_t e = 0; e < 6; ++e) mean[e] += static_cast<double>(sum.stress[e] / sum.weight) / 8;
      }
      const Peak found{von_mises(mean), cells.cells[i], cells.place[i]};
      const auto same = std::find_if(best.begin(), best.end(), [&](const Peak& p) { return p.place == found.place; });
      if (same == best.end())
        best.push_back(found);
      else if (found.stress > same->stress)
        *same = found;
    }
    return best;
  }

  const VoxelModel& model_;
  const VoxelElement& element_;
  const VoxelFemProblem& problem_;
  const std::vector<double>& u_;
  float least_ = 0;
  std::vector<Sum> at_node_;
};

}  // namespace

StressSummary measure_stress(const VoxelModel& model, const VoxelElement& element, const VoxelFemProblem& problem,
                             const std::vector<double>& u, const Context& context) {
  return Measure(model, element, problem, u).run(context);
}

}  // namespace fibrolite
