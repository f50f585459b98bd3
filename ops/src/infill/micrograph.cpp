// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/micrograph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "child_process.h"
#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "helper_program.h"
#include "infill/cells.h"
#include "infill/census.h"
#include "png_file.h"

namespace fibrolite {
namespace {

constexpr int max_side_px = 2048;          // larger templates are halved: fibres stay many pixels wide
constexpr double distance_unit = 64;       // a pixel of distance in the integer height image
constexpr double least_likeness = 0.1;     // of white noise 0; a photograph buried in noise as strong as itself has 0.3
constexpr double least_two_levels = 0.68;  // of noise 0.64; fibres that can be told apart have 0.72 or more
constexpr double clear_two_levels = 0.85;  // grain of coherent light has up to 0.77
constexpr double least_fatness = 1.5;      // of fibres over membranes, if levels are not clear; of such grain 1.3
constexpr double least_fibre_px = 6;       // wide; noise that has been enlarged has 3
constexpr double saddle_ratio = 0.72;      // a waist wider than this share of the smaller fibre is no border

/// 8-bit, no larger than max_side_px, light evened out.
cv::Mat even_light(const GrayImage& micrograph) {
  cv::Mat gray(micrograph.height, micrograph.width, CV_8U);
  std::copy(micrograph.pixels.begin(), micrograph.pixels.end(), gray.begin<std::uint8_t>());
  while (std::max(gray.cols, gray.rows) > max_side_px) cv::resize(gray, gray, {}, 0.5, 0.5, cv::INTER_AREA);

  cv::Mat value, light;
  gray.convertTo(value, CV_32F);
  value += 1;
  // Three box filters make a near Gaussian whose cost does not grow with its width.
  const int width = std::max(3, std::min(gray.cols, gray.rows) / 8) | 1;
  value.copyTo(light);
  for (int pass = 0; pass < 3; ++pass)
    cv::boxFilter(light, light, CV_32F, {width, width}, {-1, -1}, true, cv::BORDER_REFLECT);
  cv::Mat flat;
  cv::divide(value, light, flat, 128);
  flat.convertTo(gray, CV_8U);
  return gray;
}

/// How alike pixels two apart are: 0 of noise without grain, whatever its distribution.
double likeness(const cv::Mat& gray) {
  cv::Mat value;
  gray.convertTo(value, CV_32F);
  value -= cv::mean(value)[0];
  const double square = value.dot(value) / static_cast<double>(value.total());
  if (!(square > 0)) return 0;
  double sum = 0;
  for (const auto& [dx, dy] : {std::pair{2, 0}, std::pair{0, 2}}) {
    const cv::Rect here(0, 0, value.cols - dx, value.rows - dy), there(dx, dy, here.width, here.height);
    sum += value(here).dot(value(there)) / here.area();
  }
  return sum / (2 * square);
}

/// Share of the variance that two grey levels explain, one on each side of the mask: 2 / pi of normal noise, however
/// coarse its grain; 1 of two clear levels.
double two_levels(const cv::Mat& gray, const cv::Mat& mask) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(gray, mean, deviation);
  const double share = cv::countNonZero(mask) / static_cast<double>(mask.total());
  const double step = cv::mean(gray, mask)[0] - cv::mean(gray, ~mask)[0];
  return deviation[0] > 0 ? share * (1 - share) * step * step / (deviation[0] * deviation[0]) : 0;
}

cv::Mat depth_of(const cv::Mat& mask) {
  cv::Mat depth;
  cv::distanceTransform(mask, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return depth;
}

/// How fat the mask is: mean depth of its pixels.
double thickness(const cv::Mat& mask) {
  const double pixels = cv::countNonZero(mask);
  return pixels > 0 ? cv::sum(depth_of(mask))[0] / pixels : 0;
}

/// Share of the mask that its largest connected region holds.
double largest_share(const cv::Mat& mask) {
  cv::Mat label, stats, centers;
  const int count = cv::connectedComponentsWithStats(mask, label, stats, centers, 4, CV_32S);
  int largest = 0;
  for (int i = 1; i < count; ++i) largest = std::max(largest, stats.at<int>(i, cv::CC_STAT_AREA));
  return static_cast<double>(largest) / std::max(1, cv::countNonZero(mask));
}

/// Fibres are fat and apart, membranes are thin and hang together: whichever differs more decides.
bool bright_is_fibre(const cv::Mat& bright) {
  const cv::Mat dark = ~bright;
  const double by_thickness = std::log((thickness(bright) + 0.1) / (thickness(dark) + 0.1));
  const double by_share = std::log((largest_share(dark) + 0.05) / (largest_share(bright) + 0.05));
  return by_thickness + 0.5 * by_share > 0;
}

/// Nuclei and grain inside a fibre are not membrane: fill holes that are small against the fibres.
void fill_small_holes(cv::Mat& fibre, double typical_radius_px) {
  cv::Mat label, stats, centers;
  const int count = cv::connectedComponentsWithStats(~fibre, label, stats, centers, 8, CV_32S);
  const double limit = 0.5 * typical_radius_px * typical_radius_px;
  for (int y = 0; y < fibre.rows; ++y)
    for (int x = 0; x < fibre.cols; ++x) {
      const int i = label.at<int>(y, x);
      if (i > 0 && i < count && stats.at<int>(i, cv::CC_STAT_AREA) < limit) fibre.at<std::uint8_t>(y, x) = 255;
    }
}

template <class T>
double median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

/// One marker per fibre: the core of each basin of depth; basins too shallow to be a fibre have none.
cv::Mat markers(const cv::Mat& depth, int& count) {
  Image<std::uint16_t> height(depth.cols, depth.rows);
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      height(x, y) = static_cast<std::uint16_t>(std::min(65535.0, std::round(depth.at<float>(y, x) * distance_unit)));
  const Basins found = basins(height, saddle_ratio);
  cv::Mat marker = cv::Mat::zeros(depth.rows, depth.cols, CV_32S);
  count = 0;
  if (found.count == 0) return marker;
  // Specks outnumber fibres in a noisy image: the median is taken by area, that is over pixels.
  std::vector<std::uint16_t> peak_of_pixel;
  for (const std::int32_t label : found.label.pixels)
    if (label > 0) peak_of_pixel.push_back(found.peak[static_cast<std::size_t>(label - 1)]);
  const double typical = median(std::move(peak_of_pixel));
  std::vector<int> number(found.peak.size(), 0);
  for (std::size_t i = 0; i < found.peak.size(); ++i)
    if (found.peak[i] > 0.25 * typical) number[i] = ++count;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const int label = found.label(x, y);
      if (label == 0) continue;
      const auto i = static_cast<std::size_t>(label - 1);
      if (number[i] > 0 && height(x, y) > 0.6 * found.peak[i]) marker.at<int>(y, x) = number[i];
    }
  return marker;
}

LabelImage to_labels(const cv::Mat& marker) {
  LabelImage label(marker.cols, marker.rows);
  for (int y = 0; y < marker.rows; ++y)
    for (int x = 0; x < marker.cols; ++x) label(x, y) = std::max(0, marker.at<int>(y, x));
  return label;
}

/// Signed distance to the membranes, px: to the edges of pixels, not their centres.
FloatImage distance_to_membranes(const LabelImage& label) {
  cv::Mat fibre(label.height, label.width, CV_8U);
  for (int y = 0; y < label.height; ++y)
    for (int x = 0; x < label.width; ++x) {
      const int own = label(x, y);
      // Fibres that touch are two voids all the same.
      const bool touches = (x > 0 && label(x - 1, y) > 0 && label(x - 1, y) != own) ||
                           (y > 0 && label(x, y - 1) > 0 && label(x, y - 1) != own);
      fibre.at<std::uint8_t>(y, x) = own > 0 && !touches ? 255 : 0;
    }
  const cv::Mat inside = depth_of(fibre), outside = depth_of(~fibre);
  FloatImage distance(label.width, label.height);
  for (int y = 0; y < label.height; ++y)
    for (int x = 0; x < label.width; ++x) {
      const float in = inside.at<float>(y, x), out = outside.at<float>(y, x);
      distance(x, y) = in > 0 ? in - 0.5F : 0.5F - out;
    }
  return distance;
}

constexpr const char* better_image =
    "use a sharp cross-section with fibres apart from each other, at least 12 pixels wide";

[[noreturn]] void nothing_stands_out() {
  throw Error(Code::BadInput, "nothing stands out in the micrograph: it is even, or noise", "template image",
              better_image);
}
[[noreturn]] void too_few(int found) {
  throw Error(Code::BadInput, "found " + std::to_string(found) + " fibres in the micrograph, at least 4 are needed",
              "template image", better_image);
}

}  // namespace

