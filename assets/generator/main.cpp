// SPDX-License-Identifier: GPL-3.0-or-later
// fibrolite-assets OUTDIR [SHEET.png]: writes models/*.ply and textures/muscle.png, the same bytes every time, and if
// asked a picture of all models.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "bundled_models.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/infill/micrograph.h"
#include "fibrolite/ops/picture.h"
#include "generator.h"
#include "sheet.h"

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fputs("usage: fibrolite-assets OUTDIR [SHEET.png]\n", stderr);
    return 2;
  }
  try {
    const std::filesystem::path out = argv[1];
    std::filesystem::create_directories(out / "models");
    std::filesystem::create_directories(out / "textures");
    for (const std::string& name : fibrolite::bundled_model_names()) {
      const fibrolite::Mesh mesh = fibrolite::bundled_model(name);
      fibrolite::write_mesh(out / "models" / (name + ".ply"), mesh);
      std::printf("%s.ply  %zu triangles\n", name.c_str(), mesh.triangles.size());
    }
    fibrolite::write_gray(out / "textures" / "muscle.png", fibrolite::muscle_micrograph(fibrolite::muscle_seed));
    std::puts("muscle.png");
    if (argc == 3) fibrolite::write_png(argv[2], fibrolite::contact_sheet(480));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fibrolite-assets: error: %s\n", error.what());
    return 1;
  }
  return 0;
}
