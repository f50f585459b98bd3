// SPDX-License-Identifier: GPL-3.0-or-later
// Fibrolite inside a host program such as a slicer: the host keeps its own mesh type and its user interface, starts the
// work on a thread, shows progress, may cancel, and takes *layers* straight from the volume: no mesh of the interior is
// ever made.
//   02_embed_in_slicer MODEL OUT  (writes OUT.pgm, the middle layer)
#include <fibrolite/error.h>
#include <fibrolite/file.h>
#include <fibrolite/mesh_io.h>
#include <fibrolite/ops/hybridize.h>
#include <fibrolite/ops/prepare.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <iostream>
#include <thread>

namespace {

using namespace fibrolite;

// What the host has: its own triangles. Two loops turn them into a fibrolite::Mesh.
struct HostFacet {
  float corner[3][3];
};

Mesh to_mesh(const std::vector<HostFacet>& facets) {
  Mesh mesh;
  for (const HostFacet& facet : facets) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& c : facet.corner) mesh.vertices.push_back({c[0], c[1], c[2]});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;  // prepare() welds it
}

std::vector<HostFacet> facets_of_the_host(const char* path) {
  const Mesh mesh = read_mesh(path).mesh;
  std::vector<HostFacet> facets;
  for (const auto& triangle : mesh.triangles) {
    HostFacet facet{};
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3f p = mesh.vertices[triangle[c]];
      facet.corner[c][0] = p.x, facet.corner[c][1] = p.y, facet.corner[c][2] = p.z;
    }
    facets.push_back(facet);
  }
  return facets;
}

// The samples inside, and a voxel more: the surface runs between samples.
Box3d printed_box(const Solid& solid) { return solid.bounds_mm().grown(solid.grid().voxel_mm); }

// One layer of the printed solid as a bitmap: 255 = material.
GrayImage layer(const Solid& solid, double z_mm, double pixel_mm) {
  const Box3d box = printed_box(solid);
  GrayImage image(static_cast<int>(std::ceil(box.size().x / pixel_mm)),
                  static_cast<int>(std::ceil(box.size().y / pixel_mm)));
  const Shape distance = distance_to(solid);
  std::vector<Vec3d> row(static_cast<std::size_t>(image.width));
  std::vector<float> value(row.size());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      row[static_cast<std::size_t>(x)] = {box.min.x + (x + 0.5) * pixel_mm, box.min.y + (y + 0.5) * pixel_mm, z_mm};
    }
    distance.evaluate(row, value);
    for (int x = 0; x < image.width; ++x) image(x, y) = value[static_cast<std::size_t>(x)] < 0 ? 255 : 0;
  }
  return image;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 02_embed_in_slicer MODEL OUT\n";
    return 2;
  }
  // The host's state: a progress bar it reads, a Cancel button that calls context.cancel().
  std::atomic<double> bar = 0;
  const Context context([&](double fraction, std::string_view) { bar = fraction; }, {});

  const MeshFile file{.mesh = to_mesh(facets_of_the_host(argv[1])), .unit_mm = 1.0, .notes = {}};
  Report report;
  auto work = std::async(std::launch::async, [&] {
    const Model model = prepare(file, {.size_mm = 60, .unit_mm = {}}, context.part(0, 0.05, "prepare"));
    // A host guards its memory: ask before anything is allocated.
    if (predict_memory(model.mesh, 0.3, {}, InfillKind::Hybrid) > 4e9) {
      throw Error(Code::TooLarge, "this model needs more than 4 GB", "voxel 0.3 mm", "try a larger voxel");
    }
    return hybridize(model, {.recipe = {}, .voxel_mm = 0.3}, report, context.part(0.05, 1, "fill")).solid;
  });
  for (long shown = -1; work.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready;) {
    if (std::lround(100 * bar) != shown) std::cerr << (shown = std::lround(100 * bar)) << " %\n";
  }
  const Solid solid = work.get();  // throws what hybridize() threw, Cancelled included

  const Box3d box = printed_box(solid);
  const double layer_mm = 0.2, pixel_mm = 0.2;
  const int layers = static_cast<int>(std::ceil(box.size().z / layer_mm));
  double volume_mm3 = 0;
  for (int i = 0; i < layers; ++i) {
    for (const std::uint8_t p : layer(solid, box.min.z + (i + 0.5) * layer_mm, pixel_mm).pixels)
      volume_mm3 += p / 255.0;
  }
  volume_mm3 *= pixel_mm * pixel_mm * layer_mm;
  std::cout << layers << " layers; volume by layers " << volume_mm3 << " mm3, by the solid " << solid.volume_mm3()
            << " mm3\n";

  const GrayImage middle = layer(solid, box.center().z, pixel_mm);
  OutputFile out(std::string(argv[2]) + ".pgm");
  out.write("P5\n" + std::to_string(middle.width) + " " + std::to_string(middle.height) + "\n255\n");
  out.write(std::as_bytes(std::span(middle.pixels)));
  out.commit();
  return std::abs(volume_mm3 / solid.volume_mm3() - 1) < 0.03 ? 0 : 1;
} catch (const fibrolite::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