FibreMap find_fibres(const GrayImage& micrograph) try {
  if (micrograph.width < 16 || micrograph.height < 16) too_few(0);
  cv::Mat gray = even_light(micrograph);
  const double alike = likeness(gray);
  // No stronger: a membrane may be two pixels wide.
  cv::medianBlur(gray, gray, 3);
  cv::GaussianBlur(gray, gray, {3, 3}, 0.7);
  cv::Mat fibre;
  cv::threshold(gray, fibre, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
  const double levels = two_levels(gray, fibre);
  if (alike < least_likeness || levels < least_two_levels) nothing_stands_out();
  if (!bright_is_fibre(fibre)) {
    gray = 255 - gray;
    fibre = ~fibre;
  }
  fill_small_holes(fibre, 2 * thickness(fibre));
  cv::morphologyEx(fibre, fibre, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {3, 3}));

  int count = 0;
  cv::Mat marker = markers(depth_of(fibre), count);
  if (count < 4) too_few(count);
  cv::Mat color;
  cv::cvtColor(gray, color, cv::COLOR_GRAY2BGR);
  cv::watershed(color, marker);

  // cv::watershed gives each fibre some of the membrane, as far as the next fibre on flat ground; membranes belong to
  // nobody, so they are cleared and then shared out evenly before anything is measured.
  FibreMap map;
  map.label = to_labels(marker);
  const auto clear_membranes = [&](LabelImage& label) {
    for (int y = 0; y < label.height; ++y)
      for (int x = 0; x < label.width; ++x)
        if (fibre.at<std::uint8_t>(y, x) == 0) label(x, y) = 0;
  };
  clear_membranes(map.label);
  fill_gaps(map.label);
  std::vector<Cell> cells = measure_cells(map.label, count);
  std::vector<std::int64_t> areas;
  for (const Cell& cell : cells) areas.push_back(cell.pixels);
  const double typical_area = median(areas);
  std::vector<char> sliver;
  for (const Cell& cell : cells) sliver.push_back(static_cast<double>(cell.pixels) < 0.1 * typical_area);
  map.fibres = merge_cells(map.label, count, sliver);
  if (map.fibres < 4) too_few(map.fibres);
  cells = measure_cells(map.label, map.fibres);
  map.mean_pitch_px = mean_pitch(map.label, cells);
  clear_membranes(map.label);
  map.census = census(distance_to_membranes(map.label), 1, 0);
  map.census.fibres = map.fibres;
  const double width = std::sqrt(4 / std::numbers::pi * map.census.mean_area);
  if (levels < clear_two_levels && width < least_fatness * map.census.membrane) nothing_stands_out();
  if (width < least_fibre_px)
    throw Error(Code::BadInput,
                "fibres in the micrograph are " + number_text(width, 2) +
                    " pixels wide, which is too few to tell them " + "from noise",
                "template image", better_image);
  return map;
} catch (const cv::Exception& e) {
  throw Error(Code::Internal, "image processing failed: " + e.err, "find_fibres");
}

