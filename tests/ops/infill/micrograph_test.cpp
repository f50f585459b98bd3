// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/micrograph.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <tuple>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "generator.h"
#include "micrographs.h"
#include "models.h"

namespace fibrolite {
namespace {

GrayImage inverted(GrayImage image) {
  for (std::uint8_t& p : image.pixels) p = static_cast<std::uint8_t>(255 - p);
  return image;
}

GrayImage halved(const GrayImage& image) {
  GrayImage half(image.width / 2, image.height / 2);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x)
      half(x, y) = static_cast<std::uint8_t>(
          (image(2 * x, 2 * y) + image(2 * x + 1, 2 * y) + image(2 * x, 2 * y + 1) + image(2 * x + 1, 2 * y + 1)) / 4);
  return half;
}

const GrayImage& muscle() {
  static const GrayImage image = read_gray(bundled_micrograph());
  return image;
}

/// columns x rows square fibres of `pitch` pixels with membranes `wall` wide, half a pitch of membrane around them all.
GrayImage square_fibres(int columns, int rows, int pitch, int wall) {
  GrayImage image((columns + 1) * pitch, (rows + 1) * pitch, 60);
  for (int y = 0; y < rows * pitch; ++y)
    for (int x = 0; x < columns * pitch; ++x)
      if (x % pitch >= wall && y % pitch >= wall) image(x + pitch / 2, y + pitch / 2) = 180;
  return image;
}

TEST(Micrograph, CountsSquaresThatWereDrawn) {
  const FibreMap map = find_fibres(square_fibres(9, 7, 26, 5));
  EXPECT_EQ(map.fibres, 63);
  EXPECT_NEAR(map.mean_pitch_px, 26, 0.3);  // squares share sides with four neighbours, one pitch away
}

TEST(Micrograph, EachDrawnSquareIsOneLabelOfItsOwn) {
  const FibreMap map = find_fibres(square_fibres(9, 7, 26, 5));
  std::set<int> seen;
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 9; ++column) seen.insert(map.label(13 + column * 26 + 15, 13 + row * 26 + 15));
  EXPECT_EQ(seen.size(), 63U);
  EXPECT_FALSE(seen.contains(0));
  EXPECT_EQ(map.label(13 + 26 + 2, 13 + 40), 0) << "the middle of a membrane";
}

TEST(Micrograph, BundledTextureIsWhatTheGeneratorDraws) {
  const GrayImage drawn = muscle_micrograph(muscle_seed);
  ASSERT_EQ(muscle().width, drawn.width);
  ASSERT_EQ(muscle().height, drawn.height);
  int different = 0;
  for (std::size_t i = 0; i < drawn.pixels.size(); ++i) different += std::abs(muscle().pixels[i] - drawn.pixels[i]) > 1;
  EXPECT_EQ(different, 0);
}

TEST(Micrograph, FindsTheFibresThatWereDrawn) {
  const int drawn = muscle_fibre_count(muscle_seed);
  const FibreMap map = find_fibres(muscle());
  EXPECT_NEAR(map.fibres, drawn, 0.1 * drawn);
  EXPECT_NEAR(map.mean_pitch_px, 42, 4.2) << "the generator's pitch";
}

TEST(Micrograph, DarkFibresAreFoundAsWell) {
  const int bright = find_fibres(muscle()).fibres;
  EXPECT_NEAR(find_fibres(inverted(muscle())).fibres, bright, 0.03 * bright);
}

TEST(Micrograph, HalfTheSizeGivesTheSameFibres) {
  const FibreMap full = find_fibres(muscle()), half = find_fibres(halved(muscle()));
  EXPECT_NEAR(half.fibres, full.fibres, 0.1 * full.fibres);
  EXPECT_NEAR(half.mean_pitch_px, full.mean_pitch_px / 2, 0.06 * full.mean_pitch_px);
}

TEST(Micrograph, AnImageWithoutFibresIsRefused) {
  const auto code = [](const GrayImage& image) {
    try {
      (void)find_fibres(image);
    } catch (const Error& e) {
      return e.code();
    }
    return Code::Internal;
  };
  EXPECT_EQ(code(GrayImage(200, 200, 128)), Code::BadInput);
  EXPECT_EQ(code(GrayImage(5, 5, 1)), Code::BadInput);
  EXPECT_EQ(code(GrayImage()), Code::BadInput);
  GrayImage three(120, 40, 180);  // three fibres side by side are not enough to learn from
  for (int y = 0; y < 40; ++y)
    for (const int x : {38, 39, 40, 78, 79, 80}) three(x, y) = 60;
  EXPECT_EQ(code(three), Code::BadInput);
}

