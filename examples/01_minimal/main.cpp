// SPDX-License-Identifier: GPL-3.0-or-later
// The main job from C++: a model in, the same model with a hybrid interior out.
//   01_minimal MODEL OUT  (writes OUT.stl)
#include <fibrolite/error.h>
#include <fibrolite/mesh_io.h>
#include <fibrolite/ops/hybridize.h>
#include <fibrolite/ops/prepare.h>
#include <fibrolite/surface.h>

#include <iostream>

int main(int argc, char** argv) try {
  using namespace fibrolite;
  if (argc != 3) {
    std::cerr << "usage: 01_minimal MODEL OUT\n";
    return 2;
  }
  // 1. Any of .stl .obj .ply .off .3mf, scaled so that its longest side is 60 mm.
  const Model model = prepare(read_mesh(argv[1]), {.size_mm = 60, .unit_mm = {}});

  // 2. Partition, verification by FEM, infills, joints, one solid. Every number of the run is in the recipe.
  Recipe recipe;
  recipe.shell.thickness_mm = 1.2;
  recipe.tcs.cell_mm = 5;
  Report report;
  const Hybrid hybrid = hybridize(model, {.recipe = recipe, .voxel_mm = 0.3}, report);

  // 3. Meshed once, at the end.
  write_mesh(std::string(argv[2]) + ".stl", surface(hybrid.solid));

  for (const PartReport& part : report.parts) {
    std::cout << "part " << part.id << ": " << part.kind << ", " << part.infill << ", " << part.infill_volume_mm3
              << " mm3 of material inside; " << part.reason << '\n';
  }
  std::cout << report.solid.mass_g << " g, " << 100 * report.solid.fill_ratio << " % of the full model\n";
  return 0;
} catch (const fibrolite::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
