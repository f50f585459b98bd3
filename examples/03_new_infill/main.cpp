// SPDX-License-Identifier: GPL-3.0-or-later
// An infill of your own. An infill is a distance function: no voxels, no mesh, no clipping; assemble() clips it to its
// part and realize() makes the voxels. Here: gyroid walls.
//   03_new_infill MODEL OUT  (writes OUT.stl)
#include <fibrolite/error.h>
#include <fibrolite/mesh_io.h>
#include <fibrolite/ops/assemble.h>
#include <fibrolite/ops/prepare.h>
#include <fibrolite/pieces.h>
#include <fibrolite/realize.h>
#include <fibrolite/surface.h>
#include <fibrolite/to_solid.h>

#include <cmath>
#include <iostream>
#include <numbers>

namespace {

using namespace fibrolite;

struct GyroidParams {
  double cell_mm = 8.0;  ///< Period.
  double wall_mm = 0.9;  ///< Wall thickness; 2 voxels or more.
};

/// 1. A function of space. It must be pure and thread-safe.
class Gyroid final : public Shape::Function {
 public:
  explicit Gyroid(const GyroidParams& params)
      : wave_(static_cast<float>(2 * std::numbers::pi / params.cell_mm)),
        half_wall_(static_cast<float>(params.wall_mm / 2)) {}

  // Called with up to 512 points at a time.
  void evaluate(const PointBlock& block, float* out) const override {
    for (int i = 0; i < block.count; ++i) {
      const float x = wave_ * block.x[i], y = wave_ * block.y[i], z = wave_ * block.z[i];
      const float sx = std::sin(x), sy = std::sin(y), sz = std::sin(z);
      const float cx = std::cos(x), cy = std::cos(y), cz = std::cos(z);
      const float g = sx * cy + sy * cz + sz * cx;
      // Divided by its gradient, a field becomes a distance near its zero set: walls of even thickness.
      const float dx = cx * cy - sz * sx, dy = cy * cz - sx * sy, dz = cz * cx - sy * sz;
      const float gradient = wave_ * std::max(std::sqrt(dx * dx + dy * dy + dz * dz), 1.2F);
      out[i] = std::abs(g) / gradient - half_wall_;
    }
  }

  // How fast the value can change, mm per mm: lets realize() skip blocks. 1 at the walls, where the gradient is
  // above 1.37; at most 2.1 elsewhere, thanks to the clamp.
  [[nodiscard]] double lipschitz() const override { return 2.2; }

 private:
  float wave_, half_wall_;
};

Shape gyroid(const GyroidParams& params) { return Shape(std::make_shared<Gyroid>(params)); }

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 03_new_infill MODEL OUT\n";
    return 2;
  }
  const double shell_mm = 1.0;
  const Model model = prepare(read_mesh(argv[1]), {.size_mm = 60, .unit_mm = {}});

  // 2. The body: a level set whose band reaches as deep as the shell is thick.
  const Solid body = to_solid(model.mesh, {.grid = {.voxel_mm = 0.3}, .inside_band_mm = shell_mm}).solid;

  // 3. Shell and infill as one shape; the whole body is one region here.
  const Shape shape =
      assemble(distance_to(body), {{.region = everything(), .fill = gyroid({})}}, {}, {.shell_mm = shell_mm});

  // 4. Voxels, only where the body is; then triangles.
  const Solid solid = realize(shape, body);
  write_mesh(std::string(argv[2]) + ".stl", surface(solid));

  const double fill = solid.volume_mm3() / body.volume_mm3();
  const auto loose = pieces(solid).material.size();
  std::cout << 100 * fill << " % of the full model, " << loose << " piece(s)\n";
  return fill > 0.1 && fill < 0.9 && loose == 1 ? 0 : 1;
} catch (const fibrolite::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
