// SPDX-License-Identifier: GPL-3.0-or-later
#include "growth_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

namespace fibrolite::bench {
namespace {

struct Series {
  std::string name, color;
  std::vector<std::pair<double, double>> points;  ///< Voxel, figure.
};

constexpr double width = 360, height = 300, left = 56, top = 34, gap = 90;

class Panel {
 public:
  Panel(std::string title, std::vector<Series> series, double x) : title_(std::move(title)), all_(std::move(series)) {
    x_ = x;
    for (const Series& s : all_)
      for (const auto& [voxel, figure] : s.points) {
        finest_ = std::min(finest_, voxel);
        coarsest_ = std::max(coarsest_, voxel);
        least_ = std::min(least_, figure);
        most_ = std::max(most_, figure);
      }
    least_ = std::pow(10, std::floor(std::log10(least_)));
    most_ = std::pow(10, std::ceil(std::log10(most_)));
  }
  void draw(std::ostream& out) const {
    out << "<text x='" << x_ << "' y='18' font-weight='bold'>" << title_ << "</text>\n";
    out << "<rect x='" << x_ << "' y='" << top << "' width='" << width << "' height='" << height
        << "' fill='none' stroke='#888'/>\n";
    for (double v = least_; v <= most_ * 1.001; v *= 10) {
      line(out, x_, y_of(v), x_ + width, y_of(v), "#ddd", "");
      out << "<text x='" << x_ - 6 << "' y='" << y_of(v) + 4 << "' text-anchor='end'>" << v << "</text>\n";
    }
    for (double v = coarsest_; v >= finest_ * 0.999; v /= 2) {
      line(out, x_of(v), top, x_of(v), top + height, "#ddd", "");
      out << "<text x='" << x_of(v) << "' y='" << top + height + 16 << "' text-anchor='middle'>" << v << " mm</text>\n";
    }
    if (all_.front().points.size() > 1) {  // by four with every halving, from the first series' first point
      const auto [voxel, figure] = all_.front().points.front();
      const double last = std::min(most_, figure * std::pow(voxel / finest_, 2));
      line(out, x_of(voxel), y_of(figure), x_of(voxel / std::sqrt(last / figure)), y_of(last), "#888", "4 4");
    }
    double legend = top + 16;
    for (const Series& s : all_) {
      out << "<polyline fill='none' stroke='" << s.color << "' stroke-width='2' points='";
      for (const auto& [voxel, figure] : s.points) out << x_of(voxel) << ',' << y_of(figure) << ' ';
      out << "'/>\n";
      for (const auto& [voxel, figure] : s.points)
        out << "<circle cx='" << x_of(voxel) << "' cy='" << y_of(figure) << "' r='3.5' fill='" << s.color << "'/>\n";
      out << "<text x='" << x_ + 10 << "' y='" << legend << "' fill='" << s.color << "'>" << s.name << "</text>\n";
      legend += 16;
    }
  }

 private:
  [[nodiscard]] double x_of(double voxel) const {
    return x_ + 24 + (width - 48) * std::log(coarsest_ / voxel) / std::max(std::log(coarsest_ / finest_), 1e-9);
  }
  [[nodiscard]] double y_of(double figure) const {
    return top + height * std::log(most_ / figure) / std::log(most_ / least_);
  }
  static void line(std::ostream& out, double x0, double y0, double x1, double y1, const char* color,
                   const char* dashes) {
    out << "<line x1='" << x0 << "' y1='" << y0 << "' x2='" << x1 << "' y2='" << y1 << "' stroke='" << color
        << "' stroke-dasharray='" << dashes << "'/>\n";
  }

  std::string title_;
  std::vector<Series> all_;
  double x_ = 0, finest_ = 1e9, coarsest_ = 0, least_ = 1e9, most_ = 0;
};

}  // namespace

std::string growth_plot(const nlohmann::json& cases) {
  Series time{"Fibrolite", "#0072b2", {}}, floor_time{"floor", "#d55e00", {}},
      time_slabs{"in slabs, 300M", "#009e73", {}};
  Series peak = time, floor_peak = floor_time, peak_slabs = time_slabs;
  for (const auto& c : cases) {
    const std::string name = c.at("name");
    if (!name.starts_with("peer-tcs") || name.ends_with("alone") || c.contains("failure")) continue;
    const double voxel = c.at("voxel_mm");
    const bool slabs = name.ends_with("slabs");
    (slabs ? time_slabs : time).points.emplace_back(voxel, c.at("compute_cpu_s").get<double>());
    (slabs ? peak_slabs : peak).points.emplace_back(voxel, c.at("peak_rss_mb").get<double>());
    if (slabs) continue;
    floor_time.points.emplace_back(voxel, c.at("floor").at("compute_cpu_s").get<double>());
    floor_peak.points.emplace_back(voxel, c.at("floor").at("peak_rss_mb").get<double>());
  }
  if (time.points.size() < 2) return {};
  std::ostringstream out;
  out << "<svg xmlns='http://www.w3.org/2000/svg' width='" << 2 * (width + left) + gap << "' height='"
      << top + height + 30 << "' font-family='sans-serif' font-size='12'>\n<rect width='100%' height='100%' "
      << "fill='white'/>\n";
  Panel("CPU seconds of the compute stages", {time, floor_time, time_slabs}, left).draw(out);
  Panel("peak memory of the process, MB", {peak, floor_peak, peak_slabs}, left + width + gap).draw(out);
  out << "</svg>\n";
  return out.str();
}

}  // namespace fibrolite::bench
