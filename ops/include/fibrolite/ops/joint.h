// SPDX-License-Identifier: GPL-3.0-or-later
// Transient layers and support columns (paper Sec. 6).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/image.h"
#include "fibrolite/ops/interfaces.h"
#include "fibrolite/shape.h"

namespace fibrolite {

enum class Bridge { Mst, Bbox };  ///< Ours: minimum spanning tree of bridges; the paper's: bounding boxes.

struct JointParams {
  bool enabled = true;
  bool columns = true;  ///< Support columns; without them the layer alone joins, where it touches.
  Bridge bridge = Bridge::Mst;
  double layer_mm = 1.2;     ///< Thickness of the transient layer (half in each part); 2 voxels, print.wall_mm or more.
  double column_mm = 0.8;    ///< Diameter of a support column; 2 voxels, print.wall_mm or more.
  double spacing_mm = 3.0;   ///< Poisson-disk distance between support columns; more than column_mm.
  double reach_mm = 12;      ///< A column that meets no crystal within this is dropped (2 cells).
  double min_wall_mm = 0.8;  ///< Width of a bridge; 2 voxels, print.wall_mm or more.
};

/// The transient layer as a binary section image in the interface's frame (paper Sec. 6.1), and how it was joined.
struct Layer {
  static constexpr int cap_px = 3;  ///< Largest distance kept inside the section, pixels.
  Image<std::uint8_t> solid;        ///< 1 = material; inside the body's section only.
  FloatImage distance_mm;  ///< Of the same layer, sub-pixel, negative in material; reaches a little beyond the body.
  Vec2d origin_mm{};       ///< Local coordinates of pixel (0, 0)'s centre.
  double pixel_mm = 0.1;
  int regions_before = 0, regions_after = 0;
  double union_area_mm2 = 0, bridge_area_mm2 = 0;
  double shell_area_mm2 = 0;         ///< Of the shell's ring, which runs on through the section.
  double other_bridge_area_mm2 = 0;  ///< What the rule that was not used would have taken.
};
/// Number of connected (8-neighbour) material regions of a layer: the connectivity check. A joint is sound iff this
/// is 1.
[[nodiscard]] int regions(const Layer& layer);

/// US = S_a | S_b | shell ring inside the body's section, then bridges until one region is left.
/// `fill_a`, `fill_b`: unclipped structures; `body`: distance to the mesh; shell ring = { -shell_mm <= body <= 0 }.
/// Regions below 3 pixels are dropped. @throws Error BadRecipe (a range above).
[[nodiscard]] Layer transient_layer(const Interface& interface, const Shape& fill_a, const Shape& fill_b,
                                    const Shape& body, double shell_mm, double pixel_mm, const JointParams& params);

struct Joint {
  Shape shape;  ///< Layer and columns, unclipped by the body.
  Layer layer;
  std::vector<Capsule> columns;
  int columns_dropped = 0;      ///< Found no crystal within reach.
  double contact_area_mm2 = 0;  ///< Layer that touches the fill inside the lumen, columns included: the lesser side.
  std::vector<std::string> warnings;
};
/// Support columns run along the interface's normal from the layer into each side's crystal (`crystal_a`, `crystal_b`:
/// whether that side's fill is a crystal). `stick_mm`: thickness of its thinnest members, a quarter of which is how
/// deep a column must end in material. Random numbers: hash(seed, "joint", index). Cost: O(section pixels). Source:
/// paper Sec. 6.
[[nodiscard]] Joint join(const Interface& interface, const Shape& fill_a, const Shape& fill_b, bool crystal_a,
                         bool crystal_b, double stick_mm, const Shape& body, double shell_mm, std::uint64_t seed,
                         int index, const JointParams& params, const Context& context = {});

}  // namespace fibrolite
