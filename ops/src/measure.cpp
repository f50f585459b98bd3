// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/measure.h"

#include <algorithm>
#include <array>

#include "fibrolite/blocks.h"

namespace fibrolite {
namespace {

using Values = std::array<float, PointBlock::capacity>;

/// Share of a voxel below zero, from the distance at its sample.
float below(float distance, float inverse_voxel) { return std::clamp(0.5F - distance * inverse_voxel, 0.0F, 1.0F); }

/// What of a voxel's material is not the shell's, which fills what the lumen leaves of the part.
float beside_shell(float solid, float part, float lumen) { return std::clamp(solid - (part - lumen), 0.0F, lumen); }

PartSums rounded(const PartSums& sums) {
  const Vec3d m = sums.moment_mm;
  return {rounded_for_sums(sums.part),
          rounded_for_sums(sums.lumen),
          rounded_for_sums(sums.infill),
          {rounded_for_sums(m.x), rounded_for_sums(m.y), rounded_for_sums(m.z)}};
}

/// The share of each region in each sample's voxel: shares[region][sample], 1 in all. Near a border a voxel is split as
/// the border runs through it, so that volumes do not jump when a border passes a sample.
void split(const std::vector<Shape>& regions, const PointBlock& block, const Box3d& box, float inverse_voxel,
           std::vector<Values>& shares) {
  shares.resize(regions.size());
  Values sum{}, least;
  least.fill(far_mm);
  std::array<std::size_t, PointBlock::capacity> owner{};
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].bound(box).lo * inverse_voxel >= 0.5F) {
      shares[i].fill(0);
      continue;
    }
    Values value;
    regions[i].evaluate(block, value.data());
    for (std::size_t k = 0; k < value.size(); ++k) {
      shares[i][k] = below(value[k], inverse_voxel);
      sum[k] += shares[i][k];
      if (value[k] < least[k]) {
        least[k] = value[k];
        owner[k] = i;
      }
    }
  }
  for (std::size_t k = 0; k < sum.size(); ++k) {
    for (std::size_t i = 0; i < regions.size(); ++i) {
      shares[i][k] = sum[k] > 0 ? shares[i][k] / sum[k] : (i == owner[k] ? 1.0F : 0.0F);
    }
  }
}

/// The only region with a share in a block, as in most there is one; else how many regions there are.
std::size_t only_region(const std::vector<Shape>& regions, const Box3d& box, float inverse_voxel) {
  std::size_t only = regions.size();
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].bound(box).lo * inverse_voxel >= 0.5F) continue;
    if (only < regions.size()) return regions.size();
    only = i;
  }
  return only;
}

/// Eight sums side by side, which the compiler can keep in one register.
struct Lanes {
  std::array<float, 8> of{};
  [[nodiscard]] double total() const {
    double sum = 0;
    for (const float lane : of) sum += static_cast<double>(lane);
    return sum;
  }
};

/// Of a block that lies wholly in the lumen, as most do: the same sums as one_part()'s, in the same order.
PartSums one_lumen(const Values& solid, const PointBlock& block, float inverse) {
  constexpr double row = 8, slice = 64, all = 512;
  Lanes infill;
  if (below(range_of(solid.data(), PointBlock::capacity).lo, inverse) > 0) {
    for (std::size_t k = 0; k < PointBlock::capacity; k += 8)
      for (std::size_t z = 0; z < 8; ++z) infill.of[z] += below(solid[k + z], inverse);
  }
  Vec3d moment{};
  for (std::size_t x = 0; x < 8; ++x) {
    for (std::size_t y = 0; y < 8; ++y) moment.y += row * static_cast<double>(block.y[64 * x + 8 * y]);
    for (std::size_t z = 0; z < 8; ++z) moment.z += 8.0 * static_cast<double>(block.z[z]);
    moment.x += slice * static_cast<double>(block.x[64 * x]);
  }
  return {all, all, infill.total(), moment};
}

PartSums one_part(const Values& body, const Values& solid, const PointBlock& block, float inverse, float shell) {
  const Interval range = range_of(body.data(), PointBlock::capacity);
  if (below(range.lo, inverse) <= 0) return {};
  if (below(range.hi + shell, inverse) >= 1) return one_lumen(solid, block, inverse);
  Lanes part, lumen, infill;
  Vec3d moment{};
  for (std::size_t x = 0; x < 8; ++x) {
    Lanes slice;
    for (std::size_t y = 0; y < 8; ++y) {
      Lanes row;
      for (std::size_t z = 0; z < 8; ++z) {
        const std::size_t k = 64 * x + 8 * y + z;
        const float deep = below(body[k] + shell, inverse);
        row.of[z] = below(body[k], inverse);
        lumen.of[z] += deep;
        infill.of[z] += beside_shell(below(solid[k], inverse), row.of[z], deep);
        slice.of[z] += row.of[z];
      }
      moment.y += row.total() * static_cast<double>(block.y[64 * x + 8 * y]);
    }
    for (std::size_t z = 0; z < 8; ++z) {
      part.of[z] += slice.of[z];
      moment.z += static_cast<double>(slice.of[z]) * static_cast<double>(block.z[z]);
    }
    moment.x += slice.total() * static_cast<double>(block.x[64 * x]);
  }
  return {part.total(), lumen.total(), infill.total(), moment};
}

