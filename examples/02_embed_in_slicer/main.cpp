// SPDX-License-Identifier: GPL-3.0-or-later
// A toy slicer built on fibrolite/slicer.h alone. It has its own triangles, fills them on a thread of its own while it
// shows progress (Ctrl-C is its Cancel button), then lets four workers fetch layers in tiles, and writes them in order.
// No mesh of the interior is made, and of the layers only those in work are held.
//   02_embed_in_slicer MODEL OUT  (writes OUT.pgm, a Netpbm stream: the layers one after the other, bottom first)
#include <fibrolite/error.h>
#include <fibrolite/slicer.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <fstream>
#include <future>
#include <iostream>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace {

using fibrolite::Slicer;

// What the host has: its own triangles.
struct HostFacet {
  float corner[3][3];
};

std::vector<HostFacet> facets_of_the_host(const char* path) {
  const fibrolite::Mesh mesh = fibrolite::read_mesh(path).mesh;
  std::vector<HostFacet> facets;
  for (const auto& triangle : mesh.triangles) {
    HostFacet facet{};
    for (std::size_t c = 0; c < 3; ++c) {
      const fibrolite::Vec3f p = mesh.vertices[triangle[c]];
      facet.corner[c][0] = p.x, facet.corner[c][1] = p.y, facet.corner[c][2] = p.z;
    }
    facets.push_back(facet);
  }
  return facets;
}

fibrolite::MeshFile to_model(const std::vector<HostFacet>& facets) {
  fibrolite::MeshFile model{.mesh = {}, .unit_mm = 1, .notes = {}};
  for (const HostFacet& facet : facets) {
    const auto first = static_cast<std::uint32_t>(model.mesh.vertices.size());
    for (const auto& c : facet.corner) model.mesh.vertices.push_back({c[0], c[1], c[2]});
    model.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return model;  // equal corners are welded when it is opened
}

const fibrolite::Context* pressed_on_cancel = nullptr;
void cancel(int) {
  if (pressed_on_cancel != nullptr) pressed_on_cancel->cancel();
}

// A finished layer on its way to the printer.
struct Layer {
  std::vector<std::uint8_t> pixels;
  double area_mm2 = 0;
};

// Workers put layers in as they finish, the printer takes them in order; at most `room` wait.
class Conveyor {
 public:
  void put(int number, Layer layer) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stopped_ || number < next_ + room; });
    waiting_.emplace(number, std::move(layer));
    changed_.notify_all();
  }
  // Nothing if the belt was stopped.
  std::optional<Layer> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stopped_ || waiting_.contains(next_); });
    if (stopped_) return std::nullopt;
    Layer layer = std::move(waiting_.extract(next_++).mapped());
    changed_.notify_all();
    return layer;
  }
  void stop() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
  }
  bool stopped() {
    const std::lock_guard lock(mutex_);
    return stopped_;
  }

 private:
  static constexpr int room = 8;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<int, Layer> waiting_;
  int next_ = 0;
  bool stopped_ = false;
};

// A layer fetched tile by tile, as a host does that draws only what it shows.
Layer fetch(const Slicer& slicer, int number, const fibrolite::Context& context) {
  constexpr int edge = 256;
  const fibrolite::SliceGrid& grid = slicer.grid();
  Layer layer{std::vector<std::uint8_t>(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height)),
              0};
  for (int y = 0; y < grid.height; y += edge) {
    for (int x = 0; x < grid.width; x += edge) {
      const fibrolite::PixelRange tile{x, y, std::min(edge, grid.width - x), std::min(edge, grid.height - y)};
      std::uint8_t* rows = layer.pixels.data() + static_cast<std::ptrdiff_t>(y) * grid.width + x;
      layer.area_mm2 += slicer.tile(number, tile, rows, grid.width, context);
    }
  }
  return layer;
}

// All layers into a file; their volume, mm3.
double print(const Slicer& slicer, const std::string& path, const fibrolite::Context& context) {
  const fibrolite::SliceGrid& grid = slicer.grid();
  Conveyor conveyor;
  std::atomic<int> next = 0;
  std::vector<std::future<void>> workers;
  for (int w = 0; w < 4; ++w) {
    workers.push_back(std::async(std::launch::async, [&] {
      try {
        for (int n = next++; n < grid.layers && !conveyor.stopped(); n = next++)
          conveyor.put(n, fetch(slicer, n, context));
      } catch (...) {
        conveyor.stop();
        throw;
      }
    }));
  }
  std::ofstream out(path, std::ios::binary);
  double volume_mm3 = 0;
  for (int n = 0; n < grid.layers; ++n) {
    const std::optional<Layer> layer = conveyor.take();
    if (!layer) break;
    out << "P5\n" << grid.width << ' ' << grid.height << "\n255\n";
    out.write(reinterpret_cast<const char*>(layer->pixels.data()), static_cast<std::streamsize>(layer->pixels.size()));
    volume_mm3 += layer->area_mm2 * grid.layer_mm;
  }
  for (std::future<void>& worker : workers) worker.get();  // throws what fetching threw
  if (!out.flush()) throw fibrolite::Error(fibrolite::Code::Io, "cannot be written", path);
  return volume_mm3;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 02_embed_in_slicer MODEL OUT\n";
    return 2;
  }
  std::atomic<double> bar = 0;
  const fibrolite::Context context([&](double fraction, std::string_view) { bar = fraction; }, {});
  pressed_on_cancel = &context;
  std::signal(SIGINT, cancel);

  fibrolite::SlicerParams params;
  params.fill.recipe = fibrolite::set({}, "shell.thickness_mm=1.2");
  params.fill.voxel_mm = 0.3;
  params.prepare.size_mm = 60;
  params.pixel_mm = {0.15, 0.15};
  params.layer_mm = 0.2;
  params.max_memory_bytes = 4e9;
  const fibrolite::MeshFile model = to_model(facets_of_the_host(argv[1]));
  auto opening = std::async(std::launch::async, [&] { return Slicer(model, params, context); });
  for (long shown = -1; opening.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready;) {
    if (std::lround(100 * bar) != shown) std::cerr << (shown = std::lround(100 * bar)) << " %\n";
  }
  const Slicer slicer = opening.get();  // throws what opening threw, Cancelled included
  for (const std::string& warning : slicer.report().warnings) std::cerr << warning << '\n';

  const double volume_mm3 = print(slicer, std::string(argv[2]) + ".pgm", context);
  const double solid_mm3 = slicer.report().solid.volume_mm3;
  std::cout << slicer.grid().layers << " layers of " << slicer.grid().width << " x " << slicer.grid().height
            << " pixels; volume by layers " << volume_mm3 << " mm3, by the solid " << solid_mm3 << " mm3\n";
  return std::abs(volume_mm3 / solid_mm3 - 1) < 0.005 ? 0 : 1;
} catch (const fibrolite::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
