// SPDX-License-Identifier: GPL-3.0-or-later
// fibrolite-assets OUTDIR: writes models/*.ply and textures/muscle.png, the same bytes every time.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/infill/micrograph.h"
#include "generator.h"
#include "models.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: fibrolite-assets OUTDIR\n", stderr);
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
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fibrolite-assets: error: %s\n", error.what());
    return 1;
  }
  return 0;
}
