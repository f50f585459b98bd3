// SPDX-License-Identifier: GPL-3.0-or-later
// What an infill returns: an unclipped shape and what there is to report.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/shape.h"

namespace fibrolite {

struct Fill {
  Shape shape;     ///< Unclipped; assemble() alone clips it to the part.
  int fibres = 0;  ///< Voids in the middle section of a column; 0 otherwise.
  std::vector<std::string> warnings{};
  int free_edges = 0;  ///< Membranes that end in a void of the middle section.
  /// Of a fill made of sticks: visits each stick that may reach into the box, once, from node to node. Else empty.
  std::function<void(const Box3d& box, const std::function<void(const Capsule&)>& visit)> sticks{};
  double ball_mm = 0;  ///< Diameter of the balls at the nodes of those sticks.
};

}  // namespace fibrolite