/// Light that falls to less than half from side to side and again to half toward the corners, and noise.
TEST(Micrograph, APhotographWithUnevenLightShowsItsFibres) {
  for (const double pitch : {24.0, 34.0, 60.0})
    for (const double noise : {0.0, 8.0, 24.0}) {
      int drawn = 0;
      const FibreMap map = find_fibres(photograph(11, pitch, 600, noise, &drawn));
      EXPECT_NEAR(map.fibres, drawn, 0.03 * drawn) << pitch << ' ' << noise;
    }
}

TEST(Micrograph, AnImageWithoutStructureIsRefused) {
  const auto refused = [](const GrayImage& image) {
    try {
      (void)find_fibres(image);
    } catch (const Error& e) {
      return e.code() == Code::BadInput;
    }
    return false;
  };
  for (const double sd : {2.0, 10.0, 40.0})
    for (const int grain : {0, 1, 4, 30})
      EXPECT_TRUE(refused(pure_noise(3, 400, 128, sd, grain))) << sd << ' ' << grain;
  Random random(5, "test");
  GrayImage even(400, 400), black_and_white(400, 400), ramp(400, 400), dome(400, 400);
  for (std::uint8_t& p : even.pixels) p = static_cast<std::uint8_t>(random.below(256));
  for (std::uint8_t& p : black_and_white.pixels) p = random.uniform() < 0.5 ? 255 : 0;
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x) {
      ramp(x, y) = static_cast<std::uint8_t>(30 + x / 2);
      dome(x, y) = static_cast<std::uint8_t>(220 - ((x - 200) * (x - 200) + (y - 200) * (y - 200)) / 500);
    }
  EXPECT_TRUE(refused(even));
  EXPECT_TRUE(refused(black_and_white));
  EXPECT_TRUE(refused(ramp));
  EXPECT_TRUE(refused(dome));
}

/// Grain of laser light: of exponential brightness, its amplitude of Rayleigh's; and noise that has been enlarged.
TEST(Micrograph, GrainIsNoStructure) {
  const auto refused = [](const GrayImage& image) {
    try {
      (void)find_fibres(image);
    } catch (const Error& e) {
      return e.code() == Code::BadInput;
    }
    return false;
  };
  constexpr int side = 500;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const GrayImage real = pure_noise(seed, side, 128, 25, 6), imaginary = pure_noise(seed + 10, side, 128, 25, 6);
    GrayImage bright(side, side), amplitude(side, side), enlarged(side, side);
    Random random(seed, "grain");
    GrayImage dots(side / 2, side / 2);
    for (std::uint8_t& p : dots.pixels) p = random.uniform() < 0.3 ? 255 : 20;
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const double re = real(x, y) - 128, im = imaginary(x, y) - 128, square = re * re + im * im;
        bright(x, y) = static_cast<std::uint8_t>(std::min(255.0, 0.04 * square));
        amplitude(x, y) = static_cast<std::uint8_t>(std::min(255.0, 3 * std::sqrt(square)));
        enlarged(x, y) = dots(x / 2, y / 2);
      }
    EXPECT_TRUE(refused(bright)) << seed;
    EXPECT_TRUE(refused(amplitude)) << seed;
    EXPECT_TRUE(refused(enlarged)) << seed;
  }
}

/// Hexagons of pitch p with walls w: (p - w)^2 sqrt(3) / 2 each.
TEST(Micrograph, CensusOfAHoneycomb) {
  for (const auto& [columns, rows, pitch, wall] : {std::tuple{14, 12, 24.0, 4.0}, std::tuple{10, 9, 60.0, 20.0}}) {
    const GrayImage image = honeycomb(columns, rows, pitch, wall);
    const FibreMap map = find_fibres(image);
    const double area = (pitch - wall) * (pitch - wall) * std::sqrt(0.75);
    EXPECT_EQ(map.census.fibres, columns * rows);
    EXPECT_NEAR(map.census.mean_area, area, 0.08 * area) << "the corners are rounded";
    EXPECT_NEAR(map.census.membrane, wall, 0.5);
    const double porosity = columns * rows * area / (image.width * image.height);
    EXPECT_NEAR(map.census.porosity, porosity, 0.08 * porosity);
    EXPECT_NEAR(map.mean_pitch_px, pitch, 0.01 * pitch);
  }
}

