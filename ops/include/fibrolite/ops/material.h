// SPDX-License-Identifier: GPL-3.0-or-later
// What the part is printed in.
#pragma once

namespace fibrolite {

struct Material {
  double density_g_cm3 = 1.24;  ///< PLA.
  double young_mpa = 3500;      ///< > 0
  double poisson = 0.36;        ///< 0 to below 0.5
  double yield_mpa = 50;        ///< > 0
};

}  // namespace fibrolite