void add_parts(const Values& body, const Values& solid, const std::vector<Values>& shares, const PointBlock& block,
               float inverse, float shell, PartSums* into) {
  for (std::size_t k = 0; k < PointBlock::capacity; ++k) {
    const float part = below(body[k], inverse);
    if (part <= 0) continue;
    const float lumen = below(body[k] + shell, inverse), infill = beside_shell(below(solid[k], inverse), part, lumen);
    for (std::size_t r = 0; r < shares.size(); ++r) {
      const float share = shares[r][k];
      if (share <= 0) continue;
      into[r].part += share * part;
      into[r].lumen += share * lumen;
      into[r].infill += share * infill;
      into[r].moment_mm =
          into[r].moment_mm + static_cast<double>(share * part) * Vec3d{block.x[k], block.y[k], block.z[k]};
    }
  }
}

VolumeSums sums_over(const std::vector<Vec3i>& origins, const Solid& body, const Solid& solid,
                     const std::vector<Shape>& regions, double shell_mm, const Context& context) {
  const double h = body.grid().voxel_mm;
  const auto inverse = static_cast<float>(1 / h), shell = static_cast<float>(shell_mm);
  const Shape body_shape = distance_to(body), solid_shape = distance_to(solid);
  const std::size_t n = regions.size();

  // Each block is rounded, so that blocks add up to the same bits in any order.
  constexpr std::size_t batch_size = 16384;
  VolumeSums total{.parts = std::vector<PartSums>(n)};
  std::vector<PartSums> sums(std::min(origins.size(), batch_size) * n);
  struct Filled {
    double body, solid;
  };
  std::vector<Filled> filled(std::min(origins.size(), batch_size));
  for (std::size_t start = 0; start < origins.size(); start += batch_size) {
    context.check();
    const std::vector<Vec3i> batch(
        origins.begin() + static_cast<std::ptrdiff_t>(start),
        origins.begin() + static_cast<std::ptrdiff_t>(std::min(start + batch_size, origins.size())));
    std::fill(sums.begin(), sums.end(), PartSums{});
    for_each_block(batch, h, [&](std::size_t number, const PointBlock& block) {
      Values b, s;
      body_shape.evaluate(block, b.data());
      solid_shape.evaluate(block, s.data());
      const Vec3d low = h * Vec3d{1.0 * block.leaf->x, 1.0 * block.leaf->y, 1.0 * block.leaf->z};
      PartSums* const into = &sums[number * n];
      const Box3d box{low, low + Vec3d{7 * h, 7 * h, 7 * h}};
      if (const std::size_t only = n == 1 ? 0 : only_region(regions, box, inverse); only < n) {
        into[only] = one_part(b, s, block, inverse, shell);
      } else {
        thread_local std::vector<Values> shares;
        split(regions, block, box, inverse, shares);
        add_parts(b, s, shares, block, inverse, shell, into);
      }
      for (std::size_t r = 0; r < n; ++r) into[r] = rounded(into[r]);
      filled[number] = {body.filled_vox(*block.leaf), solid.filled_vox(*block.leaf)};
    });
    for (std::size_t i = 0; i < batch.size(); ++i) {
      total.body_vox += filled[i].body;
      total.solid_vox += filled[i].solid;
      for (std::size_t r = 0; r < n; ++r) total.parts[r] += sums[i * n + r];
    }
  }
  return total;
}

}  // namespace

PartSums& PartSums::operator+=(const PartSums& other) {
  part += other.part;
  lumen += other.lumen;
  infill += other.infill;
  moment_mm = moment_mm + other.moment_mm;
  return *this;
}

PartVolumes PartSums::volumes(double voxel_mm) const {
  const double voxel_mm3 = voxel_mm * voxel_mm * voxel_mm;
  return {part * voxel_mm3, lumen * voxel_mm3, infill * voxel_mm3, part > 0 ? moment_mm / part : Vec3d{}};
}

VolumeSums& VolumeSums::operator+=(const VolumeSums& other) {
  body_vox += other.body_vox;
  solid_vox += other.solid_vox;
  parts.resize(std::max(parts.size(), other.parts.size()));
  for (std::size_t i = 0; i < other.parts.size(); ++i) parts[i] += other.parts[i];
  return *this;
}

Volumes volumes(const VolumeSums& sums, double voxel_mm) {
  const double h = voxel_mm;
  Volumes result{sums.body_vox * h * h * h, sums.solid_vox * h * h * h, {}};
  for (const PartSums& part : sums.parts) result.parts.push_back(part.volumes(voxel_mm));
  return result;
}

VolumeSums measure(const Solid& body, const Solid& solid, const std::vector<Shape>& regions, double shell_mm,
                   const SampleRange& range, const Context& context) {
  return sums_over(blocks(body, range), body, solid, regions, shell_mm, context);
}

Volumes measure(const Solid& body, const Solid& solid, const std::vector<Shape>& regions, double shell_mm,
                const Context& context) {
  return volumes(sums_over(blocks(body), body, solid, regions, shell_mm, context), body.grid().voxel_mm);
}

}  // namespace fibrolite