/// As read from a file of that ending.
GrayImage through_a_file(const cv::Mat& image, const std::string& ending) {
  const testing::TempDir folder;
  std::vector<std::uint8_t> bytes;
  cv::imencode(ending, image, bytes);
  std::ofstream(folder / ending, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return read_gray(folder / ending);
}

/// Every pixel of a gray image made into one of colour.
template <class Pixel, class Make>
cv::Mat each_pixel(const GrayImage& gray, int type, const Make& make) {
  cv::Mat image(gray.height, gray.width, type);
  for (int y = 0; y < gray.height; ++y)
    for (int x = 0; x < gray.width; ++x) image.at<Pixel>(y, x) = make(gray(x, y));
  return image;
}

TEST(Micrograph, ColourInAnyFormatGivesTheSameFibres) {
  int drawn = 0;
  const cv::Mat pink = each_pixel<cv::Vec3b>(photograph(4, 30, 400, 8, &drawn), CV_8UC3, [](int v) {
    return cv::Vec3b(static_cast<std::uint8_t>(v * 2 / 3), static_cast<std::uint8_t>(v / 2),
                     static_cast<std::uint8_t>(v));
  });
  for (const char* ending : {".png", ".jpg", ".tif"})
    EXPECT_NEAR(find_fibres(through_a_file(pink, ending)).fibres, drawn, 0.04 * drawn) << ending;
}

/// Red fibres in green of the same luminance; ink that is there or not; numbers of any size.
TEST(Micrograph, FibresThatStandOutInAnyWayAreFound) {
  const GrayImage squares = square_fibres(9, 7, 26, 5);
  const cv::Mat hue = each_pixel<cv::Vec3b>(squares, CV_8UC3, [](int v) {
    const double share = (v - 60) / 120.0;
    return cv::Vec3b(60, cv::saturate_cast<std::uint8_t>(141 - 81 * share),
                     cv::saturate_cast<std::uint8_t>(40 + 160 * share));
  });
  const cv::Mat ink =
      each_pixel<cv::Vec4b>(squares, CV_8UC4, [](int v) { return cv::Vec4b(0, 0, 0, static_cast<std::uint8_t>(v)); });
  const cv::Mat numbers = each_pixel<float>(squares, CV_32F, [](int v) { return static_cast<float>(1e-3 * v - 0.05); });
  const cv::Mat deep = each_pixel<std::uint16_t>(squares, CV_16U, [](int v) { return static_cast<std::uint16_t>(v); });
  EXPECT_EQ(find_fibres(through_a_file(hue, ".png")).fibres, 63);
  EXPECT_EQ(find_fibres(through_a_file(ink, ".png")).fibres, 63);
  EXPECT_EQ(find_fibres(through_a_file(numbers, ".tif")).fibres, 63);
  EXPECT_EQ(find_fibres(through_a_file(deep, ".png")).fibres, 63);
  // Gray stays what it is, in one channel or in three alike.
  const GrayImage photo = photograph(4, 30, 400);
  const cv::Mat three =
      each_pixel<cv::Vec3b>(photo, CV_8UC3, [](int v) { return cv::Vec3b::all(static_cast<std::uint8_t>(v)); });
  EXPECT_EQ(through_a_file(three, ".png").pixels, photo.pixels);
}

TEST(Micrograph, AFileThatIsNoImageIsRefused) {
  const testing::TempDir folder;
  std::ofstream(folder / "a.png") << "not an image";
  EXPECT_THROW((void)read_gray(folder / "a.png"), Error);
  EXPECT_THROW((void)read_gray(folder / "missing.png"), Error);
}

TEST(Micrograph, GrayImagesSurviveTheFile) {
  const testing::TempDir folder;
  const GrayImage image = square_fibres(3, 2, 10, 3);
  write_gray(folder / "b.png", image);
  EXPECT_EQ(read_gray(folder / "b.png").pixels, image.pixels);
}

// --- synthesis
// -----------------------------------------------------------------------------------------------------------------

const FibreMap& muscle_map() {
  static const FibreMap map = find_fibres(muscle());
  return map;
}

MembraneImage membranes(double side_mm, std::uint64_t seed = 1, double fibre_mm = 2.4, double wall_mm = 0.8) {
  MembraneParams params;
  params.fibre_mm = fibre_mm;
  params.wall_mm = wall_mm;
  params.width_mm = params.height_mm = side_mm;
  params.pixel_mm = std::min(0.1, wall_mm / 4);
  params.seed = seed;
  return synthesize(muscle_map(), params);
}

/// Voids as 4-connected regions: their pixel counts, and whether they touch the frame.
struct Void {
  int pixels = 0;
  bool at_frame = false;
  float deepest_mm = 0;
};
std::vector<Void> voids(const FloatImage& image) {
  std::vector<Void> found;
  Image<std::uint8_t> seen(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (seen(x, y) != 0 || image(x, y) <= 0) continue;
      found.emplace_back();
      std::vector<std::pair<int, int>> stack{{x, y}};
      seen(x, y) = 1;
      while (!stack.empty()) {
        const auto [i, j] = stack.back();
        stack.pop_back();
        Void& v = found.back();
        ++v.pixels;
        v.deepest_mm = std::max(v.deepest_mm, image(i, j));
        v.at_frame |= i == 0 || j == 0 || i + 1 == image.width || j + 1 == image.height;
        for (const auto& [p, q] : {std::pair{i - 1, j}, std::pair{i + 1, j}, std::pair{i, j - 1}, std::pair{i, j + 1}})
          if (p >= 0 && q >= 0 && p < image.width && q < image.height && seen(p, q) == 0 && image(p, q) > 0) {
            seen(p, q) = 1;
            stack.emplace_back(p, q);
          }
      }
    }
  return found;
}

TEST(Synthesize, HasTheSizeThatWasAsked) {
  MembraneParams params;
  params.width_mm = 12.34;
  params.height_mm = 5.5;
  const MembraneImage image = synthesize(muscle_map(), params);
  EXPECT_GE(image.width_mm(), 12.34);
  EXPECT_LT(image.width_mm(), 12.34 + 3 * params.pixel_mm);
  EXPECT_GE(image.height_mm(), 5.5);
}

TEST(Synthesize, AsManyFibresAsThePitchSays) {
  // Cells of a mean neighbour distance d cover about sqrt(3)/2 d^2 each; irregular ones up to a tenth more or less.
  const MembraneImage image = membranes(40);
  double whole = 0, cut = 0;
  for (const Void& v : voids(image.distance_mm)) (v.at_frame ? cut : whole) += 1;
  const double expected = image.width_mm() * image.height_mm() / (2.4 * 2.4 * std::sqrt(3.0) / 2);
  EXPECT_NEAR(whole + cut / 2, expected, 0.15 * expected);
}

/// By Euler's formula a triangulation has twice as many triangles as corners, and three times as many sides.
TEST(Synthesize, TrianglesBetweenTheSameFibres) {
  MembraneParams params;
  params.fibre_mm = 5;
  params.wall_mm = 0.5;
  params.width_mm = params.height_mm = 60;
  params.pixel_mm = 0.1;
  const MembraneImage cells = synthesize(muscle_map(), params);
  params.walls = Walls::Delaunay;
  const MembraneImage triangles = synthesize(muscle_map(), params);
  const auto count = [](const MembraneImage& image) {
    double whole = 0, cut = 0;
    for (const Void& v : voids(image.distance_mm)) (v.at_frame ? cut : whole) += 1;
    return whole + cut / 2;
  };
  EXPECT_NEAR(count(triangles) / count(cells), 2, 0.2);
  // Walls of the hexagons about a grid of pitch p are sqrt(3) p long for each fibre, the sides of its triangles 3 p.
  const auto material = [](const MembraneImage& image) {
    const auto& pixels = image.distance_mm.pixels;
    const auto solid = std::count_if(pixels.begin(), pixels.end(), [](float d) { return d < 0; });
    return static_cast<double>(solid) / static_cast<double>(pixels.size());
  };
  EXPECT_NEAR(material(triangles) / material(cells), std::sqrt(3.0), 0.2);
  params.fibre_mm = 1.9;
  EXPECT_THROW((void)synthesize(muscle_map(), params), Error);
}

TEST(Synthesize, CellsAreClosedAndNoneIsTinyOrHuge) {
  const double mean_cell_mm2 = 2.4 * 2.4 * std::sqrt(3.0) / 2;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const MembraneImage image = membranes(30, seed);
    for (const Void& v : voids(image.distance_mm)) {
      EXPECT_LT(v.pixels * 0.01, 5 * mean_cell_mm2) << "a leak joins cells";
      if (!v.at_frame) {
        EXPECT_GT(v.deepest_mm, 0.2 - 0.05) << "narrower than the gap";
      }
    }
  }
}

