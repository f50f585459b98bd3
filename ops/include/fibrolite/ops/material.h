// SPDX-License-Identifier: GPL-3.0-or-later
// What the part is printed in.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace fibrolite {

/// Isotropic and linear: one stiffness, one yield stress. Prints are not quite that; see docs/loads.md.
struct Material {
  double density_g_cm3 = 1.24;  ///< > 0. The defaults are those of PLA.
  double young_mpa = 3500;      ///< > 0
  double poisson = 0.36;        ///< 0 to below 0.5
  double yield_mpa = 50;        ///< > 0
  friend bool operator==(const Material&, const Material&) = default;
};

/// A material by name, and where its numbers come from.
struct NamedMaterial {
  std::string name;
  Material material;
  std::string source;
};
/// PLA (the default), PETG, resin, PA12, AlSi10Mg.
[[nodiscard]] const std::vector<NamedMaterial>& materials();
/// @throws Error BadRecipe: no such material (with the nearest name).
[[nodiscard]] Material material(std::string_view name);
/// @throws Error BadRecipe: a number out of its range, naming its key.
void check_material(const Material& material);

}  // namespace fibrolite
