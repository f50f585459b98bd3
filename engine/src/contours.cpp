// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/contours.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "fibrolite/error.h"
#include "layer_cells.h"

namespace fibrolite {
namespace {

/// The surface in one triangle of a cell: from where it leaves the material to where it enters it. Edges have a number
/// each, and at most one crossing; the link that ends on an edge is followed by the one that starts there.
struct Link {
  std::uint64_t from, to;
  Vec2d at;   // of `from`, cells
  bool keep;  // near a corner of a triangle, where other outlines may be close
};

using Outline = std::vector<Link>;

/// Numbers the edges of the cells and the spokes to their centres.
class Edges {
 public:
  explicit Edges(const SliceGrid& grid) : columns_(static_cast<std::uint64_t>(grid.width) + 1) {}
  /// From corner k of cell (x, y) to the next.
  [[nodiscard]] std::uint64_t side(int x, int y, std::size_t k) const {
    static constexpr std::array<int, 4> dx{0, 1, 0, 0}, dy{0, 0, 1, 0};
    return 6 * corner(x + dx[k], y + dy[k]) + (k % 2);
  }
  [[nodiscard]] std::uint64_t spoke(int x, int y, std::size_t k) const { return 6 * corner(x, y) + 2 + k; }

 private:
  [[nodiscard]] std::uint64_t corner(int x, int y) const {
    return static_cast<std::uint64_t>(y) * columns_ + static_cast<std::uint64_t>(x);
  }
  std::uint64_t columns_;
};

/// A corner of a triangle: where, and the distance there.
struct Sample {
  Vec2d at;
  float value;
};

/// The crossing, the same bits from either triangle: always seen from the lower and more left end.
Link crossing_between(Sample a, Sample b, std::uint64_t from, std::uint64_t to) {
  if (b.at.y < a.at.y || (b.at.y == a.at.y && b.at.x < a.at.x)) std::swap(a, b);
  const double t = crossing(a.value, b.value);
  constexpr double close = 0.05;
  return {from, to, a.at + t * (b.at - a.at), t < close || t > 1 - close};
}

void link_cell(const CellBlock& block, int i, int j, int x, int y, const Edges& edges, std::vector<Link>& out) {
  const std::array<float, 4> v = block.corners(i, j);
  const Sample centre{{x + 0.5, y + 0.5}, block.centre(i, j)};
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t next = (k + 1) % 4;
    // Counter-clockwise: this corner, the next one, the centre.
    const std::array<Sample, 3> corner{Sample{{1.0 * x + corner_x[k], 1.0 * y + corner_y[k]}, v[k]},
                                       Sample{{1.0 * x + corner_x[next], 1.0 * y + corner_y[next]}, v[next]}, centre};
    const std::array<std::uint64_t, 3> edge{edges.side(x, y, k), edges.spoke(x, y, next), edges.spoke(x, y, k)};
    std::size_t leaves = 3, enters = 3;
    for (std::size_t e = 0; e < 3; ++e) {
      const bool here = corner[e].value < 0, there = corner[(e + 1) % 3].value < 0;
      if (here && !there) leaves = e;
      if (!here && there) enters = e;
    }
    if (leaves == 3) continue;
    out.push_back(crossing_between(corner[leaves], corner[(leaves + 1) % 3], edge[leaves], edge[enters]));
  }
}

std::vector<Link> all_links(const Shape& shape, const SliceGrid& grid, double z_mm) {
  const int squares = squares_across(grid) * squares_up(grid);
  const Edges edges(grid);
  std::vector<std::vector<Link>> found(static_cast<std::size_t>(squares));
  tbb::parallel_for(0, squares, [&](int number) {
    const auto mixed = [&](const CellRange& cells) {
      CellBlock block(shape, grid, cells, z_mm);
      block.close_rim(grid, cells);
      for (int j = 0; j < cells.y1 - cells.y0; ++j) {
        for (int i = 0; i < cells.x1 - cells.x0; ++i) {
          if (block.split(i, j))
            link_cell(block, i, j, cells.x0 + i, cells.y0 + j, edges, found[static_cast<std::size_t>(number)]);
        }
      }
    };
    const auto full = [&](const CellRange& cells) {
      if (cells.x0 > 0 && cells.y0 > 0 && cells.x1 < grid.width && cells.y1 < grid.height) return;
      // At the rim even what is full has an outline.
      for (int y = cells.y0; y < cells.y1; y += block_cells) {
        for (int x = cells.x0; x < cells.x1; x += block_cells)
          mixed({x, y, std::min(x + block_cells, cells.x1), std::min(y + block_cells, cells.y1)});
      }
    };
    visit_cells(shape, grid, square(grid, number), z_mm, z_mm, full, mixed);
  });
  std::vector<Link> links;
  for (std::vector<Link>& part : found) {
    links.insert(links.end(), part.begin(), part.end());
    part = {};
  }
  std::sort(links.begin(), links.end(), [](const Link& a, const Link& b) { return a.from < b.from; });
  return links;
}

/// Chains links into closed outlines, the one with the lowest edge first.
std::vector<Outline> chain(const std::vector<Link>& links) {
  std::vector<Outline> outlines;
  std::vector<bool> used(links.size(), false);
  for (std::size_t first = 0; first < links.size(); ++first) {
    if (used[first]) continue;
    Outline& outline = outlines.emplace_back();
    for (std::size_t i = first; !used[i];) {
      used[i] = true;
      outline.push_back(links[i]);
      const auto next = std::lower_bound(links.begin(), links.end(), links[i].to,
                                         [](const Link& link, std::uint64_t edge) { return link.from < edge; });
      if (next == links.end() || next->from != links[i].to)
        throw Error(Code::Internal, "an outline does not close", "contours");
      i = static_cast<std::size_t>(next - links.begin());
    }
  }
  return outlines;
}

/// Twice the signed area.
double shoelace(const std::vector<Vec2d>& points) {
  double twice = 0;
  for (std::size_t i = 0, last = points.size() - 1; i < points.size(); last = i++)
    twice += points[last].x * points[i].y - points[i].x * points[last].y;
  return twice;
}

double distance_to_line(Vec2d p, Vec2d a, Vec2d b) {
  const Vec2d along = b - a, to = p - a;
  const double length = norm(along);
  return length > 0 ? std::abs(along.x * to.y - along.y * to.x) / length : norm(to);
}

/// Leaves out points on nearly straight stretches. Two outlines come closer than the tolerance only about the corners
/// of triangles, and the points there stay.
std::vector<Vec2d> thinned(const Outline& outline, double tolerance) {
  std::vector<Vec2d> points;
  constexpr std::size_t longest = 256;
  for (std::size_t i = 0; i < outline.size();) {
    points.push_back(outline[i].at);
    std::size_t end = i + 1;  // the next point that stays; past the last one: the first
    while (end < outline.size() && end - i < longest && !outline[end].keep) {
      const Vec2d to = outline[(end + 1) % outline.size()].at;
      bool straight = true;
      for (std::size_t k = i + 1; k <= end && straight; ++k)
        straight = distance_to_line(outline[k].at, outline[i].at, to) <= tolerance;
      if (!straight) break;
      ++end;
    }
    i = end;
  }
  if (points.size() >= 3) return points;
  points.clear();
  for (const Link& link : outline) points.push_back(link.at);
  return points;
}

/// Which outlines lie round which: along a ray to the left from one point of each, an odd number of crossings of
/// another outline puts it inside that one. Only pieces in the ray's own row of cells can be crossed.
void nest(const std::vector<Outline>& outlines, int rows, std::vector<Contour>& contours) {
  struct Piece {
    int outline;
    Vec2d a, b;
  };
  const auto row = [](const Piece& p) { return static_cast<std::size_t>(std::floor(0.5 * (p.a.y + p.b.y))); };
  const auto piece = [&](std::size_t outline, std::size_t k) {
    const Outline& points = outlines[outline];
    return Piece{static_cast<int>(outline), points[k].at, points[(k + 1) % points.size()].at};
  };
  std::vector<std::vector<Piece>> by_row(static_cast<std::size_t>(rows));
  for (std::size_t n = 0; n < outlines.size(); ++n) {
    for (std::size_t k = 0; k < outlines[n].size(); ++k) {
      const Piece p = piece(n, k);
      if (p.a.y != p.b.y) by_row[row(p)].push_back(p);
    }
  }
  tbb::parallel_for(std::size_t{0}, outlines.size(), [&](std::size_t n) {
    std::size_t k = 0;
    while (piece(n, k).a.y == piece(n, k).b.y) ++k;  // a closed outline has pieces that rise
    const Piece start = piece(n, k);
    const Vec2d eye = 0.5 * (start.a + start.b);
    std::vector<std::pair<int, double>> crossed;  // outline, x
    for (const Piece& p : by_row[row(start)]) {
      if (p.outline == static_cast<int>(n) || (p.a.y <= eye.y) == (p.b.y <= eye.y)) continue;
      const double x = p.a.x + (eye.y - p.a.y) / (p.b.y - p.a.y) * (p.b.x - p.a.x);
      if (x < eye.x) crossed.emplace_back(p.outline, x);
    }
    std::sort(crossed.begin(), crossed.end());
    double nearest = -1;
    for (std::size_t i = 0, end = 0; i < crossed.size(); i = end) {
      while (end < crossed.size() && crossed[end].first == crossed[i].first) ++end;
      if ((end - i) % 2 == 0) continue;
      ++contours[n].depth;
      // The innermost outline around is met first on the way out.
      if (crossed[end - 1].second > nearest) {
        nearest = crossed[end - 1].second;
        contours[n].parent = crossed[i].first;
      }
    }
  });
}

}  // namespace

std::vector<Contour> contours(const Shape& shape, const SliceGrid& grid, int layer, const ContourParams& params) {
  if (!(params.tolerance_px >= 0 && params.tolerance_px <= 0.1))
    throw Error(Code::BadRecipe, "the tolerance of outlines is 0 to 0.1 pixels", "tolerance");
  const std::vector<Outline> outlines = chain(all_links(shape, grid, (layer + 0.5) * grid.layer_mm));
  std::vector<Contour> result(outlines.size());
  tbb::parallel_for(std::size_t{0}, outlines.size(), [&](std::size_t n) {
    Contour& contour = result[n];
    contour.points = thinned(outlines[n], params.tolerance_px);
    for (Vec2d& p : contour.points) p = {p.x * grid.pixel_mm.x, p.y * grid.pixel_mm.y};
    contour.area_mm2 = 0.5 * shoelace(contour.points);
  });
  nest(outlines, grid.height, result);
  return result;
}

}  // namespace fibrolite