TEST(Synthesize, EveryMembraneIsAtLeastTheWall) {
  // Opening by a disc almost as wide as the wall must keep the membrane: independent of how the distance was made.
  for (const double wall : {0.8, 0.4}) {
    const MembraneImage image = membranes(16, 5, 2.4, wall);
    const FloatImage& d = image.distance_mm;
    const double radius_px = wall / 2 / image.pixel_mm - 0.75;
    const int r = static_cast<int>(std::floor(radius_px));
    std::vector<std::pair<int, int>> disc;
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i)
        if (i * i + j * j <= radius_px * radius_px) disc.emplace_back(i, j);
    Image<std::uint8_t> opened(d.width, d.height);
    for (int y = r; y < d.height - r; ++y)
      for (int x = r; x < d.width - r; ++x)
        if (std::all_of(disc.begin(), disc.end(), [&](auto o) { return d(x + o.first, y + o.second) < 0; }))
          for (const auto& [i, j] : disc) opened(x + i, y + j) = 1;
    std::int64_t solid = 0, lost = 0;
    for (int y = 2 * r; y < d.height - 2 * r; ++y)
      for (int x = 2 * r; x < d.width - 2 * r; ++x)
        if (d(x, y) < 0) {
          ++solid;
          lost += opened(x, y) == 0;
        }
    EXPECT_GT(solid, 1000);
    EXPECT_LT(static_cast<double>(lost), 0.001 * static_cast<double>(solid)) << "wall " << wall;
  }
}

