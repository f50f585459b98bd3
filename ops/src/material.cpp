// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/material.h"

#include <cmath>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"

namespace fibrolite {

// Stiffness and strength of printed specimens where the maker gives both directions: those across the layers, which
// fail first. Data sheets give no Poisson's ratio; where no publication is named, it is the usual one of the material's
// family.
const std::vector<NamedMaterial>& materials() {
  static const std::vector<NamedMaterial> table{
      {"PLA", Material{},
       "density, E, nu: Farah, Anderson, Langer 2016, doi 10.1016/j.addr.2016.06.012; yield: Ultimaker PLA data sheet"},
      {"PETG",
       {.density_g_cm3 = 1.27, .young_mpa = 2000, .poisson = 0.38, .yield_mpa = 45},
       "density: Prusament PETG data sheet; E and yield: middle of printed specimens, ISO 527; nu: copolyesters"},
      {"resin",
       {.density_g_cm3 = 1.18, .young_mpa = 2800, .poisson = 0.35, .yield_mpa = 65},
       "E and strength: Formlabs Clear V4 data sheet, post-cured, ASTM D638 (brittle: strength stands for yield); "
       "density "
       "and nu: cured acrylates"},
      {"PA12",
       {.density_g_cm3 = 0.93, .young_mpa = 1650, .poisson = 0.40, .yield_mpa = 48},
       "EOS PA 2200 data sheet, ISO 527 (strength stands for yield); nu: polyamides"},
      {"AlSi10Mg",
       {.density_g_cm3 = 2.67, .young_mpa = 70000, .poisson = 0.33, .yield_mpa = 240},
       "EOS Aluminium AlSi10Mg data sheet, as built, building direction (in the layer: 75 GPa, 270 MPa); nu: "
       "aluminium"}};
  return table;
}

Material material(std::string_view name) {
  std::vector<std::string> names;
  for (const NamedMaterial& row : materials()) {
    if (row.name == name) return row.material;
    names.push_back(row.name);
  }
  throw Error(Code::BadRecipe, "no material is called '" + std::string(name) + "'", "material",
              "did you mean " + nearest_name(name, names) + "?");
}

void check_material(const Material& material) {
  const auto require = [](bool holds, const char* key, double value, const char* range) {
    if (!holds)
      throw Error(Code::BadRecipe, std::string("material.") + key + " cannot be " + number_text(value), "recipe",
                  std::string("use ") + range);
  };
  const auto positive = [&](const char* key, double value) {
    require(value > 0 && std::isfinite(value), key, value, "a number above 0");
  };
  positive("density_g_cm3", material.density_g_cm3);
  positive("young_mpa", material.young_mpa);
  require(material.poisson >= 0 && material.poisson < 0.5, "poisson", material.poisson, "0 to below 0.5");
  positive("yield_mpa", material.yield_mpa);
}

}  // namespace fibrolite
