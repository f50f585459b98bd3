// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture_shade.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "picture_shadow.h"

namespace fibrolite {
namespace {

/// Linear light.
struct Light {
  float r = 0, g = 0, b = 0;
};
Light operator*(float s, Light c) { return {s * c.r, s * c.g, s * c.b}; }
Light operator+(Light a, Light b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
Light mix(Light a, Light b, float t) { return (1 - t) * a + t * b; }

float decode(std::uint8_t value) {
  static const auto table = [] {
    std::array<float, 256> t;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const double v = static_cast<double>(i) / 255;
      t[i] = static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    return t;
  }();
  return table[value];
}
std::uint8_t encode(float light) {
  const double v = std::clamp(static_cast<double>(light), 0.0, 1.0);
  return static_cast<std::uint8_t>(
      std::lround(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055)));
}
Light decode(Rgb c) { return {decode(c.r), decode(c.g), decode(c.b)}; }

class Shader {
 public:
  Shader(const Raster& raster, const Mesh& mesh, const View& view, const std::optional<CutPlane>& cut,
         const PointColor& color, const PictureParams& params, int samples, double inset_mm)
      : raster_(raster),
        mesh_(mesh),
        view_(view),
        cut_(cut),
        color_(color),
        params_(params),
        samples_(samples),
        inset_mm_(inset_mm) {}

  RgbImage run(const Context& context);

 private:
  template <class Work>
  void for_rows(const Context& context, Work work) const {
    tbb::parallel_for(tbb::blocked_range<int>(0, params_.height_px, 4), [&](const auto& rows) {
      context.check();
      for (int y = rows.begin(); y != rows.end(); ++y) work(y);
    });
  }
  [[nodiscard]] Vec3d position(int sx, int sy) const {
    return view_.unproject(sx + 0.5, sy + 0.5, Raster::depth_mm(raster_(sx, sy)));
  }
  [[nodiscard]] std::size_t sample_index(int sx, int sy) const {
    return static_cast<std::size_t>(sy) * static_cast<std::size_t>(view_.width) + static_cast<std::size_t>(sx);
  }
  [[nodiscard]] Vec3d normal(int sx, int sy) const;
  /// Samples of one layer lie within a few pixels' width in depth.
  [[nodiscard]] double layer_mm() const { return 4.0 * samples_ / view_.samples_per_mm; }
  [[nodiscard]] Vec3d inside(int sx, int sy) const;
  void find_normals();
  void find_colors(const Context& context);
  void color_pixel(int x, int y, bool every_sample);
  [[nodiscard]] bool crosses_border(int x, int y) const;
  void find_openness(const Context& context);
  [[nodiscard]] float openness(int x, int y) const;
  [[nodiscard]] Light surface_light(int sx, int sy, float open) const;
  [[nodiscard]] Light cap_light(int sx, int sy) const;