TEST(Synthesize, DistanceIsLipschitz) {
  const MembraneImage image = membranes(20);
  const FloatImage& d = image.distance_mm;
  const double p = image.pixel_mm, slack = 1e-4;
  double worst_side = 0, worst_diagonal = 0;
  for (int y = 0; y + 1 < d.height; ++y)
    for (int x = 0; x + 1 < d.width; ++x) {
      worst_side = std::max({worst_side, std::abs(d(x + 1, y) - d(x, y)) + 0.0, std::abs(d(x, y + 1) - d(x, y)) + 0.0});
      worst_diagonal = std::max(worst_diagonal, std::abs(d(x + 1, y + 1) - d(x, y)) + 0.0);
    }
  EXPECT_LE(worst_side, p + slack);
  EXPECT_LE(worst_diagonal, p * std::sqrt(2.0) + slack);
}

TEST(Synthesize, DistanceIsExactNearTheWall) {
  // Brute force: the distance from a void pixel to the nearest sign change along a row or column crossing, sub-pixel.
  const MembraneImage image = membranes(10);
  const FloatImage& d = image.distance_mm;
  std::vector<std::pair<double, double>> border;
  for (int y = 0; y + 1 < d.height; ++y)
    for (int x = 0; x + 1 < d.width; ++x) {
      const double a = d(x, y), right = d(x + 1, y), down = d(x, y + 1);
      if ((a < 0) != (right < 0)) border.emplace_back(x + a / (a - right), y);
      if ((a < 0) != (down < 0)) border.emplace_back(x, y + a / (a - down));
    }
  double worst = 0;
  for (int y = 20; y < d.height - 20; ++y)
    for (int x = 20; x < d.width - 20; ++x) {
      if (d(x, y) <= 0 || d(x, y) > 0.15) continue;  // no void is narrower than 0.4
      double nearest = 1e9;
      for (const auto& [bx, by] : border) nearest = std::min(nearest, std::hypot(x - bx, y - by));
      worst = std::max(worst, std::abs(nearest * image.pixel_mm - d(x, y)));
    }
  EXPECT_LT(worst, 0.35 * image.pixel_mm) << "border points are up to a pixel apart";
}

GrayImage doubled(const GrayImage& image) {
  GrayImage twice(2 * image.width, 2 * image.height);
  for (int y = 0; y < twice.height; ++y)
    for (int x = 0; x < twice.width; ++x) {
      const int i = std::min(x / 2 + (x & 1), image.width - 1), j = std::min(y / 2 + (y & 1), image.height - 1);
      twice(x, y) =
          static_cast<std::uint8_t>((image(x / 2, y / 2) + image(i, y / 2) + image(x / 2, j) + image(i, j) + 2) / 4);
    }
  return twice;
}

