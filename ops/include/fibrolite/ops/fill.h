// SPDX-License-Identifier: GPL-3.0-or-later
// What an infill returns: an unclipped shape and what there is to report.
#pragma once

#include <string>
#include <vector>

#include "fibrolite/shape.h"

namespace fibrolite {

struct Fill {
  Shape shape;     ///< Unclipped; assemble() alone clips it to the part.
  int fibres = 0;  ///< Voids in the middle section of a column; 0 otherwise.
  std::vector<std::string> warnings;
};

}  // namespace fibrolite
