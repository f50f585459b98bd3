// SPDX-License-Identifier: GPL-3.0-or-later
// What an infill returns: an unclipped shape and what there is to report.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// What a section of fibres holds: pixels of a template, mm of a part.
struct FibreCensus {
  int fibres = 0;
  double mean_area = 0;  ///< Of the voids that are whole; of all if none is.
  double membrane = 0;   ///< Median thickness.
  double porosity = 0;   ///< Share of void.
};

struct Fill {
  Shape shape;     ///< Unclipped; assemble() alone clips it to the part.
  int fibres = 0;  ///< Voids in the middle section of a column; 0 otherwise.
  std::vector<std::string> warnings{};
  int free_edges = 0;  ///< Membranes that end in a void of the middle section.
  /// Of a fill made of sticks: visits each stick that may reach into the box, once, from node to node. Else empty.
  std::function<void(const Box3d& box, const std::function<void(const Capsule&)>& visit)> sticks{};
  double ball_mm = 0;        ///< Diameter of the balls at the nodes of those sticks.
  FibreCensus section{};     ///< Of fibres: the middle section, inside the shell, mm.
  FibreCensus micrograph{};  ///< And the template they were taken from, px.
};

}  // namespace fibrolite
