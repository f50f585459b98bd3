// SPDX-License-Identifier: GPL-3.0-or-later
// Synthetic muscle: a relaxed power diagram (cells of uneven size) drawn as a microscope would see it.

#include <algorithm>
#include <cmath>
#include <vector>

#include "fibrolite/random.h"
#include "generator.h"

namespace fibrolite {
namespace {

constexpr int side_px = 1024;
constexpr double pitch_px = 42;  // mean distance of fibre centres
constexpr double margin_px = 3 * pitch_px;
constexpr int fascicles = 14;        // over image and margin
constexpr double membrane_px = 1.5;  // half width between fibres
constexpr double septum_px = 4.5;    // half width between bundles

/// Smooth noise in [-1, 1] on a lattice of `cell` pixels.
double value_noise(std::uint64_t seed, double x, double y, double cell) {
  const double gx = x / cell, gy = y / cell;
  const double fx = std::floor(gx), fy = std::floor(gy);
  const auto corner = [&](double i, double j) {
    const auto ix = static_cast<std::uint64_t>(static_cast<std::int64_t>(i) + 4096);
    const auto iy = static_cast<std::uint64_t>(static_cast<std::int64_t>(j) + 4096);
    return 2 * Random(seed, "noise", ix << 20 | iy).uniform() - 1;
  };
  const auto ease = [](double t) { return t * t * (3 - 2 * t); };
  const double tx = ease(gx - fx), ty = ease(gy - fy);
  const double top = corner(fx, fy) * (1 - tx) + corner(fx + 1, fy) * tx;
  const double bottom = corner(fx, fy + 1) * (1 - tx) + corner(fx + 1, fy + 1) * tx;
  return top * (1 - ty) + bottom * ty;
}

struct Fibre {
  Vec2d center;
  double weight = 0;  // of the power diagram, px^2
  int fascicle = 0;
  double brightness = 0;
  Vec2d nucleus;
};

/// Fibres with buckets of one pitch, so that the neighbours of a point are found at once.
class Tissue {
 public:
  explicit Tissue(std::uint64_t seed);
  /// The two nearest by power distance decide the cell; `d` is the distance to the membrane's edge, px, negative in the
  /// membrane.
  struct Hit {
    int fibre;
    double d;
    bool septum;
  };
  [[nodiscard]] Hit at(Vec2d p) const;
  [[nodiscard]] int nearest(Vec2d p) const;
  [[nodiscard]] const Fibre& operator[](int i) const { return fibres_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] std::size_t size() const { return fibres_.size(); }

 private:
  void fill_buckets();
  void relax();
  template <class Visit>
  void near(Vec2d p, Visit&& visit) const {
    const int bx = static_cast<int>((p.x + margin_px) / pitch_px), by = static_cast<int>((p.y + margin_px) / pitch_px);
    for (int j = std::max(0, by - 2); j <= std::min(buckets_ - 1, by + 2); ++j)
      for (int i = std::max(0, bx - 2); i <= std::min(buckets_ - 1, bx + 2); ++i)
        for (const int id : bucket_[static_cast<std::size_t>(j * buckets_ + i)]) visit(id);
  }
  [[nodiscard]] double power(int id, Vec2d p) const {
    const Fibre& f = (*this)[id];
    return dot(p - f.center, p - f.center) - f.weight;
  }

