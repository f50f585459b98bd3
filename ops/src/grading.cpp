// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/grading.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "fibrolite/clones.h"
#include "fibrolite/error.h"

namespace fibrolite {
namespace {

constexpr double most_entries = 2e6;
constexpr double full_share = 0.95;  // of the volume: peaks under a load or at a corner are not what most members see

/// Which of the entries along one axis lies before each point, and how far that is beyond it, in steps.
FIBROLITE_CLONES void along(int count, const float* __restrict place, float first, float per_mm, int entries,
                            int stride, int* __restrict entry, float* __restrict way) {
  const auto last = static_cast<float>(entries - 1);
  for (int n = 0; n < count; ++n) {
    const float s = (place[n] - first) * per_mm, low = s < 0 ? 0 : s, steps = last < low ? last : low;
    const int whole = static_cast<int>(steps), cell = whole < entries - 2 ? whole : entries - 2;
    entry[n] += stride * cell;
    way[n] = steps - static_cast<float>(cell);
  }
}

/// Trilinear: `row` and `layer` are the ways to the next entry along y and z.
FIBROLITE_CLONES void between(int count, const float* __restrict value, int row, int layer, const int* __restrict entry,
                              const float* __restrict x, const float* __restrict y, const float* __restrict z,
                              float* __restrict out) {
  for (int n = 0; n < count; ++n) {
    const float* const v = value + entry[n];
    const float a = v[0] + x[n] * (v[1] - v[0]), b = v[row] + x[n] * (v[row + 1] - v[row]);
    const float c = v[layer] + x[n] * (v[layer + 1] - v[layer]);
    const float d = v[layer + row] + x[n] * (v[layer + row + 1] - v[layer + row]);
    const float low = a + y[n] * (b - a), high = c + y[n] * (d - c);
    out[n] = low + z[n] * (high - low);
  }
}

/// Values on a lattice, trilinear between. At most two million, so that an int numbers them.
struct Table final : Shape::Function {
  Vec3d origin{};
  double step = 1, steepest = 0;
  std::array<int, 3> size{1, 1, 1};
  std::vector<float> value;

  [[nodiscard]] std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] Vec3d place(int i, int j, int k) const {
    return origin + step * Vec3d{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
  }
  void evaluate(const PointBlock& block, float* out) const override {
    std::array<int, PointBlock::capacity> entry;
    std::array<std::array<float, PointBlock::capacity>, 3> way;
    const Vec3f from = to_float(origin);
    const auto per_mm = static_cast<float>(1 / step);
    const int n = block.count;
    std::fill_n(entry.begin(), n, 0);
    along(n, block.z, from.z, per_mm, size[2], size[1] * size[0], entry.data(), way[2].data());
    along(n, block.y, from.y, per_mm, size[1], size[0], entry.data(), way[1].data());
    along(n, block.x, from.x, per_mm, size[0], 1, entry.data(), way[0].data());
    between(n, value.data(), size[0], size[1] * size[0], entry.data(), way[0].data(), way[1].data(), way[2].data(),
            out);
  }
  [[nodiscard]] double lipschitz() const override { return steepest; }
};

std::shared_ptr<Table> table_over(const Box3d& box, double step_mm) {
  auto table = std::make_shared<Table>();
  const Vec3d size = box.size();
  table->step = std::max(step_mm, std::cbrt(size.x * size.y * size.z / most_entries));
  table->origin = box.min;
  for (std::size_t axis = 0; axis < 3; ++axis)
    table->size[axis] = 2 + static_cast<int>(size[static_cast<int>(axis)] / table->step);
  table->value.assign(table->at(0, 0, table->size[2]), 0);
  return table;
}

/// Each value at least that of its neighbours less what the way to them allows: once up and once down the lattice.
void limit_slope(Table& table, double per_mm) {
  const auto [nx, ny, nz] = table.size;
  const auto raise = [&](int i, int j, int k, int sign) {
    float& own = table.value[table.at(i, j, k)];
    // The 13 neighbours that this sweep has already seen.
    for (int dz = -1; dz <= 0; ++dz) {
      for (int dy = -1; dy <= (dz < 0 ? 1 : 0); ++dy) {
        for (int dx = -1; dx <= (dz < 0 || dy < 0 ? 1 : -1); ++dx) {
          const int a = i + sign * dx, b = j + sign * dy, c = k + sign * dz;
          if (a < 0 || b < 0 || c < 0 || a >= nx || b >= ny || c >= nz) continue;
          const double way = table.step * std::sqrt(static_cast<double>(dx * dx + dy * dy + dz * dz));
          own = std::max(own, table.value[table.at(a, b, c)] - static_cast<float>(per_mm * way));
        }
      }
    }
  };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) raise(i, j, k, 1);
  for (int k = nz - 1; k >= 0; --k)
    for (int j = ny - 1; j >= 0; --j)
      for (int i = nx - 1; i >= 0; --i) raise(i, j, k, -1);
}

void check(const StressGrade& grade) {
  const auto refuse = [](const char* what, const char* where) { throw Error(Code::BadRecipe, what, where); };
  if (!(grade.least > 0) || !(grade.most >= grade.least) || !std::isfinite(grade.most))
    refuse("must be above zero, and grade_most no less", "tcs.grade_least");
  if (!(grade.slope_mm > 0) || !std::isfinite(grade.slope_mm)) refuse("must be above zero", "tcs.grade_depth_mm");
}

}  // namespace