  const Raster& raster_;
  const Mesh& mesh_;
  const View& view_;
  const std::optional<CutPlane>& cut_;
  const PointColor& color_;
  const PictureParams& params_;
  int samples_;
  double inset_mm_;
  double size_mm_ = 1;
  std::vector<Vec3f> vertex_normals_;
  std::vector<Rgb> colors_;  ///< Of each sample.
  FloatImage raw_openness_;  ///< Of each pixel's middle sample, 0 closed to 1 open.
};

/// Sums of the triangles' area vectors: smooth over a surface that was smooth. In mesh order, so the same bits always.
void Shader::find_normals() {
  std::vector<Vec3f>& sum = vertex_normals_;
  sum.assign(mesh_.vertices.size(), {});
  for (const Mesh::Triangle& t : mesh_.triangles) {
    const Vec3d a = to_double(mesh_.vertices[t[0]]), b = to_double(mesh_.vertices[t[1]]),
                c = to_double(mesh_.vertices[t[2]]);
    const Vec3f n = to_float(cross(b - a, c - a));
    for (const std::uint32_t v : t) sum[v] = {sum[v].x + n.x, sum[v].y + n.y, sum[v].z + n.z};
  }
}

Vec3d Shader::normal(int sx, int sy) const {
  const std::uint64_t word = raster_(sx, sy);
  if (Raster::is_cap(word)) return cut_->normal;
  const Mesh::Triangle& t = mesh_.triangles[Raster::triangle(word)];
  std::array<Vec3d, 3> s;
  for (std::size_t k = 0; k < 3; ++k) s[k] = view_.project(to_double(mesh_.vertices[t[k]]));
  const auto turn = [](Vec3d a, Vec3d b, double x, double y) {
    return (x - a.x) * (b.y - a.y) - (y - a.y) * (b.x - a.x);
  };
  const double x = sx + 0.5, y = sy + 0.5;
  const double a = turn(s[1], s[2], x, y), b = turn(s[2], s[0], x, y), c = turn(s[0], s[1], x, y);
  const auto unit = [&](std::size_t k) { return normalized(to_double(vertex_normals_[t[k]])); };
  return normalized(a * unit(0) + b * unit(1) + c * unit(2));
}

// The colour function may be costly, so it is asked once per pixel and visible layer; then again for every sample of
// the pixels where neighbours disagree, so that borders between colours are as smooth as outlines.
void Shader::find_colors(const Context& context) {
  colors_.assign(static_cast<std::size_t>(view_.width) * static_cast<std::size_t>(view_.height), {});
  for_rows(context, [&](int y) {
    for (int x = 0; x < params_.width_px; ++x) color_pixel(x, y, false);
  });
  Image<std::uint8_t> border(params_.width_px, params_.height_px, 0);
  for_rows(context, [&](int y) {
    for (int x = 0; x < params_.width_px; ++x) border(x, y) = crosses_border(x, y) ? 1 : 0;
  });
  for_rows(context, [&](int y) {
    for (int x = 0; x < params_.width_px; ++x) {
      if (border(x, y) != 0) color_pixel(x, y, true);
    }
  });
}

void Shader::color_pixel(int x, int y, bool every_sample) {
  const double same_layer_mm = layer_mm();
  struct Known {
    double depth;
    bool cap;
    Rgb color;
  };
  std::array<Known, 9> known;
  std::size_t count = 0;
  for (int j = 0; j < samples_; ++j) {
    for (int i = 0; i < samples_; ++i) {
      const int sx = x * samples_ + i, sy = y * samples_ + j;
      const std::uint64_t word = raster_(sx, sy);
      if (Raster::empty(word)) continue;
      const double depth = Raster::depth_mm(word);
      const bool cap = Raster::is_cap(word);
      const auto same = [&](const Known& k) { return k.cap == cap && std::abs(k.depth - depth) < same_layer_mm; };
      const auto end = known.begin() + static_cast<std::ptrdiff_t>(count);
      const auto found = every_sample ? end : std::find_if(known.begin(), end, same);
      if (found != end) {
        colors_[sample_index(sx, sy)] = found->color;
      } else {
        const Rgb c = color_(inside(sx, sy));
        colors_[sample_index(sx, sy)] = c;
        if (count < known.size()) known[count++] = {depth, cap, c};
      }
    }
  }
}

// On the surface itself a rounding decides to which of two touching things a point belongs: half a voxel in, none does.
Vec3d Shader::inside(int sx, int sy) const {
  const Vec3d p = position(sx, sy);
  return Raster::is_cap(raster_(sx, sy)) ? p : p - inset_mm_ * normal(sx, sy);
}

bool Shader::crosses_border(int x, int y) const {
  const int middle = samples_ / 2;
  const int sx = x * samples_ + middle, sy = y * samples_ + middle;
  const std::uint64_t word = raster_(sx, sy);
  if (Raster::empty(word)) return false;
  const Rgb own = colors_[sample_index(sx, sy)];
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const int nx = sx + i * samples_, ny = sy + j * samples_;
      if (nx < 0 || ny < 0 || nx >= view_.width || ny >= view_.height || Raster::empty(raster_(nx, ny))) continue;
      // Where one thing hides another the layers have been told apart already.
      const std::uint64_t next = raster_(nx, ny);
      const bool same_layer = Raster::is_cap(next) == Raster::is_cap(word) &&
                              std::abs(Raster::depth_mm(next) - Raster::depth_mm(word)) < layer_mm();
      if (same_layer && colors_[sample_index(nx, ny)] != own) return true;
    }
  }
  return false;
}

