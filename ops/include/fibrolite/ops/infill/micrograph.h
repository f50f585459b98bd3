// SPDX-License-Identifier: GPL-3.0-or-later
// From a micrograph of muscle to a distance image of membranes (paper Sec. 5.1, Fig. 3).
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>

#include "fibrolite/image.h"
#include "fibrolite/ops/fill.h"

namespace fibrolite {

/// Fibres found in a template image (halved until its longest side is at most 2048 pixels).
struct FibreMap {
  Image<std::int32_t> label;  ///< 0 = membrane, 1..fibres = fibre.
  int fibres = 0;
  double mean_pitch_px = 0;  ///< Mean distance between centres of neighbouring fibres.
  FibreCensus census{};      ///< px
};
/// Segment fibres by watershed (bright fibres, dark membranes, or the reverse: decided by which side is compact).
/// Uneven light is evened out. @throws Error BadInput: nothing stands out (an even image, noise), fewer than 4
/// fibres found, or fibres less than 6 pixels wide.
[[nodiscard]] FibreMap find_fibres(const GrayImage& micrograph);

/// Tile-free texture of fibres, larger than the template, by image quilting (Efros & Freeman 2001), rescaled so that
/// fibres have the wanted pitch, as a 2-D signed distance to the membranes: mm, negative in the membrane, sub-pixel.
/// Samples are 1-Lipschitz.
struct MembraneImage {
  FloatImage distance_mm;
  double pixel_mm = 0.1;
  double wall_mm = 0;  ///< What a section that grows must not add to its membranes.
  [[nodiscard]] double width_mm() const { return distance_mm.width * pixel_mm; }
  [[nodiscard]] double height_mm() const { return distance_mm.height * pixel_mm; }
};
enum class Walls {
  Image,     ///< The paper's: the membranes between the fibres.
  Delaunay,  ///< The same fibres as corners of triangles, walls along their sides: stiff across, too.
};
struct MembraneParams {
  double fibre_mm = 2.4;  ///< Mean distance between centres of neighbouring fibres.
  double wall_mm = 0.8;   ///< Every membrane is as thick or thicker.
  double gap_mm = 0.4;    ///< Every void is a union of discs this wide; what is narrower becomes membrane.
  /// Both hold, too, when the section is shrunk by this while membranes keep their thickness; above 0, up to 1.
  double least_scale = 1;
  Walls walls = Walls::Image;
  double width_mm = 10, height_mm = 10;  ///< Of the wanted section.
  double pixel_mm = 0.1;                 ///< min(wall / 4, 0.1 mm) or finer.
  std::uint64_t seed = 1;
};
/// Fibres must lie farther apart than this to leave a void: 2 walls, or a wall and a gap; between triangles twice that.
[[nodiscard]] constexpr double least_fibre_mm(double wall_mm, double gap_mm, Walls walls) {
  return (walls == Walls::Image ? 1 : 2) * std::max(2 * wall_mm, wall_mm + gap_mm);
}
/// Texture synthesis, then walls along the borders of the cells found in it. @throws Error BadRecipe (a range above),
/// TooLarge, BadInput (a map without fibres). Cost: O(pixels), parallel.
[[nodiscard]] MembraneImage synthesize(const FibreMap& map, const MembraneParams& params);

/// 8-bit gray image from a .png, .jpg, .tif, .bmp file: of colours the mix in which most stands out, of deeper values
/// all from the lowest to the highest. @throws Error BadInput.
[[nodiscard]] GrayImage read_gray(const std::filesystem::path& path);
/// 8-bit PNG, whole or absent. @throws Error Io.
void write_gray(const std::filesystem::path& path, const GrayImage& image);
/// The micrograph that comes with the project (installed asset, or the one in the source tree). @throws Error Internal
/// if missing.
[[nodiscard]] std::filesystem::path bundled_micrograph();

}  // namespace fibrolite
