// SPDX-License-Identifier: GPL-3.0-or-later
#include "infill/thickness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "discs.h"
#include "fibrolite/ops/infill/mfs.h"
#include "infill/spline.h"
#include "micrographs.h"

namespace fibrolite {
namespace {

TEST(Thickness, DiscsSeeHowThickABarIs) {
  Image<std::uint8_t> bar(200, 200);
  for (int y = 0; y < 200; ++y)
    for (int x = 80; x < 101; ++x) bar(x, y) = 1;
  EXPECT_TRUE(holds_discs(bar, 20, 50, 1.5));
  EXPECT_FALSE(holds_discs(bar, 23, 50, 1.5));
  for (int x = 0; x < 200; ++x)
    for (int y = 120; y < 129; ++y) bar(x, y) = 1;
  EXPECT_FALSE(holds_discs(bar, 20, 50, 1.5)) << "a thinner one crosses it";
}

TEST(Thickness, TheVoidBetweenTwoWallsThatMeetEndsInARoundAsWideAsTheGap) {
  // Middles of the walls: y = +-x / 10. A disc of 0.4 fits between the walls where they are 0.6 off the axis.
  const Raster raster{{3, -2}, 0.05, 241, 81};
  const FloatImage walls =
      walls_along({{{0, 0}, {40, 4}}, {{0, 0}, {40, -4}}}, raster, {.wall_mm = 0.8, .gap_mm = 0.4}, 2);
  const auto value = [&](double x, double y) {
    return spline(walls, static_cast<float>((x - 3) / 0.05), static_cast<float>((y + 2) / 0.05));
  };
  const double slant = std::sqrt(1.01), middle = 0.6 * slant * 10;
  EXPECT_NEAR(value(middle - 0.2, 0), 0, 0.006);
  EXPECT_NEAR(value(middle - 0.2 - 0.15, 0), -0.15, 0.006) << "a true distance in the wall";
  EXPECT_NEAR(value(middle + 2, (middle + 2) / 10 - 0.4 * slant), 0, 0.003) << "along a wall nothing changes";
  EXPECT_NEAR(value(middle + 2, (middle + 2) / 10), -0.4, 0.02) << "blunt where two sides are equally near";
  EXPECT_LE(value(middle + 3, 0), (middle + 3) / 10 / slant - 0.4 + 0.003) << "at most the distance in the void";
}

/// Every seed, size, kind of wall and template: measured on a grid five times as fine as the image, whose samples know
/// nothing of lines, levels or distances.
TEST(Thickness, NoWallIsThinnerAndNoVoidNarrowerThanAsked) {
  struct Case {
    const char* name;
    FibreMap map;
    double fibre_mm, wall_mm, gap_mm;
    Walls walls;
  };
  const FibreMap muscle = find_fibres(read_gray(bundled_micrograph())), comb = find_fibres(honeycomb(9, 8, 40, 7)),
                 blobs = find_fibres(photograph(11, 34, 300));
  const std::vector<Case> cases = {{"muscle", muscle, 2.4, 0.8, 0.4, Walls::Image},
                                   {"muscle, tight", muscle, 1.7, 0.8, 0.5, Walls::Image},
                                   {"muscle, wide gap", muscle, 3, 0.4, 1.2, Walls::Image},
                                   {"honeycomb", comb, 2.4, 0.6, 0.6, Walls::Image},
                                   {"uneven", blobs, 4, 0.5, 0.8, Walls::Image},
                                   {"muscle, triangles", muscle, 4.15, 0.8, 0.4, Walls::Delaunay},
                                   {"uneven, triangles", blobs, 5, 0.8, 0.6, Walls::Delaunay}};
  for (const Case& c : cases)
    for (const std::uint64_t seed : {1, 2, 3}) {
      MembraneParams params;
      params.fibre_mm = c.fibre_mm;
      params.wall_mm = c.wall_mm;
      params.gap_mm = c.gap_mm;
      params.walls = c.walls;
      params.width_mm = params.height_mm = 8 * c.fibre_mm;
      params.pixel_mm = std::min({0.1, c.wall_mm / 4, c.gap_mm / 4});
      params.seed = seed;
      const MembraneImage image = synthesize(c.map, params);
      const Shape finished = sweep(image, Axis::straight({0, 0, 0}, {0, 0, 10}));
      const Discs fine(finished, frame_along({0, 0, 5}, {0, 0, 1}), params.width_mm, params.height_mm, 0.02);
      const double rim = 1.5 * std::max(c.wall_mm, c.gap_mm);
      EXPECT_TRUE(fine.walls_hold(c.wall_mm - 0.03, rim)) << c.name << ' ' << seed;
      EXPECT_TRUE(fine.gaps_hold(c.gap_mm - 0.03, rim)) << c.name << ' ' << seed;
      EXPECT_FALSE(fine.walls_hold(c.wall_mm + 0.05, rim)) << c.name << ' ' << seed << ": thicker than asked";
    }
}

}  // namespace
}  // namespace fibrolite