// Ambient occlusion in screen space: of the samples seen around a point, how much of its sky do those above its tangent
// plane take? After McGuire et al. 2011 (Alchemy), at two radii: creases, and the depths of a lattice.
void Shader::find_openness(const Context& context) {
  raw_openness_ = FloatImage(params_.width_px, params_.height_px, 1.0F);
  constexpr int taps = 18;
  constexpr std::array<double, 2> reach_of_size{0.018, 0.075};
  for_rows(context, [&](int y) {
    for (int x = 0; x < params_.width_px; ++x) {
      const int sx = x * samples_ + samples_ / 2, sy = y * samples_ + samples_ / 2;
      if (Raster::empty(raster_(sx, sy))) continue;
      const Vec3d p = position(sx, sy), n = normal(sx, sy);
      // A 4 x 4 pattern of turns, blurred over 4 x 4 pixels afterwards.
      const double turn = ((x & 3) * 4 + (y & 3)) * 7 % 16 * (2 * std::numbers::pi / 16);
      double open = 1;
      for (const double share : reach_of_size) {
        const double reach_mm = share * size_mm_, reach_px = reach_mm * view_.samples_per_mm / samples_;
        double taken = 0;
        for (int k = 0; k < taps; ++k) {
          const double radius = reach_px * (k + 0.5) / taps, angle = turn + 2.399963 * k;
          const int qx = x + static_cast<int>(std::lround(radius * std::cos(angle)));
          const int qy = y + static_cast<int>(std::lround(radius * std::sin(angle)));
          if (qx < 0 || qy < 0 || qx >= params_.width_px || qy >= params_.height_px) continue;
          const int tx = qx * samples_ + samples_ / 2, ty = qy * samples_ + samples_ / 2;
          if (Raster::empty(raster_(tx, ty))) continue;
          const Vec3d v = position(tx, ty) - p;
          const double length = norm(v);
          if (length < 1e-9) continue;
          const double near = std::max(0.0, 1 - length / (3 * reach_mm));
          taken += std::max(0.0, dot(v, n) / length - 0.12) * near;
        }
        open *= std::clamp(1 - 1.9 * taken / taps, 0.0, 1.0);
      }
      raw_openness_(x, y) = static_cast<float>(open);
    }
  });
}

float Shader::openness(int x, int y) const {
  const auto depth = [&](int px, int py) {
    return raster_(px * samples_ + samples_ / 2, py * samples_ + samples_ / 2);
  };
  const std::uint64_t own = depth(x, y);
  if (Raster::empty(own)) return 1;
  const float same_mm = static_cast<float>(0.01 * size_mm_);
  float sum = 0, weight = 0;
  for (int j = -2; j <= 1; ++j) {
    for (int i = -2; i <= 1; ++i) {
      const int px = x + i, py = y + j;
      if (px < 0 || py < 0 || px >= params_.width_px || py >= params_.height_px) continue;
      const std::uint64_t word = depth(px, py);
      if (Raster::empty(word) || Raster::is_cap(word) != Raster::is_cap(own)) continue;
      if (std::abs(Raster::depth_mm(word) - Raster::depth_mm(own)) > same_mm) continue;
      sum += raw_openness_(px, py);
      weight += 1;
    }
  }
  return weight > 0 ? sum / weight : raw_openness_(x, y);
}

