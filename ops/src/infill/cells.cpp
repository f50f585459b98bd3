// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/cells.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace fibrolite {
namespace {

/// Calls visit(neighbour index) for the 4-neighbours of pixel i.
template <class Visit>
void neighbours(int width, int height, std::size_t i, Visit&& visit) {
  const auto w = static_cast<std::size_t>(width);
  const int x = static_cast<int>(i % w), y = static_cast<int>(i / w);
  if (x > 0) visit(i - 1);
  if (x + 1 < width) visit(i + 1);
  if (y > 0) visit(i - w);
  if (y + 1 < height) visit(i + w);
}

/// Length of the border between cells, by pair (smaller label first), in pixel edges.
std::map<std::pair<int, int>, int> shared_borders(const LabelImage& label) {
  std::map<std::pair<int, int>, int> shared;
  const auto meet = [&](int a, int b) {
    if (a != b) ++shared[std::minmax(a, b)];
  };
  for (int y = 0; y < label.height; ++y)
    for (int x = 0; x < label.width; ++x) {
      if (x + 1 < label.width) meet(label(x, y), label(x + 1, y));
      if (y + 1 < label.height) meet(label(x, y), label(x, y + 1));
    }
  return shared;
}

}  // namespace

Basins basins(const Image<std::uint16_t>& height, double saddle_ratio) {
  const std::size_t n = height.pixels.size();
  // Counting sort, highest first; equal heights in scan order.
  std::vector<std::uint32_t> start(65537, 0);
  for (const std::uint16_t h : height.pixels) ++start[65536U - h];
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<std::uint32_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[start[65535U - height.pixels[i]]++] = static_cast<std::uint32_t>(i);

  constexpr std::uint32_t none = 0xffffffff;
  std::vector<std::uint32_t> parent(n, none);  // a root is the peak of its basin
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const std::uint32_t i : order) {
    const std::uint16_t h = height.pixels[i];
    if (h == 0) break;
    parent[i] = i;
    neighbours(height.width, height.height, i, [&](std::size_t j) {
      if (parent[j] == none) return;
      const std::uint32_t a = root(i), b = root(static_cast<std::uint32_t>(j));
      if (a == b) return;
      const bool a_higher = height.pixels[a] > height.pixels[b] || (height.pixels[a] == height.pixels[b] && a < b);
      const std::uint32_t high = a_higher ? a : b, low = a_higher ? b : a;
      // The pixel itself, not yet anyone's, joins the first basin it meets; basins join when the saddle is shallow.
      if (a == i || h > saddle_ratio * height.pixels[low]) parent[low] = high;
    });
  }

  Basins result;
  result.label = LabelImage(height.width, height.height);
  for (std::size_t i = 0; i < n; ++i)
    if (parent[i] == i) {
      result.label.pixels[i] = ++result.count;
      result.peak.push_back(height.pixels[i]);
    }
  for (std::size_t i = 0; i < n; ++i)
    if (parent[i] != none) result.label.pixels[i] = result.label.pixels[root(static_cast<std::uint32_t>(i))];
  return result;
}

void fill_gaps(LabelImage& label) {
  std::vector<std::size_t> front, next;
  for (std::size_t i = 0; i < label.pixels.size(); ++i)
    if (label.pixels[i] > 0) front.push_back(i);
  while (!front.empty()) {
    next.clear();
    for (const std::size_t i : front)
      neighbours(label.width, label.height, i, [&](std::size_t j) {
        if (label.pixels[j] > 0) return;
        label.pixels[j] = label.pixels[i];
        next.push_back(j);
      });
    front.swap(next);
  }
}

std::vector<Cell> measure_cells(const LabelImage& label, int count) {
  std::vector<Cell> cells(static_cast<std::size_t>(count));
  cv::Mat inner(label.height, label.width, CV_8U);
  for (int y = 0; y < label.height; ++y)
    for (int x = 0; x < label.width; ++x) {
      const int own = label(x, y);
      Cell& cell = cells[static_cast<std::size_t>(own - 1)];
      ++cell.pixels;
      cell.center = cell.center + Vec2d{static_cast<double>(x), static_cast<double>(y)};
      cell.at_frame |= x == 0 || y == 0 || x + 1 == label.width || y + 1 == label.height;
      const bool border = (x > 0 && label(x - 1, y) != own) || (y > 0 && label(x, y - 1) != own) ||
                          (x + 1 < label.width && label(x + 1, y) != own) ||
                          (y + 1 < label.height && label(x, y + 1) != own);
      inner.at<std::uint8_t>(y, x) = border ? 0 : 255;
    }
  cv::Mat depth;
  cv::distanceTransform(inner, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (int y = 0; y < label.height; ++y)
    for (int x = 0; x < label.width; ++x) {
      Cell& cell = cells[static_cast<std::size_t>(label(x, y) - 1)];
      // Measured to the centres of border pixels; the border itself lies half a pixel further out.
      cell.inscribed_px = std::max(cell.inscribed_px, depth.at<float>(y, x) + 0.5);
    }
  for (Cell& cell : cells)
    if (cell.pixels > 0) cell.center = (1.0 / static_cast<double>(cell.pixels)) * cell.center;
  return cells;
}

int merge_cells(LabelImage& label, int count, const std::vector<char>& small) {
  std::vector<std::map<int, int>> border(static_cast<std::size_t>(count));
  for (const auto& [pair, length] : shared_borders(label)) {
    border[static_cast<std::size_t>(pair.first - 1)][pair.second] += length;
    border[static_cast<std::size_t>(pair.second - 1)][pair.first] += length;
  }
  std::vector<int> owner(static_cast<std::size_t>(count));
  std::iota(owner.begin(), owner.end(), 1);
  const auto root = [&](int a) {
    while (owner[static_cast<std::size_t>(a - 1)] != a) a = owner[static_cast<std::size_t>(a - 1)];
    return a;
  };
  for (int a = 1; a <= count; ++a) {
    if (!small[static_cast<std::size_t>(a - 1)] || root(a) != a) continue;
    std::map<int, int> by_owner;
    for (const auto& [b, length] : border[static_cast<std::size_t>(a - 1)]) by_owner[root(b)] += length;
    by_owner.erase(a);
    const auto best = std::max_element(by_owner.begin(), by_owner.end(),
                                       [](const auto& p, const auto& q) { return p.second < q.second; });
    if (best != by_owner.end()) owner[static_cast<std::size_t>(a - 1)] = best->first;
  }
  std::vector<int> number(static_cast<std::size_t>(count), 0);
  int left = 0;
  for (int a = 1; a <= count; ++a)
    if (root(a) == a) number[static_cast<std::size_t>(a - 1)] = ++left;
  for (std::int32_t& pixel : label.pixels) pixel = number[static_cast<std::size_t>(root(pixel) - 1)];
  return left;
}

double mean_pitch(const LabelImage& label, const std::vector<Cell>& cells) {
  const auto shared = shared_borders(label);
  for (const bool frame_too : {false, true}) {
    double sum = 0;
    int pairs = 0;
    for (const auto& [pair, length] : shared) {
      const Cell &a = cells[static_cast<std::size_t>(pair.first - 1)],
                 &b = cells[static_cast<std::size_t>(pair.second - 1)];
      if (!frame_too && (a.at_frame || b.at_frame)) continue;
      sum += norm(a.center - b.center);
      ++pairs;
    }
    if (pairs > 0) return sum / pairs;
  }
  return 0;
}

}  // namespace fibrolite