  std::vector<Fibre> fibres_;
  int buckets_ = 0;
  std::vector<std::vector<int>> bucket_;
};

Tissue::Tissue(std::uint64_t seed) {
  const double extent = side_px + 2 * margin_px;
  buckets_ = static_cast<int>(std::ceil(extent / pitch_px)) + 1;
  // A hexagonal packing has this many cells of the wanted pitch.
  const auto count = static_cast<std::size_t>(extent * extent / (pitch_px * pitch_px * std::sqrt(3.0) / 2));
  Random random(seed, "fibres");
  for (std::size_t i = 0; i < count; ++i) {
    Fibre f;
    f.center = {random.uniform() * extent - margin_px, random.uniform() * extent - margin_px};
    f.weight = (2 * random.uniform() - 1) * 0.10 * pitch_px * pitch_px;
    f.brightness = 178 + 20 * (2 * random.uniform() - 1);
    fibres_.push_back(f);
  }
  for (int round = 0; round < 5; ++round) relax();

  std::vector<Vec2d> bundle;
  for (int i = 0; i < fascicles; ++i)
    bundle.push_back({random.uniform() * extent - margin_px, random.uniform() * extent - margin_px});
  for (Fibre& f : fibres_) {
    const auto far = [&](Vec2d b) { return dot(b - f.center, b - f.center); };
    f.fascicle = static_cast<int>(
        std::min_element(bundle.begin(), bundle.end(), [&](Vec2d a, Vec2d b) { return far(a) < far(b); }) -
        bundle.begin());
  }
  // A nucleus sits on the rim of its fibre.
  for (std::size_t i = 0; i < fibres_.size(); ++i) {
    const double angle = random.uniform() * 6.283185307179586;
    const Vec2d way{std::cos(angle), std::sin(angle)};
    double reach = 0;
    while (reach < 2 * pitch_px && at(fibres_[i].center + reach * way).d > 3) reach += 0.5;
    fibres_[i].nucleus = fibres_[i].center + reach * way;
  }
}

void Tissue::fill_buckets() {
  bucket_.assign(static_cast<std::size_t>(buckets_) * static_cast<std::size_t>(buckets_), {});
  for (std::size_t i = 0; i < fibres_.size(); ++i) {
    const int bx = static_cast<int>((fibres_[i].center.x + margin_px) / pitch_px);
    const int by = static_cast<int>((fibres_[i].center.y + margin_px) / pitch_px);
    bucket_[static_cast<std::size_t>(by * buckets_ + bx)].push_back(static_cast<int>(i));
  }
}

/// One step of Lloyd's relaxation on samples 3 px apart. It is stopped early: muscle is packed, not crystalline.
void Tissue::relax() {
  fill_buckets();
  std::vector<Vec2d> sum(fibres_.size());
  std::vector<int> samples(fibres_.size());
  for (double y = -margin_px + 1; y < side_px + margin_px; y += 3)
    for (double x = -margin_px + 1; x < side_px + margin_px; x += 3) {
      const int id = nearest({x, y});
      if (id < 0) continue;
      sum[static_cast<std::size_t>(id)] = sum[static_cast<std::size_t>(id)] + Vec2d{x, y};
      ++samples[static_cast<std::size_t>(id)];
    }
  for (std::size_t i = 0; i < fibres_.size(); ++i)
    if (samples[i] > 0) fibres_[i].center = (1.0 / samples[i]) * sum[i];
  fill_buckets();
}

int Tissue::nearest(Vec2d p) const {
  int best = -1;
  near(p, [&](int id) {
    if (best < 0 || power(id, p) < power(best, p)) best = id;
  });
  return best;
}

Tissue::Hit Tissue::at(Vec2d p) const {
  constexpr double rounding = 2.5;  // px: corners of fibres are round
  const int own = nearest(p);
  if (own < 0) return {-1, -septum_px, true};
  double sum = 0, plain = 1e9;
  bool septum = false;
  near(p, [&](int id) {
    if (id == own) return;
    const bool other_bundle = (*this)[id].fascicle != (*this)[own].fascicle;
    const double border = (power(id, p) - power(own, p)) / (2 * norm((*this)[id].center - (*this)[own].center));
    const double d = border - (other_bundle ? septum_px : membrane_px);
    sum += std::exp(-std::min(d, 60.0) / rounding);
    if (d < plain) {
      plain = d;
      septum = other_bundle;
    }
  });
  return {own, -rounding * std::log(sum), septum};
}

Vec2d warped(std::uint64_t seed, int x, int y) {
  const double u = value_noise(seed ^ 1, x, y, 34) + 0.5 * value_noise(seed ^ 2, x, y, 13);
  const double v = value_noise(seed ^ 3, x, y, 34) + 0.5 * value_noise(seed ^ 4, x, y, 13);
  return {x + 3.2 * u, y + 3.2 * v};
}

/// Gaussian blur of about 0.9 px: binomial weights 1 4 6 4 1 in both directions.
FloatImage blurred(const FloatImage& in) {
  constexpr float weight[] = {1 / 16.F, 4 / 16.F, 6 / 16.F, 4 / 16.F, 1 / 16.F};
  FloatImage rows(in.width, in.height), out(in.width, in.height);
  const auto inside = [](int i) { return std::clamp(i, 0, side_px - 1); };
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x)
      for (int k = -2; k <= 2; ++k) rows(x, y) += weight[k + 2] * in(inside(x + k), y);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x)
      for (int k = -2; k <= 2; ++k) out(x, y) += weight[k + 2] * rows(x, inside(y + k));
  return out;
}

double light(double x, double y) {
  const double u = x / side_px - 0.42, v = y / side_px - 0.55;
  return 1.06 - 0.55 * (u * u + v * v) + 0.16 * (x / side_px - 0.5) - 0.10 * (y / side_px - 0.5);
}

}  // namespace

GrayImage muscle_micrograph(std::uint64_t seed) {
  const Tissue tissue(seed);
  FloatImage scene(side_px, side_px);
  for (int y = 0; y < side_px; ++y)
    for (int x = 0; x < side_px; ++x) {
      const Vec2d p = warped(seed, x, y);
      const Tissue::Hit hit = tissue.at(p);
      const Fibre& fibre = tissue[hit.fibre];
      const double inside = std::clamp(hit.d + 0.5, 0.0, 1.0);
      const double flesh = fibre.brightness + 6 * value_noise(seed ^ 5, x, y, 5);
      const double gap = (hit.septum ? 92 : 74) + 10 * value_noise(seed ^ 6, x, y, 9);
      double value = inside * flesh + (1 - inside) * gap;
      const double core = std::clamp(3.2 - norm(p - fibre.nucleus), 0.0, 1.0) * inside;
      value = core * 58 + (1 - core) * value;
      scene(x, y) = static_cast<float>(value * light(x, y));
    }
  const FloatImage soft = blurred(scene);
  GrayImage image(side_px, side_px);
  for (std::size_t i = 0; i < soft.pixels.size(); ++i) {
    Random grain(seed, "grain", i);  // the sum of four uniform numbers is near enough to a normal one
    const double normal = (grain.uniform() + grain.uniform() + grain.uniform() + grain.uniform() - 2) * std::sqrt(3.0);
    image.pixels[i] = static_cast<std::uint8_t>(std::clamp(std::lround(soft.pixels[i] + 7 * normal), 0L, 255L));
  }
  return image;
}

int muscle_fibre_count(std::uint64_t seed) {
  const Tissue tissue(seed);
  std::vector<int> area(tissue.size());
  for (int y = 0; y < side_px; ++y)
    for (int x = 0; x < side_px; ++x) ++area[static_cast<std::size_t>(tissue.nearest(warped(seed, x, y)))];
  const double mean = pitch_px * pitch_px * std::sqrt(3.0) / 2;
  return static_cast<int>(std::count_if(area.begin(), area.end(), [&](int a) { return a > mean / 4; }));
}

}  // namespace fibrolite