Light Shader::surface_light(int sx, int sy, float open) const {
  const Vec3d n = normal(sx, sy);
  // Lights travel with the camera: key from the upper left, fill from the right, a rim from behind.
  const Vec3d c{dot(n, view_.right), dot(n, view_.up), -dot(n, view_.forward)};
  const Vec3d key = normalized({-0.50, 0.62, 0.60}), fill = normalized({0.75, 0.05, 0.66});
  const double sky = 0.5 + 0.5 * dot(n, normalized(params_.up));
  const double lit_key = std::max(0.0, dot(c, key)), lit_fill = std::max(0.0, dot(c, fill));
  const double rim = std::pow(1 - std::clamp(c.z, 0.0, 1.0), 3.0) * (0.4 + 0.6 * sky);
  const double shine = std::pow(std::max(0.0, dot(c, normalized(key + Vec3d{0, 0, 1}))), 36.0);
  const double direct = 0.35 + 0.65 * open;
  const double diffuse = (0.16 + 0.26 * sky) * open + (0.62 * lit_key + 0.16 * lit_fill) * direct;
  Light light = static_cast<float>(diffuse) * decode(colors_[sample_index(sx, sy)]);
  const auto gloss = static_cast<float>((0.10 * shine + 0.10 * rim) * direct);
  light = light + Light{gloss, gloss, gloss};
  if (!cut_) return light;
  // What lies behind the cut sinks into a cool dark.
  const double behind = std::max(0.0, -cut_->side(position(sx, sy)));
  const auto haze = static_cast<float>(0.40 * (1 - std::exp(-behind / (0.17 * size_mm_))));
  return mix(light, {0.035F, 0.045F, 0.065F}, haze);
}

Light Shader::cap_light(int sx, int sy) const {
  const Light own = 0.92F * decode(colors_[sample_index(sx, sy)]);
  const Light line = 0.10F * own;
  const float t = Raster::cap_depth(raster_(sx, sy));
  return mix(line, own, t * t * (3 - 2 * t));
}

RgbImage Shader::run(const Context& context) {
  size_mm_ = std::max(bounds(mesh_).longest_side(), 1e-6);
  find_normals();
  context.progress(0.1);
  find_colors(context);
  context.progress(0.5);
  find_openness(context);
  context.progress(0.8);
  const GroundShadow shadow(mesh_, cut_, normalized(params_.up));
  RgbImage image(params_.width_px, params_.height_px);
  for_rows(context, [&](int y) {
    for (int x = 0; x < params_.width_px; ++x) {
      const float open = openness(x, y);
      const double down = (y + 0.5) / params_.height_px;
      Light sum;
      for (int j = 0; j < samples_; ++j) {
        for (int i = 0; i < samples_; ++i) {
          const int sx = x * samples_ + i, sy = y * samples_ + j;
          const std::uint64_t word = raster_(sx, sy);
          if (Raster::empty(word)) {
            const double dim = shadow.at(view_, sx + 0.5, sy + 0.5);
            sum = sum + static_cast<float>(1 - dim) * mix({1, 1, 1}, {0.86F, 0.875F, 0.90F}, static_cast<float>(down));
          } else {
            sum = sum + (Raster::is_cap(word) ? cap_light(sx, sy) : surface_light(sx, sy, open));
          }
        }
      }
      sum = (1.0F / static_cast<float>(samples_ * samples_)) * sum;
      image(x, y) = {encode(sum.r), encode(sum.g), encode(sum.b)};
    }
  });
  context.progress(1);
  return image;
}

}  // namespace

RgbImage shade(const Raster& raster, const Mesh& mesh, const View& view, const std::optional<CutPlane>& cut,
               const PointColor& color, const PictureParams& params, int samples, double inset_mm,
               const Context& context) {
  return Shader(raster, mesh, view, cut, color, params, samples, inset_mm).run(context);
}

}  // namespace fibrolite