Shape thicker_where_stressed(const StressGrade& grade, const Box3d& box, const Shape& body,
                             const std::function<double(Vec3d)>& stress_mpa, const Context& context) {
  check(grade);
  const auto table = table_over(box, grade.slope_mm / 4);
  std::vector<float> depth(table->value.size());
  tbb::parallel_for(0, table->size[2], [&](int k) {
    context.check();
    std::vector<Vec3d> points;
    for (int j = 0; j < table->size[1]; ++j)
      for (int i = 0; i < table->size[0]; ++i) points.push_back(table->place(i, j, k));
    const std::size_t first = table->at(0, 0, k);
    std::vector<float> distance(points.size());
    body.evaluate(points, distance);
    for (std::size_t n = 0; n < points.size(); ++n) {
      depth[first + n] = distance[n];
      // A little outside too, where points just inside read half of their value.
      if (distance[n] < 2 * table->step) table->value[first + n] = static_cast<float>(stress_mpa(points[n]));
    }
  });
  std::vector<float> inside;
  for (std::size_t n = 0; n < depth.size(); ++n)
    if (depth[n] < 0) inside.push_back(table->value[n]);
  float full = 0;
  if (!inside.empty()) {
    const auto place =
        inside.begin() + static_cast<std::ptrdiff_t>(full_share * static_cast<double>(inside.size() - 1));
    std::nth_element(inside.begin(), place, inside.end());
    full = *place;
  }
  const double span = grade.most - grade.least;
  for (float& v : table->value)
    v = static_cast<float>(grade.least + span * (full > 0 ? std::min(1.0F, v / full) : 0.0F));
  limit_slope(*table, span / grade.slope_mm);
  table->steepest = std::sqrt(3.0) * span / grade.slope_mm;
  return Shape(std::move(table));
}

namespace {

std::shared_ptr<Table> depths(const Shape& body, const Box3d& box, double step_mm, const Context& context) {
  constexpr int edge = 4;  // entries of a neighbourhood
  const auto table = table_over(box, step_mm);
  table->steepest = std::sqrt(3.0);
  const auto [nx, ny, nz] = table->size;
  const auto fill = [&](int i0, int j0, int k0) {
    const int i1 = std::min(i0 + edge, nx), j1 = std::min(j0 + edge, ny), k1 = std::min(k0 + edge, nz);
    const Vec3d low = table->place(i0, j0, k0), high = table->place(i1 - 1, j1 - 1, k1 - 1);
    const double outside = body(0.5 * (low + high)) - 0.5 * norm(high - low);
    for (int k = k0; k < k1; ++k)
      for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i)
          table->value[table->at(i, j, k)] = outside > 0 ? static_cast<float>(outside) : body(table->place(i, j, k));
  };
  tbb::parallel_for(0, (nz + edge - 1) / edge, [&](int slab) {
    context.check();
    for (int j = 0; j < ny; j += edge)
      for (int i = 0; i < nx; i += edge) fill(i, j, slab * edge);
  });
  return table;
}

}  // namespace

Shape depth_table(const Shape& body, const Box3d& box, double step_mm, const Context& context) {
  return Shape(depths(body, box, step_mm, context));
}

std::vector<Vec3d> places_inside(const Shape& body, const Box3d& box, double volume_mm3, double shell_mm,
                                 const Shape& where, const Context& context) {
  constexpr double places = 20000, least_share = 0.05;  // of the box: what an open model encloses may be anything
  const Vec3d size = box.size();
  const double volume = std::max(volume_mm3, least_share * size.x * size.y * size.z);
  const auto table = depths(body, box, std::cbrt(volume / places), context);
  std::vector<Vec3d> inside;
  for (int k = 0; k < table->size[2]; ++k)
    for (int j = 0; j < table->size[1]; ++j)
      for (int i = 0; i < table->size[0]; ++i)
        if (table->value[table->at(i, j, k)] < -shell_mm) inside.push_back(table->place(i, j, k));
  std::vector<float> there(inside.size());
  where.evaluate(inside, there);
  std::size_t kept = 0;
  for (std::size_t n = 0; n < inside.size(); ++n)
    if (there[n] < 0) inside[kept++] = inside[n];
  inside.resize(kept);
  return inside;
}

}  // namespace fibrolite