namespace {

[[noreturn]] void refuse_image(const std::filesystem::path& path) {
  throw Error(Code::BadInput, "cannot read image", path.string(), "give a .png, .jpg, .tif or .bmp image");
}

/// Any image, read by a program of its own (ops/decode).
GrayImage decoded_gray(std::span<const std::byte> file, const std::filesystem::path& path) {
  constexpr ChildLimits limits{.wall_s = 120, .output_bytes = std::size_t{1} << 30U};
  const ChildResult result =
      run_child(helper_program("fibrolite-decode", "FIBROLITE_DECODE"), {}, file, limits, Context());
  constexpr std::string_view magic = "FBLTGRY1";
  std::array<std::uint32_t, 2> size{};
  const std::span<const std::byte> out = result.output;
  if (!result.failure.empty() || out.size() < magic.size() + sizeof size ||
      std::memcmp(out.data(), magic.data(), magic.size()) != 0)
    refuse_image(path);
  std::memcpy(size.data(), out.data() + magic.size(), sizeof size);
  const std::span<const std::byte> pixels = out.subspan(magic.size() + sizeof size);
  if (size[0] == 0 || size[1] == 0 || pixels.size() / size[0] != size[1] || pixels.size() % size[0] != 0)
    refuse_image(path);
  GrayImage gray(static_cast<int>(size[0]), static_cast<int>(size[1]));
  std::memcpy(gray.pixels.data(), pixels.data(), pixels.size());
  return gray;
}

}  // namespace

GrayImage read_gray(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (bytes.empty()) refuse_image(path);
  const auto input = std::as_bytes(std::span(bytes));
  if (auto gray = plain_gray_png(input)) return *std::move(gray);
  return decoded_gray(input, path);
}

void write_gray(const std::filesystem::path& path, const GrayImage& image) {
  write_png_file(path, image.width, image.height, 1, image.pixels);
}

std::filesystem::path bundled_micrograph() {
  for (const char* assets : {FIBROLITE_INSTALL_ASSETS, FIBROLITE_SOURCE_ASSETS}) {
    std::filesystem::path path = std::filesystem::path(assets) / "textures" / "muscle.png";
    if (std::filesystem::exists(path)) return path;
  }
  throw Error(Code::Internal, "the bundled micrograph is missing", FIBROLITE_INSTALL_ASSETS "/textures/muscle.png",
              "reinstall, or name a template with mfs.template");
}

}  // namespace fibrolite
