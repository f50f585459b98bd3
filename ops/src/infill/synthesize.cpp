// SPDX-License-Identifier: GPL-3.0-or-later
// Texture synthesis of membranes: quilt the template's depth image, find the cells again, draw exact walls along their
// borders.

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/ops/infill/micrograph.h"
#include "fibrolite/random.h"
#include "infill/cells.h"
#include "infill/network.h"
#include "infill/quilt.h"
#include "infill/thickness.h"

namespace fibrolite {
namespace {

constexpr int pitch_px = 14;           // of the quilted texture; borders become smooth lines, so it needs no more
constexpr double saddle_ratio = 0.75;  // a waist wider than this share of the smaller cell is no border
constexpr int smoothing_rounds = 14;   // reaches about sqrt(rounds) = 4 px along a border
constexpr int max_side_px = 20000;

void check(const FibreMap& map, const MembraneParams& p) {
  const auto refuse = [](const std::string& what, const std::string& where, const std::string& hint) {
    throw Error(Code::BadRecipe, what, where, hint);
  };
  if (!(p.wall_mm > 0)) refuse("the membrane must have a thickness above zero", "mfs.wall_mm", "try 0.8");
  if (!(p.gap_mm > 0)) refuse("the narrowest void must have a width above zero", "mfs.gap_mm", "try 0.4");
  if (!(p.fibre_mm > least_fibre_mm(p.wall_mm, p.gap_mm, p.walls)) || !std::isfinite(p.fibre_mm))
    refuse(p.walls == Walls::Image ? "a fibre must be wider than two membranes, and than a membrane and a gap"
                                   : "fibres with triangles between them must lie more than four walls apart, and than "
                                     "two walls and two gaps",
           "mfs.fibre_mm", "raise fibre_mm, or lower wall_mm or gap_mm");
  if (!(p.least_scale > 0) || p.least_scale > 1)
    refuse("the section cannot be shrunk by that", "least_scale", "use a number up to 1");
  if (!(p.pixel_mm > 0) || p.pixel_mm > p.wall_mm / 4 * 1.001)
    refuse("the pixel must be at most a quarter of the membrane", "pixel_mm", "use wall_mm / 4");
  if (!(p.width_mm > 0) || !(p.height_mm > 0)) refuse("the section has no size", "width_mm, height_mm", "");
  if (std::max(p.width_mm, p.height_mm) / p.pixel_mm > max_side_px)
    throw Error(Code::TooLarge, "the section needs an image over " + std::to_string(max_side_px) + " pixels wide",
                "mfs", "use thicker membranes or a smaller part");
  if (map.fibres < 4 || !(map.mean_pitch_px > 0))
    throw Error(Code::BadInput, "the template holds no fibres", "mfs.template");
}

/// How deep inside a fibre each pixel of the template lies: 0 in membranes, 255 at half a pitch; one fibre is pitch_px
/// wide.
GrayImage depth_texture(const FibreMap& map) {
  cv::Mat inside(map.label.height, map.label.width, CV_8U);
  for (int y = 0; y < map.label.height; ++y)
    for (int x = 0; x < map.label.width; ++x) {
      const int own = map.label(x, y);
      // Fibres that touch have no membrane pixel between them; make one.
      const bool touches = (x > 0 && map.label(x - 1, y) != own) || (y > 0 && map.label(x, y - 1) != own);
      inside.at<std::uint8_t>(y, x) = own == 0 || touches ? 0 : 255;
    }
  cv::Mat depth, texture;
  cv::distanceTransform(inside, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  depth.convertTo(depth, CV_8U, 255 / (0.5 * map.mean_pitch_px));
  const double scale = pitch_px / map.mean_pitch_px;
  const cv::Size size(std::max(2 * pitch_px, static_cast<int>(std::lround(depth.cols * scale))),
                      std::max(2 * pitch_px, static_cast<int>(std::lround(depth.rows * scale))));
  cv::resize(depth, texture, size, 0, 0, scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  GrayImage image(texture.cols, texture.rows);
  for (int y = 0; y < texture.rows; ++y) std::copy_n(texture.ptr<std::uint8_t>(y), texture.cols, &image(0, y));
  return image;
}

/// The quilted texture as a partition into cells. The watershed closes what a seam tore open.
LabelImage find_cells(const GrayImage& quilted, double least_inscribed_px, int& count) {
  cv::Mat soft(quilted.height, quilted.width, CV_8U);
  for (int y = 0; y < quilted.height; ++y) std::copy_n(&quilted(0, y), quilted.width, soft.ptr<std::uint8_t>(y));
  soft.convertTo(soft, CV_16U, 64);
  cv::GaussianBlur(soft, soft, {5, 5}, 0.8);
  Image<std::uint16_t> height(quilted.width, quilted.height);
  for (int y = 0; y < soft.rows; ++y) std::copy_n(soft.ptr<std::uint16_t>(y), soft.cols, &height(0, y));
  Basins found = basins(height, saddle_ratio);
  fill_gaps(found.label);
  count = found.count;
  // Merging can leave another cell too small only by its own size, never shrink one: two rounds settle it.
  for (int round = 0; round < 2; ++round) {
    std::vector<char> small;
    for (const Cell& cell : measure_cells(found.label, count))
      small.push_back(!cell.at_frame && cell.inscribed_px < least_inscribed_px);
    count = merge_cells(found.label, count, small);
  }
  return std::move(found.label);
}

/// Sides of the Delaunay triangles between the cells' centres, px.
std::vector<Segment2d> triangle_sides(const LabelImage& cells, int count) {
  cv::Subdiv2D triangles({0, 0, cells.width, cells.height});
  for (const Cell& cell : measure_cells(cells, count))
    triangles.insert({static_cast<float>(cell.center.x), static_cast<float>(cell.center.y)});
  std::vector<cv::Vec4f> edges;
  triangles.getEdgeList(edges);
  std::vector<Segment2d> sides;
  const auto inside = [&](float x, float y) {  // the triangle around all of them has corners outside
    return x >= 0 && y >= 0 && x < static_cast<float>(cells.width) && y < static_cast<float>(cells.height);
  };
  for (const cv::Vec4f& e : edges)
    if (inside(e[0], e[1]) && inside(e[2], e[3])) sides.push_back({{e[0], e[1]}, {e[2], e[3]}});
  return sides;
}

}  // namespace

MembraneImage synthesize(const FibreMap& map, const MembraneParams& params) try {
  check(map, params);
  const GrayImage texture = depth_texture(map);
  // The pitch of the quilted cells is known only afterwards, so there is a quarter more of them than asked for, and two
  // for the rim.
  const auto side = [&](double mm) {
    return static_cast<int>(std::ceil((1.25 * mm / params.fibre_mm + 4) * pitch_px));
  };
  QuiltParams quilting;
  quilting.block_px = std::min({4 * pitch_px, texture.width, texture.height});
  quilting.overlap_px = quilting.block_px / 3;
  const GrayImage quilted =
      quilt(texture, side(params.width_mm), side(params.height_mm), quilting, Random(params.seed, "quilt"));

  int count = 0;
  const double least_px = (params.wall_mm + params.gap_mm) / 2 / params.fibre_mm * pitch_px;
  const LabelImage cells = find_cells(quilted, least_px, count);
  // Lines can be scaled freely: the pitch comes out exactly as wanted.
  const double found_pitch_px = mean_pitch(cells, measure_cells(cells, count));
  const double scale = params.fibre_mm / (found_pitch_px > 0 ? found_pitch_px : pitch_px);
  std::vector<Segment2d> borders =
      params.walls == Walls::Image ? smooth_borders(cells, smoothing_rounds) : triangle_sides(cells, count);
  const Vec2d middle{0.5 * (cells.width - 1), 0.5 * (cells.height - 1)};
  for (Segment2d& s : borders) s = {scale * (s.a - middle), scale * (s.b - middle)};

  MembraneImage result;
  result.pixel_mm = params.pixel_mm;
  result.wall_mm = params.wall_mm;
  const int width = static_cast<int>(std::ceil(params.width_mm / params.pixel_mm)) + 1;
  const int height = static_cast<int>(std::ceil(params.height_mm / params.pixel_mm)) + 1;
  const Vec2d corner{-0.5 * (width - 1) * params.pixel_mm, -0.5 * (height - 1) * params.pixel_mm};
  result.distance_mm =
      walls_along(std::move(borders), {corner, params.pixel_mm, width, height},
                  {params.wall_mm, params.gap_mm, params.least_scale}, 0.5 * (params.wall_mm + params.fibre_mm));
  return result;
} catch (const cv::Exception& e) {
  throw Error(Code::Internal, "image processing failed: " + e.err, "synthesize");
}

}  // namespace fibrolite
