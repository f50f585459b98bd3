// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/infill/gyroid.h"

#include <cmath>
#include <string>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "nodal.h"

namespace fibrolite {
namespace {

constexpr double cell_per_wall = 4;

void check(const GyroidParams& p) {
  if (!(p.wall_mm > 0)) throw Error(Code::BadRecipe, "must be above zero", "gyroid.wall_mm");
  if (!(p.cell_mm >= cell_per_wall * p.wall_mm * (1 - 1e-12)) || !std::isfinite(p.cell_mm))
    throw Error(Code::BadRecipe, "the cell is too small for its walls", "gyroid.cell_mm",
                std::string("use ").append(number_text(cell_per_wall)).append(" times gyroid.wall_mm or more"));
}

double measured(const GyroidParams& p) {
  return sheet_density(Surface::Gyroid, p.cell_mm, p.wall_mm, membrane_mm2(Surface::Gyroid, p.cell_mm));
}

}  // namespace

double density(const GyroidParams& params) {
  const GyroidParams p = sized(params);
  check(p);
  return measured(p);
}

GyroidParams sized(const GyroidParams& params) {
  if (!params.density) return params;
  GyroidParams p = params;
  p.density.reset();
  if (!(p.cell_mm > 0)) throw Error(Code::BadRecipe, "must be above zero", "gyroid.cell_mm");
  const double area = membrane_mm2(Surface::Gyroid, p.cell_mm), wanted = *params.density;
  const auto of = [&](double wall_mm) { return sheet_density(Surface::Gyroid, p.cell_mm, wall_mm, area); };
  // The thickest walls a cell may have, and the thinnest worth a name; density rises with thickness.
  double high = p.cell_mm / cell_per_wall, low = 0.04 * high;
  if (!(wanted >= of(low) && wanted <= of(high)))
    throw Error(Code::BadRecipe, std::string("no walls give a density of ").append(number_text(wanted)),
                "gyroid.density",
                std::string("use ")
                    .append(number_text(std::ceil(1000 * of(low)) / 1000))
                    .append(" to ")
                    .append(number_text(std::floor(1000 * of(high)) / 1000)));
  for (int i = 0; i < 16; ++i) {
    const double middle = 0.5 * (low + high);
    (of(middle) < wanted ? low : high) = middle;
  }
  p.wall_mm = 0.5 * (low + high);
  return p;
}

Shape gyroid(const GyroidParams& params) {
  const GyroidParams p = sized(params);
  check(p);
  return sheet(Surface::Gyroid, p.cell_mm, p.wall_mm, {});
}

Fill generate(const Part&, const GyroidParams& params) { return {.shape = gyroid(params)}; }

}  // namespace fibrolite