/// Fibres to a square millimetre are 1 / (pitch^2 sqrt(3) / 2) of even hexagons; of the same cells at any resolution
/// they are the same.
TEST(Synthesize, FibresAreAsLargeWhateverTheResolutionOfTheImage) {
  const auto per_mm2 = [](const GrayImage& image) {
    MembraneParams params;
    params.width_mm = params.height_mm = 50;
    const MembraneImage made = synthesize(find_fibres(image), params);
    double whole = 0, cut = 0;
    for (const Void& v : voids(made.distance_mm)) (v.at_frame ? cut : whole) += 1;
    return (whole + cut / 2) / (made.width_mm() * made.height_mm());
  };
  const double once = per_mm2(muscle());
  // A pitch within 3 %.
  EXPECT_NEAR(per_mm2(halved(muscle())), once, 0.06 * once);
  EXPECT_NEAR(per_mm2(doubled(muscle())), once, 0.06 * once);
}

/// A tile shows as a shift at which an image meets itself: the largest correlation over all shifts from two fibres on.
double likest_shift(const FloatImage& fine, int every, int from) {
  FloatImage image(fine.width / every, fine.height / every);
  double mean = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) mean += image(x, y) = fine(x * every, y * every);
  mean /= static_cast<double>(image.pixels.size());
  const int most = std::min(image.width, image.height) / 2;
  double likest = 0;
  for (int dy = 0; dy < most; ++dy)
    for (int dx = -most + 1; dx < most; ++dx) {
      if (std::hypot(dx, dy) < from) continue;
      double ab = 0, aa = 0, bb = 0;
      for (int y = 0; y + dy < image.height; ++y)
        for (int x = std::max(0, -dx); x + std::max(0, dx) < image.width; ++x) {
          const double a = image(x, y) - mean, b = image(x + dx, y + dy) - mean;
          ab += a * b;
          aa += a * a;
          bb += b * b;
        }
      likest = std::max(likest, ab / std::sqrt(aa * bb));
    }
  return likest;
}

TEST(Synthesize, NoShiftShowsATile) {
  constexpr double bound = 0.3;
  const MembraneImage large = membranes(48);
  EXPECT_LT(likest_shift(large.distance_mm, 4, 12), bound);
  // A section of 11 mm laid side by side: the same method sees it.
  const MembraneImage small = membranes(11);
  FloatImage tiled(large.distance_mm.width, large.distance_mm.height);
  for (int y = 0; y < tiled.height; ++y)
    for (int x = 0; x < tiled.width; ++x)
      tiled(x, y) = small.distance_mm(x % small.distance_mm.width, y % small.distance_mm.height);
  EXPECT_GT(likest_shift(tiled, 4, 12), 0.9);
}

TEST(Synthesize, SameSeedSameBitsOnAnyNumberOfThreads) {
  const MembraneImage two = membranes(25, 7);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const MembraneImage one = membranes(25, 7);
  EXPECT_EQ(one.distance_mm.pixels, two.distance_mm.pixels);
  EXPECT_NE(membranes(25, 8).distance_mm.pixels, one.distance_mm.pixels);
}

TEST(Synthesize, RefusesWhatCannotBeMade) {
  const auto code = [](auto change) {
    MembraneParams params;
    change(params);
    try {
      (void)synthesize(muscle_map(), params);
    } catch (const Error& e) {
      return e.code();
    }
    return Code::Internal;
  };
  EXPECT_EQ(code([](MembraneParams& p) { p.fibre_mm = 1.6; }), Code::BadRecipe);
  EXPECT_EQ(code([](MembraneParams& p) { p.wall_mm = 0; }), Code::BadRecipe);
  EXPECT_EQ(code([](MembraneParams& p) { p.wall_mm = std::nan(""); }), Code::BadRecipe);
  EXPECT_EQ(code([](MembraneParams& p) { p.pixel_mm = 0.5; }), Code::BadRecipe);
  EXPECT_EQ(code([](MembraneParams& p) { p.width_mm = 1e5; }), Code::TooLarge);
}

}  // namespace
}  // namespace fibrolite
